"""Pieces of maps triangle by triangle: directions of islands, least moves of faces, sides let go, maps one to one."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.maps import embedding, local_untangle, tutte, upright
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.topology import boundary_loops


def islands_of(*parts):
    """Islands of points (n,3), uv (n,2), triangles (m,3), polygons (m,) each."""
    first = np.cumsum([0, *(len(p[0]) for p in parts)])
    number = np.cumsum([0, *(int(p[3].max()) + 1 for p in parts)])
    return upright._Islands(
        np.concatenate([p[0] for p in parts]),
        np.concatenate([p[1] for p in parts]),
        np.concatenate([p[2] + k for p, k in zip(parts, first, strict=False)]),
        np.concatenate([p[3] + k for p, k in zip(parts, number, strict=False)]),
        np.repeat(np.arange(len(parts)), [len(p[2]) for p in parts]),
        len(parts),
    )


def patch(turn=0.0, stretch=1.0, columns=4, rows=3):
    """A grid of quads in the plane, cut along their diagonals, and turned."""
    V, quads = meshes.quad_grid(columns, rows)
    V = np.asarray(V, float)[:, :2] * [stretch, 1]
    triangles = np.concatenate([np.array(quads)[:, :3], np.array(quads)[:, [0, 2, 3]]])
    c, s = np.cos(turn), np.sin(turn)
    return V, V @ np.array([[c, s], [-s, c]]), triangles, np.tile(np.arange(len(quads)), 2)


def in_space(V, height):
    return np.column_stack([V, height])


# ---- upright -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turn", [0.0, 0.4, 1.2, -0.7])
def test_the_direction_of_an_island_is_that_of_most_of_its_sides(turn):
    rng = np.random.default_rng(1)
    V, uv, triangles, polygons = patch(turn)
    other = V + 0.3 * rng.normal(size=V.shape)
    islands = islands_of(
        (in_space(V, 0 * V[:, 0]), uv, triangles, polygons), (in_space(V, 0 * V[:, 0]), other, triangles, polygons)
    )
    share, direction = upright._edge_directions(islands)
    quarter = np.pi / 2
    assert share[0] == pytest.approx(1) and abs((direction[0] - turn + quarter / 2) % quarter - quarter / 2) < 1e-9
    # Askew, side by side: the share of all lengths within three bins around the best one.
    sides = {}
    for t, p in zip(triangles.tolist(), polygons.tolist(), strict=True):
        for a, b in zip(t, t[1:] + t[:1], strict=True):
            sides.setdefault(frozenset((a, b)), []).append(p)
    real = [e for e, of in sides.items() if len(of) == 1 or of[0] != of[1]]
    outline = [e for e, of in sides.items() if len(of) == 1]

    def best(edges):
        bins, lengths, angles = [], [], []
        for edge in edges:
            a, b = sorted(edge)
            d = other[b] - other[a]
            angle = np.arctan2(d[1], d[0]) % quarter
            bins.append(min(int(angle / quarter * 180), 180 - 1))
            lengths.append(np.hypot(*d))
            angles.append(angle)
        bins, lengths, angles = np.array(bins), np.array(lengths), np.array(angles)

        def near(k):
            return np.abs((bins - k + 180 // 2) % 180 - 180 // 2) <= 3

        within = [lengths[near(k)].sum() + 1e-6 * lengths[bins == k].sum() for k in range(180)]
        k = int(np.argmax(within))
        z = (lengths * near(k) * np.exp(4j * angles)).sum()
        return lengths[near(k)].sum() / lengths.sum(), np.angle(z) / 4

    (share_all, of_all), (share_out, of_out) = best(real), best(outline)
    own = share_out >= min(max(share_all, 0.3), 0.5)
    assert share[1] == pytest.approx(share_out if own else share_all)
    assert direction[1] == pytest.approx(of_out if own else of_all)


def upward(height, turn=0.0, up=(0.0, 0.0, 1.0), viewers=None, stretch=1.0):
    V, uv, triangles, polygons = patch(turn, stretch)
    islands = islands_of((in_space(V, height(*V.T)), uv, triangles, polygons))
    return float(upright._upward(islands, np.array([up]), viewers)[0])


@pytest.mark.parametrize("turn", [0.0, 0.9, -2.0])
@pytest.mark.parametrize(("slope", "steep"), [(1.0, True), (0.101, True), (0.099, False)])
def test_islands_rise_where_they_are_steep_enough(turn, slope, steep):
    """What is level lies away from the viewer, that is along y, in place of up."""
    found = upward(lambda x, y: slope * x, turn)
    assert np.exp(1j * found) == pytest.approx(np.exp(1j * (turn if steep else turn + np.pi / 2)))


@pytest.mark.parametrize(("share", "sure"), [(0.11, True), (0.09, False)])
def test_heights_that_cancel_are_those_of_a_ridge(share, sure):
    """A roof: to the left and to the right it falls by as much but for a share, and its back rises a little."""

    def roof(x, y):
        middle = (x.min() + x.max()) / 2
        left = (x < middle + 1e-9) * (x - middle)
        right = (x > middle) * (middle - x)
        return (1 + share) * left + (1 - share) * right + 0.02 * y

    found = upward(roof)
    along = np.exp(1j * found)
    if sure:
        assert abs(along.real) > 0.5
    else:
        assert along == pytest.approx(1j, abs=0.1)
    # With its other end higher it is the other way up.
    assert sure or np.exp(1j * upward(lambda x, y: roof(x, -y))) == pytest.approx(-1j, abs=0.1)


@pytest.mark.parametrize(("more", "is_ridge"), [(3.05, True), (2.95, False)])
def test_a_ridge_is_what_rises_three_times_as_much_across(more, is_ridge):
    """A saddle that rises along x and falls along y, with heights along y as well."""
    area = np.ones(4)
    rise = np.array([[np.sqrt(more), 0], [-np.sqrt(more), 0], [0, 1], [0, -1]])
    V, uv, triangles, polygons = patch(columns=2, rows=1)
    islands = upright._Islands(in_space(V, 0 * V[:, 0]), uv, triangles, polygons, np.zeros(4, int), 1)
    height = uv[triangles].mean(axis=1)[:, 1]
    found = upright._along_ridge(islands, area, height, rise)
    assert np.isfinite(found[0]) == is_ridge
    assert not is_ridge or found[0] == pytest.approx(np.pi / 2)
    assert not is_ridge or upright._along_ridge(islands, area, -height, rise)[0] == pytest.approx(-np.pi / 2)


@pytest.mark.parametrize(("share", "higher"), [(0.021, True), (0.019, False)])
def test_an_end_of_a_ridge_is_higher_where_heights_and_places_go_together(share, higher):
    V, uv, triangles, polygons = patch(columns=8, rows=8)
    islands = islands_of((in_space(V, 0 * V[:, 0]), uv, triangles, polygons))
    place = uv[triangles].mean(axis=1)[:, 1]
    place = (place - place.mean()) / place.std()
    other = np.cos(7 * uv[triangles].mean(axis=1)[:, 0])
    other -= other.mean() + (other * place).mean() * place
    height = share * place + np.sqrt(1 - share**2) * other / other.std()
    rise = np.tile([1.0, 0.0], (len(triangles), 1)) * np.where(np.arange(len(triangles)) % 2, 1, -1)[:, None]
    found = upright._along_ridge(islands, np.ones(len(triangles)), height, rise)
    assert np.isfinite(found[0]) == higher


def test_level_directions_are_away_from_the_viewer_and_to_the_right():
    up = np.array([[0.0, 0, 1], [0, 1.0, 0], [0, 0.2, -2.0]])
    away, right = upright._level(up, None)
    # Away is along y where that is not up, and along z, towards which nobody looks, where it is.
    assert away[0].tolist() == [0, 1, 0] and right[0].tolist() == [1, 0, 0]
    np.testing.assert_allclose([away[1], right[1]], [[0, 0, 1], [-1, 0, 0]])
    viewers = np.array([[1.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0]])
    away, right = upright._level(up, viewers)
    assert away[0].tolist() == [-1, 0, 0] and right[0].tolist() == [0, 1, 0]
    for a, r, u in zip(away, right, up, strict=True):
        assert a @ u == pytest.approx(0) and r @ u == pytest.approx(0) and r @ a == pytest.approx(0)
        assert np.linalg.norm(r) == pytest.approx(1)
    # Seen along `up` there is no right.
    assert not np.any(upright._level(up[:1], up[:1]))


def test_islands_side_by_side_share_no_polygon():
    charts = [
        SimpleNamespace(vertices=np.zeros((3, 3)), triangles=np.array([[0, 1, 2]]), faces=np.array([4])),
        SimpleNamespace(vertices=np.ones((4, 3)), triangles=np.array([[0, 1, 2], [0, 2, 3]]), faces=np.array([4, 4])),
        SimpleNamespace(vertices=np.ones((4, 3)), triangles=np.array([[0, 1, 2], [0, 2, 3]]), faces=np.array([0, 7])),
    ]
    found = upright._together(charts, [np.zeros((len(c.vertices), 2)) for c in charts])
    assert found.triangles.tolist() == [[0, 1, 2], [3, 4, 5], [3, 5, 6], [7, 8, 9], [7, 9, 10]]
    assert found.owner.tolist() == [0, 1, 1, 2, 2] and found.count == 3 and len(found.uv) == len(found.points) == 11
    p = found.polygons
    assert p[1] == p[2] and len({p[0], p[1], p[3], p[4]}) == 4


# ---- folds ---------------------------------------------------------------------------------------------------


def test_least_steps_of_a_face_add_the_area_that_is_missing():
    rng = np.random.default_rng(0)
    corners, side = rng.normal(size=(6, 3, 2)), np.array([1, -1, 1, -1, 1, 1])
    missing = 1e-5 * rng.random(6)
    steps = local_untangle._area_steps(corners, side, missing)

    def area(p):
        return 0.5 * np.linalg.det(p[1:] - p[0])

    for k in range(6):
        gained = side[k] * (area(corners[k] + steps[k]) - area(corners[k]))
        assert gained == pytest.approx(missing[k], rel=1e-3)
        # It is along the gradient: any other step of that length gains less.
        for _ in range(5):
            other = rng.normal(size=(3, 2))
            other *= np.linalg.norm(steps[k]) / np.linalg.norm(other)
            assert side[k] * (area(corners[k] + other) - area(corners[k])) < gained * (1 + 1e-6)


def test_areas_around_faces_are_means_over_the_faces_at_their_vertices():
    V, F = meshes.bumpy(4, 4)
    uv = V[:, :2] * np.exp(V[:, :1])
    found = local_untangle._area_around(uv, F)
    area = np.abs(signed_areas(uv, F))
    for t, value in zip(F, found, strict=True):
        at = [area[(v == F).any(axis=1)].mean() for v in t]
        assert value == pytest.approx(np.mean(at))


@pytest.mark.parametrize("depth", [0.05, 0.3])
def test_faces_of_the_boundary_are_pushed_until_they_have_a_little_area(depth):
    """A corner of the outline that is pulled across the side that is opposite to it."""
    V, F = meshes.grid(5, 5)
    uv = V[:, :2].copy()
    side = np.sign(signed_areas(uv, F)).astype(int)
    loop = boundary_loops(F)[0]
    v = int(loop[np.argmin(np.bincount(F.ravel())[loop])])
    (row,) = np.flatnonzero((v == F).any(axis=1))[:1]
    others = [u for u in F[row] if u != v]
    middle = uv[others].mean(axis=0)
    uv[v] = middle + depth * (middle - uv[v])
    assert local_untangle._folded(uv, F, side).sum() >= 1
    found = local_untangle._pushed(uv, F, side)
    assert not local_untangle._folded(found, F, side).any()
    moved = np.flatnonzero((found != uv).any(axis=1))
    assert set(moved.tolist()) <= set(F[(v == F).any(axis=1)].ravel().tolist())
    assert local_untangle._pushed(V[:, :2], F, side) is not None
    np.testing.assert_array_equal(local_untangle._pushed(V[:, :2], F, side), V[:, :2])


# ---- rectangles ----------------------------------------------------------------------------------------------


def letting_go(edges, side, corner):
    """Vertices (b,) of the boundary that are let go, the one with most edges along its side first."""
    released = set()
    while True:
        count = {}
        for i, j in edges:
            own = [{side[k], (side[k] - 1) % 4} if corner[k] else {side[k]} for k in (i, j)]
            if not {i, j} & released and own[0] & own[1]:
                for k in (i, j):
                    count[k] = count.get(k, 0) + (not corner[k])
        if not count:
            return released
        if not any(count.values()):
            raise FoldedUVError("corners")
        released.add(min(count, key=lambda k: (-count[k], k)))


@pytest.mark.parametrize("seed", range(6))
def test_vertices_are_let_go_from_sides_along_which_edges_run(seed):
    rng = np.random.default_rng(seed)
    n = 12
    # A fan of ears: every triangulation of a polygon has edges between its vertices alone.
    ring, triangles = list(range(n)), []
    while len(ring) > 3:
        k = int(rng.integers(len(ring)))
        triangles.append([ring[k - 1], ring[k], ring[(k + 1) % len(ring)]])
        ring.pop(k)
    triangles = np.array([*triangles, ring])
    loop = np.arange(n)
    side = np.repeat([0, 1, 2, 3], 3)
    corner = np.arange(n) % 3 == 0
    quads = np.array([[0, 4, 1, 5], [2, 7, 11, 8]]) if seed % 2 else tutte.NO_QUADS
    edges = set()
    for t in triangles.tolist():
        for a, b in zip(t, t[1:] + t[:1], strict=True):
            if abs(a - b) not in (1, n - 1):
                edges.add((min(a, b), max(a, b)))
    for q in quads.tolist():
        edges |= {(min(q[0], q[2]), max(q[0], q[2])), (min(q[1], q[3]), max(q[1], q[3]))}
    try:
        expected = letting_go(sorted(edges), side.tolist(), corner.tolist())
    except FoldedUVError:
        with pytest.raises(FoldedUVError, match="Two corners of the square are joined by an"):
            tutte.released_vertices(triangles, loop, side, corner, n, quads)
        return
    found = tutte.released_vertices(triangles, loop, side, corner, n, quads)
    assert set(np.flatnonzero(found).tolist()) == expected


# ---- one to one ----------------------------------------------------------------------------------------------


def squares(*shifts):
    """Unit squares at these places, of two triangles each."""
    T, uv = [], []
    for k, shift in enumerate(shifts):
        for t in ((0, 1, 2), (0, 2, 3)):
            T.append([4 * k + i for i in t])
            uv.append(np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])[list(t)] + shift)
    return np.array(T), np.array(uv)


@pytest.mark.parametrize(
    ("shifts", "sound"),
    [
        ([(0, 0)], True),
        ([(0, 0), (3, 0)], True),
        ([(0, 0), (1.001, 0)], True),
        ([(0, 0), (0.5, 0.25)], False),
        ([(0, 0), (1.5, 0), (0, 1.5), (1.5, 1.5)], True),
        ([(0, 0), (1.5, 0), (0, 1.5), (1.4, 1.4)], True),
        ([(0, 0), (1.5, 0), (0, 1.5), (0.9, 0.9)], False),
    ],
)
@pytest.mark.parametrize("mirrored", [False, True])
def test_maps_are_one_to_one_where_no_place_is_covered_twice(shifts, sound, mirrored, monkeypatch):
    T, uv = squares(*shifts)
    uv = uv * [-1, 1] if mirrored else uv
    turned = np.full(len(T), mirrored)
    edges = embedding._edges(T, turned)
    assert embedding._is_embedding(T, uv, edges, turned) == sound
    if sound and len(shifts) > 1:
        # Where there is too much to look at, nothing is known.
        monkeypatch.setattr(embedding, "MOST_WINDINGS", 0)
        near = any(np.abs(np.subtract(a, b)).max() < 0.5 for k, a in enumerate(shifts) for b in shifts[:k])
        assert embedding._is_embedding(T, uv, edges, turned) == (not near)


@pytest.mark.parametrize("inner", [0.4, 0.9])
def test_what_lies_within_another_island_is_found_by_how_the_outline_winds(inner, monkeypatch):
    T, uv = squares((0, 0), (9, 9))
    uv[2:] = (uv[2:] - 9) * inner + (1 - inner) / 2
    turned = np.zeros(len(T), bool)
    assert not embedding._is_embedding(T, uv, embedding._edges(T, turned), turned)
    # A frame around an island: its outline winds around the inside once there and once back.
    ring = np.array([[0.0, 0], [9, 0], [9, 9], [0, 9], [3, 3], [6, 3], [6, 6], [3, 6]])
    frame = np.array(
        [[k, (k + 1) % 4, 4 + (k + 1) % 4] for k in range(4)] + [[k, 4 + (k + 1) % 4, 4 + k] for k in range(4)]
    )
    T, corners = np.concatenate([frame, T[2:] - 4 + 8]), np.concatenate([ring[frame], uv[2:] + 4])
    turned = np.zeros(len(T), bool)
    edges = embedding._edges(T, turned)
    assert embedding._is_embedding(T, corners, edges, turned)
    monkeypatch.setattr(embedding, "MOST_WINDINGS", 3)
    assert not embedding._is_embedding(T, corners, edges, turned)
