"""UVs come into OBJ files however their faces count: from the front or behind, with UVs shared, missing, unused."""

from __future__ import annotations

import mesh_bytes
import numpy as np
import pytest

from omt_uv.files.in_place import obj, obj_text

VALUES = np.array([[0, 0], [1, 0], [0, 1], [0.25, 0.5], [0.5, 0.125]], np.float32)


def file_of(rng):
    """A strip of triangles whose corners name UVs that are spread over the file; its bytes, faces and positions."""
    count = int(rng.integers(2, 6))
    points = np.array([[k // 2, k % 2, 0.1 * k] for k in range(count + 2)], np.float32)
    faces = np.array([[k, k + 1, k + 2] for k in range(count)])
    lines = [f"v {x} {y} {z}" for x, y, z in points.tolist()]
    there = 0
    for face in faces.tolist():
        for _ in range(int(rng.integers(0, 4)) + (there == 0)):
            lines.append(f"vt {rng.random():.3f} {rng.random():.3f}")
            there += 1
        bare = rng.random() < 0.2
        words = []
        for v in face:
            backward = rng.random() < 0.5
            uv = int(rng.integers(0, there))
            vertex = v - len(points) if backward else v + 1
            words.append(f"{vertex}" if bare else f"{vertex}/{uv - there if backward else uv + 1}")
        lines.append(f"f {' '.join(words)}")
    if rng.random() < 0.5:
        lines.append("vt 0.5 0.5")
    return "\n".join([*lines, ""]).encode(), faces, points


@pytest.mark.parametrize("seed", range(40))
def test_every_corner_has_its_uv_and_all_else_is_as_it_was(seed):
    rng = np.random.default_rng(seed)
    data, faces, points = file_of(rng)
    # What is wished: few values, what is there, or a bit of both.
    was = obj_text.read(data)
    old = np.where(was.corner_uv[:, None] >= 0, was.uv[np.maximum(was.corner_uv, 0)], 0).astype(np.float32)
    wished = VALUES[rng.integers(0, len(VALUES), faces.size)]
    keep = rng.random(len(faces)) < rng.choice([0.0, 0.5, 1.0])
    wished = np.where(np.repeat(keep, 3)[:, None], old, wished)
    new, told = obj.put(data, [mesh_bytes.imported(faces, wished, points)])
    found = obj_text.read(new)
    assert told == [] and (found.corner_vertex == was.corner_vertex).all()
    np.testing.assert_array_equal(found.uv[found.corner_uv].astype(np.float32), wished)
    strip = [[line for line in text.splitlines() if line[:2] == b"v "] for text in (data, new)]
    assert strip[0] == strip[1] and new.count(b"f ") == len(faces)
    # A second time nothing is left to be done.
    again, _ = obj.put(new, [mesh_bytes.imported(faces, wished, points)])
    assert again == new
