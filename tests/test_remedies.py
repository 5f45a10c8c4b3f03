"""Remedies: the solver knows no menus, and operators and commands say them in Blender's words."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

import pytest

from omt_uv.remedies import ACTIONS, ADVICE, REMEDIES, action_advised, action_for, advise, explain
from omt_uv.solver import errors

SOLVER = Path(__file__).resolve().parents[1] / "omt_uv" / "solver"
MENUS = re.compile(
    r" > |Select |Merge by|Recalculate|Degenerate Dissolve|Delete Loose|Clean Up|Separate by|Paint |Mark seams"
    r"|Edit Mode|Object Mode|[Mm]enu"
)


def texts(path: Path):
    """String constants of a module, docstrings left out."""
    tree = ast.parse(path.read_text())
    nodes = [n for n in ast.walk(tree) if isinstance(n, ast.Module | ast.ClassDef | ast.FunctionDef)]
    docstrings = {id(n.body[0].value) for n in nodes if n.body and isinstance(n.body[0], ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield node.value


def test_no_text_of_the_solver_names_a_menu():
    named = [f"{p.relative_to(SOLVER)}: {t!r}" for p in SOLVER.rglob("*.py") for t in texts(p) if MENUS.search(t)]
    assert not named, "\n".join(named)


@pytest.mark.parametrize("key", REMEDIES, ids=lambda key: key.__name__)
def test_what_was_wrong_and_where_stays_and_the_remedy_is_blenders(key):
    error = key("A cause", kind="face", elements=[3, 5])
    assert str(error) == f"A cause (2 faces: 3, 5). {key.remedy}."
    assert explain(error) == f"A cause (2 faces: 3, 5). {REMEDIES[key]}."
    # An error that was given other elements on its way is the same.
    assert explain(key(error.cause, error.remedy, "vertex", [1])) == f"A cause (1 vertex: 1). {REMEDIES[key]}."
    # A class of errors has words of its own, in the solver and in Blender.
    base = key.__mro__[1]
    assert key.remedy != base.remedy and REMEDIES[key] != REMEDIES.get(base)


def test_a_remedy_for_the_very_case_stands():
    assert explain(errors.EmptyMeshError("There are no UVs", "Unwrap the mesh first")).endswith(
        "Unwrap the mesh first."
    )


def test_an_error_without_blenders_words_is_said_in_the_solvers():
    others = [c for _, c in inspect.getmembers(errors, inspect.isclass) if c.__module__ == errors.__name__]
    for key in set(others) - set(REMEDIES):
        assert explain(key("A cause")) == str(key("A cause"))


def test_warnings_advise_in_blenders_words():
    assert advise(f"2 triangles have no area; {errors.DISSOLVE}") == (
        "2 triangles have no area; use Mesh > Clean Up > Degenerate Dissolve"
    )
    assert advise(f"delete what is double, or {errors.MERGE} (3 times)").endswith("or use Merge by Distance (3 times)")
    assert advise("Nothing to advise") == "Nothing to advise"
    said = " ".join(p.read_text() for p in SOLVER.rglob("*.py"))
    for name in ("MERGE", "MERGING", "DISSOLVE", "TURN_OUTSIDE"):
        assert getattr(errors, name) in ADVICE and f"{{{name}}}" in said


def named(words: str) -> set[str]:
    """Actions whose label stands in what is told."""
    return {action for action, label, _ in ACTIONS if label in words}


def test_what_names_a_button_has_it():
    """A warning or an error that tells to do what a button does comes with that button."""
    for neutral, words in ADVICE.items():
        assert named(words) <= {action_advised(f"2 vertices are odd; {neutral}")}, neutral
    for kind, words in REMEDIES.items():
        assert not named(words) or action_for(kind("A cause")) in named(words), kind
    # Each of them is there for something.
    actions = {action_advised(text) for text in ADVICE} | {action_for(kind("A cause")) for kind in REMEDIES}
    assert {action for action, _, _ in ACTIONS} - {"APPLY_LEVEL", "CUT_FURTHER"} <= actions


@pytest.mark.parametrize("kind", REMEDIES)
def test_an_error_that_is_one_of_a_kind_has_its_button(kind):
    """Kinds of errors are divided further as time goes by."""
    kin = type("Kin", (kind,), {})
    assert action_for(kin("A cause")) == action_for(kind("A cause"))
