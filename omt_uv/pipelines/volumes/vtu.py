"""Write tetrahedra as a VTK file of an unstructured grid (.vtu), in XML with numbers as text, which ParaView reads."""

from __future__ import annotations

import numpy as np

# VTK's number of a tetrahedron.
TETRAHEDRON = 10


def vtu_text(points: np.ndarray, tets: np.ndarray, vectors: dict[str, np.ndarray], cells: dict[str, np.ndarray]) -> str:
    """The file: points (n,3), tetrahedra (m,4), vectors (n,3) at points and numbers (m,) of tetrahedra by their
    names."""
    m = len(tets)
    at_points = "".join(_array(name, values, "Float64", 3) for name, values in vectors.items())
    at_cells = "".join(_array(name, values, "Float64", 1) for name, values in cells.items())
    return (
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">\n'
        f'<UnstructuredGrid>\n<Piece NumberOfPoints="{len(points)}" NumberOfCells="{m}">\n'
        f"<Points>\n{_array('Points', points, 'Float64', 3)}</Points>\n"
        f"<Cells>\n{_array('connectivity', tets, 'Int64', 0)}{_array('offsets', 4 * np.arange(1, m + 1), 'Int64', 0)}"
        f"{_array('types', np.full(m, TETRAHEDRON), 'UInt8', 0)}</Cells>\n"
        f"<PointData>\n{at_points}</PointData>\n<CellData>\n{at_cells}</CellData>\n"
        "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    )


def _array(name: str, values: np.ndarray, kind: str, components: int) -> str:
    """One DataArray."""
    width = f' NumberOfComponents="{components}"' if components else ""
    flat = np.asarray(values).ravel()
    text = " ".join(map(repr, flat.tolist()))
    return f'<DataArray type="{kind}" Name="{name}"{width} format="ascii">\n{text}\n</DataArray>\n'
