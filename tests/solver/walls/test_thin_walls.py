"""Thin walls: which faces lie opposite to one another, and where both sides come apart."""

import bodies
import meshes
import numpy as np
import pytest
from thin_walls import inner_edges, thickened, tube

from omt_uv.solver.mesh.geometry import face_areas, face_normals
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import graph_components
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.walls import opposite
from omt_uv.solver.walls.opposite import Faces
from omt_uv.solver.walls.two_sides import wall_edges

OPEN = {
    "half a sphere": meshes.hemisphere(16, 48),
    "cap": meshes.cap(24, 48, 0.8),
    "hills": meshes.bumpy(24, 24),
    "tube": tube(),
    "square": meshes.grid(12, 12),
}
WHOLE = {
    "sphere": bodies.icosphere(3),
    "torus": meshes.torus(),
    "hose": meshes.torus(96, 8, 0.05),
    "thick": thickened(*meshes.hemisphere(16, 48), 0.5),
    "belt": thickened(*meshes.grid(200, 4, 50.0, 1.0), 0.05),
    "open": meshes.hemisphere(16, 48),
}


def parts(F, pair, edges):
    return graph_components(*(pair[~edges] // 3).T, len(F))[1]


def sides_of(name, thickness, change=lambda V, F: (V, F)):
    """A wall, the number of its part for every face, and of the faces of one side."""
    V, F = OPEN[name]
    count = len(F)
    V, F = change(*thickened(V, F, thickness))
    pair, length = inner_edges(V, F)
    edges = wall_edges(V, F, pair, length, np.zeros(len(pair), bool))
    return V, F, parts(F, pair, edges), count, length[edges].sum()


@pytest.mark.parametrize("name", OPEN)
@pytest.mark.parametrize("thickness", [0.01, 0.05])
def test_both_sides_of_a_wall_come_apart_and_its_border_stays_with_one(name, thickness):
    _, F, part, count, _ = sides_of(name, thickness)
    one, other, border = part[:count], part[count : 2 * count], part[2 * count :]
    assert len(set(one)) == len(set(other)) == len(set(border)) == 1
    assert one[0] != other[0] and part.max() == 1 and border[0] in (one[0], other[0])


@pytest.mark.parametrize("name", ["half a sphere", "cap"])
@pytest.mark.parametrize("inside_out", [False, True])
def test_the_border_of_a_wall_stays_with_its_larger_side(name, inside_out):
    """Whichever side has the lower numbers."""
    V, F = OPEN[name]
    V, F = thickened(V, F[:, ::-1] if inside_out else F, 0.05)
    pair, length = inner_edges(V, F)
    part = parts(F, pair, wall_edges(V, F, pair, length, np.zeros(len(pair), bool)))
    count = len(OPEN[name][1])
    area = face_areas(V, F)
    larger = int(area[:count].sum() < area[count : 2 * count].sum())
    assert set(part[2 * count :]) == {part[larger * count]} and part[0] != part[count]


@pytest.mark.parametrize("name", OPEN)
def test_where_it_lies_how_large_it_is_and_the_order_of_its_faces_do_not_matter(name):
    random = np.random.default_rng(3)
    turn = np.linalg.qr(random.standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    _, F, part, count, length = sides_of(name, 0.03)
    for size in (1e-3, 1e4):
        moved = sides_of(name, 0.03, lambda V, F, s=size: (s * (V @ turn.T) + 7 * s, F))
        assert moved[4] == pytest.approx(size * length, rel=1e-9)
        # Of two sides as large as each other either may have the border.
        assert len(set(zip(part[: 2 * count], moved[2][: 2 * count], strict=True))) == 2
    order = random.permutation(len(F))
    shuffled = sides_of(name, 0.03, lambda V, F: (V, F[order]))
    assert shuffled[4] == pytest.approx(length, rel=1e-9)


@pytest.mark.parametrize("name", WHOLE)
def test_what_is_no_thin_wall_stays_whole(name):
    V, F = WHOLE[name]
    pair, length = inner_edges(V, F)
    assert wall_edges(V, F, pair, length, np.zeros(len(pair), bool)) is None


def test_polygons_stay_whole():
    V, F = thickened(*meshes.grid(6, 6), 0.05)
    pair, length = inner_edges(V, F)
    # The border is a diagonal of every quad there: cut along it would be shorter by nothing, and is barred.
    tail = F.ravel()[pair[:, 0]]
    head = F.ravel()[pair[:, 0] + 1 - 3 * (pair[:, 0] % 3 == 2)]
    within = (np.abs(tail - head) >= 49) & (np.abs(tail - head) != 49)
    edges = wall_edges(V, F, pair, length, within)
    assert edges.any() and not (edges & within).any()


def test_faces_opposite_are_those_found_by_looking_at_all_of_them():
    V, F = thickened(*meshes.bumpy(10, 10), 0.04)
    V = V + 0.002 * np.random.default_rng(1).standard_normal(V.shape)
    faces = Faces.of(V, F)
    middle, normal, area = V[F].mean(axis=1), face_normals(V, F), face_areas(V, F)
    side = np.sqrt(area.sum())

    def beneath(k):
        off = ((middle - middle[k]) ** 2).sum(axis=1) + (opposite.TURNED * side) ** 2 * ((normal + normal[k]) ** 2).sum(
            axis=1
        )
        return int(off.argmin())

    found = faces.opposite()
    for k in range(len(F)):
        j = beneath(k)
        way = middle[j] - middle[k]
        depth = -way @ normal[k]
        aside = np.linalg.norm(way + depth * normal[k])
        far = np.linalg.norm(way), np.linalg.norm(middle[beneath(j)] - middle[j])
        is_beneath = 0 < depth < opposite.THIN * side
        is_beneath &= aside <= depth + opposite.ASIDE * np.sqrt(max(area[k], area[j]))
        against = normal[k] @ normal[j] < -opposite.AGAINST
        assert found[k] == (is_beneath and against and far[0] <= opposite.EVEN * far[1])
    assert 0.8 < found.mean() < 1 and faces.are_likely()


def test_a_body_with_more_faces_than_are_sought_among_is_told_the_same(monkeypatch):
    wall, ball = thickened(*meshes.hemisphere(24, 64), 0.05), bodies.icosphere(4)
    for step in (1, 7):
        monkeypatch.setattr(opposite, "SOUGHT", -(-len(wall[1]) // step))
        assert Faces.of(*wall).are_likely() and not Faces.of(*ball).are_likely()


@pytest.mark.parametrize("name", ["half a sphere", "hills"])
def test_no_island_of_an_unwrapped_wall_has_faces_of_both_sides(name):
    V, F = OPEN[name]
    count = len(F)
    surface = triangle_surface(*thickened(V, F, 0.05))
    found = drain(unwrap(surface, options=UnwrapOptions(max_shear=1.35)))
    inside = [chart.faces[chart.faces < 2 * count] < count for chart in found.charts]
    assert all(side.all() or not side.any() for side in inside)
