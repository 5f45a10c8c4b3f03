"""What is found of a surface hangs neither on which of its parts comes first, nor on faces that are not chosen."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.pipelines.layout import UnwrapJob
from omt_uv.pipelines.measuring.diagrams import diagram
from omt_uv.pipelines.measuring.region_figures import figures_by_region
from omt_uv.pipelines.reading import Reading
from omt_uv.pipelines.shapes.partition import PartitionSettings, partition_surface
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.settings import Settings
from omt_uv.solver.errors import EmptyMeshError
from omt_uv.solver.mesh.surface import Surface, triangle_surface
from omt_uv.solver.progress import drain

LARGE, SMALL = "large", "small"
# Places of a part beside another one, and how large it is.
PARTS = {LARGE: (meshes.bumpy(7, 6), 0.0), SMALL: (meshes.bumpy(4, 3, 0.2), 3.0)}


def surface(*names: str) -> tuple[Surface, np.ndarray]:
    """Parts, one after the other, and which of its faces (f,) bool are of the large one."""
    positions, triangles, large, n = [], [], [], 0
    for name in names:
        (V, F), at = PARTS[name]
        positions.append(V + [at, 0, 0])
        triangles.append(F + n)
        large += [name == LARGE] * len(F)
        n += len(V)
    return triangle_surface(np.concatenate(positions), np.concatenate(triangles)), np.array(large)


def uvs(of: Surface) -> np.ndarray:
    """UVs (c,2) float32 that come of places alone, not evenly."""
    x, y, z = of.positions[of.corner_vertex].T
    return np.stack([0.1 * x + 0.02 * z, 0.1 * y + 0.01 * x * y], axis=1).astype(np.float32)


def reading(of: Surface, faces) -> Reading:
    return Reading(of, np.ones(len(of.face_start) - 1, bool) if faces is None else faces, uvs(of), None)


def diagram_of(domain: str):
    def found(of: Surface, faces):
        made = drain(diagram(of, faces, domain))
        return [len(made.shares), *np.sort(made.shares)]

    return found


def cells(of: Surface, faces):
    made = drain(partition_surface(of, faces, None, PartitionSettings(cells=4, relax=1, write="attribute")))
    assert faces is None or ((made.cell >= 0) == faces).all()
    return [made.figures["cells"], made.figures["area"], *np.sort(np.bincount(made.cell[made.cell >= 0]))]


def regions(of: Surface, faces):
    given = reading(of, faces)
    first = of.positions[of.corner_vertex[of.face_start[:-1]]][:, 1] < 0.5
    rows = figures_by_region([given], [("low", [first & given.faces])], 512)
    return [value for row in rows for value in vars(row).values() if not isinstance(value, str)]


def layout(of: Surface, faces):
    made = drain(lay_out([UnwrapJob(of, faces)], Settings("free", "draft", texture_size=256)))
    uv = made.uv[0].reshape(-1, 3, 2).astype(float)
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return np.sort(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]))


FOUND = {"diagram of a square": diagram_of("square"), "diagram of a disk": diagram_of("disk"), "cells": cells,
         "regions": regions, "layout": layout}  # fmt: skip
# What is of the largest part alone takes no notice of another one.
OF_ONE = [name for name in FOUND if name.startswith("diagram")]


@pytest.mark.parametrize("name", FOUND)
@pytest.mark.parametrize("order", [(LARGE, SMALL), (SMALL, LARGE)], ids=" ".join)
def test_faces_that_are_not_chosen_do_not_count(name, order):
    alone, _ = surface(LARGE)
    np.testing.assert_allclose(FOUND[name](*surface(*order)), FOUND[name](alone, None), rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("name", OF_ONE)
@pytest.mark.parametrize("order", [(LARGE, SMALL), (SMALL, LARGE)], ids=" ".join)
def test_what_is_of_one_part_is_of_the_largest(name, order):
    alone, _ = surface(LARGE)
    both, _ = surface(*order)
    np.testing.assert_allclose(FOUND[name](both, None), FOUND[name](alone, None), rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("name", [name for name in FOUND if name not in OF_ONE])
def test_the_order_of_parts_is_all_one(name):
    first, other = (FOUND[name](surface(*order)[0], None) for order in ((LARGE, SMALL), (SMALL, LARGE)))
    # Starts that are drawn are drawn in another order: cells are others, as large.
    count = 2 if name == "cells" else None
    np.testing.assert_allclose(first[:count], other[:count], rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("order", [(LARGE, SMALL), (SMALL, LARGE)], ids=" ".join)
def test_a_region_of_faces_that_are_not_chosen_is_refused_by_name(order):
    of, large = surface(*order)
    with pytest.raises(EmptyMeshError, match="'beside'"):
        figures_by_region([reading(of, large)], [("beside", [~large])], 512)
