"""One class for all that a user can mend, wherever it is raised."""

import ast
from pathlib import Path

import omt_uv.errors

PACKAGE = Path(omt_uv.errors.__file__).parent
# What ends a live session is no error: nobody reports it as one.
SIGNALS = {"Disturbed"}


def test_every_error_outside_of_the_solver_is_one_that_a_user_can_mend():
    bases = {}
    for path in PACKAGE.glob("**/*.py"):
        if "solver" not in path.relative_to(PACKAGE).parts:
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ClassDef) and node.bases:
                    bases[node.name] = [b.id for b in node.bases if isinstance(b, ast.Name)]

    def ends(name):
        return {name} if name not in bases else set().union(*map(ends, bases[name]))

    ends_of = {name: ends(name) for name in bases}
    raised = [n for n, found in ends_of.items() if n.endswith(("Error", "Refusal")) or found & {"Exception"}]
    assert "PackingError" in raised and "UserError" in raised
    assert [n for n in raised if n not in SIGNALS and ends_of[n] != {"ValueError"}] == []
    assert [n for n in raised if n not in SIGNALS and bases[n] == ["ValueError"]] == ["UserError"]
