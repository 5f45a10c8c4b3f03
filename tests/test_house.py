"""The rules of CONTRIBUTING.md that are no matter of layers: results, refusals, docstrings, loops, tools and tests."""

from __future__ import annotations

import ast
import dataclasses
import functools
import importlib
import inspect
import re
import typing
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from sources import nodes_of, tree_of, walked

from omt_uv.solver import errors
from omt_uv.solver.errors import MeshError

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "omt_uv"
SOLVER = PACKAGE / "solver"
MODULES = sorted(p for p in PACKAGE.glob("**/*.py") if "presets" not in p.parts)
TOOL_FOLDERS = ("benchmarks", "examples", "scripts", "tests/support")
TOOLS = sorted(p for name in TOOL_FOLDERS for p in (ROOT / name).glob("**/*.py"))
TESTS = sorted((ROOT / "tests").glob("**/*.py"))
MOST_FUNCTION_LINES = 60
MOST_PARAMETERS = 8

# Dataclasses that change, and why they may.
CHANGING = {
    "_Shown": "what an overlay shows of an object until the next change of its UVs",
    "_LiveIsland": "an island that follows the slider: its UVs are those of the last step",
    "State": "the last run's summary, which the panel draws",
}
# What the solver raises beside the classes of `errors.py`, and why.
RAISED_BESIDE = {
    "ValueError": "an argument that no mesh could make valid",
    "AttributeError": "a name that a package does not have",
    "StuckError": "caught within remeshing, where another way is tried",
    "MarkerError": "markers that turn a globe, which are no elements of the mesh that is mapped",
}
# Classes of errors that stand neither in `solver/errors.py` nor below UserError.
OTHER_ERRORS = {"StuckError", "MarkerError", "UserError", "Disturbed"}
# Generators of faces whose result is no dataclass of its own, and why.
PLAIN_RESULTS = {
    "multilevel_start": "positions and how many folds are left: a step of sphere_map alone",
    "relax_cvt": "the working mesh that it was given, moved, and its last step: a step of remesh alone",
}
# Modules that may visit faces one by one, and why.
VISITORS = {"omt_uv/solver/api/arrays.py": "polygons of any numbers of sides come as lists of Python"}
# Modules in which lists go together that need not end together, how often, and why.
STARTS = "where each part starts, and where all end"
UNEVEN = {
    "omt_uv/blender/mesh.py": (1, "corners at the end that get nothing"),
    "omt_uv/blender/remesh_objects.py": (1, "the new mesh may have fewer materials"),
    "omt_uv/blender/shapes/cell_objects.py": (1, "the new mesh may have fewer materials"),
    "omt_uv/files/obj_precision.py": (1, "a line may hold more than the numbers that are written"),
    "omt_uv/pipelines/layout.py": (2, STARTS),
    "omt_uv/pipelines/subdivision.py": (3, STARTS),
    "omt_uv/solver/maps/mirror_symmetry.py": (1, "an axis may have no image"),
    "omt_uv/solver/parameterization/polygons/convexity.py": (3, STARTS),
    "omt_uv/solver/parameterization/mirrored_charts.py": (1, STARTS),
    "omt_uv/solver/signatures/membrane.py": (1, STARTS),
}
# Names of arrays over vertices, edges or faces, whose elements no loop of Python visits.
ARRAYS = "V|F|vertices|edges|faces|triangles|halfedges|corners|positions|polygons"
LOOP = re.compile(rf"(range\(len\()?(enumerate\()?(\w+\.)*({ARRAYS})(\.tolist\(\))?\)*")
SHAPE = re.compile(r"\((\d|[a-z]{1,2}|\.\.\.),[^)]*\)")


def nodes(paths, kind):
    """Pairs (path, node) of every node of a kind."""
    for path in paths:
        yield from ((path, n) for n in nodes_of(path) if isinstance(n, kind))


@functools.cache
def imports_of(path):
    """All that a file imports; what it says besides is not kept."""
    every = walked(ast.parse(path.read_text(encoding="utf-8")))
    return [n for n in every if isinstance(n, ast.Import | ast.ImportFrom)]


def place(path, node):
    return f"{path.relative_to(ROOT)}:{node.lineno}"


def solver_modules():
    return [p for p in MODULES if p.is_relative_to(SOLVER)]


def faces():
    """Triples (package, name, object) of every name that a package of the solver shows."""
    for init in sorted(SOLVER.glob("**/__init__.py")):
        package = importlib.import_module(".".join(init.parent.relative_to(ROOT).parts))
        for name in getattr(package, "__all__", ()):
            yield package.__name__, name, getattr(package, name)


SPARSE = re.compile(r"(.*\.)?(coo|csr|csc)_(matrix|array)")
FUNCTIONS = {f"{p.removeprefix('omt_uv.')}.{n}": f for p, n, f in faces() if inspect.isfunction(f)}


# ---- results and refusals -----------------------------------------------------------------------------------


def test_dataclasses_are_frozen():
    changing = {
        n.name: place(path, n)
        for path, n in nodes(MODULES, ast.ClassDef)
        for d in map(ast.unparse, n.decorator_list)
        if d.startswith("dataclass") and "frozen=True" not in d
    }
    assert changing.keys() == CHANGING.keys(), changing
    assert not [where for where in changing.values() if "solver" in where]


def test_solvers_return_frozen_dataclasses():
    results = {name: typing.get_type_hints(f).get("return") for name, f in FUNCTIONS.items()}
    solvers = {name: typing.get_args(result)[-1] for name, result in results.items()
               if str(result).startswith("collections.abc.Generator")
               and FUNCTIONS[name].__name__ not in PLAIN_RESULTS}  # fmt: skip
    assert len(solvers) > 20
    for name, result in solvers.items():
        assert dataclasses.is_dataclass(result) and result.__dataclass_params__.frozen, name


def test_the_solver_raises_named_errors():
    named = {name for name, cls in vars(errors).items() if inspect.isclass(cls)}
    strange = [
        f"{place(path, n)} {ast.unparse(n)}"
        for path, n in nodes(solver_modules(), ast.Raise)
        if isinstance(n.exc, ast.Call)
        and ast.unparse(n.exc.func)[:1].isupper()
        and ast.unparse(n.exc.func) not in named | RAISED_BESIDE.keys()
    ]
    assert not strange, "\n".join(strange)


def test_errors_have_one_base_in_the_solver_and_one_above():
    bases = {n.name: {ast.unparse(b) for b in n.bases} for _, n in nodes(MODULES, ast.ClassDef)}
    exceptions = {"Exception", "ValueError", "RuntimeError"}
    assert {name for name, above in bases.items() if above & exceptions} == OTHER_ERRORS | {"MeshError"}


@pytest.mark.parametrize("cls", [c for c in vars(errors).values() if inspect.isclass(c) and issubclass(c, MeshError)])
def test_a_refusal_names_cause_elements_and_remedy(cls):
    refusal = cls("The cause", remedy="The remedy", kind="face", elements=[7, 9])
    assert {"The cause", "faces: 7, 9", "The remedy"} <= set(
        re.findall(r"The cause|faces: 7, 9|The remedy", str(refusal))
    )
    assert refusal.elements.dtype == np.int64
    assert cls is MeshError or cls.__doc__


# ---- functions ----------------------------------------------------------------------------------------------


def test_public_functions_state_shapes():
    """Where an argument is an array, and no class of ours that states the shapes of its own."""
    for name, function in FUNCTIONS.items():
        hints = {k: v for k, v in typing.get_type_hints(function).items() if k != "return"}
        bare = [p for p in inspect.signature(function).parameters if p not in hints or hints[p] is np.ndarray]
        assert not bare or SHAPE.search(function.__doc__ or ""), (name, bare)


def test_no_loop_of_python_visits_vertices_edges_or_faces():
    loops = [
        f"{place(path, n.iter)} for ... in {ast.unparse(n.iter)}"
        for path, n in nodes(solver_modules(), ast.For | ast.comprehension)
        if LOOP.fullmatch(ast.unparse(n.iter)) and str(path.relative_to(ROOT)) not in VISITORS
    ]
    assert not loops, "\n".join(loops)


# ---- benchmarks, scripts and what tests share ---------------------------------------------------------------


def test_sparse_matrices_of_entries_name_their_shape():
    """Without one it ends with the last row that has an entry, which is the last one of most meshes, and not of all."""
    short = [
        place(path, n)
        for path, n in nodes(MODULES, ast.Call)
        if SPARSE.fullmatch(ast.unparse(n.func)) and n.args and isinstance(n.args[0], ast.Tuple)
        and any(isinstance(part, ast.Tuple) for part in n.args[0].elts)
        and len(n.args) < 2 and all(keyword.arg != "shape" for keyword in n.keywords)
    ]  # fmt: skip
    assert not short, short


def test_what_goes_together_ends_together():
    """`zip` leaves out silently what one list has more than another."""
    uneven = Counter()
    for path, call in nodes(MODULES, ast.Call):
        if isinstance(call.func, ast.Name) and call.func.id == "zip":
            strict = [k.value.value for k in call.keywords if k.arg == "strict"]
            assert strict, place(path, call)
            uneven[str(path.relative_to(ROOT))] += not strict[0]
    assert +uneven == {name: count for name, (count, _) in UNEVEN.items()}


@pytest.mark.parametrize("path", TOOLS, ids=lambda p: str(p.relative_to(ROOT)))
def test_tools_keep_the_rules_of_the_package(path):
    tree = tree_of(path)
    assert ast.get_docstring(tree)
    for node in walked(tree):
        if isinstance(node, ast.FunctionDef):
            assert node.end_lineno - node.lineno < MOST_FUNCTION_LINES, node.name
            assert len(node.args.args + node.args.kwonlyargs) <= MOST_PARAMETERS, node.name
    for node in tree.body:
        # What `main` does, the module says.
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name != "main" and not node.name.startswith("_"):
            assert ast.get_docstring(node), node.name
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple):
            assert not isinstance(node.value, ast.Tuple), "one named constant a line"


def test_contributing_names_every_folder_and_no_other():
    text = (ROOT / "CONTRIBUTING.md").read_text()
    named = set(re.findall(r"^\| `(omt_uv/\w+)` \|", text, re.MULTILINE))
    there = {str(p.relative_to(ROOT)) for p in PACKAGE.iterdir() if p.is_dir() and p.name != "__pycache__"}
    assert named == there
    for path in re.findall(r"`((?:tests|docs|benchmarks|scripts)(?:/[\w.]+)*)`", text):
        assert (ROOT / path).exists(), path


def test_no_code_stands_among_the_documents():
    assert not list((ROOT / "docs").glob("**/*.py"))


# ---- tests --------------------------------------------------------------------------------------------------


def test_tests_find_what_they_share_without_changing_the_path():
    assert not [p for p in TESTS if p != Path(__file__) and "sys.path" in p.read_text().replace("in sys.path", "")]


def test_tests_assert_nothing_about_time():
    """A machine that is busy would fail them. Only what plays in a real window has a patience."""
    clocks = {"time", "timeit"}
    named = [
        (place(p, n), [n.module] if isinstance(n, ast.ImportFrom) else [a.name for a in n.names])
        for p in TESTS
        for n in imports_of(p)
    ]
    assert not [where for where, names in named if clocks & set(names)]


def test_every_module_of_the_solver_is_imported_by_a_test():
    imported = set()
    for path in TESTS:
        for node in imports_of(path):
            if isinstance(node, ast.ImportFrom) and node.module:
                imported |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    every = {
        ".".join(p.relative_to(ROOT).with_suffix("").parts) for p in SOLVER.glob("**/*.py") if p.stem != "__init__"
    }
    assert not every - imported
