"""Numbers of an OBJ that is written anew are those of the mesh, to the last bit, all of them."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


def numbers(path, kind):
    """Rows of numbers of the lines of a kind, single precision."""
    rows = [line.split()[1:] for line in path.read_text().splitlines() if line.startswith(f"{kind} ")]
    return np.array(rows, np.float32)


@pytest.mark.parametrize("moved", [False, True], ids=["at home", "moved"])
def test_every_coordinate_and_uv_of_every_object_comes_back(package, tmp_path, moved):
    rng, objects = np.random.default_rng(4), []
    for k in range(2):
        obj = scenes.bump(4, 3, name=f"Part {k}", offset=2.0 * k)
        obj.data.vertices.foreach_set("co", (1 / 3 + rng.random(3 * len(obj.data.vertices)) * 7).astype(np.float32))
        scenes.set_uv(obj, rng.random((len(obj.data.loops), 2)))
        obj.location = (0.1 * moved, 0, 0)
        objects.append(obj)
    # What is beside them is not theirs.
    scenes.cube()
    bpy.context.view_layer.update()
    package("files.saving").save(tmp_path / "out.obj", objects)
    places, uvs = numbers(tmp_path / "out.obj", "v"), numbers(tmp_path / "out.obj", "vt")
    expected = np.concatenate([np.array([(o.matrix_world @ v.co)[:] for v in o.data.vertices]) for o in objects])
    np.testing.assert_allclose(places[:, :3], expected, rtol=0 if not moved else 1e-6, atol=0 if not moved else 1e-6)
    own = np.unique(np.concatenate([scenes.uv_of(o) for o in objects]), axis=0)
    np.testing.assert_array_equal(np.unique(uvs, axis=0), own)


@pytest.mark.parametrize("faces", [[], [(0, 1, 2)]], ids=["no faces", "a face"])
@pytest.mark.parametrize("first", [False, True])
def test_objects_without_uvs_stand_beside_others(package, tmp_path, faces, first):
    """Whatever they have of faces, their places and the UVs of the others come back."""
    bare = scenes.add([[1 / 3, 0, 0], [1, 1 / 7, 0], [0, 1, 1 / 9]], faces, "A bare" if first else "Z bare")
    mapped = scenes.bump(3, 3, name="Mapped", offset=2.0)
    uv = np.random.default_rng(5).random((len(mapped.data.loops), 2)).astype(np.float32)
    scenes.set_uv(mapped, uv)
    objects = [bare, mapped] if first else [mapped, bare]
    package("files.saving").save(tmp_path / "out.obj", objects)
    places = numbers(tmp_path / "out.obj", "v")[:, :3]
    own = np.array([v.co for v in bare.data.vertices], np.float32)
    assert all((places == row).all(axis=1).any() for row in own)
    np.testing.assert_array_equal(np.unique(numbers(tmp_path / "out.obj", "vt"), axis=0), np.unique(uv, axis=0))
