"""The house: which folder may import from which, how large folders and functions are, and what every package says."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from sources import nodes_of, tree_of

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "omt_uv"
MODULES = sorted(p for p in PACKAGE.glob("**/*.py") if "presets" not in p.parts)
MOST_MODULES, MOST_LINES, MOST_FUNCTION_LINES, MOST_PARAMETERS = 14, 450, 60, 8

# From the ground up: a folder imports from those named behind it alone, and these stand above it in this list.
ARROWS: dict[str, str] = {
    "settings": "",
    "errors": "",
    "links": "",
    "temporary": "",
    "supervision": "temporary",
    # The names of the front door are looked up in solver.api when they are used.
    "solver": "",
    "solver.mesh": "solver",
    "solver.linalg": "solver solver.mesh",
    "solver.transfer": "solver solver.mesh",
    "solver.quads": "solver solver.mesh",
    "solver.analysis": "solver solver.mesh solver.linalg",
    "solver.contact": "solver solver.mesh solver.linalg",
    "solver.flows": "solver solver.mesh solver.contact",
    "solver.comparison": "solver solver.mesh solver.analysis",
    "solver.maps": "solver solver.mesh solver.linalg",
    "solver.packing": "solver solver.mesh",
    "solver.transport": "solver solver.mesh solver.linalg",
    "solver.conformal": "solver solver.mesh solver.linalg solver.maps",
    "solver.revolution": "solver solver.mesh solver.linalg",
    "solver.walls": "solver solver.mesh solver.linalg",
    "solver.cutting": "solver solver.mesh solver.linalg solver.quads solver.analysis solver.maps solver.conformal "
    "solver.revolution solver.walls",
    "solver.seams": "solver solver.mesh solver.linalg solver.analysis solver.maps solver.packing solver.cutting "
    "solver.revolution",
    "solver.canonical": "solver solver.mesh solver.linalg solver.maps solver.transport solver.conformal",
    "solver.refinement": "solver solver.mesh solver.linalg solver.analysis solver.maps",
    "solver.subdivision": "solver solver.mesh solver.maps solver.refinement",
    "solver.parameterization.polygons": "solver solver.mesh solver.linalg solver.quads solver.maps solver.transport "
    "solver.conformal solver.canonical solver.refinement",
    "solver.parameterization": "solver solver.mesh solver.linalg solver.quads solver.analysis solver.maps "
    "solver.transport solver.cutting solver.seams solver.conformal solver.canonical solver.refinement "
    "solver.revolution solver.parameterization.polygons",
    "solver.editing": "solver solver.mesh solver.linalg solver.analysis solver.maps solver.refinement",
    "solver.arranging": "solver solver.mesh",
    "solver.sphere": "solver solver.mesh solver.linalg solver.maps solver.transport solver.conformal solver.refinement",
    "solver.volumes": "solver solver.mesh solver.linalg solver.contact solver.flows solver.sphere",
    "solver.globe": "solver solver.mesh solver.linalg solver.sphere",
    "solver.strain": "solver solver.mesh solver.analysis",
    "solver.registration": "solver solver.mesh solver.linalg solver.analysis solver.maps solver.refinement "
    "solver.parameterization solver.sphere",
    "solver.registration.charts": "solver solver.mesh solver.linalg solver.registration",
    "solver.remeshing.components": "solver solver.mesh solver.analysis",
    "solver.remeshing.edits": "solver solver.mesh solver.remeshing.components",
    "solver.remeshing.relaxation": "solver solver.mesh solver.linalg solver.remeshing.edits",
    "solver.remeshing.fitting": "solver solver.mesh solver.linalg solver.contact solver.remeshing.edits "
    "solver.remeshing.relaxation",
    "solver.remeshing.initial": "solver solver.mesh solver.maps solver.transport solver.cutting solver.conformal "
    "solver.refinement solver.parameterization solver.sphere solver.remeshing.components solver.remeshing.edits",
    "solver.remeshing": "solver solver.mesh solver.analysis solver.remeshing.components solver.remeshing.edits "
    "solver.remeshing.relaxation solver.remeshing.fitting solver.remeshing.initial",
    "solver.partition": "solver solver.mesh solver.linalg solver.transport",
    "solver.signatures": "solver solver.mesh solver.linalg solver.analysis solver.conformal solver.canonical "
    "solver.sphere solver.registration solver.transport solver.partition",
    "solver.api": "solver solver.mesh solver.analysis solver.maps solver.parameterization solver.editing solver.sphere "
    "solver.remeshing",
    "remedies": "solver",
    "xatlas_charts": "errors solver solver.mesh",
    "pipelines": "errors settings solver solver.mesh solver.canonical solver.analysis solver.maps solver.packing "
    "solver.subdivision solver.transfer solver.refinement "
    "solver.parameterization solver.editing solver.sphere solver.globe solver.remeshing solver.contact "
    "xatlas_charts",
    "pipelines.shapes": "settings errors solver solver.mesh solver.transfer solver.registration "
    "solver.registration.charts "
    "solver.strain solver.canonical solver.partition solver.signatures solver.contact solver.flows pipelines",
    "pipelines.volumes": "errors solver solver.mesh solver.flows solver.volumes",
    "pipelines.measuring": "solver solver.mesh solver.maps solver.canonical solver.conformal solver.cutting "
    "solver.sphere solver.transport pipelines",
    "pipelines.regions": "settings solver solver.mesh solver.analysis solver.maps solver.editing "
    "solver.parameterization pipelines",
    "pipelines.arranging": "settings solver solver.mesh solver.editing solver.arranging pipelines",
    "blender": "errors settings solver solver.mesh solver.canonical solver.analysis solver.globe "
    "solver.parameterization solver.subdivision pipelines",
    "blender.measuring": "errors solver pipelines pipelines.measuring blender",
    "blender.shapes": "settings errors solver solver.mesh solver.analysis solver.registration solver.strain pipelines "
    "pipelines.shapes blender",
    "blender.volumes": "errors solver solver.flows solver.volumes pipelines.volumes blender",
    "files.formats": "solver",
    "files.in_place": "errors solver",
    "files": "errors temporary supervision solver blender files.formats files.in_place",
    "display": "solver solver.mesh solver.maps pipelines blender",
    "display.textures": "solver solver.maps pipelines pipelines.measuring display",
    "session": "errors settings solver solver.mesh solver.maps solver.editing solver.parameterization pipelines "
    "blender",
    "batch": "errors temporary supervision solver",
    "commands": "errors supervision remedies settings solver solver.mesh solver.comparison solver.cutting solver.globe "
    "solver.parameterization pipelines pipelines.measuring pipelines.regions pipelines.volumes blender blender.volumes "
    "blender.measuring pipelines.shapes blender.shapes "
    "files files.in_place display solver.flows solver.volumes solver.strain solver.editing",
    "commands.pictures": "settings solver pipelines.measuring display.textures files commands",
    "commands.shapes": "settings supervision batch display solver solver.signatures solver.mesh solver.registration "
    "solver.strain pipelines.shapes blender "
    "blender.shapes files commands",
    "commands.arranging": "solver pipelines pipelines.arranging blender commands",
    "commands.volumes": "solver solver.flows solver.volumes pipelines.volumes blender.volumes files commands",
    "commands.batches": "supervision solver batch files commands",
    "operators": "errors links remedies settings solver solver.mesh solver.cutting solver.globe "
    "solver.parameterization solver.editing "
    "pipelines pipelines.regions blender files display session",
    "operators.inspection": "settings remedies solver solver.comparison pipelines pipelines.measuring blender "
    "blender.measuring display display.textures session operators",
    "operators.shapes": "settings solver solver.registration pipelines pipelines.shapes blender "
    "blender.shapes session operators",
    "operators.volumes": "solver solver.flows pipelines pipelines.volumes blender blender.volumes session operators",
    "operators.regions": "settings solver display pipelines blender session operators",
    "operators.arranging": "solver pipelines pipelines.arranging blender session operators",
    "panels.translations": "settings solver",
    "panels": "links errors remedies settings solver blender display session operators operators.inspection "
    "operators.arranging operators.volumes panels.translations",
}
SOLVER_LIBRARIES = {"numpy", "scipy"}
# Libraries that need not be there; imported within functions, which say how to get them.
OPTIONAL = {"solver.volumes.meshing": {"tetgen"}, "solver.volumes.envelope": {"pytetwild"}}
# Blender's modules stay in these.
KNOW_BLENDER = ("blender", "files", "display", "session", "operators", "panels", "commands")
ENTRY = ("__init__", "__main__", "cli", "registration")


def name_of(path: Path) -> str:
    """Dotted name below omt_uv; a package's is that of its folder."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


NAMES = {name_of(p): p for p in MODULES}
FOLDERS = sorted({p.parent for p in MODULES} - {PACKAGE})


def folder_of(name: str) -> str:
    """The folder in which a module stands: "solver.mesh"; a module of omt_uv itself stands for itself."""
    path = NAMES[name]
    return name if path.name == "__init__.py" or path.parent == PACKAGE else name.rpartition(".")[0]


def imports(path: Path):
    """Triples (level, module, names) of every import statement, wherever it stands."""
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            yield from ((0, alias.name, ()) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.level, node.module or "", tuple(alias.name for alias in node.names)


def imported(path: Path):
    """The modules of the package that a module imports."""
    parts = list(path.relative_to(PACKAGE).parts[:-1])
    for level, module, names in imports(path):
        if level:
            base = ".".join([*parts[: len(parts) - level + 1], *module.split(".")]).strip(".")
            for name in names:
                full = f"{base}.{name}".strip(".")
                yield full if full in NAMES else base


def arrows() -> dict[tuple[str, str], list[str]]:
    """Pairs of folders, and the imports that make them."""
    found: dict[tuple[str, str], list[str]] = {}
    for path in MODULES:
        here = folder_of(name_of(path))
        for module in imported(path):
            there = folder_of(module)
            if here != there and there and here not in ("", *ENTRY):
                found.setdefault((here, there), []).append(f"{path.relative_to(ROOT)} imports {module}")
    return found


def functions():
    """Triples (place, node, arguments) of every function of the package."""
    for path in MODULES:
        for node in nodes_of(path):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                every = node.args.posonlyargs + node.args.args + node.args.kwonlyargs
                yield f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", node, every


def test_every_folder_has_its_place_in_the_table():
    assert {folder_of(name_of(p)) for p in MODULES} == {*ARROWS, "", "cli", "registration", "__main__"}


def test_arrows_between_folders_are_those_of_the_table():
    wrong = [why for (here, there), why in arrows().items() if there not in ARROWS[here].split()]
    assert not wrong, "\n".join(line for lines in wrong for line in lines)


def test_the_table_allows_no_circle_and_no_climb():
    order = list(ARROWS)
    for here, allowed in ARROWS.items():
        # solver.remeshing imports its own subfolders, and they are above it in the list.
        assert all(order.index(there) < order.index(here) for there in allowed.split()), here


def test_modules_of_a_folder_make_no_circle():
    below = {name_of(p): {m for m in imported(p) if m != name_of(p)} for p in MODULES if p.name != "__init__.py"}
    while below:
        ground = [name for name, uses in below.items() if not uses & below.keys()]
        assert ground, f"these import one another in a circle: {sorted(below)}"
        for name in ground:
            del below[name]


@pytest.mark.parametrize("path", FOLDERS, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_folders_hold_a_few_modules(path):
    modules = [p for p in path.glob("*.py") if p.name != "__init__.py"]
    rooms = [p for p in path.iterdir() if p in FOLDERS]
    assert len(modules) + len(rooms) >= 2 and len(modules) <= MOST_MODULES


@pytest.mark.parametrize("path", FOLDERS, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_every_package_says_what_it_is_and_names_its_main_names(path):
    tree = ast.parse((path / "__init__.py").read_text())
    lines = (ast.get_docstring(tree) or "").splitlines()
    assert len(lines) >= 3, "three lines: what it is, what it may import, its main names"
    module = importlib.import_module(f"omt_uv.{name_of(path / '__init__.py')}")
    assert module.__all__ and sorted(module.__all__) == list(module.__all__)
    for name in module.__all__:
        # A name that a module of the package bears, too, would be either, as chance decides.
        assert not (path / f"{name}.py").exists() and not (path / name).is_dir(), name
        assert getattr(module, name).__doc__


def test_functions_are_short():
    long = [f"{place}: {n.end_lineno - n.lineno + 1} lines" for place, n, _ in functions()
            if n.end_lineno - n.lineno >= MOST_FUNCTION_LINES]  # fmt: skip
    assert not long, "\n".join(long)


def test_functions_have_few_parameters():
    wide = [f"{place}: {len(every)}" for place, _, every in functions() if len(every) > MOST_PARAMETERS]
    assert not wide, "\n".join(wide)


def test_every_class_name_is_there_once():
    classes = Counter(n.name for p in MODULES for n in nodes_of(p) if isinstance(n, ast.ClassDef))
    assert not [name for name, count in classes.items() if count > 1]


def test_one_named_constant_a_line():
    """A tuple of numbers hides which is which."""
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in MODULES
        for node in tree_of(path).body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple)
    ]
    assert not found, "\n".join(found)


def test_modules_stay_small():
    assert len(MODULES) > 500
    assert not [str(path) for path in MODULES if len(path.read_text().splitlines()) > MOST_LINES]


def test_imports_from_outside():
    """The package imports itself relatively (inside Blender it has another name), the solver numpy and scipy alone."""
    for path in MODULES:
        named = {module.split(".")[0] for level, module, _ in imports(path) if level == 0}
        outside = named - set(sys.stdlib_module_names)
        assert "omt_uv" not in outside, path
        folder = folder_of(name_of(path))
        if folder.split(".")[0] == "solver":
            assert outside <= SOLVER_LIBRARIES | OPTIONAL.get(name_of(path), set()), path
        if folder.split(".")[0] not in (*KNOW_BLENDER, "registration"):
            blender = outside & {"bpy", "bmesh", "gpu", "blf", "mathutils", "imbuf"}
            assert not blender or path.name == "__main__.py", path


def test_entry_of_the_extension_imports_nothing_at_the_top():
    tree = ast.parse((ROOT / "__init__.py").read_text())
    assert not [n for n in tree.body if isinstance(n, ast.Import | ast.ImportFrom)]


FACES = ["solver", "pipelines", "blender", "files", "display", "session", "commands", "operators", "panels"]


@pytest.mark.parametrize("name", [*FACES, "registration", "cli"])
def test_start_imports_no_scipy(name):
    """Blender's start waits for nothing but what it needs."""
    code = f"import sys, omt_uv.{name}; sys.exit('scipy' in sys.modules or 'xatlas' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT).returncode == 0
