"""Who makes one dataclass of another hands on all that both have, or says here why not.

An option that is left out of such a call takes its default without a word: a balance that the second refinement of a
chart forgets, an aspect that its coarse mesh does not know.
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterator
from pathlib import Path

from sources import tree_of, walked

ROOT = Path(__file__).resolve().parents[1] / "omt_uv"
# What is left out, by the function and the class that it makes: why it is left out.
LEFT_OUT = {
    ("_as_chart_map", "ChartMap"): (("warnings",), "those of before are told once, beside what comes after"),
    ("_into_shape", "MapOptions"): (
        ("balance", "aspect", "kind"),
        "inside existing UVs areas are exact, and only disks and squares are asked for",
    ),
    ("_refined", "RefinementOptions"): (
        ("boundary", "warm_start", "prolonged", "multiplier", "order", "crossing"),
        "what has no room in its domain starts anew with a free boundary",
    ),
    ("_coarse_initial_map", "DiskMesh"): (("polygons",), "a coarser mesh has triangles alone"),
    ("move_pins", "NewtonProblem"): (("smoother", "symmetry"), "pins are drawn to their places without either"),
    ("_mapped", "VolumeBody"): (("polygons",), "a surface that a library made has triangles alone"),
    ("_least_on_disk", "Signature"): (("floor",), "costs of single points have none"),
    ("_refined", "Signature"): (("floor",), "costs of single points have none"),
}


@functools.cache
def trees() -> list[ast.Module]:
    """The sources; not before a test asks for them."""
    return [tree_of(path) for path in sorted(ROOT.rglob("*.py"))]


def _is_dataclass(node: ast.AST) -> bool:
    return isinstance(node, ast.ClassDef) and any("dataclass" in ast.unparse(d) for d in node.decorator_list)


@functools.cache
def classes() -> dict[str, ast.ClassDef]:
    """Dataclasses by their names."""
    return {node.name: node for tree in trees() for node in walked(tree) if _is_dataclass(node)}


def fields_of(name: str) -> list[str]:
    """Fields of a dataclass in the order in which it takes them."""
    above = [field for base in classes()[name].bases if ast.unparse(base) in classes() for field in fields_of(base.id)]
    own = [
        line.target.id
        for line in classes()[name].body
        if isinstance(line, ast.AnnAssign) and "ClassVar" not in ast.unparse(line.annotation)
    ]
    return list(dict.fromkeys([*above, *own]))


def given(call: ast.Call, within: ast.FunctionDef) -> dict[str, ast.expr]:
    """What a call gives to each field; a tuple of that function that stands with a star by its parts."""
    tuples = {
        line.targets[0].id: line.value.elts
        for line in walked(within)
        if isinstance(line, ast.Assign) and isinstance(line.targets[0], ast.Name) and isinstance(line.value, ast.Tuple)
    }
    values: list[ast.expr] = []
    for value in call.args:
        values += tuples.get(ast.unparse(value.value), []) if isinstance(value, ast.Starred) else [value]
    found = dict(zip(fields_of(call.func.id), values, strict=False))
    return found | {one.arg: one.value for one in call.keywords if one.arg}


@functools.cache
def left_out() -> list[tuple[str, str, set[str]]]:
    """Function, class that it makes, and the fields that this has in common with a parameter and does not get, though
    others come from there."""
    return list(_left_out())


def _left_out() -> Iterator[tuple[str, str, set[str]]]:
    for tree in trees():
        for function in (node for node in walked(tree) if isinstance(node, ast.FunctionDef)):
            every = [*function.args.args, *function.args.kwonlyargs]
            kinds = {a.arg: ast.unparse(a.annotation).partition(" |")[0] for a in every if a.annotation}
            for call in (node for node in walked(function) if isinstance(node, ast.Call)):
                if not isinstance(call.func, ast.Name) or call.func.id not in classes():
                    continue
                if any(one.arg is None for one in call.keywords):
                    continue
                gets = given(call, function)
                for name in {n for n, kind in kinds.items() if kind in classes()}:
                    if any(ast.unparse(value) == f"{name}.{field}" for field, value in gets.items()):
                        both = set(fields_of(kinds[name])) & set(fields_of(call.func.id))
                        yield function.name, call.func.id, both - gets.keys()


def test_what_two_dataclasses_have_in_common_is_handed_on():
    wrong = [
        (function, made, sorted(missing - set(LEFT_OUT.get((function, made), ((), ""))[0])))
        for function, made, missing in left_out()
    ]
    assert [row for row in wrong if row[2]] == []


def test_what_is_left_out_with_a_reason_is_left_out():
    found: dict[tuple[str, str], set[str]] = {}
    for function, made, missing in left_out():
        found.setdefault((function, made), set()).update(missing)
    assert {key: set(names) for key, (names, _) in LEFT_OUT.items()} == {k: v for k, v in found.items() if v}


def _mentions(function: ast.FunctionDef, name: str) -> bool:
    """Whether a function hands on the warnings of a parameter, or all of it."""
    for node in walked(function):
        if isinstance(node, ast.Attribute) and node.attr == "warnings" and ast.unparse(node.value) == name:
            return True
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "replace" and ast.unparse(node.args[0]) == name:
            return True
    return False


def silent() -> Iterator[tuple[str, str, str]]:
    """Function, class that it makes with warnings of its own, and a parameter that has some, of which it takes none."""
    for tree in trees():
        for function in (node for node in walked(tree) if isinstance(node, ast.FunctionDef)):
            every = [*function.args.args, *function.args.kwonlyargs]
            kinds = {a.arg: ast.unparse(a.annotation).partition(" |")[0] for a in every if a.annotation}
            of = [n for n, kind in kinds.items() if kind in classes() and "warnings" in fields_of(kind)]
            for call in (node for node in walked(function) if isinstance(node, ast.Call)):
                if not isinstance(call.func, ast.Name) or call.func.id not in classes():
                    continue
                told = given(call, function).get("warnings")
                # Who is given all warnings leaves to its caller whose they are.
                if told is not None and ast.unparse(told) not in {a.arg for a in every}:
                    yield from ((function.name, call.func.id, n) for n in of if not _mentions(function, n))


def test_warnings_of_what_something_is_made_of_are_handed_on():
    assert list(silent()) == []
