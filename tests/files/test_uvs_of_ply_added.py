"""UVs that Blender does not read of a .ply are given to an object that has none, and to no other."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes

PLACES = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)]
FACES = [[0, 1, 2, 3], [1, 4, 5, 2]]


@pytest.fixture(autouse=True)
def empty(package):
    scenes.open_empty()


def written(path, names, corners):
    """A text with UVs of vertices by these names, or of the corners of its faces, if any."""
    uv = [(0.1 + 0.3 * x, 0.2 + 0.4 * y) for x, y, _ in PLACES]
    head = ["ply", "format ascii 1.0", f"element vertex {len(PLACES)}", *(f"property float {a}" for a in "xyz")]
    head += [f"property float {name}" for name in names]
    head += [f"element face {len(FACES)}", "property list uchar int vertex_indices"]
    head += ["property list uchar float texcoord"] * corners
    rows = [" ".join(map(str, [*place, *(own if names else ())])) for place, own in zip(PLACES, uv, strict=True)]
    for face in FACES:
        row = [len(face), *face, *([2 * len(face), *(x for v in face for x in uv[v])] if corners else ())]
        rows.append(" ".join(map(str, row)))
    path.write_text("\n".join([*head, "end_header", *rows]) + "\n")
    return np.array([uv[v] for face in FACES for v in face])


@pytest.mark.parametrize(
    ("names", "corners"), [(("u", "v"), False), (("texture_u", "texture_v"), False), ((), True), ((), False)]
)
@pytest.mark.parametrize("before", [(), ("Mine",), ("Mine", "Other")])
def test_only_an_object_without_uvs_gets_those_of_its_file(package, tmp_path, names, corners, before):
    path = tmp_path / "a.ply"
    expected = written(path, names, corners)
    obj = scenes.add(PLACES, FACES)
    for name in before:
        scenes.set_uv(obj, scenes.seen_from_above(obj)) if name == "Mine" else obj.data.uv_layers.new(name=name)
    layers = [layer.name for layer in obj.data.uv_layers]
    there = scenes.uv_of(obj) if before else None
    add = package("files.ply_uvs").add_uvs
    add(path, obj)
    if before:
        assert [layer.name for layer in obj.data.uv_layers] == layers
        np.testing.assert_array_equal(scenes.uv_of(obj), there)
        return
    has = bool(names or corners)
    assert len(obj.data.uv_layers) == has
    for _ in range(2):
        if has:
            np.testing.assert_allclose(scenes.uv_of(obj), expected, atol=1e-6)
        # Once more changes nothing.
        add(path, obj)
        assert len(obj.data.uv_layers) == has


def test_a_file_that_is_none_gives_nothing(package, tmp_path):
    obj = scenes.add(PLACES, FACES)
    (tmp_path / "a.ply").write_text("ply\nformat ascii 1.0\n")
    package("files.ply_uvs").add_uvs(tmp_path / "a.ply", obj)
    assert not obj.data.uv_layers and bpy.context.object == obj


@pytest.mark.parametrize("kept", [[0], [1], [1, 0], [0, 1]])
@pytest.mark.parametrize(("names", "corners"), [(("u", "v"), False), ((), True)])
def test_faces_that_are_there_have_their_own_uvs_whatever_others_the_file_has(package, tmp_path, names, corners, kept):
    """Whoever reads it may leave some out, and have them in another order."""
    path = tmp_path / "a.ply"
    expected = written(path, names, corners).reshape(2, 4, 2)
    obj = scenes.add(PLACES, [FACES[k] for k in kept])
    package("files.ply_uvs").add_uvs(path, obj)
    found = scenes.uv_of(obj).reshape(-1, 4, 2)
    np.testing.assert_allclose(found, expected[kept], atol=1e-6)
