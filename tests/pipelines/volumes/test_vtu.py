"""The grid file of ParaView, read by a program that knows the format alone: counts, components and values hold."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from omt_uv.pipelines.volumes.vtu import vtu_text


def arrays(parent):
    """Arrays (k,c) by their names, as the file says they are."""
    found = {}
    for array in parent.findall("DataArray"):
        assert array.get("format") == "ascii"
        kind = {"Float64": float, "Int64": np.int64, "UInt8": np.uint8}[array.get("type")]
        values = np.array((array.text or "").split()).astype(kind)
        found[array.get("Name")] = values.reshape(-1, int(array.get("NumberOfComponents", "1")))
    return found


@pytest.mark.parametrize("points, tets", [(0, 0), (5, 1), (30, 17)])
def test_every_array_is_as_long_and_as_wide_as_its_part_of_the_grid(points, tets):
    rng = np.random.default_rng(points)
    where, cells = rng.normal(size=(points, 3)), rng.integers(0, max(points, 1), (tets, 4))
    vectors = {"way": rng.normal(size=(points, 3)), "back": 1e-300 * rng.normal(size=(points, 3))}
    numbers = {"volume": rng.random(tets), "error": np.full(tets, np.inf)}
    root = ElementTree.fromstring(vtu_text(where, cells, vectors, numbers))
    assert root.tag == "VTKFile" and root.get("type") == "UnstructuredGrid"
    (piece,) = root.findall("UnstructuredGrid/Piece")
    assert (int(piece.get("NumberOfPoints")), int(piece.get("NumberOfCells"))) == (points, tets)
    np.testing.assert_array_equal(arrays(piece.find("Points"))["Points"], where)
    of = arrays(piece.find("Cells"))
    np.testing.assert_array_equal(of["connectivity"].reshape(-1, 4), cells)
    np.testing.assert_array_equal(of["offsets"].ravel(), np.cumsum(np.full(tets, 4)))
    # VTK's number of a tetrahedron.
    assert (of["types"] == 10).all() and len(of["types"]) == tets
    for part, given, count in (("PointData", vectors, points), ("CellData", numbers, tets)):
        found = arrays(piece.find(part))
        assert found.keys() == given.keys()
        for name, values in given.items():
            assert len(found[name]) == count
            np.testing.assert_array_equal(found[name].ravel(), values.ravel())
