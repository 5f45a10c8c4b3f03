"""Branches that meshes take seldom or never: what is decided there, with pieces that are written in advance."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import done, told

from omt_uv.solver import errors
from omt_uv.solver.conformal.moebius import centre_on_sphere
from omt_uv.solver.contact import box_pairs as contact_boxes
from omt_uv.solver.cutting import protrusions, symmetric_cut
from omt_uv.solver.maps import local_untangle, tutte
from omt_uv.solver.maps.energy import area_forms_of, elements
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization import chart_map, mirrored_charts
from omt_uv.solver.refinement import mirrored_motion, vertex_sweeps
from omt_uv.solver.registration import alignment, coarse_meshes, gathering, surface_newton
from omt_uv.solver.registration.carriers import InPlace
from omt_uv.solver.registration.charts import seam_arcs

# ---- maps ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_means_are_brought_to_the_middle_of_the_sphere_unless_they_gather_in_one_point(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(30, 3)) + [2, 0, 0]
    points /= np.linalg.norm(points, axis=1)[:, None]
    mass = rng.uniform(1, 2, 30)
    found = centre_on_sphere(points, mass)
    assert np.linalg.norm(mass @ found) < 1e-12 * mass.sum()
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1)
    # Cross ratios stay, so that it is a Moebius map.
    a, b = (np.linalg.norm(p[:3, None] - p[None, 3:6], axis=2) for p in (points, found))
    assert a[0, 0] * a[1, 1] / (a[0, 1] * a[1, 0]) == pytest.approx(b[0, 0] * b[1, 1] / (b[0, 1] * b[1, 0]))
    assert np.array_equal(centre_on_sphere(found, mass), found) or np.abs(mass @ found).max() > 1e-16
    with pytest.raises(errors.PrecisionError, match="The map gathers half of the surface in one"):
        centre_on_sphere(np.tile(points[:1], (5, 1)), np.ones(5))


@pytest.mark.parametrize("kind", ["even", "points", "flat", "one point", "mixed"])
@pytest.mark.parametrize("chosen", [None, "some", "one", "none"])
@pytest.mark.parametrize("entries", [1 << 20, 3])
def test_boxes_that_overlap_are_those_of_all_pairs(kind, chosen, entries, monkeypatch):
    monkeypatch.setattr(contact_boxes, "MOST_ENTRIES", entries)
    rng = np.random.default_rng(len(kind))
    low = rng.random((60, 3)) * (0 if kind == "one point" else 1)
    size = {"even": 0.1, "points": 0.0, "flat": np.array([0.2, 0.2, 0]), "one point": 0.0}.get(kind)
    high = low + (rng.random((60, 3)) ** 6 if size is None else size)
    low[7:10], high[7:10] = low[7], high[7]
    concerned = None if chosen is None else np.zeros(60, bool)
    if chosen in ("some", "one"):
        concerned[[7] if chosen == "one" else rng.choice(60, 9, replace=False)] = True
    found = contact_boxes.box_pairs(low, high, concerned)
    expected = [
        (i, j)
        for i in range(60)
        for j in range(i + 1, 60)
        if (low[i] <= high[j]).all() and (low[j] <= high[i]).all()
        if concerned is None or concerned[i] or concerned[j]
    ]
    assert sorted(map(tuple, found.tolist())) == expected


@pytest.mark.parametrize("fault", [None, "precision", "no area"])
def test_what_has_no_conformal_map_is_spread_without_end(fault, monkeypatch):
    V, F = meshes.grid(3, 3)
    uv = 2 * V[:, :2]
    if fault == "no area":
        uv = uv.copy()
        uv[F[0]] = uv[F[0, 0]]
    monkeypatch.setattr(protrusions, "cut_classes", lambda component, cut: F)
    result = errors.PrecisionError("no") if fault == "precision" else SimpleNamespace(uv=uv)
    monkeypatch.setattr(protrusions, "conformal_disk", lambda *_: done(result))
    found = protrusions.disk_spread(SimpleNamespace(positions=V, triangles=F), None)
    assert found == (pytest.approx(0, abs=1e-12) if fault is None else np.inf)


@pytest.mark.parametrize("opens", [True, False])
@pytest.mark.parametrize("spreads", [[5.0, 0.9, 0.9], [5.0, 5.0, 5.0], [5.0, 0.9, 5.0, 0.9, 0.9]])
def test_a_symmetric_cut_goes_on_until_it_is_bearable_or_has_all_its_tips(spreads, opens, monkeypatch):
    tips = [np.zeros(0), np.zeros(1), np.zeros(2), None]
    seen = iter(spreads)
    half = SimpleNamespace(
        component=None, whole=lambda chosen: chosen, turned=lambda chosen, tips: chosen, both=len,
        shortened=lambda chosen, tips: chosen, opens=lambda chosen: opens,
    )  # fmt: skip
    monkeypatch.setattr(symmetric_cut, "_begun", lambda half: (0, tips[0]))
    monkeypatch.setattr(symmetric_cut, "log_scale", lambda component, chosen: chosen)
    monkeypatch.setattr(symmetric_cut, "spread", lambda component, scale: next(seen))
    following = lambda half, chosen, t, scale: None if chosen == 2 else (chosen + 1, tips[chosen + 1])  # noqa: E731
    monkeypatch.setattr(symmetric_cut, "_continued", following)
    found = symmetric_cut.symmetric_cut(half, 9, 1.0)
    ends = {3: 1 if spreads[1] < 1 else None, 5: 2}[len(spreads)]
    assert found == ((ends, ends) if opens and ends is not None else None)
    # With as many tips as may be no spread is asked for.
    monkeypatch.setattr(symmetric_cut, "spread", lambda *_: 99.0)
    assert symmetric_cut.symmetric_cut(half, 2, 1.0) == ((2, 2) if opens else None)


def test_without_polygons_areas_have_no_forms():
    V, F = meshes.grid(3, 3)
    faces = elements(V, F, face_areas(V, F))
    a, b = faces.derivatives(V[:, 0] + 1j * V[:, 1])
    assert faces.alone is None and area_forms_of(faces, a, b, 1.0).tolist() == [[0, 0, 0]] * len(F)


def test_inner_folds_are_straightened_where_nothing_is_held(monkeypatch):
    V, F = meshes.grid(7, 7)
    boundary = np.zeros(len(V), bool)
    boundary[boundary_loops(F)[0]] = True
    inner = int(np.linalg.norm(V - V.mean(axis=0), axis=1).argmin())
    uv = V[:, :2].copy()
    uv[inner] += 2.2 * (V[:, 0].max() - V[:, 0].min()) / 7
    sign = np.sign(signed_areas(V[:, :2], F)[0])
    assert (sign * signed_areas(uv, F) <= 0).any()
    turned = F if sign > 0 else F[:, ::-1]
    found = local_untangle.inner_folds_straightened(uv, turned, boundary)
    assert (signed_areas(found, turned) > 0).all() and np.array_equal(found[boundary], uv[boundary])
    held = boundary.copy()
    held[inner] = True
    assert np.array_equal(local_untangle.inner_folds_straightened(uv, turned, held)[inner], uv[inner])

    def fails(*_):
        raise errors.PrecisionError("no")

    monkeypatch.setattr(local_untangle, "solve_general", fails)
    weights = local_untangle._mean_value_matrix(uv, turned)
    assert local_untangle._solved(uv, weights, np.array([inner])) is uv


@pytest.mark.parametrize("fails", [0, 1, 2, None])
def test_evened_maps_are_the_best_before_double_precision_ends(fails, monkeypatch):
    V, F = meshes.bumpy(9, 9)
    loop = boundary_loops(F)[0]
    angle = 2 * np.pi * np.arange(len(loop)) / len(loop)
    uv = tutte.tutte(V, F, loop, np.column_stack([np.cos(angle), np.sin(angle)]))
    faces = elements(V, F, face_areas(V, F))
    whole, calls = tutte._Means.of, []

    def weighted(*given):
        calls.append(None)
        if fails is not None and len(calls) > fails:
            raise errors.PrecisionError("no")
        return whole(*given)

    monkeypatch.setattr(tutte._Means, "of", weighted)
    monkeypatch.setattr(tutte, "_goes_on", lambda *_: True)
    found = tutte.evened_tutte(V, loop, uv, faces, 1.0, patient=lambda: True)
    if fails == 0:
        assert np.array_equal(found, uv)
    else:
        assert not np.array_equal(found, uv) and np.array_equal(found[loop], uv[loop])
    if fails is not None:
        assert len(calls) == fails + 1
        assert tutte.evened_tutte(V, loop, uv, faces, 1.0, 0.0, patient=lambda: True) is None


@pytest.mark.parametrize(
    ("counts", "rounds"), [([0], 0), ([1, 0], 1), ([2, 1, 2, 0], 3), ([3], 0), ([1] * 9, 5), ([2, 3, 0], 1)]
)
def test_few_folds_of_symmetric_maps_are_straightened_and_averaged_again(counts, rounds, monkeypatch):
    """Of 250 triangles, 2 are a hundredth or less, and 3 are more."""
    V, F = meshes.grid(3, 3)
    at, calls = [0], []

    def folded(dets):
        at[0] += 1
        return np.arange(9) < counts[at[0] - 1]

    class Many(np.ndarray):
        pass

    triangles = np.concatenate([F] * 40)[:250]
    faces = SimpleNamespace(part=None, triangles=triangles, derivatives=lambda w: (w, w), folded=folded)
    monkeypatch.setattr(mirrored_motion, "boundary_edges", lambda triangles: np.array([[0, 1]]))

    def straightened(uv, triangles, outline):
        calls.append(np.flatnonzero(outline).tolist())
        return uv + [1, 0]

    monkeypatch.setattr(mirrored_motion, "inner_folds_straightened", straightened)
    symmetry = SimpleNamespace(averaged=lambda w: w + 1j)
    found = mirrored_motion._straightened(symmetry, np.zeros(9, complex), faces)
    assert found.tolist() == [rounds * (1 + 1j)] * 9 and calls == [[0, 1]] * rounds


@pytest.mark.parametrize("last", ["apart", "stuck"])
def test_what_lets_edges_cross_is_taken_back(last, monkeypatch):
    before, loop = np.arange(5) + 0j, np.arange(5)
    w = before + 1
    pairs = iter([np.array([[0, 2]]), np.array([[2, 3]]), np.array([[0, 2]]) if last == "stuck" else [], []])
    asked = []

    def crossings(old, step, loop, shares):
        asked.append((step.copy(), shares))
        return next(pairs)

    monkeypatch.setattr(vertex_sweeps, "crossings_on_the_way", crossings)
    monkeypatch.setattr(vertex_sweeps, "loop_edges", lambda loop: (loop, np.roll(loop, -1)))
    vertex_sweeps._uncross(w, before, loop)
    # The edges 0-1 and 2-3, and then 2-3 and 3-4; all of the loop if that did not help.
    assert w.tolist() == [0, 1, 2, 3, 4]
    assert [a[0].real.tolist() for a in asked[:3]] == [[1] * 5, [0, 0, 0, 0, 1], [0] * 5]
    assert asked[0][1] == (1.0, 6.0) and len(asked) == 3


@pytest.mark.parametrize(("kind", "boundary"), [("conformal", "square"), ("conformal", "free"), ("polar", "square")])
@pytest.mark.parametrize("folds", [0, 2])
def test_maps_by_name_tell_what_they_are_not(kind, boundary, folds, monkeypatch):
    from omt_uv.solver.canonical import named_maps
    from omt_uv.solver.progress import RunLog

    asked = []
    found = SimpleNamespace(uv=np.zeros((4, 2)), conformal=None, cells=None, warnings=())
    monkeypatch.setattr(named_maps, "conformal_map", lambda problem: asked.append(problem) or done(found))
    monkeypatch.setattr(named_maps, "polar_map", lambda problem, balance: asked.append(problem) or done(found))
    monkeypatch.setattr(chart_map, "measured_chart", lambda *_: SimpleNamespace(folds=folds))
    monkeypatch.setattr(chart_map, "placed_chart", lambda *given: given)
    monkeypatch.setattr(chart_map, "_stages", lambda placed, *_: placed)
    monkeypatch.setattr(chart_map, "replace", lambda placed, status: (status, placed))
    disk = SimpleNamespace(vertices=np.zeros((4, 3)), triangles=None, target=None, boundary=boundary, corners=None)
    options, log = SimpleNamespace(kind=kind, aspect=3.0, balance=0.5), RunLog()
    chart = SimpleNamespace(vertices=np.zeros((3, 3)))
    (status, placed), _ = told(chart_map._named_map(chart, disk, 1.0, options, None, log))
    assert status == kind and len(placed[0]) == 3 and placed[-1] == (boundary == "free")
    assert asked[0].aspect == (1.0 if (kind, boundary) == ("polar", "square") else 3.0)
    said = [text for text in log.warnings if "rectangle of its own aspect" in text]
    assert bool(said) == ((kind, boundary) == ("conformal", "square"))
    assert [text for text in log.warnings if text.startswith(f"{folds} ")] == [f"2 {chart_map.FOLDED}"] * (folds > 0)
    assert set(log.seconds) == {kind, "measure"}


# ---- registration --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("flat", [True, False])
def test_coarse_triangles_of_places_are_turned_outwards_and_leave_none_out(flat):
    places = np.random.default_rng(0).normal(size=(20, 2 if flat else 3))
    places /= 1 if flat else np.linalg.norm(places, axis=1)[:, None]
    found = coarse_meshes._delaunay(places)
    assert set(found.ravel().tolist()) == set(range(20))
    if flat:
        assert (signed_areas(places, found) > 0).all()
    else:
        assert (np.linalg.det(places[found]) > 0).all() and len(found) == 2 * 20 - 4
    # A place that is there twice, or within the hull of the others, is left out.
    assert coarse_meshes._delaunay(np.concatenate([places, places[:1]])) is None
    twice = np.concatenate([places[:9], places[:1]])
    V, none = np.random.default_rng(1).normal(size=(10, 3)), np.zeros(0, int)
    assert coarse_meshes.coarse_mesh(V, twice, np.array([3, 0]), none, 10) is None
    found = coarse_meshes.coarse_mesh(V, places[:10], np.array([3, 0]), none, 10)
    assert found.chosen[found.landmarks].tolist() == [3, 0] and sorted(found.chosen.tolist()) == list(range(10))
    assert np.array_equal(found.domain, places[found.chosen])


@pytest.mark.parametrize(
    ("folds", "laid", "fresh"), [([0], False, False), ([9, 5, 2, 1, 0], False, False), ([5] * 9, True, False),
                                 ([5, 5, 5, 5, 5, 3, 2, 1, 0], True, True)],
)  # fmt: skip
def test_folds_that_stay_are_laid_out_anew(folds, laid, fresh, monkeypatch):
    """Places tell by their size how often they were straightened, and by their sign whether they were laid out."""
    asked = []

    def each_spot(before, triangles, after, held, rings):
        asked.append(rings)
        return done(after + 1)

    def volumes(places, triangles):
        k = int(places[0, 0])
        return np.where(np.arange(9) < folds[min(k % 100, len(folds) - 1)], -1.0, 1.0)

    monkeypatch.setattr(coarse_meshes, "untangle_spots", each_spot)
    monkeypatch.setattr(coarse_meshes, "signed_volumes", volumes)
    monkeypatch.setattr(coarse_meshes, "vertices_around", lambda triangles, folded, n, rings: np.ones(n, bool))
    spots = []
    monkeypatch.setattr(
        coarse_meshes, "laid_out", lambda before, triangles, after, spot: spots.append(spot) or after + 100
    )
    held = np.array([True, False, False])
    found, _ = told(coarse_meshes.straightened(np.zeros((3, 3)), None, np.zeros((3, 3)), held))
    rounds = len(coarse_meshes.RINGS)
    assert asked == list(coarse_meshes.RINGS) * (2 if laid else 1)
    assert [s.tolist() for s in spots] == [[False, True, True]] * laid
    assert (found == (100 + 2 * rounds if fresh else rounds)).all()
    plane = np.zeros((3, 2))
    assert told(coarse_meshes.straightened(plane, None, plane, held))[0] is plane


def test_vertices_gather_at_weighted_means_of_the_faces_around_them(monkeypatch):
    V, F = meshes.grid(3, 3)
    domain = V[:, :2] ** 2 + 0.1 * V[:, :2]
    n, off = len(V), np.linspace(0, 2, len(F))
    free = np.arange(n) % 2 == 0
    folds = iter([[0], []])
    puts = []

    def folded(trial, triangles):
        return np.isin(np.arange(len(triangles)), next(folds))

    carrier = SimpleNamespace(within=lambda places: places + 0.0, folded=folded, place=lambda places: places)
    placed = InPlace(V.copy(), domain, np.zeros(n, int), np.zeros((n, 3)))
    monkeypatch.setattr(InPlace, "put", lambda self, vertices, places, take: puts.append((vertices, places, take)))
    gathering._moved(SimpleNamespace(carrier=carrier), placed, F, off, free.copy())
    ((vertices, places, take),) = puts
    area = np.abs(signed_areas(domain, F))
    stays = set(F[0].tolist())
    assert vertices.tolist() == [v for v in range(n) if free[v] and v not in stays] and take.all()
    for v, place in zip(vertices, places, strict=True):
        rows = [t for t in range(len(F)) if v in F[t]]
        weight = np.array([area[t] * (1 + off[t] ** 2) for t in rows])
        centres = np.array([domain[F[t]].mean(axis=0) for t in rows])
        assert place == pytest.approx(weight @ centres / weight.sum())
    # Where folds never end, all stay.
    always = SimpleNamespace(within=lambda places: places, folded=lambda trial, t: np.ones(len(t), bool), place=None)
    monkeypatch.setattr(gathering, "RESTORING", 0)
    assert gathering._moved(SimpleNamespace(carrier=always), placed, F, off, free.copy()) is placed


@pytest.mark.parametrize(("rounds", "ends"), [([[0], [1], []], True), ([[0], [1], [2], [3]], False)])
def test_vertices_of_folds_stay_where_they_were(rounds, ends, monkeypatch):
    triangles = np.array([[0, 1, 2], [2, 3, 4], [4, 5, 6], [6, 7, 8]])
    at = iter(rounds)
    monkeypatch.setattr(surface_newton, "RESTORING", len(rounds) - (not ends))

    def places(value):
        return InPlace(np.full((9, 3), value), np.full((9, 2), value), np.full(9, value), np.full((9, 3), value))

    folded = lambda after, t: np.isin(np.arange(4), next(at))  # noqa: E731
    problem = SimpleNamespace(faces=SimpleNamespace(triangles=triangles), carrier=SimpleNamespace(folded=folded))
    before, after = places(0), places(1)
    found = surface_newton.without_folds(problem, before, after)
    if ends:
        assert found.faces.tolist() == [0, 0, 0, 0, 0, 1, 1, 1, 1] and (found.positions[:, 0] == found.faces).all()
    else:
        assert found is before


@pytest.mark.parametrize(
    ("lower", "predicted", "steps"),
    [
        ([90, 80, 70], [9, 9, 9], 3),
        ([90, None], [9], 1),
        # Little is promised, or little was gained.
        ([90, 80], [9, 0.79], 2),
        ([90, 89.911], [9, 9], 2),
        ([90, 89.909, 80], [9, 9, 9], 3),
    ],
)
def test_newton_steps_on_a_surface_end_where_little_is_gained(lower, predicted, steps, monkeypatch):
    values = iter(zip(lower, [*predicted, 0], strict=False))

    def step(problem, placed, value):
        low, promise = next(values)
        return None if low is None else (placed + 1, low, promise)

    monkeypatch.setattr(surface_newton, "_step", step)
    problem = SimpleNamespace(energy=lambda placed: 100.0, left_out=None)
    (placed, count), fractions = told(surface_newton.minimise_on(problem, 0, 3, 0.01, "A"))
    assert placed == count == steps and fractions == pytest.approx(np.arange(len(fractions)) / 3)
    assert len(fractions) == steps + (None in lower)


def test_arcs_that_contradict_each_other_are_no_way():
    def arcs(following, other):
        return SimpleNamespace(chart=np.zeros(len(following)), following=np.array(following), other=np.array(other))

    one = arcs([1, 2, 3, 0], [2, -1, 0, -1])
    assert seam_arcs._from_first(one, one, 0).tolist() == [0, 1, 2, 3]
    assert seam_arcs._from_first(one, one, 2).tolist() == [2, 3, 0, 1]
    # A free side goes to no side that is sewn on, and what is opposite goes to what is opposite.
    assert seam_arcs._from_first(one, one, 1) is None
    assert seam_arcs._from_first(one, arcs([1, 2, 3, 0], [1, -1, 0, -1]), 0) is None
    # All of them go somewhere, and no two to the same.
    assert seam_arcs._from_first(arcs([1, 0, 3, 2], [-1] * 4), arcs([1, 0, 3, 2], [-1] * 4), 0) is None
    assert seam_arcs._from_first(arcs([1, 2, 3, 0], [-1] * 4), arcs([1, 0, 3, 2], [-1] * 4), 0) is None


def test_no_pairs_are_met_by_a_map_that_changes_nothing():
    z = np.array([0.1 + 0.2j, -0.5j])
    none = np.zeros(0, complex)
    assert alignment.moebius_of_pairs(none, none)(z).tolist() == z.tolist()
    assert alignment.moebius_of_pairs(none, none, True)(z).tolist() == z.conj().tolist()


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("edges", [0, 1, None])
def test_charts_are_cut_along_images_of_cuts_where_there_come_to_be_no_more_of_them(count, edges, monkeypatch):
    cuts, more = SimpleNamespace(edges=np.zeros((1, 2), int)), SimpleNamespace(edges=np.ones((2, 2), int))

    @dataclass(frozen=True)
    class Charts:
        charts: list
        cuts: object

    charts = [SimpleNamespace(patches=[])] * 2
    prepared, surface = Charts(charts, cuts), SimpleNamespace(seams=np.zeros((3, 2), int))
    found = Charts(list(range(count)), None if edges is None else SimpleNamespace(edges=np.zeros((edges, 2), int)))
    asked = []

    def disk_charts(surface, faces, **given):
        asked.append((surface, given))
        return done(found)

    flat = [False, True]
    monkeypatch.setattr(mirrored_charts, "_is_flat", lambda chart: flat.pop())
    monkeypatch.setattr(mirrored_charts, "with_images", lambda surface, faces, cuts: more)
    monkeypatch.setattr(mirrored_charts, "disk_charts", disk_charts)
    monkeypatch.setattr(mirrored_charts, "replace", lambda of, **more: SimpleNamespace(**(vars(of) | more)))
    result, _ = told(mirrored_charts.cut_alike(surface, None, prepared, {"given": 1}))
    ((cut, given),) = asked
    assert given == {"extremities": 0, "given": 1} and cut.seams.tolist() == [[0, 0]] * 3 + [[1, 1]] * 2
    if count == 2 and edges == 0:
        assert result.charts == [0, 1] and result.cuts is more
    else:
        assert result is prepared
    # Nothing to do: no cuts, holes, what unrolls, and cuts that are their own images.
    flat[:] = [True, True]
    steps = [Charts(charts, None), Charts(charts, found.cuts and SimpleNamespace(edges=np.zeros((0, 2)))),
             Charts([*charts, SimpleNamespace(patches=[1])], cuts), prepared]  # fmt: skip
    for one in steps:
        assert told(mirrored_charts.cut_alike(surface, None, one, {}))[0] is one
    flat[:] = [False, False]
    monkeypatch.setattr(mirrored_charts, "with_images", lambda surface, faces, cuts: cuts)
    assert told(mirrored_charts.cut_alike(surface, None, prepared, {}))[0] is prepared and len(asked) == 1
