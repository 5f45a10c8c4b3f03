"""Of several UVs that the vertices of a PLY file have, and the corners of its faces, one counts, and all are
written."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from mesh_bytes import imported

from omt_uv.files.in_place import ply

POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]
FACES = [(0, 1, 2), (1, 3, 2)]


def file_of(pairs, corners=False, lengths=(6, 6)):
    """An ASCII file: the k-th pair of a vertex is (v + k / 10, -v - k / 10), corners have theirs from 100 on."""
    head = ["ply", "format ascii 1.0", f"element vertex {len(POINTS)}", *(f"property float {a}" for a in "xyz")]
    head += [f"property float {name}" for pair in pairs for name in pair]
    head += [f"element face {len(FACES)}", "property list uchar int vertex_indices"]
    head += ["property list uchar float texcoord"] * corners + ["end_header"]
    rows = [" ".join(map(str, [*point, *(x for k in range(len(pairs)) for x in (v + k / 10, -v - k / 10))]))
            for v, point in enumerate(POINTS)]  # fmt: skip
    for k, (face, length) in enumerate(zip(FACES, lengths, strict=True)):
        more = [length, *(100 + 10 * k + j for j in range(length))] if corners else []
        rows.append(" ".join(map(str, [len(face), *face, *more])))
    return "\n".join([*head, *rows, ""]).encode()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_pair_that_blender_reads_counts_wherever_it_stands(count):
    for pairs in permutations(ply.PAIRS, count):
        first = min(pairs, key=ply.PAIRS.index)
        _, uv = ply.read_uv(file_of(pairs))
        corner = np.concatenate(FACES)
        shift = pairs.index(first) / 10
        np.testing.assert_allclose(uv, np.stack([corner + shift, -corner - shift], axis=1))
        # Those of corners count where vertices have none.
        np.testing.assert_array_equal(ply.read_uv(file_of(pairs, corners=True))[1], uv)


@pytest.mark.parametrize("lengths", [(6, 6), (0, 6), (6, 0), (0, 0), (4, 6), (8, 6)])
def test_faces_whose_corners_all_have_uvs_keep_them_and_others_have_none(lengths):
    _, uv = ply.read_uv(file_of([], True, lengths))
    expected = np.zeros((2, 3, 2))
    for k in range(2):
        if lengths[k] == 6:
            expected[k] = 100 + 10 * k + np.arange(6).reshape(3, 2)
    if 6 not in lengths:
        assert uv is None
    else:
        np.testing.assert_array_equal(uv, expected.reshape(-1, 2))


def test_a_file_without_uvs_has_none():
    assert ply.read_uv(file_of([]))[1] is None


@pytest.mark.parametrize("moved", [[], [0], [1], [0, 1]], ids=str)
def test_faces_whose_uvs_stay_keep_how_they_were_written(moved):
    """Numbers may be written in many ways."""
    data = file_of([], corners=True)
    for word in range(100, 116):
        data = data.replace(b" %d" % word, b" %d.50e0" % word)
    wished = ply.read_uv(data)[1].astype(np.float32)
    for face in moved:
        wished[3 * face + 1] += np.float32(0.25)
    new, told = ply.put(data, [imported(FACES, wished, np.array(POINTS, float))])
    assert told == [] and (ply.read_uv(new)[1].astype(np.float32) == wished).all()
    before, after = data.splitlines(), new.splitlines()
    assert len(before) == len(after) and [a != b for a, b in zip(before[-2:], after[-2:], strict=True)] == [
        face in moved for face in range(2)
    ]
    assert before[:-2] == after[:-2]
