"""Bodies of many handles taken apart."""

from types import SimpleNamespace

import bodies
import meshes
import numpy as np
import pytest
from short_cuts import gluing_of
from thin_walls import thickened

from omt_uv.solver.cutting.component import classify
from omt_uv.solver.cutting.gluing_facts import in_unit_box
from omt_uv.solver.cutting.handle_partition import FEW, MANY_HANDLES, cluster_borders, partition_pairs, wall_pairs
from omt_uv.solver.mesh.gluing import components, corner_classes
from omt_uv.solver.mesh.repair import repaired_gluing
from omt_uv.solver.mesh.surface import chosen_triangles, triangle_surface


def voxel_surface(solid):
    """The boundary of voxels (a,b,c) bool: no two of them meet at an edge or a corner alone."""
    V, F = meshes.cube()
    side = {(-1, 0, 0): 0, (1, 0, 0): 1, (0, -1, 0): 2, (0, 1, 0): 3, (0, 0, -1): 4, (0, 0, 1): 5}
    padded = np.pad(solid, 1)
    corners, faces = [], []
    for direction, k in side.items():
        open_ = solid & ~np.roll(padded, [-x for x in direction], (0, 1, 2))[1:-1, 1:-1, 1:-1]
        for cell in np.argwhere(open_):
            for row in (k, k + 6):
                faces.append(len(corners) + np.arange(3))
                corners.extend(np.round(V[F[row]] + cell))
    points, index = np.unique(np.array(corners), axis=0, return_inverse=True)
    return points, index.ravel()[np.array(faces)]


def frame(n):
    """A flat frame of n by n square holes: n^2 handles."""
    solid = np.ones((2 * n + 1, 2 * n + 1, 1), bool)
    solid[1::2, 1::2] = False
    return voxel_surface(solid)


def handles(gluing):
    one_sided = np.zeros(len(gluing.triangles), bool)
    return classify(gluing, corner_classes(gluing), components(gluing), one_sided).handles


def test_few_handles_are_left_alone():
    V, F = frame(3)
    gluing = gluing_of(V, F)
    assert handles(gluing).tolist() == [9] and MANY_HANDLES > 9
    assert not partition_pairs(gluing, V, np.zeros(len(F), bool)).any()


def test_a_plate_of_many_holes_comes_apart_into_few_handles():
    V, F = frame(4)
    gluing = gluing_of(V, F)
    assert handles(gluing).tolist() == [16]
    gone = partition_pairs(gluing, V, np.zeros(len(F), bool))
    # Both sides of the plate, its outer wall with one of them, and the walls of the holes.
    assert gone.any() and handles(gluing.without(gone)).max() <= MANY_HANDLES


@pytest.mark.parametrize("first", [0, 1])
def test_bodies_come_apart_as_each_does_alone(first):
    """A plate of few holes stays whole beside one of many, whichever comes first."""
    plates = [frame(4), frame(3)]
    plates = plates[first:] + plates[:first]
    alone = [partition_pairs(gluing_of(V, F), V, np.zeros(len(F), bool)).sum() for V, F in plates]
    (V, F), (W, G) = plates
    both, faces = np.vstack([V, W + 20]), np.vstack([F, G + len(V)])
    gluing = gluing_of(both, faces)
    gone = partition_pairs(gluing, both, np.zeros(len(faces), bool))
    of_first = gluing.first // 3 < len(F)
    assert [gone[of_first].sum(), gone[~of_first].sum()] == alone and 0 in alone and sum(alone) > 0


def test_clusters_have_few_handles_and_nothing_else_is_touched():
    V, F = frame(4)
    W, G = meshes.torus(12, 8)
    both, faces = np.concatenate([V, W + [50, 0, 0]]), np.concatenate([F, G + len(V)])
    gluing = gluing_of(both, faces)
    crowded = np.arange(len(faces)) < len(F)
    gone = cluster_borders(gluing, both, np.zeros(len(faces), bool), crowded)
    assert gone.any() and crowded[gluing.first[gone] // 3].all()
    left = gluing.without(gone)
    inside = np.unique(components(left)[crowded])
    assert len(inside) > 1 and handles(left)[inside].max() <= FEW
    # Where borders are cut they part clusters: each pair has two different ones beside it.
    component = components(left)
    assert (component[gluing.first[gone] // 3] != component[gluing.second[gone] // 3]).all()


def cloth(count):
    """A square in three waves."""
    V, F = meshes.grid(count, count, 2.0, 2.0)
    return np.column_stack([V[:, :2], 0.2 * np.sin(9 * V[:, 0])]), F


@pytest.mark.parametrize(
    ("body", "parts"),
    [
        (thickened(*meshes.hemisphere(12, 32), 0.05), 2),
        (thickened(*cloth(40), 0.02), 1),
        (thickened(*meshes.grid(12, 12), 0.08), 1),
        (meshes.cube(), 1),
        (bodies.icosphere(2), 1),
    ],
    ids=["cap", "cloth", "board", "cube", "ball"],
)
def test_thin_walls_come_apart_but_for_hard_ones(body, parts):
    surface = triangle_surface(*body)
    gluing = repaired_gluing(surface, *chosen_triangles(surface, None)).gluing
    positions, gone = in_unit_box(surface, gluing)[0], np.zeros(len(gluing.first), bool)
    for asked in (True, False):
        search = SimpleNamespace(wants=lambda *_, asked=asked: asked)
        found = wall_pairs(surface, gluing, positions, gone, search)
        assert components(gluing.without(found)).max() + 1 == (parts if asked else 1)
        assert found.any() == (asked and parts > 1)
    # What has come apart already does not do so again.
    apart = wall_pairs(surface, gluing, positions, gone, SimpleNamespace(wants=lambda *_: True))
    assert not wall_pairs(surface, gluing, positions, apart, SimpleNamespace(wants=lambda *_: True)).any()
