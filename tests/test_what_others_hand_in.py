"""Bytes that are no text, in whatever comes from outside: files, other programs, a caller; and what a machine says of
itself. Every place that reads such has a scene here, found in the sources."""

from __future__ import annotations

import ast
import functools
import io
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from sources import nodes_of, walked

import omt_uv
from omt_uv import supervision
from omt_uv.batch import engine, plan, pool, servant
from omt_uv.files.formats import off
from omt_uv.pipelines.shapes import signature_index
from omt_uv.solver import counts
from omt_uv.solver.errors import CountError

ROOT = Path(omt_uv.__file__).parent
FOREIGN = b"\xff\xfe\xe9"
SHOWN = FOREIGN.decode(errors="replace")
KEPT = FOREIGN.decode("utf-8", "surrogateescape")


@functools.cache
def functions() -> list[tuple[str, list[ast.AST]]]:
    """Names of all functions of the package, but for those of the solver, and what stands in each."""
    paths = [path for path in sorted(ROOT.rglob("*.py")) if not path.is_relative_to(ROOT / "solver")]
    return [
        (".".join([*path.relative_to(ROOT).with_suffix("").parts, node.name]), walked(node))
        for path in paths
        for node in nodes_of(path)
        if isinstance(node, ast.FunctionDef)
    ]


def places(call) -> set[str]:
    """Functions of the package in which a call stands."""
    return {name for name, nodes in functions() if any(map(call, nodes))}


def takes_foreign_bytes(node) -> bool:
    if not isinstance(node, ast.Call):
        return False
    values = [value for value in (*node.args, *(k.value for k in node.keywords)) if isinstance(value, ast.Constant)]
    return any(value.value in ("replace", "surrogateescape") for value in values)


def asks_the_system(node) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == "sysconf"


def child_prints(folder: Path) -> str:
    code = f"import os; os.write(1, {FOREIGN!r}); os.write(2, {FOREIGN!r})"
    found = supervision.watch(supervision.Errand([sys.executable, "-c", code], "a"), lambda child: None)
    assert found.err == SHOWN
    return found.out


def servant_prints(folder: Path) -> str:
    (folder / "said").write_bytes(FOREIGN)
    return servant._text(folder / "said")


def comment_of_a_mesh(folder: Path) -> str:
    (folder / "a.off").write_bytes(b"OFF # " + FOREIGN + b"\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    points, faces = off.read_off(folder / "a.off")
    return SHOWN if points.shape == (3, 3) and list(faces[0]) == [0, 1, 2] else ""


def name_in_an_index(folder: Path) -> str:
    return signature_index._text(FOREIGN)


def library_of_materials(folder: Path) -> str:
    saving = pytest.importorskip("omt_uv.files.saving", exc_type=ImportError)
    (told,) = saving._left_behind(b"mtllib " + FOREIGN + b"\n", ".obj", folder / "in" / "a.obj", folder / "b.obj")
    return SHOWN if SHOWN in told else told


def blender_prints(folder: Path) -> str:
    from omt_uv.files.silence import silence

    with silence() as printed:
        os.write(1, FOREIGN)
    return printed()


def names_of_materials(folder: Path) -> str:
    materials = pytest.importorskip("omt_uv.files.obj_materials", exc_type=ImportError)
    path = folder / "a.obj"
    path.write_bytes(b"o " + FOREIGN + b"\nv 0 0 0\n")
    materials.name_materials(path, [])
    return KEPT if FOREIGN in path.read_bytes() else ""


def name_of_an_image(folder: Path) -> str:
    bpy = pytest.importorskip("bpy")
    images = pytest.importorskip("omt_uv.files.images")
    like = bpy.data.images.new("like", 1, 1)
    return images._new_image(f"a{KEPT}", np.zeros((1, 1, 4), np.float32), like).name[1:]


def name_of_what_is_open(folder: Path) -> str:
    export = pytest.importorskip("omt_uv.files.export")
    saved = []
    wm = SimpleNamespace(save_as_mainfile=lambda filepath, check_existing: saved.append(Path(filepath).name))
    with pytest.MonkeyPatch.context() as patch:
        data, ops = SimpleNamespace(filepath=f"/{KEPT}.blend"), SimpleNamespace(wm=wm)
        patch.setattr(export, "bpy", SimpleNamespace(data=data, ops=ops))
        export._name_source()
    return SHOWN if saved == ["source.blend"] else ""


def message_of_a_failure(folder: Path) -> str:
    there = SimpleNamespace(beside=lambda name: folder / name)
    record = SimpleNamespace(status=3, words=["unwrap", f"{KEPT}.obj"], message=KEPT)
    engine.keep_failure(there, SimpleNamespace(name="a"), record)
    (written,) = (path for path in folder.rglob("*.txt"))
    return "".join(written.read_text().split("status 3")[1].split())


def part_of_a_file(folder: Path) -> str:
    return KEPT if 1 <= plan._part_of(KEPT, 3) <= 3 else ""


def names_of_an_index(folder: Path) -> str:
    none = np.zeros((1, 1))
    index = signature_index.SignatureIndex((KEPT,), ("",), none, none, none)
    with np.load(io.BytesIO(index.bytes())) as data:
        return data["names"][0].decode("utf-8", "surrogateescape")


# How a text of such bytes comes out: shown with marks in their place, kept, or with one of each as a question mark.
BYTES = {
    "supervision.watch": (child_prints, SHOWN), "batch.servant._text": (servant_prints, SHOWN),
    "batch.engine.keep_failure": (message_of_a_failure, "???"), "batch.plan._part_of": (part_of_a_file, KEPT),
    "pipelines.shapes.signature_index.bytes": (names_of_an_index, KEPT),
    "files.formats.off.read_off": (comment_of_a_mesh, SHOWN),
    "pipelines.shapes.signature_index._text": (name_in_an_index, KEPT),
    "files.saving._left_behind": (library_of_materials, SHOWN),
    "files.silence.silence": (blender_prints, SHOWN), "files.obj_materials.name_materials": (names_of_materials, KEPT),
    "files.images._new_image": (name_of_an_image, "???"), "files.export._name_source": (name_of_what_is_open, SHOWN),
}  # fmt: skip


def test_every_place_that_takes_foreign_bytes_has_a_scene():
    assert places(takes_foreign_bytes) == set(BYTES)


@pytest.mark.parametrize("place", BYTES)
def test_bytes_that_are_no_text_are_no_error(place, tmp_path):
    scene, expected = BYTES[place]
    assert scene(tmp_path) == expected


# A machine of which each figure is another one.
FIGURES = {"SC_PAGE_SIZE": 1000, "SC_PAGESIZE": 1000, "SC_PHYS_PAGES": 10**6, "SC_AVPHYS_PAGES": 10}


def most_vertices() -> float:
    """The memory up to which a remesh is not refused."""
    low, high = 1.0, 1e12
    while high - low > 1e-6 * high:
        middle = (low + high) / 2
        try:
            counts.check_vertices(middle)
            low = middle
        except CountError:
            high = middle
    for none in (np.inf, np.nan):
        with pytest.raises(CountError):
            counts.check_vertices(none)
    return low * counts.BYTES_PER_VERTEX


SYSTEM = {"batch.pool.free_memory": pool.free_memory}
# Of the solver, and who asks it.
ASKED = {"solver.counts.check_vertices": most_vertices}


def test_every_place_that_asks_the_system_has_a_scene():
    assert places(asks_the_system) == set(SYSTEM)


@pytest.mark.parametrize("place", [*SYSTEM, *ASKED])
def test_the_memory_that_counts_is_that_of_the_whole_machine(place, monkeypatch):
    monkeypatch.setattr(os, "sysconf", FIGURES.__getitem__, raising=False)

    def read_text(path, *_, **__):
        raise FileNotFoundError(path)

    monkeypatch.setattr(Path, "read_text", read_text)
    assert (SYSTEM | ASKED)[place]() == pytest.approx(1e9)
