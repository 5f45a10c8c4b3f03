"""Handlers of several exceptions: a scene in which each of them comes up where the handler is, and does not come out.

`test_every_handler` finds the handlers in the sources. One with a kind of exception that has no scene here, nor a
reason in `OF_OTHERS`, fails; so does a scene without its exception.
"""

from __future__ import annotations

import argparse
import csv
import json
import struct
import sys
import zipfile
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from handlers import Handler, handlers, kind_of, named

SEVERAL = {
    (h.module.removeprefix("omt_uv."), h.function, h.place): (h, {kind_of(k): k for k in kinds})
    for h in handlers()
    if isinstance(kinds := named(h.node.type, h.module), tuple) and len(kinds) > 1
}
SCENES: dict[tuple[str, str, int], dict[str, object]] = {}
OF_OTHERS = {
    ("commands.shapes.library", "run", 1): "`tests/commands/shapes/test_library.py`",
    ("solver.parameterization.chart_map", "_refined", 1): "`test_every_warning` of the solver",
}
DEEP = "[" * 100_000
LARGE = 10**400


def scene(module: str, function: str, place: int, *kinds: str):
    """Keep a function as the scene of kinds of exceptions of a handler; it is given the kind, and `Stage`."""

    def keep(run):
        SCENES.setdefault((module, function, place), {}).update(dict.fromkeys(kinds, run))
        return run

    return keep


class Stage(SimpleNamespace):
    """Where a scene is played: a folder `at`, `patch`, modules by name, and a file there."""

    def file(self, content, name: str = "file") -> Path:
        path = self.at / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def fails(self, owner, name: str, kind: type) -> None:
        """Let what is called raise an exception."""
        self.patch.setattr(owner, name, raising(kind))


def raising(kind: type):
    def fail(*_, **__):
        raise made(kind)

    return fail


def made(kind: type) -> BaseException:
    if issubclass(kind, UnicodeError):
        return kind("utf-8", b"\xff", 0, 1, "no text")
    return kind("a cause")


@contextmanager
def met(handler: Handler):
    """The exceptions that come up in calls of a function, one after the other."""
    path, name, found = handler.module.replace(".", "/"), handler.function.rpartition(".")[2], []

    def within(frame, event, given):
        if event == "exception":
            found.append(given[1])
        return within

    def calls(frame, event, given):
        here = frame.f_code.co_name == name and frame.f_code.co_filename.endswith(f"{path}.py")
        return within if here else None

    before = sys.gettrace()
    sys.settrace(calls)
    try:
        yield found
    finally:
        sys.settrace(before)


# ---- batches ----------------------------------------------------------------------------------------------------


@scene("batch.cluster", "Cluster.__init__", 3, "OSError", "ValueError")
def _no_scheduler(kind, stage):
    stage.patch.setitem(sys.modules, "distributed", SimpleNamespace(Client=raising(kind)))
    stage.module("batch.cluster").Cluster(SimpleNamespace(), (), "tcp://nowhere:1", False)


@scene("batch.plan", "_of_list", 1, "OSError", "UnicodeDecodeError")
def _no_list(kind, stage):
    path = stage.file(b"\xff\xfe")
    stage.module("batch.plan")._of_list(path if kind is UnicodeDecodeError else stage.at / "none")


@scene("batch.pool", "free_memory", 1, "OSError", "StopIteration")
def _memory_is_not_told(kind, stage):
    pool = stage.module("batch.pool")
    (stage.at / "proc").mkdir()
    if kind is StopIteration:
        stage.file("MemTotal: 3 kB\n", "proc/meminfo")
    stage.patch.setattr(pool, "Path", lambda path: stage.at / path.strip("/"))
    pool.free_memory()


@scene("batch.pool", "free_memory", 2, "OSError", "ValueError")
def _no_group_has_a_limit(kind, stage):
    pool = stage.module("batch.pool")
    for folder in ("proc", "sys/fs/cgroup"):
        (stage.at / folder).mkdir(parents=True)
    stage.file("MemAvailable: 3 kB\n", "proc/meminfo")
    if kind is ValueError:
        stage.file("max\n", "sys/fs/cgroup/memory.max")
    stage.patch.setattr(pool, "Path", lambda path: stage.at / path.strip("/"))
    assert pool.free_memory() == 3 * 1024


# ---- commands ---------------------------------------------------------------------------------------------------


@scene("commands.common", "write_picture", 1, "OSError", "RuntimeError")
def _picture_is_not_written(kind, stage):
    stage.fails(stage.module("display.canvas"), "save", kind)
    stage.module("commands.common").write_picture(stage.at / "a.png", np.zeros((2, 2, 3)))


@scene("commands.shapes.distances", "_classes", 1, "OSError", "UnicodeDecodeError", "csv.Error")
def _no_table(kind, stage):
    content = b"\xff\n" if kind is UnicodeDecodeError else b"a," + b"b" * (csv.field_size_limit() + 1)
    path = stage.at / "none" if kind is OSError else stage.file(content)
    stage.module("commands.shapes.distances")._classes(path, ("a",))


BLOCKS = {KeyError: "{}", TypeError: "[]", ValueError: "{", RecursionError: DEEP,
          OverflowError: json.dumps({"index": "a", "block": [0], "curvature": LARGE})}  # fmt: skip


@scene("commands.shapes.distances", "run_block", 1, "OSError", *(k.__name__ for k in BLOCKS))
def _no_block(kind, stage):
    path = stage.at / "none" if kind is OSError else stage.file(BLOCKS[kind])
    stage.module("commands.shapes.distances").run_block(argparse.Namespace(input=path))


# ---- files ------------------------------------------------------------------------------------------------------


@scene("files.fbx_nodes", "count", 1, "IndexError", "struct.error")
def _short_fbx(kind, stage):
    nodes = stage.module("files.fbx_nodes")
    begin = nodes.MAGIC.ljust(23, b"\0") + struct.pack("<I", 7400)
    # A record that ends before its own name, or has a string whose length is cut off.
    values = (27 + 5, 0, 0, 9) if kind is IndexError else (27 + 13 + 2, 1, 2, 0)
    nodes.count(begin + struct.pack("<IIIB", *values) + (b"\0" * 20 if kind is IndexError else b"S\0"))


GLTF = {ValueError: "{", LookupError: "{}", TypeError: "[]", AttributeError: '{"buffers": [{"uri": 1}]}',
        RecursionError: DEEP, OverflowError: '{"buffers": [{"uri": "a", "byteLength": 1e999}]}'}  # fmt: skip


@scene("files.formats.headers", "_gltf", 1, *(k.__name__ for k in GLTF))
def _strange_gltf(kind, stage):
    assert stage.module("files.formats.headers")._gltf(stage.file(GLTF[kind])) is None


@scene("files.images", "load", 2, "RuntimeError", "files.images.ImageError")
def _no_image(kind, stage):
    images = stage.module("files.images")
    if kind is RuntimeError:
        stage.fails(images, "pixels_of", kind)
    images.load(stage.file(b"no picture", "a.png"))


MALFORMED = ("AttributeError", "IndexError", "KeyError", "OverflowError", "RecursionError", "TypeError", "ValueError")


@scene("files.in_place.glb", "put_into", 2, *MALFORMED)
def _malformed(kind, stage):
    glb = stage.module("files.in_place.glb")
    stage.fails(glb, "_put", kind)
    glb.put_into(None, ())


@scene("files.in_place.glb_data", "read", 1, "RecursionError", "ValueError")
def _no_json_within(kind, stage):
    data = stage.module("files.in_place.glb_data")
    text = DEEP.encode() if kind is RecursionError else b"{   "
    chunk = struct.pack("<II", len(text), data.JSON_CHUNK) + text
    data.read(struct.pack("<III", data.MAGIC, 2, 12 + len(chunk)) + chunk)


@scene("files.in_place.gltf", "read", 1, "RecursionError", "ValueError")
def _no_json(kind, stage):
    stage.module("files.in_place.gltf").read(DEEP.encode() if kind is RecursionError else b"{", stage.at)


PARTS = {AttributeError: {"buffers": [1]}, IndexError: {"bufferViews": [{"buffer": 5}]},
         KeyError: {"bufferViews": [{}]}, TypeError: {"bufferViews": [{"buffer": "a"}]}}  # fmt: skip


@scene("files.in_place.gltf", "read", 2, *(k.__name__ for k in PARTS))
def _no_gltf(kind, stage):
    stage.module("files.in_place.gltf").read(json.dumps(PARTS[kind]).encode(), stage.at)


@scene("files.in_place.obj_text", "_indices", 1, "OverflowError", "ValueError")
def _no_indices(kind, stage):
    word = b"x" if kind is ValueError else b"9" * 40
    assert stage.module("files.in_place.obj_text")._indices([word, b"2"]).tolist() == [[0, 0], [2, 0]]


@scene("files.in_place.plain_obj", "read_plain", 1, "OSError", "files.in_place.imported.InPlaceError")
def _not_plain(kind, stage):
    plain = stage.module("files.in_place.plain_obj")
    if kind is not OSError:
        stage.fails(plain, "read", kind)
    path = stage.at / "none.obj" if kind is OSError else stage.file(b"v 0 0 0\n", "a.obj")
    assert plain.read_plain(path) is None


LINES = {IndexError: b"format\n", KeyError: b"format strange 1.0\n", ValueError: b"element vertex x\n"}


@scene("files.in_place.ply_rows", "read_header", 1, *(k.__name__ for k in LINES))
def _no_header(kind, stage):
    stage.module("files.in_place.ply_rows").read_header(b"ply\n" + LINES[kind])


@scene("files.in_place.ply_rows", "_count", 1, "IndexError", "ValueError")
def _no_length(kind, stage):
    data = b"" if kind is IndexError else b"x"
    stage.module("files.in_place.ply_rows")._count(data, [0], 0, len(data))


READERS = ("ArithmeticError", "LookupError", "OSError", "RuntimeError", "SystemError", "TypeError", "ValueError")


@scene("files.meshes", "load", 1, *READERS)
def _reader_fails(kind, stage):
    files = stage.module("files.meshes")
    stage.patch.setitem(files._READERS, ".obj", raising(kind))
    files.load(stage.file(b"v 0 0 0\n", "a.obj"))


@scene("files.read_back", "check", 1, "KeyError", "ValueError", "struct.error")
def _not_read_back(kind, stage):
    back = stage.module("files.read_back")
    stage.patch.setattr(back, "_COUNTERS", {} if kind is KeyError else {".ply": raising(kind)})
    back.check(stage.at / "a.ply", ".ply", ())


@scene("files.verified", "_lives", 1, "OverflowError", "ProcessLookupError")
def _is_dead(kind, stage):
    verified = stage.module("files.verified")
    if kind is ProcessLookupError:
        stage.fails(verified.os, "kill", kind)
    assert not verified._lives(f"{verified.PREFIX}{'9' * 40 if kind is OverflowError else 7}_a")


@scene("files.verified", "_lives", 2, "PermissionError", "ValueError")
def _may_live(kind, stage):
    verified = stage.module("files.verified")
    if kind is PermissionError:
        stage.fails(verified.os, "kill", kind)
    assert verified._lives(f"{verified.PREFIX}{'x' if kind is ValueError else 7}_a")


# ---- panels and sessions ----------------------------------------------------------------------------------------


@scene("panels.welcome", "show_tab", 1, "AttributeError", "TypeError")
def _no_tabs_yet(kind, stage):
    class Region:
        type = "UI"

        def __setattr__(self, name, value):
            raise kind(name)

    asked = []
    area = SimpleNamespace(type="VIEW_3D", width=1, height=1, regions=[Region()], tag_redraw=lambda: asked.append(1),
                           spaces=SimpleNamespace(active=SimpleNamespace()))  # fmt: skip
    window = SimpleNamespace(screen=SimpleNamespace(areas=[area]))
    manager = SimpleNamespace(window_manager=SimpleNamespace(windows=[window]))
    welcome = stage.module("panels.welcome")
    stage.patch.setattr(welcome, "bpy", SimpleNamespace(app=SimpleNamespace(version=(9, 9, 9)), context=manager))
    assert not welcome.show_tab() and asked == [1]


PRESETS = {SyntaxError: "(", ValueError: "op.a = f()", TypeError: "op.a = {[]: 1}", RecursionError: "", OSError: "",
           MemoryError: ""}  # fmt: skip


@scene("session.presets", "values", 1, *(k.__name__ for k in PRESETS))
def _no_preset(kind, stage):
    presets = stage.module("session.presets")
    if not PRESETS[kind]:
        stage.fails(presets.ast, "parse", kind)
    presets.values(stage.file(PRESETS[kind], "a.py"))


@scene("session.presets", "choose", 1, "AttributeError", "OverflowError", "TypeError", "ValueError")
def _no_setting(kind, stage):
    class Properties:
        margin = 4
        bl_rna = SimpleNamespace(properties={"margin": SimpleNamespace(is_readonly=False)})
        is_property_set = property_unset = staticmethod(lambda name: False)

        def __setattr__(self, name, value):
            raise kind(name)

    text = "op.margin = 1e999" if kind is ValueError else "op.margin = 7"
    stage.module("session.presets").choose(stage.file(text, "a.py"), Properties())


# ---- pipelines --------------------------------------------------------------------------------------------------


@scene("pipelines.measuring.region_figures", "diameter", 1, "ValueError", "scipy.QhullError")
def _no_hull(kind, stage):
    line = np.array([[0.0, 0], [1, 1], [3, 3]])
    points = line * np.nan if kind is ValueError else line
    stage.module("pipelines.measuring.region_figures").diameter(points)


@scene("pipelines.shapes.landmark_pairs", "read_pairs", 1, "OSError", "ValueError", "RecursionError")
def _no_pairs(kind, stage):
    path = stage.at / "none" if kind is OSError else stage.file("[" if kind is ValueError else DEEP)
    stage.module("pipelines.shapes.landmark_pairs").read_pairs(path)


@scene("pipelines.shapes.signature_index", "read_index", 2, "OSError", "KeyError", "ValueError", "TypeError",
       "EOFError", "zipfile.BadZipFile", "zlib.error", "RuntimeError", "MemoryError")  # fmt: skip
def _no_index(kind, stage):
    path = stage.file(b"", "s.npz")
    name = kind_of(kind)
    whole = {name: np.arange(3.0) for name in ("packed", "floors", "coefficients", "names", "marks")}
    if name == "KeyError":
        np.savez(path, floors=whole["floors"])
    elif name == "TypeError":
        np.savez(path, **{**whole, "names": ["a"], "marks": 0.5})
    elif name in ("zlib.error", "RuntimeError"):
        np.savez_compressed(path, **whole)
        raw = bytearray(path.read_bytes())
        with zipfile.ZipFile(path) as archive:
            at = archive.infolist()[0].header_offset
        body = at + 30 + sum(struct.unpack_from("<HH", raw, at + 26))
        if name == "zlib.error":
            raw[body : body + 4] = b"\xff" * 4
        for place in (at + 6, raw.index(b"PK\x01\x02") + 8):
            raw[place] |= name == "RuntimeError"
        path.write_bytes(raw)
    elif name == "MemoryError":
        head = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000000000,), }\n"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("packed.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head)
    elif name == "OSError":
        stage.fails(np, "load", kind)
    else:
        path.write_bytes({"ValueError": b"no array", "EOFError": b"", "zipfile.BadZipFile": b"PK\x03\x04abc"}[name])
    stage.module("pipelines.shapes.signature_index").read_index(path)


PAIRS = {TypeError: [1], ValueError: [[1, 2, 3]], OverflowError: [[[0, 0, LARGE], 1]]}


@scene("pipelines.shapes.landmark_pairs", "read_pairs", 2, *(k.__name__ for k in PAIRS))
def _no_pair(kind, stage):
    stage.module("pipelines.shapes.landmark_pairs").read_pairs(stage.file(json.dumps(PAIRS[kind])))


@scene("pipelines.volumes.handle_file", "read_handle_file", 2, "ValueError", "RecursionError")
def _no_handles(kind, stage):
    path = stage.file("[" if kind is ValueError else DEEP)
    stage.module("pipelines.volumes.handle_file").read_handle_file(path)


@scene("pipelines.volumes.handle_file", "_vertices", 1, "TypeError", "ValueError")
def _no_vertices(kind, stage):
    entry = {"vertices": [0, 10**30] if kind is TypeError else [[1], [1, 2]]}
    body = SimpleNamespace(positions=np.zeros((4, 3)), name="Body")
    stage.module("pipelines.volumes.handle_file")._vertices(entry, body, None, "here")


POINTS = {TypeError: {}, ValueError: "x", OverflowError: [LARGE, 0, 0]}


@scene("pipelines.volumes.handle_file", "_points", 1, *(k.__name__ for k in POINTS))
def _no_points(kind, stage):
    stage.module("pipelines.volumes.handle_file")._points({"to": POINTS[kind]}, "to", "here")


# ---- the solver -------------------------------------------------------------------------------------------------

BROKEN = {
    "ZeroAreaFaceError": ([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], [[0, 1, 2], [0, 1, 3]]),
    "DuplicateFaceError": ([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 2]]),
    "NonManifoldEdgeError": ([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]],
                             [[0, 1, 2], [1, 0, 3], [0, 1, 4]]),
    "OrientationError": ([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, -1, 0]], [[0, 1, 2], [0, 1, 3]]),
}  # fmt: skip


@scene("solver.cutting.disk_charts", "_existing", 1, *(f"solver.errors.{name}" for name in BROKEN))
def _broken(kind, stage):
    points, faces = BROKEN[kind.__name__]
    surface = stage.module("solver.mesh.surface").triangle_surface(np.array(points), np.array(faces))
    stage.module("solver.cutting.disk_charts")._existing(surface, None, False, None, lambda: None)


@scene("solver.parameterization.initial_map", "_coarse_or_coarser_refined", 1, "solver.errors.FoldedUVError",
       "solver.errors.PrecisionError")  # fmt: skip
def _coarser(kind, stage):
    maps, progress = stage.module("solver.parameterization.initial_map"), stage.module("solver.progress")
    calls = []

    def refined(disk, initial, balance, quality):
        calls.append(quality)
        if len(calls) == 1:
            raise made(kind)
        return initial
        yield

    def coarse(disk, balance, log):
        return "coarse"
        yield

    stage.patch.setattr(maps, "_coarse_refined", refined)
    stage.patch.setattr(maps, "coarse_initial_map", coarse)
    stage.patch.setattr(maps, "replace", lambda disk, **_: disk)
    disk = SimpleNamespace(vertices=np.zeros((10**6, 3)))
    found = progress.drain(maps._coarse_or_coarser_refined(disk, None, 0.0, "rough", None))
    assert found == ("coarse", "coarse") and calls == ["rough", "freed"]


@scene("solver.parameterization.initial_map", "_transport", 1, "solver.errors.PrecisionError",
       "solver.errors.TransportError")  # fmt: skip
def _no_transport(kind, stage):
    maps, progress = stage.module("solver.parameterization.initial_map"), stage.module("solver.progress")
    stage.fails(stage.module("solver.transport.semidiscrete"), "transport", kind)
    assert progress.drain(maps._transport(None, None, None, progress.RunLog())) == (None, "a cause")


@scene("solver.sphere.sphere_map", "_refined_start", 1, "solver.errors.FoldedUVError", "solver.errors.TransportError")
def _no_start(kind, stage):
    def start():
        raise made(kind)
        yield

    told, progress = [], stage.module("solver.progress")
    steps = stage.module("solver.sphere.sphere_map")._refined_start(None, start(), None, told, {})
    assert progress.drain(steps) is None and told == ["a cause; the map was built from coarse to fine instead"]


@scene("solver.transport.regular_triangulation", "by_hull", 1, "ValueError", "scipy.QhullError")
def _no_triangulation(kind, stage):
    sites = np.zeros((5, 2)) if kind is not ValueError else np.full((5, 2), np.nan)
    with np.errstate(all="ignore"):
        stage.module("solver.transport.regular_triangulation").by_hull(sites, np.zeros(5))


@scene("solver.transport.spherical_power_diagram", "by_hull", 1, "ValueError", "scipy.QhullError")
def _no_diagram(kind, stage):
    sites = np.full((5, 3), np.nan) if kind is ValueError else meshes.grid(2, 1)[0]
    stage.module("solver.transport.spherical_power_diagram").by_hull(sites, np.zeros(len(sites)))


# ---- all of them ----------------------------------------------------------------------------------------------


def test_every_kind_has_a_scene():
    wished = {(*key, kind) for key, (_, kinds) in SEVERAL.items() for kind in kinds if key not in OF_OTHERS}
    there = {(*key, kind) for key, kinds in SCENES.items() for kind in kinds}
    assert not wished - there, "\n".join(map(str, sorted(wished - there)))
    assert not there - wished, "\n".join(map(str, sorted(there - wished)))
    assert SEVERAL.keys() >= OF_OTHERS.keys()


@pytest.mark.parametrize("key, kind", [(key, kind) for key, kinds in SCENES.items() for kind in kinds], ids=str)
def test_what_a_handler_is_for_happens_and_does_not_come_out(key, kind, package, tmp_path, monkeypatch):
    handler, kinds = SEVERAL[key]
    stage = Stage(at=tmp_path, patch=monkeypatch, module=package)
    out = None
    with met(handler) as found:
        try:
            SCENES[key][kind](kinds[kind], stage)
        except Exception as error:  # noqa: BLE001, it is looked at below
            out = error
    others = tuple(k for name, k in kinds.items() if name != kind)
    alone = [e for e in found if isinstance(e, kinds[kind]) and not isinstance(e, others)]
    assert alone, f"{kind} did not come up, but {found}"
    # What comes out, if anything does, was raised by the handler.
    assert out is not alone[0], f"{out!r} came out"
