"""Broken meshes: each fault is repaired for the map alone, and said; what cannot be repaired has a name."""

import meshes
import numpy as np
import pytest
from broken_meshes import broken_mesh

from omt_uv.solver import errors
from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.mesh import repair, topology
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.gluing import corner_classes
from omt_uv.solver.mesh.surface import FlatTriangles, Surface, degenerate_triangles, triangle_surface
from omt_uv.solver.parameterization.chart_map import map_chart
from omt_uv.solver.parameterization.options import MapOptions, UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain


def prepared(V, F, seams=(), **options):
    """The preparation of a surface; the input must stay as it was."""
    V, F = np.array(V, dtype=float), np.array(F)
    before = V.copy(), F.copy()
    result = cut_to_disks(triangle_surface(V, F, seams), **options)
    np.testing.assert_array_equal(V, before[0])
    np.testing.assert_array_equal(F, before[1])
    corners = np.sort(np.concatenate([c.corners.ravel() for c in result.charts]))
    np.testing.assert_array_equal(corners, np.arange(3 * len(F)))
    return result


def mapped(chart):
    """The map of a chart, which must not fold."""
    chart_map = drain(map_chart(chart, options=MapOptions(quality="draft")))
    assert np.isfinite(chart_map.uv).all()
    uv = chart_map.uv / np.ptp(chart_map.uv, axis=0).max()
    assert (signed_areas(uv, chart.triangles) > 0).all()
    return chart_map


def fin():
    """Three faces at one edge."""
    return np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 0, 1.0]]), [[0, 1, 2], [1, 0, 3], [0, 1, 4]]


def test_three_fins_become_three_charts():
    result = prepared(*fin())
    assert [len(c.triangles) for c in result.charts] == [1, 1, 1]
    assert result.cuts.edges.tolist() == [[0, 1]] and result.cuts.torn.tolist() == [[0, 1]]
    assert any("More than two faces" in w for w in result.warnings)


def test_a_fin_on_a_patch_leaves_the_patch_whole():
    V, F = meshes.grid(6, 6)
    inner = F[np.argmin(np.abs(V[F].mean(1)[:, :2] - 0.5).sum(1))]
    V = np.vstack([V, V[inner].mean(0) + [0, 0, 1]])
    result = prepared(V, np.vstack([F, [inner[0], inner[1], len(V) - 1]]))
    # A slit of one edge has no inside: the patch stays a disk as it was.
    assert sorted(len(c.triangles) for c in result.charts) == [1, len(F)]
    assert len(max(result.charts, key=lambda c: len(c.triangles)).vertices) == len(V) - 1


def test_two_spheres_that_share_a_face_come_apart():
    V, F = meshes.icosphere(1)
    mirror = V @ np.diag([1.0, 1, -1])
    low = V[:, 2].min()
    both = np.concatenate([V, mirror + [0, 0, 2 * low]])
    G = F[:, [0, 2, 1]] + len(V)
    name = np.arange(len(both))
    shared = np.flatnonzero(np.isclose(V[:, 2], low))
    name[len(V) + shared] = shared
    result = prepared(both, np.concatenate([F, name[G]]))
    assert len(result.charts) >= 2
    for chart in result.charts:
        mapped(chart)


def test_faces_that_look_the_wrong_way_are_turned_for_the_map():
    V, F = meshes.bumpy(6, 6)
    turned = F.copy()
    turned[[3, 17, 40]] = turned[[3, 17, 40]][:, ::-1]
    (chart,) = prepared(V, turned).charts
    (sound,) = prepared(V, F).charts
    assert len(chart.triangles) == len(F)
    # Every corner of the turned mesh belongs to the vertex it belongs to in the sound one.
    np.testing.assert_allclose(mapped(chart).area_l1, mapped(sound).area_l1, rtol=0.1)
    np.testing.assert_array_equal(turned.ravel()[chart.corners], chart.vertex_ids[chart.triangles])


def test_faces_turned_for_the_map_are_counted_and_said():
    """They lie in the map as their neighbours do; in the mesh's own winding just these are mirrored."""
    V, F = meshes.bumpy(6, 6)
    F = F.copy()
    F[[3, 17, 40]] = F[[3, 17, 40]][:, ::-1]
    result = drain(unwrap(triangle_surface(V, F)))
    (warning,) = result.warnings
    assert warning.startswith("3 faces look to the other side") and errors.TURN_OUTSIDE in warning
    corners, uv = result.corner_uv()
    at = np.empty((F.size, 2))
    at[corners] = uv
    signed = signed_areas(at, np.arange(F.size).reshape(-1, 3))
    np.testing.assert_array_equal(np.flatnonzero(signed < 0), [3, 17, 40])
    assert np.abs(signed).sum() == pytest.approx(signed[signed > 0].sum() - signed[signed < 0].sum())


@pytest.mark.parametrize("places", [[5], [2, 7, 20]])
def test_what_has_one_side_is_opened_where_its_faces_disagree(places):
    """Along a Moebius band the winding changes an odd number of times; if once, no face has to be turned over."""
    V, F = strip(places)
    result = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(seams="auto")))
    assert len(result.charts) == 1 and len(result.seams) >= 1
    corners, uv = result.corner_uv()
    signed = signed_areas(uv[np.argsort(corners)], np.arange(F.size).reshape(-1, 3))
    assert len(np.unique(np.sign(signed))) == (1 if len(places) == 1 else 2)


def strip(places, segments=24):
    """A Moebius band of triangles whose winding changes at these segments."""
    angle = 2 * np.pi * np.arange(segments) / segments
    side = 0.3 * np.stack([np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], 1)
    middle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    k = np.arange(segments)
    a, b = k, k + segments
    # The sides swap where the band closes.
    c, d = np.append(a[1:], b[0]), np.append(b[1:], a[0])
    F = np.stack([np.column_stack([a, c, d]), np.column_stack([a, d, b])], 1)
    for place in places:
        F[place:] = F[place:, :, ::-1]
    return np.concatenate([middle + side, middle - side]), F.reshape(-1, 3)


def test_the_winding_of_most_of_the_surface_is_kept():
    V, F = meshes.bumpy(6, 6)
    (chart,) = prepared(V, F[:, ::-1]).charts
    np.testing.assert_array_equal(chart.vertex_ids[chart.triangles], F[:, ::-1][chart.corners[:, 0] // 3])


def test_half_turned_sphere_is_cut_as_the_sound_one():
    V, F = meshes.icosphere(2)
    turned = F.copy()
    turned[: len(F) // 3] = turned[: len(F) // 3, ::-1]
    ours, sound = prepared(V, turned), prepared(V, F)
    assert len(ours.charts) == 1
    assert np.isclose(ours.cuts.length, sound.cuts.length, rtol=0.1)


def test_coincident_faces_become_a_layer_of_their_own():
    V, F = meshes.bumpy(4, 4)
    result = prepared(V, np.concatenate([F, F[:, ::-1]]))
    assert [len(c.triangles) for c in result.charts] == [len(F), len(F)]
    assert any(errors.MERGE in w for w in result.warnings)
    single = prepared(V, np.vstack([F, F[3, [1, 2, 0]]]))
    assert [len(c.triangles) for c in single.charts] == [len(F), 1]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("first", [False, True])
def test_what_lies_on_a_larger_part_is_its_other_side_whichever_comes_first(first, turned):
    V, F = meshes.bumpy(6, 6)
    middle = np.flatnonzero((np.abs(V[F].mean(axis=1)[:, :2] - V[:, :2].mean(axis=0)) < 0.2).all(axis=1))
    patch = F[middle][:, ::-1] if turned else F[middle][:, [1, 2, 0]]
    assert 4 < len(patch) < len(F) / 3
    result = prepared(V, np.concatenate([patch, F] if first else [F, patch]))
    sizes = [len(patch), len(F)] if first else [len(F), len(patch)]
    assert sorted(len(c.triangles) for c in result.charts) == sorted(sizes)
    rows = np.split(np.arange(sum(sizes)), [sizes[0]])
    # Which of two that look the same way goes on in what is around them, nothing tells.
    for chart, mine in zip(result.charts, rows, strict=True) if turned else ():
        np.testing.assert_array_equal(np.sort(chart.faces), mine)


BAD_FACES = {
    "a vertex twice": lambda F: [[F[0, 0], F[0, 1], F[0, 1]]],
    "double": lambda F: F[3:5, [1, 2, 0]],
    "three at an edge": lambda F: [[F[0, 0], F[0, 1], F[-1, 2]]],
}


@pytest.mark.parametrize("bad", BAD_FACES)
def test_nothing_is_said_of_faces_that_are_not_chosen(bad):
    V, F = meshes.bumpy(4, 4)
    surface = triangle_surface(V, np.vstack([F, BAD_FACES[bad](F)]))
    chosen = np.arange(len(surface.triangles)) < len(F)
    assert cut_to_disks(surface).warnings and cut_to_disks(surface, chosen).warnings == ()


def test_a_face_that_uses_a_vertex_twice_becomes_an_island():
    V, F = meshes.bumpy(4, 4)
    result = prepared(V, np.vstack([F, [F[0, 0], F[0, 1], F[0, 1]]]))
    assert [len(c.triangles) for c in result.charts] == [len(F), 1]
    for chart in result.charts:
        mapped(chart)


def test_polygons_that_share_two_edges_in_a_row_come_apart():
    """Two quads around a vertex that only they use: their diagonals are one line in every plane map."""
    V = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0], [1, -1, 0.0]])
    mesh = meshes.polygon_surface(V, [[0, 1, 2, 3], [2, 1, 0, 4]])
    result = cut_to_disks(mesh)
    assert [len(c.triangles) for c in result.charts] == [2, 2]
    assert any("several edges in a row" in w for w in result.warnings)


def test_of_mirror_images_around_a_vertex_both_come_apart():
    """What is left is its own mirror image as before."""
    V = np.array(
        [[-2, 0, 0], [0, 2, 0], [2, 0, 0], [0, -2, 0], [-1, 0, 0], [0, 1, 0], [1, 0, 0], [0, -1, 0], [0, 0, 0.1]]
    )
    around = [[0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]
    equal = cut_to_disks(meshes.polygon_surface(V, [*around, [5, 4, 7, 8], [7, 6, 5, 8]]))
    assert sorted(len(np.unique(c.faces)) for c in equal.charts) == [1, 1, 4]
    other = V.copy()
    other[6, 0] = 1.2
    unequal = cut_to_disks(meshes.polygon_surface(other, [*around, [5, 4, 7, 8], [7, 6, 5, 8]]))
    assert sorted(len(np.unique(c.faces)) for c in unequal.charts) == [1, 5]


def needle(V, F, at):
    """Split the edge between faces `at` and its neighbour by a vertex on it that only one side knows."""
    a, b, c = F[at]
    middle = len(V)
    V = np.vstack([V, V[[a, b]].mean(0)])
    rest = np.delete(F, at, axis=0)
    # The neighbour keeps the whole edge, and a face without area closes the gap.
    return V, np.concatenate([rest, [[a, middle, c], [middle, b, c], [a, b, middle]]])


def test_a_face_without_area_does_not_spoil_its_neighbours():
    V, F = meshes.bumpy(8, 8)
    W, G = needle(V, F, 40)
    result = prepared(W, G)
    (chart,) = result.charts
    assert any("no area" in w for w in result.warnings)
    assert not degenerate_triangles(chart.vertices, chart.triangles).any()
    sound = face_areas(W, G[chart.corners[:, 0] // 3]) > 1e-12
    kept = face_areas(chart.vertices, chart.triangles)[sound]
    np.testing.assert_allclose(kept, face_areas(W, G[chart.corners[:, 0] // 3])[sound], rtol=1e-2)
    assert mapped(chart).area_l1 < 0.05


def test_a_polygon_with_corners_in_line_is_not_warned_of():
    """A step of stairs: its side has corners in line, of which triangulation makes a triangle without area."""
    V = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, -1, 0]], float)
    corners = np.array([0, 1, 2, 3, 0, 4, 1, 1, 4, 2])
    triangles, seams = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [7, 8, 9]]), np.zeros((0, 2), np.int64)
    surface = Surface(V, corners, np.array([0, 4, 7, 10]), triangles, np.array([0, 0, 1, 2]), seams)
    assert degenerate_triangles(V, corners[surface.triangles]).any()
    assert not any("no area" in warning for warning in cut_to_disks(surface).warnings)


def test_collapsed_vertices_are_told_apart():
    V, F = meshes.bumpy(8, 8)
    V = V.copy()
    star = np.unique(F[(F == 40).any(1)])
    V[star] = V[40]
    (chart,) = prepared(V, F).charts
    mapped(chart)


@pytest.mark.parametrize("shape", ["point", "line"])
def test_a_part_without_any_area_becomes_a_speck(shape):
    V, F = meshes.bumpy(4, 4)
    speck = np.tile(V[:1], (25, 1)) + (np.linspace(0, 1, 25)[:, None] * [1.0, 0, 0] if shape == "line" else 0)
    result = prepared(np.concatenate([V, speck]), np.concatenate([F, F + len(V)]))
    assert len(result.charts) == 2
    for chart in result.charts:
        mapped(chart)


def test_vertices_that_nothing_uses_do_not_matter():
    V, F = meshes.bumpy(4, 4)
    (chart,) = prepared(np.vstack([V, [[np.nan] * 3]]), F).charts
    assert len(chart.vertices) == len(V)


def test_what_no_repair_helps():
    V, F = meshes.bumpy(4, 4)
    with pytest.raises(errors.EmptyMeshError, match="There are no faces to unwrap"):
        cut_to_disks(triangle_surface(V, F[:0]))
    V[7] = np.nan
    with pytest.raises(errors.NonFiniteError) as caught:
        cut_to_disks(triangle_surface(V, F))
    assert caught.value.elements.tolist() == [7]


def test_a_face_that_no_move_gives_an_area_is_named_by_its_number_in_the_mesh(monkeypatch):
    V = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [0, 1, 0], [0.5, 1, 0]], float)
    surface = meshes.polygon_surface(V, [[0, 1, 4, 5], [1, 2, 3, 4], [5, 4, 6]])
    monkeypatch.setattr(repair, "PERTURBATION_ROUNDS", 0)
    with pytest.raises(errors.ZeroAreaFaceError) as caught:
        cut_to_disks(surface)
    assert caught.value.kind == "face" and caught.value.elements.tolist() == [2]


def broken(kind):
    V, F = meshes.bumpy(6, 6)
    if kind == "no area":
        V[F[40]] = V[F[40][0]]
    elif kind == "turned over":
        F[[3, 17]] = F[[3, 17]][:, ::-1]
    elif kind == "double":
        F = np.concatenate([F, F[:3]])
    return (V, F) if kind != "three at an edge" else fin()


@pytest.mark.parametrize("kind", ["no area", "turned over", "double", "three at an edge"])
def test_existing_seams_alone_repair_what_is_broken_and_say_so_as_others_do(kind):
    ours, theirs = (cut_to_disks(triangle_surface(*broken(kind)), seams=seams) for seams in ("existing", "auto"))
    assert ours.warnings == theirs.warnings and ours.warnings
    for one, other in zip(ours.charts, theirs.charts, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(vars(one).values(), vars(other).values(), strict=True))
        mapped(one)


@pytest.mark.parametrize("mesh", [meshes.icosphere, meshes.annulus])
def test_existing_seams_alone_refuse_what_they_do_not_open(mesh):
    with pytest.raises(errors.NotADiskError):
        cut_to_disks(triangle_surface(*mesh()), seams="existing")


def test_touching_boundaries_are_offered_a_weld():
    V, F = meshes.annulus()
    loose = np.arange(6)  # faces whose vertices are their own
    G = F.copy()
    G[loose] = len(V) + np.unique(F[loose], return_inverse=True)[1].reshape(-1, 3)
    W = np.concatenate([V, V[np.unique(F[loose])]])
    assert any(errors.MERGING in w for w in prepared(W, G).warnings)
    # A disk that touches itself is open on purpose.
    assert not prepared(*opened(V, F, cut(triangle_surface(V, F)).edges)).warnings


def test_a_refused_chart_that_touches_itself_is_offered_a_weld():
    V, F = meshes.torus()
    around = np.arange(12)
    W, G = opened(V, F, np.column_stack([around, np.roll(around, -1)]))
    with pytest.raises(errors.TouchingBoundariesError, match="A chart has"):
        cut_to_disks(triangle_surface(W, G), seams="existing")


def opened(V, F, seams):
    """The mesh with its vertices doubled along the seams, as if it had been ripped there."""
    corners = np.arange(F.size).reshape(-1, 3)
    repaired = repair.repaired_gluing(triangle_surface(V, F, seams), np.ones(len(F), bool), corners, np.arange(len(F)))
    gluing = repaired.gluing
    _, first, G = np.unique(corner_classes(gluing), return_index=True, return_inverse=True)
    return V[F.ravel()[first]], G.reshape(-1, 3)


def test_only_the_chosen_faces_are_looked_at():
    V, F = meshes.icosphere(1)
    half = V[F].mean(1)[:, 2] > 0
    result = cut_to_disks(triangle_surface(V, F), half)
    assert sum(len(c.triangles) for c in result.charts) == half.sum()


def test_seams_must_be_known():
    with pytest.raises(ValueError, match="seams"):
        cut_to_disks(triangle_surface(*meshes.cube()), seams="none")


def test_a_diagonal_between_two_corners_on_one_vertex():
    """A pentagon that passes through two vertices twice: its diagonals have equal ends."""
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    (chart,) = cut_to_disks(meshes.polygon_surface(V, [[0, 1, 0, 1, 2]])).charts
    assert len(chart.vertices) == 5
    mapped(chart)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("chunk", range(8))
def test_every_mesh_becomes_disks_or_has_a_named_fault(chunk):
    """`cut_to_disks` checks every chart itself; only what has no numbers, no faces or no area at all may stop it."""
    for seed in range(100 * chunk, 100 * (chunk + 1)):
        surface, faces, _ = broken_mesh(seed)
        try:
            result = cut_to_disks(surface, faces, fill_holes=seed % 3 == 0)
        except (errors.EmptyMeshError, errors.NonFiniteError):
            continue
        except errors.ZeroAreaFaceError as error:
            assert error.cause == "No face has an area", seed
            continue
        except Exception as error:
            error.add_note(f"broken_mesh({seed})")
            raise
        chosen = np.ones(len(surface.face_start) - 1, bool) if faces is None else faces
        corners = np.unique(np.concatenate([c.corners.ravel() for c in result.charts]))
        assert np.array_equal(corners, np.flatnonzero(np.repeat(chosen, np.diff(surface.face_start)))), seed


@pytest.mark.parametrize("seed", range(100))
def test_triangle_soups_become_disks(seed):
    rng = np.random.default_rng(seed)
    n = rng.integers(3, 40)
    V, F = rng.normal(size=(n, 3)), rng.integers(0, n, size=(rng.integers(1, 100), 3))
    F[0] = [0, 1, 2]
    assert sum(len(c.triangles) for c in prepared(V, F, fill_holes=seed % 2 == 0).charts) == len(F)


@pytest.mark.parametrize("width", [0.0, 1e-9, 1e-8])
def test_what_has_area_keeps_it_next_to_long_strips_without_width(width):
    # Two long sides with a strip between them that has no width, and one that has hardly any.
    x = np.array([0, 0.1, 0.1 + width, 0.1 + 2.5 * width, 0.2])
    V = np.column_stack([np.tile(x, 3), np.repeat([0.0, 1.0, 2.0], len(x)), np.zeros(15)])
    F = meshes.grid(4, 2)[1]
    before = face_areas(V, F)
    moved, count = repair.perturbed(V, F, 2.0)
    after = face_areas(moved, F)
    assert count == 8
    assert not degenerate_triangles(moved, F, 1e-7).any()
    np.testing.assert_allclose(after[before > 0.01], before[before > 0.01], rtol=5e-3)


@pytest.mark.parametrize("corners", [np.zeros((3, 3)), np.outer([0, 0, 1], [2, 1, 0]), np.outer([0, 1, 2], [1, 1, 1])])
def test_a_triangle_without_area_that_is_a_chart_of_its_own_gets_one_as_any_other(corners):
    corners = np.asarray(corners, float) + [3, 4, 5]
    V = np.concatenate([corners, np.eye(3) * 7])
    chart = next(c for c in prepared(V, np.arange(6).reshape(2, 3)).charts if c.corners.min() < 3)
    expected, count = repair.perturbed(corners, np.array([[0, 1, 2]]), float(np.ptp(V, axis=0).max()))
    assert count == 1
    np.testing.assert_array_equal(chart.vertices, expected)


def split(V, polygons, seams=()):
    """A polygon mesh in which every polygon has vertices of its own, and the vertex of each before; seams by those."""
    origin = np.concatenate(polygons)
    ends = np.cumsum([len(p) for p in polygons])
    apart = [part.tolist() for part in np.split(np.arange(len(origin)), ends[:-1])]
    copies = [(a, b) for s in seams for a in np.flatnonzero(origin == s[0]) for b in np.flatnonzero(origin == s[1])]
    return meshes.polygon_surface(np.asarray(V, float)[origin], apart, copies), origin


def joined(surface, faces=None):
    count = len(surface.face_start) - 1
    same = repair.joined_vertices(surface, np.ones(count, bool) if faces is None else faces)
    # What stands for others stands for itself, lies there, and is the first.
    assert np.array_equal(same[same], same) and (same <= np.arange(len(same))).all()
    assert np.array_equal(surface.positions[same] + 0.0, surface.positions + 0.0)
    return same


def quads_of_a_cube():
    corners = 2.0 * np.array([[k >> 2 & 1, k >> 1 & 1, k & 1] for k in range(8)]) - 1
    return corners, [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def test_what_an_importer_split_is_joined_again():
    for V, polygons in (quads_of_a_cube(), meshes.icosphere(1), meshes.torus(8, 6)):
        surface, origin = split(V, [list(p) for p in polygons])
        same = joined(surface)
        _, before = np.unique(origin, return_inverse=True)
        _, after = np.unique(same, return_inverse=True)
        assert len(np.unique(np.stack([before, after]), axis=1).T) == len(V) == after.max() + 1


def test_what_is_whole_stays_as_it_is():
    for V, F in (meshes.icosphere(2), meshes.bumpy(6, 6), meshes.comb()):
        assert np.array_equal(joined(triangle_surface(V, F)), np.arange(len(V)))


def test_polygons_that_are_not_chosen_and_sides_that_are_seams_join_nothing():
    V, quads = quads_of_a_cube()
    surface, origin = split(V, quads)
    only = np.arange(6) < 1
    assert np.array_equal(joined(surface, only), np.arange(24))
    edge = (0, 1)
    marked = split(V, quads, [edge])[0]
    same, without = joined(marked), joined(surface)
    # The corners are still joined across the other sides.
    assert len(np.unique(without)) == len(np.unique(same)) == 8
    loop = [(0, 1), (1, 3), (2, 3), (0, 2)]
    same = joined(split(V, quads, loop)[0])
    assert len(np.unique(same)) == 12 and (same[:4] == np.arange(4)).all()


def test_a_part_that_touches_itself_and_a_leaf_with_two_sides_stay_open():
    V, F = meshes.grid(12, 4)
    rolled = np.stack([np.cos(2 * np.pi * V[:, 0]), np.sin(2 * np.pi * V[:, 0]), V[:, 1]], axis=1)
    end = np.isclose(V[:, 0], 1)
    rolled[end] = rolled[np.flatnonzero(np.isclose(V[:, 0], 0))]
    assert np.array_equal(joined(triangle_surface(rolled, F)), np.arange(len(V)))
    # Of a file that had to split it at the borders of its UVs its sides are one.
    same = repair.joined_vertices(triangle_surface(rolled, F), np.ones(len(F), bool), was_split=True)
    assert np.array_equal(rolled[same], rolled) and len(np.unique(same)) == len(V) - end.sum()
    both = triangle_surface(np.concatenate([V, V]), np.concatenate([F, F[:, ::-1] + len(V)]))
    assert np.array_equal(joined(both), np.arange(2 * len(V)))
    whole = np.ones(2 * len(F), bool)
    assert np.array_equal(repair.joined_vertices(both, whole, was_split=True), np.arange(2 * len(V)))


def test_sides_in_one_direction_or_in_threes_stay_apart():
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 0, 1]])
    alike, _ = split(V, [(0, 1, 2), (0, 1, 3)])
    assert np.array_equal(joined(alike), np.arange(6))
    three, _ = split(V, [(0, 1, 2), (1, 0, 3), (1, 0, 4)])
    assert np.array_equal(joined(three), np.arange(9))


def test_no_polygon_gets_one_vertex_twice():
    V = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [2, -1, 0]])
    surface, _ = split(V, [(0, 1, 2, 3), (1, 0, 4), (5, 2, 4)])
    same = joined(surface)
    for k in range(3):
        corners = surface.corner_vertex[surface.face_start[k] : surface.face_start[k + 1]]
        assert len(np.unique(same[corners])) == len(corners)


def flat_of(surface, faces=None):
    return repair.flat_triangles(surface, np.ones(len(surface.face_start) - 1, bool) if faces is None else faces)


def place_of_corners(surface, corners):
    return surface.positions[surface.corner_vertex[corners]]


@pytest.mark.parametrize("at", [0, 7, 18])
@pytest.mark.parametrize("apart", [False, True], ids=["joined", "split"])
def test_triangles_that_lie_on_an_edge_or_a_vertex_are_found_with_the_corners_they_lie_on(at, apart):
    V, F = meshes.grid(3, 3)
    a, b = F[4, :2]
    G = np.insert(F, at, [[a, b, a], [b, a, a], [a, a, a]], axis=0)
    surface = (
        triangle_surface(V[G].reshape(-1, 3), np.arange(G.size).reshape(-1, 3)) if apart else triangle_surface(V, G)
    )
    found = flat_of(surface)
    assert sorted(found.polygons) == [at, at + 1, at + 2]
    np.testing.assert_array_equal(found.corners, (3 * np.sort(found.polygons)[:, None] + np.arange(3)).ravel())
    np.testing.assert_array_equal(*(place_of_corners(surface, c) for c in (found.corners, found.hosts)))
    hosts = found.hosts.reshape(-1, 3) // 3
    assert not np.isin(hosts, found.polygons).any()
    # All of one polygon, so that its UVs lie on an edge of that.
    assert (hosts == hosts[:, :1]).all()


def test_only_triangles_that_would_tear_a_map_and_lie_on_a_polygon_are_found():
    V, F = meshes.grid(3, 3)
    inner = V.copy()
    # An edge inside without length: its triangles are joined all around.
    inner[5] = inner[6]
    assert len(flat_of(triangle_surface(inner, F)).polygons) == 0
    a, b = F[4, :2]
    with_one = triangle_surface(V, np.vstack([F, [[a, b, a]]]))
    chosen = np.ones(len(F) + 1, bool)
    assert flat_of(with_one, chosen).polygons.tolist() == [len(F)]
    chosen[-1] = False
    assert len(flat_of(with_one, chosen).polygons) == 0
    # Those beside it are not chosen: it would have nothing to lie on.
    assert len(flat_of(with_one, ~chosen).polygons) == 0
    # A needle has no area, either, but no two corners at one place.
    needle = np.vstack([V, V[a] + [0, 0, 1e-13]])
    assert len(flat_of(triangle_surface(needle, np.vstack([F, [[a, b, len(V)]]]))).polygons) == 0
    nowhere = np.vstack([V, [[np.nan] * 3]])
    assert len(flat_of(triangle_surface(nowhere, np.vstack([F, [[len(V)] * 3]]))).polygons) == 0


def test_a_flat_triangle_that_joins_its_neighbours_stays():
    """Left out, it would part a strip: its ends at one place are two vertices."""
    V, F = meshes.grid(4, 1)
    V[1] = V[2]
    surface = triangle_surface(V, F)
    assert len(flat_of(surface).polygons) == 0
    # But for where another one of these goes that lies there.
    a, b = np.flatnonzero((V[1] == V).all(axis=1))
    apex = np.setdiff1d(F[(a == F).any(axis=1) & (b == F).any(axis=1)][0], [a, b])[0]
    torn = triangle_surface(V, np.vstack([F, [[a, a, apex]]]))
    flat = np.flatnonzero((a == F).any(axis=1) & (b == F).any(axis=1))
    assert flat_of(torn).polygons.tolist() == [*flat, len(F)]


def test_a_flat_triangle_goes_that_keeps_the_parts_at_its_places_from_being_joined():
    """As where a modeller's file has rounded a seam away on one of its sides: both ends are one vertex of the other."""
    V, F = meshes.grid(4, 2)
    upper = V[F][:, :, 1].mean(axis=1) > V[:, 1].mean()
    middle = np.flatnonzero(V[:, 1] == np.median(V[:, 1]))
    a, b = middle[np.argsort(V[middle, 0])][1:3]
    V[b] = V[a]
    there = F[upper] + len(V)
    there[there == b + len(V)] = a + len(V)
    there = there[(there != np.roll(there, 1, axis=1)).all(axis=1)]
    surface = triangle_surface(np.vstack([V, V]), np.vstack([F[~upper], there]))
    every = np.ones(len(surface.triangles), bool)
    assert len(repair.flat_triangles(surface, every).polygons) == 0
    assert (joined(surface)[[a, b, a + len(V)]] == [a, b, a + len(V)]).all()
    flat = repair.flat_triangles(surface, every, False)
    assert (
        flat.polygons.tolist() == np.flatnonzero((F[~upper] == a).any(axis=1) & (F[~upper] == b).any(axis=1)).tolist()
    )
    rest = every.copy()
    rest[flat.polygons] = False
    same = joined(surface, rest)
    assert same[b] == same[a] == same[a + len(V)]
    # What is left is one disk, with no side open but those of the outline.
    triangles = same[surface.corner_vertex].reshape(-1, 3)[rest]
    assert len(topology.boundary_edges(triangles)) == 12
    assert len(topology.boundary_loops(triangles)) == 1


def test_uvs_are_carried_from_the_corners_that_have_some():
    flat = FlatTriangles(np.array([1]), np.array([3, 4, 5]), np.array([7, 2, 9]))
    corners, uv = flat.carried(np.array([0, 2, 7]), np.array([[0.0, 0], [0.2, 1], [0.7, 1]]))
    assert corners.tolist() == [0, 2, 3, 4, 7]
    assert uv.tolist() == [[0, 0], [0.2, 1], [0.7, 1], [0.2, 1], [0.7, 1]]
    nothing = FlatTriangles(*(np.zeros(0, np.int64) for _ in range(3)))
    np.testing.assert_array_equal(nothing.carried(corners, uv)[0], corners)


@pytest.mark.parametrize("first", ["outer", "inner", "mixed"])
@pytest.mark.parametrize("split_up", [False, True], ids=["shared", "split"])
def test_a_surface_with_two_sides_is_two_surfaces_whatever_the_order_of_its_faces(first, split_up):
    """Each of them whole, and with all its faces the right way round."""
    V, F = meshes.icosphere(1)
    rng = np.random.default_rng(3)
    swap = {"outer": np.zeros(len(F), bool), "inner": np.ones(len(F), bool), "mixed": rng.random(len(F)) < 0.5}[first]
    both = np.concatenate([np.where(swap[:, None], F[:, ::-1], F), np.where(swap[:, None], F, F[:, ::-1])])
    both = both[rng.permutation(len(both))]
    surface = triangle_surface(V, both)
    if split_up:
        surface = triangle_surface(V[both].reshape(-1, 3), np.arange(both.size).reshape(-1, 3))
        same = repair.joined_vertices(surface, np.ones(len(both), bool))
        assert len(np.unique(same)) == 2 * len(V)
        surface = triangle_surface(surface.positions, same.reshape(-1, 3))
    found = cut_to_disks(surface)
    assert len(found.charts) == 2 and not any("look" in text for text in found.warnings)
    outwards = (
        np.einsum(
            "mc,mc->m", np.cross(V[both[:, 1]] - V[both[:, 0]], V[both[:, 2]] - V[both[:, 0]]), V[both].mean(axis=1)
        )
        > 0
    )
    sides = [set(outwards[chart.faces].tolist()) for chart in found.charts]
    assert sides in ([{True}, {False}], [{False}, {True}])


def test_one_side_of_a_leaf_goes_on_in_what_has_one_side_alone():
    V, F = meshes.grid(4, 4)
    some = V[F].mean(axis=1)[:, 0] < 0.5
    both = np.concatenate([F[some][:, ::-1], F])
    found = cut_to_disks(triangle_surface(V, both))
    sizes = sorted(len(chart.triangles) for chart in found.charts)
    assert sizes == [int(some.sum()), len(F)]
