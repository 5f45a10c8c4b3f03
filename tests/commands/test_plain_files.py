"""OBJ files that are unwrapped without Blender: read as Blender reads them, and left to it where it decides."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import bpy

import numpy as np
import pytest
from meshes import bumpy, icosphere

V, F = bumpy(4, 5, height=0.3)
VERTICES = "".join("v {} {} {}\n".format(*v) for v in V)
FACES = "".join("f {} {} {}\n".format(*(f + 1)) for f in F)
UVS = "".join(f"vt {x} {y}\n" for x, y in V[:, :2])
MAPPED = "".join("f {0}/{0} {1}/{1} {2}/{2}\n".format(*(f + 1)) for f in F)
NORMALS = "".join("vn 0 0 1\n" for _ in V)
SMOOTH = "".join("f {0}//{0} {1}//{1} {2}//{2}\n".format(*(f + 1)) for f in F)
BOTH = "".join("f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}\n".format(*(f + 1)) for f in F)
ONE_NORMAL = "".join("f {}//1 {}//1 {}//1\n".format(*(f + 1)) for f in F)
TWO_NORMALS = ONE_NORMAL.replace("//1", "//2", 1)
QUADS = "v 0 0 0\nv 1 0 0\nv 1 1 .1\nv 0 1 0\nv 2 0 0\nv 2 1 0\n".replace(" .1", " 0.1")

# Where normals differ, Blender marks edges sharp; 4.2 did not yet.
NORMALS_MAKE_SHARP = bpy.app.version >= (4, 5)

# Texts that Blender makes nothing else of.
PLAIN = {
    "triangles": VERTICES + FACES,
    "lines of Windows": (VERTICES + FACES).replace("\n", "\r\n"),
    "names": "# made\no Thing\ng part\nmtllib none.mtl\n" + VERTICES + "usemtl red\ns 1\n" + FACES,
    "two names": VERTICES
    + "o A\n"
    + FACES
    + "v 9 9 1\nv 9 8 1\nv 8 9 1\no B\n"
    + f"f {len(V) + 1} {len(V) + 2} {len(V) + 3}",
    "UVs": VERTICES + UVS + MAPPED,
    "normals": VERTICES + NORMALS + SMOOTH,
    "all": VERTICES + UVS + NORMALS + "s 0\n" + BOTH,
    "quads": QUADS + "f 1 2 3 4\nf 2 5 6\nf 2 6 3",
    "concave at the third corner": QUADS + "v 0.2 0.2 0\nf 1 2 7 4\nf 2 5 6 3\n",
    "concave at the second corner": QUADS + "v 0.2 0.2 0\nf 2 7 4 1\nf 2 5 6 3\n",
    "minus nothing": VERTICES.replace("v 0.0 ", "v -0.0 ") + FACES,
    "exponents": VERTICES.replace("v 0.0 ", "v 1e-3 ") + FACES,
}
# And such that it does.
BLENDERS = {
    "unused vertex": VERTICES + "v 7 7 7\n" + FACES,
    "face twice": VERTICES + FACES + FACES[: FACES.index("\n") + 1],
    "vertex twice": VERTICES + FACES + "f 1 2 2\n",
    "no such vertex": VERTICES + FACES + "f 1 2 999\n",
    "vertex 0": VERTICES + FACES + "f 0 1 2\n",
    "backward": VERTICES + FACES + "f -1 -3 -9\n",
    "polygon": VERTICES + FACES + "f 1 2 9 8 7\n",
    "line": VERTICES + FACES + "l 1 2\n",
    "half of the UVs": VERTICES + UVS + MAPPED[: MAPPED.index("\n", 99)] + "\n" + FACES,
    "no such UV": VERTICES + "vt 0 0\n" + MAPPED,
    "no such normal": VERTICES + "vn 0 0 1\n" + SMOOTH,
    "normals that hardly differ": VERTICES + "vn 0 0 1\nvn 0 0.01 1\n" + TWO_NORMALS,
    "normals along a boundary": VERTICES + "vn 0 0 1\nvn 0 1 0\n" + TWO_NORMALS,
    "no normal": VERTICES + "vn 0 0 0\n" + ONE_NORMAL,
    "faces of two sides": VERTICES + "vn 0 0 1\n" + ONE_NORMAL + "f 1//1 2//1 999//1\n".replace("999", "40"),
    "flat": QUADS + "v 0.5 0.5 0\nf 2 7 4 1\nf 2 5 6 3\n",
    "colours": VERTICES.replace("\n", " 1 0 0\n") + FACES,
    "no number": VERTICES.replace("v 0.0 ", "v nan ") + FACES,
    "far off": "".join("v {} {} {}\n".format(*(v + 100)) for v in V) + FACES,
    "huge": "".join("v {} {} {}\n".format(*(v * 1e12)) for v in V) + FACES,
    "continued": VERTICES + FACES.replace(" ", " \\\n", 1),
    "mark": "\ufeff" + VERTICES + FACES,
    "free form": VERTICES + FACES + "surf 0 1 0 1 1 2 3\n",
    "nothing": "",
    "no faces": VERTICES,
}


def read(package, path):
    """What is read of a file without Blender, and by it."""
    options = package("cli").parsed(["unwrap", str(path), "-o", "out.obj"])
    plain = package("commands.selection").read_plain_file(options)
    return plain, lambda: package("commands.selection").read_file(options)


def normalized(vectors):
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def pairs(edges):
    return {frozenset(edge) for edge in edges.tolist()}


def check_alike(plain, obj, reading):
    found, ours = plain
    assert found.name == obj.name
    if NORMALS_MAKE_SHARP:
        assert pairs(ours.surface.sharp) == pairs(reading.surface.sharp)
    for name in ("positions", "corner_vertex", "face_start", "triangles", "triangle_face", "seams"):
        mine, theirs = getattr(ours.surface, name), getattr(reading.surface, name)
        assert mine.dtype == theirs.dtype and np.array_equal(mine, theirs), name
        # Zeros have signs.
        assert mine.tobytes() == np.ascontiguousarray(theirs).tobytes(), name
    for name in ("faces", "uv", "pinned"):
        assert np.array_equal(getattr(ours, name), getattr(reading, name)), name
    assert (ours.subdivision, ours.axes) == (reading.subdivision, reading.axes)


@pytest.mark.parametrize("name", PLAIN)
def test_files_are_read_as_blender_reads_them(package, tmp_path, name):
    (tmp_path / "in.obj").write_bytes(PLAIN[name].encode())
    plain, blender = read(package, tmp_path / "in.obj")
    assert plain is not None
    ((obj, reading),) = blender()
    check_alike(plain, obj, reading)


@pytest.mark.parametrize("name", BLENDERS)
def test_what_blender_decides_is_left_to_it(package, tmp_path, name):
    (tmp_path / "in.obj").write_bytes(BLENDERS[name].encode())
    assert read(package, tmp_path / "in.obj")[0] is None


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("kind", ["uv_sphere", "cube", "torus", "grid"])
def test_files_of_blender_are_read_as_it_reads_them(package, tmp_path, kind, smooth):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")()
    if smooth:
        bpy.ops.object.shade_smooth()
    bpy.ops.wm.obj_export(filepath=str(tmp_path / "in.obj"), export_materials=False)
    plain, blender = read(package, tmp_path / "in.obj")
    assert plain is not None
    ((obj, reading),) = blender()
    check_alike(plain, obj, reading)
    # The normals of flat faces make edges sharp where these are no plane.
    assert (len(plain[1].surface.sharp) > 0) == (not smooth and kind != "grid")


@pytest.mark.parametrize("kinds", [2, 3, 30])
def test_edges_between_normals_are_sharp(package, tmp_path, kinds):
    (points, triangles), rng = icosphere(2), np.random.default_rng(kinds)
    lines = ["v {:.6f} {:.6f} {:.6f}".format(*v) for v in points]
    for _ in range(4):
        normals = ["vn {:.4f} {:.4f} {:.4f}".format(*n) for n in normalized(rng.normal(size=(kinds, 3)))]
        named = rng.integers(1, kinds + 1, triangles.shape)
        faces = [
            "f {}//{} {}//{} {}//{}".format(*np.stack([f + 1, k], axis=1).ravel())
            for f, k in zip(triangles, named, strict=True)
        ]
        (tmp_path / "in.obj").write_text("\n".join([*lines, *normals, *faces]))
        plain, blender = read(package, tmp_path / "in.obj")
        assert plain is not None
        ((obj, reading),) = blender()
        check_alike(plain, obj, reading)
        assert len(plain[1].surface.sharp) > 0


@pytest.mark.parametrize("name", ["triangles", "all", "quads"])
def test_the_same_bytes_are_written_without_blender(package, tmp_path, name, monkeypatch, run):
    (tmp_path / "in.obj").write_bytes(PLAIN[name].encode())
    assert run("unwrap", tmp_path / "in.obj", "-o", tmp_path / "plain.obj") == (0, "", "")
    monkeypatch.setattr(package("files.in_place.plain_obj"), "MOST_BYTES", 0)
    assert run("unwrap", tmp_path / "in.obj", "-o", tmp_path / "blender.obj") == (0, "", "")
    assert (tmp_path / "plain.obj").read_bytes() == (tmp_path / "blender.obj").read_bytes()


def test_blender_is_not_started_for_a_plain_file(tmp_path):
    (tmp_path / "in.obj").write_text(PLAIN["triangles"])
    words = ["unwrap", str(tmp_path / "in.obj"), "-o", str(tmp_path / "out.obj")]
    program = f"import sys; from omt_uv.cli import main; print(main({words!r}), 'bpy' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=Path(__file__).parents[2]
    )
    assert done.stdout == "0 False\n"


@pytest.mark.parametrize(
    "option",
    [["--object", "in"], ["--mark-seams"], ["--uv-layer", "other"], ["--subdivision", "1"], ["--keep-free", "no"]],
)
def test_what_is_asked_of_scenes_is_asked_of_blender(package, tmp_path, option):
    (tmp_path / "in.obj").write_text(PLAIN["triangles"])
    words = ["unwrap", str(tmp_path / "in.obj"), "-o", str(tmp_path / "out.obj"), *option]
    assert package("commands.selection").read_plain_file(package("cli").parsed(words)) is None
