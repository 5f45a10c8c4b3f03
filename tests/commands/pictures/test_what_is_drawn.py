"""Every option that draws: ink is exactly where faces lie, right side up, in the size that was asked for; and nothing
else of a run changes."""

from __future__ import annotations

import argparse
import json
from itertools import pairwise

import bpy

import command_runs
import numpy as np
import pytest
import scenes
import uv_scenes
from sphere_shapes import blob

FREE_OF_PREVIEWS, FREE_OF_CELLS, SAMPLES = 0.06, 0.03, 2
# Pixels of a tile, and how far from an edge coverage is certain of what files hold with few digits.
TILE, EDGE = 72, 2e-3
PREVIEWS = ("unwrap", "refine", "magnify", "sphere", "measure", "remesh", "stack", "symmetrize", "rectify", "queue",
            "partition")  # fmt: skip
# What commands ask of a mesh, or of a file, that others do not.
OWN = {"symmetrize": "halves.blend", "rectify": "quads.blend"}
MORE = {"partition": ("--write", "mesh")}
# Options of pictures, and where they have their tests.
TESTED = {(name, "preview"): "here" for name in PREVIEWS} | {
    ("measure", "histogram"): "here", ("compare", "plot"): "here",
    ("test-texture", "made"): "here", ("test-texture", "size"): "here", ("test-texture", "kind"): "here",
    ("diagram", "made"): "here", ("diagram", "size"): "here",
    ("magnify", "image_output"): "here", ("magnify", "image_size"): "here",
    ("magnify", "image"): "here", ("magnify", "detail"): "operators/test_magnify",
    ("sphere", "image"): "test_sphere", ("sphere", "image_out"): "test_sphere",
    ("sphere", "image_layout"): "test_sphere",
}  # fmt: skip


def pixels(path) -> np.ndarray:
    """Bytes (h,w,3), top row first."""
    return np.rint(255 * scenes.pixels_of(path)).astype(int)


def triangles_of(path, key: str) -> np.ndarray:
    """Corners (m,3,k), UVs or positions, of the fans of all faces of an .obj file; (0,3,2) without UVs."""
    lines = [line.split() for line in path.read_text().splitlines()]
    points = np.array([line[1:] for line in lines if line[:1] == [key]], float)
    faces = [[word.split("/") for word in line[1:]] for line in lines if line[:1] == ["f"]]
    if not len(points):
        return np.zeros((0, 3, 2))
    index = [[int(corner[key == "vt"]) - 1 for corner in face] for face in faces]
    return points[[[face[0], *two] for face in index for two in pairwise(face[1:])]]


def coverage(corners: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Which pixels (size,size) bool have a sample inside a triangle (m,3,2) in pixels, and which have none for sure."""
    place = (np.arange(size * SAMPLES) + 0.5) / SAMPLES
    x, y = np.meshgrid(place, place)
    inside, outside = np.zeros(x.shape, bool), np.ones(x.shape, bool)
    for triangle in corners:
        double = np.linalg.det(triangle[1:] - triangle[0])
        if abs(double) < 1e-9:
            continue
        least = np.full(x.shape, np.inf)
        for (ax, ay), (bx, by) in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
            away = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) * np.sign(double) / np.hypot(bx - ax, by - ay)
            least = np.minimum(least, away)
        inside |= least > EDGE
        outside &= least < -EDGE
    samples = (size, SAMPLES, size, SAMPLES)
    return inside.reshape(samples).any(axis=(1, 3)), outside.reshape(samples).all(axis=(1, 3))


def check_ink(picture: np.ndarray, corners: np.ndarray) -> None:
    """Ink where triangles (m,3,2) in pixels are, and paper elsewhere; a mirror image would not do."""
    size = len(picture)
    assert picture.shape == (size, size, 3)
    inked, paper = (picture < 255).any(axis=2), (picture == 255).all(axis=2)
    inside, outside = coverage(corners, size)
    assert inside.any() and (inside | outside).mean() > 0.98
    assert inked[inside].all() and paper[outside].all()


def lopsided(name="in") -> bpy.types.Object:
    """A bump whose UVs are no mirror image of themselves, with a region and two islands."""
    obj = scenes.bump(5, 4, name=name)
    uv = scenes.seen_from_above(obj) * [0.5, 0.35] + [0.1, 0.55]
    uv[uv[:, 1] > 0.75] += [0.02, 0.0]
    uv += 0.08 * uv[:, ::-1] ** 2
    scenes.set_uv(obj, uv)
    obj.vertex_groups.new(name="region").add([8, 9, 14, 15], 1.0, "REPLACE")
    return obj


def save(path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    """A folder with in.blend, other.blend, halves.blend, quads.blend and an image whose colours are their places."""
    folder = tmp_path_factory.mktemp("drawn")
    scenes.open_empty()
    command_runs.body("in")
    save(folder / "in.blend")
    save(folder / "other.blend")
    for name, made in (("halves", uv_scenes.patches), ("quads", lopsided)):
        scenes.open_empty()
        made()
        save(folder / f"{name}.blend")
    image = bpy.data.images.new("image", 64, 32)
    image.colorspace_settings.name = "Non-Color"
    v, u = (np.mgrid[0:32, 0:64] + 0.5) / [[[32]], [[64]]]
    image.pixels[:] = np.stack([u, v, 0 * u, 0 * u + 1], axis=-1).ravel().tolist()
    image.filepath_raw, image.file_format = str(folder / "image.png"), "PNG"
    image.save()
    return folder


def test_every_option_of_a_picture_has_a_test(package):
    found = set()
    for name, parser in command_runs.commands(package).items():
        for action in parser._actions:
            drawn = str(action.metavar).endswith(".png") or action.dest in {"size", "image_size", "histogram", "plot"}
            drawn |= action.dest.startswith("image") or (name, action.dest) in TESTED
            found |= {(name, action.dest)} if drawn and not isinstance(action, argparse._HelpAction) else set()
    assert found == set(TESTED)


@pytest.mark.parametrize("name", PREVIEWS)
def test_previews_show_the_layout_that_is_written_and_change_nothing(run, package, monkeypatch, body, name):
    module = package("display.preview")
    whole = module.preview
    monkeypatch.setattr(module, "preview", lambda objects: whole(objects, TILE))
    words = [*command_runs.words(name, body, OWN.get(name, ""), output="out.obj"), *MORE.get(name, ())]
    words = command_runs.without(words, "--histogram", "--attributes", "--report", "--image", "--image-out",
                                 "--image-output")  # fmt: skip
    seen = {}
    for drawn in (False, True):
        for path in body.glob("out.*"):
            path.unlink()
        given = words if drawn else command_runs.without(words, "--preview")
        status, out, err = run(*given)
        assert status == 0, err
        seen[drawn] = [path.read_bytes() for path in sorted(body.glob("out.*"))], out
    assert seen[True] == seen[False] and bool(seen[True][0]) == (name != "measure")
    if name == "measure":
        assert run("stack", body / "in.blend", "-o", body / "out.obj")[0] == 0
    uv, picture = triangles_of(body / "out.obj", "vt"), pixels(body / "preview.png")
    tiles = np.split(picture, 3 if len(uv) else 2, axis=1)
    assert picture.shape[0] == TILE
    assert ((tiles[0] < 255).any(axis=2) == (tiles[-1] < 255).any(axis=2)).all()
    if len(uv):
        assert len(tiles) == 3
        low, high = np.minimum(uv.min(axis=(0, 1)), 0), np.maximum(uv.max(axis=(0, 1)), 1)
        scale = (1 - 2 * FREE_OF_PREVIEWS) * TILE / (high - low).max()
        check_ink(tiles[1], (uv - (low + high) / 2) * [1, -1] * scale + TILE / 2)


@pytest.mark.parametrize("size", [33, 64])
def test_layouts_of_test_textures_have_ink_where_faces_lie(run, tmp_path, size):
    """Also of faces that reach beyond the texture; of every kind the same pixels, in other colours."""
    scenes.open_empty()
    obj = lopsided()
    uv = scenes.uv_of(obj).astype(float) + [-0.25, 0.1]
    scenes.set_uv(obj, uv)
    save(tmp_path / "in.blend")
    loops = [list(face.loop_indices) for face in obj.data.polygons]
    # The diagonals of quads do not matter: the quads are convex.
    corners = uv[[[q[0], q[k], q[k + 1]] for q in loops for k in (1, 2)]]
    colours = set()
    for kind in ("area", "shear", "normals"):
        words = ["test-texture", tmp_path / "in.blend", "-o", tmp_path / "p.png", "--kind", kind]
        assert run(*words, "--size", size)[0] == 0
        picture = pixels(tmp_path / "p.png")
        assert len(picture) == size
        check_ink(picture, (corners * [1, -1] + [0, 1]) * size)
        colours.add(picture.tobytes())
    assert len(colours) == 3


@pytest.mark.parametrize("kind", ["checker", "circles", "world"])
@pytest.mark.parametrize("size", [1, 33])
def test_patterns_have_their_size_whatever_the_mesh(run, tmp_path, body, kind, size):
    made = []
    for given in ("-", body / "in.blend"):
        assert run("test-texture", given, "-o", tmp_path / "p.png", "--kind", kind, "--size", size)[0] == 0
        made.append((tmp_path / "p.png").read_bytes())
    assert made[0] == made[1]
    height, width, _ = pixels(tmp_path / "p.png").shape
    assert width == size and height == (max(1, size // 2) if kind == "world" else size)


@pytest.mark.parametrize("domain", ["disk", "square", "rectangle", "sphere"])
def test_diagrams_are_drawn_where_the_cells_of_the_file_lie(run, tmp_path, body, domain):
    scenes.open_empty()
    lopsided()
    save(tmp_path / "in.blend")
    path = body / "in.blend" if domain == "sphere" else tmp_path / "in.blend"
    words = ["diagram", path, "--domain", domain, "--json"]
    figures = []
    for size in (40, 63):
        status, out, err = run(*words, "-o", tmp_path / "d.png", "--size", size)
        assert status == 0, err
        figures.append(json.loads(out)["cells"])
        assert len(pixels(tmp_path / "d.png")) == size
    assert run(*words, "-o", tmp_path / "d.obj", "--size", 5)[0] == 0
    cells = triangles_of(tmp_path / "d.obj", "v")[..., [0, 2] if domain == "sphere" else [0, 1]]
    scale = (0.5 - FREE_OF_CELLS) / np.abs(cells).max()
    check_ink(pixels(tmp_path / "d.png"), (cells * [1, -1] * scale + 0.5) * 63)
    assert len(set(figures)) == 1


@pytest.mark.parametrize("words", ["measure @in --histogram #", "measure @in --beltrami --histogram #",
                                   "measure @in --beltrami --preview #", "compare @in @other --plot #"])  # fmt: skip
def test_plots_change_nothing_of_what_is_printed(run, package, monkeypatch, body, words):
    # A hundred thousand points take most of the time of so small a mesh.
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 2000)
    given = [body / f"{word[1:]}.blend" if word[0] == "@" else word for word in words.split()]
    (body / "plot.png").unlink(missing_ok=True)
    plain, drawn = run(*given[:-2]), run(*given[:-1], body / "plot.png")
    assert plain[0] == 0 and plain == drawn
    assert len(np.unique(pixels(body / "plot.png").reshape(-1, 3), axis=0)) > 3


def test_pictures_of_distances_hang_on_classes_and_change_no_distance(run, tmp_path):
    (tmp_path / "shapes").mkdir()
    for k in range(3):
        scenes.open_empty()
        V, F = blob(1, seed=k)
        scenes.add(V, F)
        save(tmp_path / "shapes" / f"s{k}.blend")
    assert run("library", tmp_path / "shapes", "-o", tmp_path / "i.npz", "--points", 60)[0] == 0
    (tmp_path / "l.csv").write_text("s0.blend,one\ns1.blend,two\ns2.blend,two\n")
    labels, tables = ("--labels", tmp_path / "l.csv"), set()
    drawn: dict[str, list] = {"--picture": [], "--mds": []}
    for option, classes in [("", ()), *((kind, more) for kind in drawn for more in ((), labels))]:
        given = (option, tmp_path / "p.png") if option else ()
        (tmp_path / "p.png").unlink(missing_ok=True)
        status, _, err = run("distances", tmp_path / "i.npz", "-o", tmp_path / "d.csv", *given, *classes)
        assert status == 0, err
        tables.add((tmp_path / "d.csv").read_bytes())
        if option:
            drawn[option].append((tmp_path / "p.png").read_bytes())
    assert len(tables) == 1 and all(plain != classed for plain, classed in drawn.values())


def test_images_follow_the_uvs_in_the_size_that_was_asked_for(run, tmp_path, body):
    """The colour of a place is where it was before."""
    scenes.open_empty()
    obj = lopsided()
    old = scenes.uv_of(obj).astype(float)
    save(tmp_path / "in.blend")
    words = ["magnify", tmp_path / "in.blend", "--quality", "draft", "--weights", "region", "--factor", 1.5,
             "--source", "uv", "--image", body / "image.png", "--image-output", tmp_path / "p.png"]  # fmt: skip
    meshes = set()
    for more, shape in (([], (32, 64)), (["--image-size", 128], (64, 128)), (["--image-size", 90], (45, 90))):
        status, _, err = run(*words, *more, "-o", tmp_path / "out.obj")
        assert status == 0, err
        meshes.add((tmp_path / "out.obj").read_bytes())
        picture = pixels(tmp_path / "p.png")
        assert picture.shape[:2] == shape
        assert run(*words, *more, "-o", tmp_path / "out.blend")[0] == 0
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
        new = scenes.uv_of(bpy.data.objects["in"]).astype(float)
        # Middles of faces are inside.
        was, now = (uv.reshape(-1, 4, 2).mean(axis=1) for uv in (old, new))
        row, column = ((1 - now[:, 1]) * shape[0]).astype(int), (now[:, 0] * shape[1]).astype(int)
        assert np.abs(picture[row, column, :2] / 255 - was).max() < 0.04
        assert np.abs(now - was).max() > 0.02
    assert len(meshes) == 1
