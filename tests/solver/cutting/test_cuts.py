"""Cuts: every surface becomes a disk, along short paths, where the artist wants them, whatever the units."""

import re
from dataclasses import replace

import hard_meshes
import meshes
import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from short_cuts import cotree_length, shortest_tree

from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.errors import OrientationError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_indices import CornerPins
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain


def holed_sphere(holes=3, subdivisions=3):
    V, F = meshes.icosphere(subdivisions)
    gone = [int(np.argmax(V @ d)) for d in np.concatenate([np.eye(3), -np.eye(3)])[:holes]]
    return V, F[~np.isin(F, gone).any(1)]


def holed_torus():
    V, F = meshes.torus()
    return V, F[~np.isin(F, [5, 160]).any(1)]


def double_torus():
    """Two tori with a missing face each, glued along it."""
    V, F = meshes.torus()
    a, b, c = F[0]
    G = F[1:] + len(V)
    # The second torus is a mirror image, so that its missing face fits the first one's.
    mirrored = G[:, [0, 2, 1]]
    name = np.arange(2 * len(V))
    name[len(V) + F[0]] = (a, b, c)
    return np.concatenate([V, V * [1, 1, -1] + [0, 0, 3]]), np.concatenate([F[1:], name[mirrored]])


def moebius(segments=24, rows=2):
    """A band with half a twist: it has one side and one boundary."""
    s, r = np.meshgrid(np.arange(segments), np.arange(rows + 1), indexing="ij")
    angle, w = 2 * np.pi * s / segments, (r / rows - 0.5) * 0.6
    x = (1 + w * np.cos(angle / 2)) * np.cos(angle), (1 + w * np.cos(angle / 2)) * np.sin(angle), w * np.sin(angle / 2)

    def name(i, j):
        return np.where(i < segments, i * (rows + 1) + j, rows - j)

    i, j = (k.ravel() for k in np.meshgrid(np.arange(segments), np.arange(rows), indexing="ij"))
    a, b, c, d = name(i, j), name(i + 1, j), name(i + 1, j + 1), name(i, j + 1)
    quads = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.stack(x, axis=2).reshape(-1, 3), quads


def projective_plane():
    """The six vertices of half an icosahedron, every two of them joined; it fits in no space without crossing."""
    F = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [0, 5, 1],
                  [1, 2, 4], [2, 3, 5], [3, 4, 1], [4, 5, 2], [5, 1, 3]])  # fmt: skip
    return np.random.default_rng(0).normal(size=(6, 3)), F


def tetrahedron():
    V = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    return V, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])


SURFACES = {
    "tetrahedron": tetrahedron, "cube": meshes.cube, "sphere": meshes.icosphere, "annulus": meshes.annulus,
    "holed sphere": holed_sphere, "torus": meshes.torus, "holed torus": holed_torus, "double torus": double_torus,
    "moebius": moebius, "projective plane": projective_plane,
}  # fmt: skip


@pytest.mark.parametrize("mesh", [moebius, projective_plane])
def test_no_seam_alone_opens_what_has_one_side_only(mesh):
    with pytest.raises(OrientationError, match="Neighbouring faces point to opposite sides"):
        cut_to_disks(triangle_surface(*mesh()), seams="existing")


@pytest.mark.parametrize("name", SURFACES)
def test_every_surface_becomes_one_disk(name):
    V, F = SURFACES[name]()
    before = V.copy(), F.copy()
    prepared = cut_to_disks(triangle_surface(V, F))  # refuses anything that is no disk
    (chart,) = prepared.charts
    assert len(chart.triangles) == len(F)
    # However it is opened, faces of this one look to both sides of the map.
    (warning,) = prepared.warnings if name == "projective plane" else [""]
    assert bool(re.search("one side only, [34] faces look to the other side", warning)) == (name == "projective plane")
    np.testing.assert_array_equal(V, before[0])
    np.testing.assert_array_equal(F, before[1])


@pytest.mark.parametrize("name", ["sphere", "annulus", "holed torus", "double torus"])
def test_cuts_are_seams_that_split_accepts(name):
    V, F = SURFACES[name]()
    cuts = cut(triangle_surface(V, F))
    (chart,) = strict_charts(triangle_surface(V, F, cuts.edges))
    assert len(chart.triangles) == len(F)
    length = np.linalg.norm(V[cuts.edges[:, 0]] - V[cuts.edges[:, 1]], axis=1).sum()
    assert np.isclose(cuts.length, length, rtol=1e-12)
    # Cut again, there is nothing left to do.
    assert len(cut(triangle_surface(V, F, cuts.edges)).edges) == 0


def test_a_klein_bottle_is_opened_where_its_winding_turns():
    V, quads = hard_meshes.klein_bottle(24, 16)
    surface = meshes.polygon_surface(V, quads.tolist())
    prepared = cut_to_disks(surface)
    (chart,) = prepared.charts
    (component,) = prepared.cuts.components
    assert component.one_sided and component.boundaries == 0 and component.handles == 2
    ends = V[prepared.cuts.edges]
    assert component.length == pytest.approx(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum(), rel=1e-9)
    # Each triangle as it was wound: its corners in their order.
    order = np.argsort(chart.corners, axis=1)
    assert ((order - order[:, :1]) % 3 == [0, 1, 2]).all()
    assert not prepared.warnings


def test_topology_is_told():
    kinds = {name: cut(triangle_surface(*SURFACES[name]())).components[0] for name in SURFACES}
    figures = {name: (p.boundaries, p.handles, p.one_sided) for name, p in kinds.items()}
    assert figures == {
        "tetrahedron": (0, 0, False), "cube": (0, 0, False), "sphere": (0, 0, False), "annulus": (2, 0, False),
        "holed sphere": (3, 0, False), "torus": (0, 1, False), "holed torus": (2, 1, False),
        "double torus": (0, 2, False), "moebius": (1, 1, True), "projective plane": (0, 1, True),
    }  # fmt: skip


def test_disks_are_left_alone():
    for mesh in (meshes.bumpy(), meshes.hemisphere(), meshes.head(12)):
        cuts = cut(triangle_surface(*mesh))
        assert len(cuts.edges) == 0 and not cuts.components


def test_an_annulus_is_cut_along_a_shortest_path():
    V, F = meshes.annulus(sectors=24, rings=3)
    cuts = cut(triangle_surface(V, F), extremities=0)
    assert np.isclose(cuts.length, 1.0 - 1 / 4) or len(cuts.edges) == 3


def test_cuts_follow_edges_that_are_marked_sharp():
    """A line of sharp edges across a flat ring, at any place, takes the cut; but not at any price."""
    V, F = meshes.annulus(sectors=24, rings=3)
    for sector in (3, 10, 20):
        line = sector + 24 * np.arange(4)
        sharp = np.column_stack([line[:-1], line[1:]])
        cuts = cut(replace(triangle_surface(V, F), sharp=sharp), extremities=0)
        assert set(map(frozenset, cuts.edges.tolist())) == set(map(frozenset, sharp.tolist()))
    around = np.column_stack([np.arange(24), (np.arange(24) + 1) % 24]) + 24
    assert len(cut(replace(triangle_surface(V, F), sharp=around), extremities=0).edges) <= 4


def test_cuts_go_around_pinned_vertices():
    V, F = meshes.annulus(sectors=24, rings=3)
    surface = triangle_surface(V, F)
    vertex = surface.corner_vertex
    inside = (vertex >= 24) & (vertex < 72)
    pins = CornerPins(inside & ~np.isin(vertex % 24, [7, 8]), V[vertex, :2])
    result = drain(unwrap(surface, pins=pins))
    inner = np.setdiff1d(result.seams, np.r_[:24, 72:96])
    assert len(inner) and not np.isin(inner, vertex[pins.pinned]).any()
    (chart_map,) = result.maps
    assert chart_map.pinned and chart_map.folds == 0 and chart_map.angle_mean < 1.001


def test_a_moebius_strip_is_cut_across():
    cuts = cut(triangle_surface(*moebius()), extremities=0)
    assert len(cuts.edges) == 2


def test_spheres_are_opened_along_short_trees():
    sphere, F = meshes.icosphere(3)
    for stretch in ([1.0, 1.0, 1.0], [1.0, 1.0, 4.0], [1.0, 3.0, 3.0], [1.0, 2.0, 3.0]):
        # Slanted, so that nothing has to be symmetric.
        V = sphere * stretch @ [[1, 0.2, 0.1], [0, 1, 0.3], [0, 0, 1]]
        cuts = cut(triangle_surface(V, F))
        assert cuts.length <= 1.3 * shortest_tree(V, F, cuts.components[0].extremities)


@pytest.mark.parametrize("name", ["torus", "holed torus", "double torus"])
def test_handles_are_opened_along_short_loops(name):
    V, F = SURFACES[name]()
    # Two loops around a torus of radii 1 and 0.4, the inner one of them along the hole.
    assert cut(triangle_surface(V, F), extremities=0).length <= 1.01 * cotree_length(V, F)


def test_the_cut_of_a_long_body_ends_at_its_tips():
    V, F = meshes.icosphere(3)
    (component,) = cut(triangle_surface(V * [1.0, 1.0, 4.0], F), extremities=2).components
    heights = np.sort(V[component.extremities, 2])
    assert heights[0] < -0.95 and heights[-1] > 0.95


def test_seams_of_the_artist_are_kept_and_used():
    V, F = meshes.torus()
    around = np.arange(12)
    seam = np.column_stack([around, np.roll(around, -1)])
    cuts = cut(triangle_surface(V, F, seam), extremities=0)
    # The seam leaves a tube, which one path along it opens.
    assert cuts.components[0].boundaries == 2 and cuts.components[0].handles == 0
    (chart,) = strict_charts(triangle_surface(V, F, np.concatenate([seam, cuts.edges])))
    assert len(chart.triangles) == len(F)


def test_painted_vertices_are_kept_free():
    V, F = meshes.annulus(sectors=24, rings=3)
    free = cut(triangle_surface(V, F), extremities=0)
    avoid = np.zeros(len(V))
    side = V[free.edges.ravel()].mean(axis=0)
    avoid[V @ side > 0] = 1
    other = cut(triangle_surface(V, F), extremities=0, avoid=avoid)
    assert avoid[free.edges].all() and not avoid[other.edges].any()


def test_a_sphere_is_opened_beside_its_painted_half():
    V, F = meshes.icosphere(2)
    front = V[:, 0] > 0
    edges = cut(triangle_surface(V, F), avoid=front.astype(float)).edges
    assert not front[edges].all(axis=1).any()
    # Where everything is painted there is still a way.
    cut_to_disks(triangle_surface(V, F), avoid=np.ones(len(V)))


def test_cuts_hide_in_creases():
    """Of the two ways around a box the sharp edge wins over the middle of a side."""
    V, F = meshes.grid(12, 8)
    V[:, 2] = 1.0 * np.minimum(np.abs(V[:, 0] - 0.5), 0.25)
    hole = np.isin(F, np.flatnonzero(np.linalg.norm(V[:, :2] - [0.5, 0.5], axis=1) < 0.1)).any(1)
    cuts = cut(triangle_surface(V, F[~hole]), extremities=0)
    assert np.allclose(V[cuts.edges][:, :, 0], 0.5)


def test_polygons_are_cut_along_their_sides():
    side = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    V, _ = meshes.cube()
    mesh = meshes.polygon_surface(V, side.tolist())
    cuts = cut(mesh)
    assert np.allclose(np.linalg.norm(V[cuts.edges[:, 0]] - V[cuts.edges[:, 1]], axis=1), 1)
    (chart,) = cut_to_disks(mesh).charts
    assert len(np.unique(chart.faces)) == 6


@pytest.mark.parametrize("scale, shift", [(1e-6, 0), (1e6, 0), (1, 1e5)])
@pytest.mark.parametrize("name", ["sphere", "cube", "double torus", "holed sphere"])
def test_units_do_not_matter(name, scale, shift):
    V, F = SURFACES[name]()
    np.testing.assert_array_equal(cut(triangle_surface(V, F)).edges, cut(triangle_surface(V * scale + shift, F)).edges)


def test_names_of_vertices_hardly_matter():
    V, F = meshes.head(20)
    closed = np.concatenate([F, _fan(F)])
    rng = np.random.default_rng(1)
    name = rng.permutation(len(V))
    shuffled = cut(triangle_surface(V[np.argsort(name)], name[closed]))
    assert np.isclose(shuffled.length, cut(triangle_surface(V, closed)).length, rtol=0.05)


def _fan(F):
    from omt_uv.solver.mesh.topology import boundary_loops

    loop = boundary_loops(F)[0][::-1]
    return np.array([[loop[0], loop[k], loop[k + 1]] for k in range(1, len(loop) - 1)])


def test_holes_are_filled_and_the_longest_boundary_stays():
    V, F = meshes.annulus()
    (chart,) = cut_to_disks(triangle_surface(V, F), fill_holes=True).charts
    assert len(chart.patches) == 24 and len(chart.triangles) == len(F)
    assert (chart.vertex_ids == -1).sum() == 1 and np.allclose(chart.vertices[chart.vertex_ids == -1], 0)
    radius = np.linalg.norm(chart.vertices[_loop(chart.disk)], axis=1)
    assert np.allclose(radius, radius.max())
    (strict,) = cut_to_disks(triangle_surface(V, F), seams="existing", fill_holes=True).charts
    np.testing.assert_array_equal(strict.disk, chart.disk)


def _loop(triangles):
    from omt_uv.solver.mesh.topology import boundary_loops

    return boundary_loops(triangles)[0]


def test_handles_are_cut_around_filled_holes():
    V, F = holed_torus()
    prepared = cut_to_disks(triangle_surface(V, F), fill_holes=True)
    (chart,) = prepared.charts
    assert len(chart.patches) > 0 and len(chart.triangles) == len(F)
    assert prepared.cuts.components[0].boundaries == 1


def test_a_path_is_really_shortest():
    """The cut between two holes of a sphere is as long as Dijkstra says."""
    V, F = holed_sphere(holes=2)
    cuts = cut(triangle_surface(V, F), extremities=0)
    sides = np.unique(np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1), axis=0)
    length = np.linalg.norm(V[sides[:, 0]] - V[sides[:, 1]], axis=1)
    graph = csr_matrix((length, sides.T), shape=(len(V), len(V)))
    first, second = boundary(F)
    distance = dijkstra(graph, directed=False, indices=first, min_only=True)[second].min()
    assert np.isclose(cuts.length, distance, rtol=1e-6)


def boundary(F):
    from omt_uv.solver.mesh.topology import boundary_loops

    return boundary_loops(F)


@meshes.models_missing
@pytest.mark.parametrize("name", ["spot", "bunny_small", "max_planck", "cow"])
def test_models_are_cut_along_short_trees(name):
    V, F = meshes.load_model(name)
    cuts = cut(triangle_surface(V, F), extremities=5)
    assert cuts.length <= 1.3 * shortest_tree(V, F, cuts.components[0].extremities)


@meshes.models_missing
@pytest.mark.parametrize("name, handles", [("three_holes", 3), ("fertility", 4)])
def test_models_with_handles(name, handles):
    V, F = meshes.load_model(name)
    cuts = cut(triangle_surface(V, F), extremities=0)
    assert cuts.components[0].handles == handles
    assert cuts.length <= cotree_length(V, F)


@meshes.models_missing
@pytest.mark.parametrize("name, parts", [("suzanne", 5), ("teapot", 19), ("beetle", 1)])
def test_models_of_many_parts(name, parts):
    V, F = meshes.load_model(name)
    prepared = cut_to_disks(triangle_surface(V, F))
    assert len(prepared.charts) == parts
    assert sum(len(c.triangles) for c in prepared.charts) == len(F)


def prism(sides, height=2.0, taper=1.0):
    """A closed prism, or with a taper a frustum, with one polygon on top and one below."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sides)])
    k = np.arange(sides)
    walls = np.column_stack([k, (k + 1) % sides, (k + 1) % sides + sides, k + sides])
    return np.vstack([ring, taper * ring + [0, 0, height]]), [*walls.tolist(), k[::-1].tolist(), (k + sides).tolist()]


def notched_block():
    """A long block with a step, all of it in unit cubes: flat vertices between the corners."""
    x, y, z = np.mgrid[0:4, 0:2, 0:2]
    solid = (z == 0) | (x < 2)
    faces = []
    for axis in range(3):
        for side in (0, 1):
            step = np.zeros(3, int)
            step[axis] = 2 * side - 1
            for cell in np.argwhere(solid):
                near = cell + step
                if (near >= 0).all() and (near < solid.shape).all() and solid[tuple(near)]:
                    continue
                one, two = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
                base = cell + side * np.eye(3, dtype=int)[axis]
                quad = [base, base + one, base + one + two, base + two]
                faces.append([tuple(v) for v in (quad if side else quad[::-1])])
    names = {v: k for k, v in enumerate(sorted({v for f in faces for v in f}))}
    return np.array(sorted(names), float), [[names[v] for v in f] for f in faces]


NETS = {
    "cube": lambda: prism(4, np.sqrt(2)), "slab": lambda: prism(4, 0.1), "hexagon": lambda: prism(6),
    "cylinder": lambda: prism(48), "frustum": lambda: prism(24, 1.0, 0.5), "block": notched_block,
}  # fmt: skip


@pytest.mark.parametrize("scale, shift", [(1, 0), (1e-6, 0), (1, 1e5)])
@pytest.mark.parametrize("name", sorted(NETS))
def test_bodies_with_flat_sides_unroll(name, scale, shift):
    V, polygons = NETS[name]()
    result = drain(unwrap(meshes.polygon_surface(scale * V + shift, polygons)))
    (chart_map,) = result.maps
    assert chart_map.area_l1 < 1e-5 and chart_map.angle_mean < 1 + 1e-5 and not chart_map.warnings


def test_smooth_bodies_and_those_to_be_kept_free_of_seams_have_no_net():
    sphere = cut(triangle_surface(*meshes.icosphere(2)))
    assert len(sphere.components[0].extremities) <= 8
    V, polygons = prism(12)
    surface = meshes.polygon_surface(V, polygons)
    avoid = (V[:, 2] > 1).astype(float)
    cuts = cut(surface, avoid=avoid)
    assert (avoid[cuts.edges].min(axis=1) > 0).sum() < (avoid[cut(surface).edges].min(axis=1) > 0).sum() == 11
