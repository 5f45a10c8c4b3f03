"""Which ways pipelines take from their solvers to what they hand on, with solvers that are written in advance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import done, told

from omt_uv.pipelines import globe, magnify, subdivision
from omt_uv.pipelines import refine as refinement
from omt_uv.pipelines.layout import Refusal
from omt_uv.pipelines.measuring import region_figures
from omt_uv.pipelines.regions import several
from omt_uv.pipelines.shapes import onto
from omt_uv.settings import RefineSettings
from omt_uv.solver.errors import FoldedUVError, MeshError
from omt_uv.solver.progress import drain

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def chart_of(scale=1.0, shift=0.0):
    return SimpleNamespace(
        patches=np.zeros((0, 3), int),
        vertices=SQUARE * scale + shift,
        triangles=HALVES,
        faces=np.array([0, 1]),
        corners=HALVES,
        vertex_ids=np.arange(4),
    )


def island_of(scale=1.0, shift=0.0):
    chart = chart_of(scale, shift)
    return SimpleNamespace(chart=chart, uv=chart.vertices[:, :2].copy())


# ---- several regions -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("after", "said"), [(0.4 * 1.0049, 0), (0.4 * 1.0051, 1), (0.4 * 0.9949, 1), (0.4, 0)])
def test_shares_that_are_missed_by_half_a_percent_are_told(after, said):
    found = several.JointShares(("eyes", "mouth"), np.array([0.1, 0.2]), np.array([0.4, 0.3]), np.array([after, 0.3]))
    assert len(found.warnings()) == said and (not said or found.warnings()[0].startswith("eyes has"))
    assert found.report()[1] == {"region": "mouth", "before": 0.2, "asked": 0.3, "after": 0.3}
    assert found.said()[1] == ("mouth", "20.000 % to 30.000 %")
    assert "mouth from 20 % to 30 % (30 % asked)" in found.text()


@pytest.mark.parametrize("boundary", ["own", "free", "disk"])
@pytest.mark.parametrize("outlines", [("sides", "circle"), ("sides", "free")])
def test_each_island_has_its_part_of_the_progress_and_the_regions_that_are_on_it(boundary, outlines, monkeypatch):
    islands = [island_of(), island_of(2.0, 5.0)]
    islands[1].chart.triangles = np.concatenate([HALVES, HALVES, HALVES])
    weights = [np.array([[0.0, 1], [1, 1]]), np.array([[0.0, 1, 1, 1, 1, 1], [0, 0, 0, 0, 0, 1]])]
    regions = [several.NamedRegion("eyes", 2.0, (None, None)), several.NamedRegion("mouth", 3.0, (None, None))]
    asked = []

    def magnified(uv, triangles, weights, factors, **options):
        asked.append((weights.tolist(), factors, options["boundary"]))
        k = len(asked) - 1
        found = SimpleNamespace(uv=uv + 1, outline=outlines[k], warnings=(f"island {k}",))
        return done(found, 0.0, 1.0)

    monkeypatch.setattr(
        several, "_islands", lambda regions: ([(1, islands[0], weights[0]), (0, islands[1], weights[1])], [])
    )
    monkeypatch.setattr(several, "magnify_regions", magnified)
    monkeypatch.setattr(several, "grown_together", lambda placed: "grown")
    monkeypatch.setattr(several, "corner_uvs", lambda count, placed: (count, [p.uv for p in placed]))
    monkeypatch.setattr(several, "_report", lambda f: f.owner)
    shares = several.JointShares(("a",), np.array([0.1]), np.array([0.2]), np.array([0.3]))
    monkeypatch.setattr(several, "_overall", lambda regions, found: shares)
    settings = replace(several.MagnifySettings(cascade=2), boundary=boundary)
    steps = several._from_uv(regions, settings)
    if boundary == "disk":
        with pytest.raises(Refusal) as caught:
            told(steps)
        assert caught.value.index == 0 and "keep the outline" in str(caught.value)
        return
    found, fractions = told(steps)
    assert fractions == pytest.approx([0, 0.25, 0.25, 1]) and found.corners == 2
    assert asked == [([[0, 1]], [4.0], boundary), (weights[1].tolist(), [4.0, 9.0], boundary)]
    assert found.reports == [[0], [1]]
    texts = [(1, "island 0"), (0, "island 1"), *[(-1, "grown")] * ("free" in outlines), (-1, shares.warnings()[0])]
    assert found.warnings == texts


def test_islands_are_those_on_which_a_region_begins_or_ends(monkeypatch):
    made = {0: [island_of(), island_of()], 1: [island_of()]}
    table = {(0, 0): [[0, 1], [1, 1]], (0, 1): [[1, 1], [0, 0]], (1, 0): [[0, 0], [0.2, 0.3]]}

    def islands_of(index, part):
        return SimpleNamespace(warnings=[f"of {index}"], islands=made[index])

    def part(index, region):
        return SimpleNamespace(surface=index, of_triangles=lambda rows: np.array(table[rows][region], float))

    regions = [several.NamedRegion(n, 2.0, (part(0, r), part(1, r))) for r, n in enumerate(("eyes", "mouth"))]
    monkeypatch.setattr(several, "islands_of", islands_of)
    monkeypatch.setattr(
        several,
        "triangle_rows",
        lambda surface, chart: (surface, next(k for k, i in enumerate(made[surface]) if i.chart is chart)),
    )
    found, warnings = several._islands(regions)
    assert [(index, made[index].index(island)) for index, island, _ in found] == [(0, 0), (1, 0)]
    assert warnings == [(0, "of 0"), (1, "of 1")]
    table[0, 0][0] = [1, 1]
    with pytest.raises(Refusal) as caught:
        several._islands(regions)
    assert caught.value.index == 0 and "eyes" in str(caught.value)


@pytest.mark.parametrize("grown", [1, 3])
def test_shares_of_all_islands_are_by_the_areas_that_they_had(grown):
    def one(scale, weights, here, target):
        island = island_of(scale)
        result = SimpleNamespace(
            uv=island.uv * [1, grown if scale > 1 else 1],
            target=SimpleNamespace(target_shares=np.array(target), density=np.ones(2)),
        )
        return several._JointIsland(0, island, np.array(weights, float), np.array(here), result)

    found = [one(1.0, [[1, 0], [1, 1]], [True, False], [0.8]), one(2.0, [[0, 0], [0, 1]], [False, True], [0.7])]
    regions = [several.NamedRegion("eyes", 2.0, ()), several.NamedRegion("mouth", 3.0, ())]
    shares = several._overall(regions, found)
    # Areas 1 and 4; of the first island half is in the first region, and all of it in the second.
    assert shares.before == pytest.approx([0.1, 0.2 + 0.4]) and shares.after == pytest.approx(shares.before)
    assert shares.target == pytest.approx([0.16, 0.2 + 0.56]) and shares.names == ("eyes", "mouth")
    assert several._target(found[0]) == pytest.approx([0.8, 1])


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("balance", [0.0, 0.1])
@pytest.mark.parametrize("misses", [[0.1, 0.0011, 0.0009], [0.1, 0.0009], [0.1, 0.1, 0.1]])
def test_meshes_are_unwrapped_again_for_what_is_missed_of_the_shares(exact, balance, misses, monkeypatch):
    asked, plans = [], []

    @dataclass
    class Density:
        factors: list
        density = np.array([1.0, 2.0])
        shares_before = np.array([0.2, 0.8])
        target_shares = np.array([0.4, 0.6])

    def lay_out(jobs, settings):
        asked.append(settings.boundary)
        layout = SimpleNamespace(corners=[0], uv=[0], warnings=[(0, "of the layout")], maps=[])
        return done(layout, 0.0, 1.0)

    def shares_of(weights, area):
        return np.array([0.4, 0.6]) / (1 + misses[len(asked) - 1])

    part = SimpleNamespace(of_triangles=lambda rows: np.array([1.0, 0.0]))
    regions = [several.NamedRegion("eyes", 2.0, (part,)), several.NamedRegion("mouth", 0.75, (part,))]
    monkeypatch.setattr(several, "region_triangles", lambda part: (np.arange(2), np.ones(2), None))
    monkeypatch.setattr(
        several, "joint_density", lambda w, a, factors, exact=True: plans.append(factors) or Density(factors)
    )
    monkeypatch.setattr(several, "_jobs", lambda surfaces, parts, density, exponent: [exponent])
    monkeypatch.setattr(several, "lay_out", lay_out)
    monkeypatch.setattr(several, "uv_areas", lambda *_: np.ones(2))
    monkeypatch.setattr(several, "shares_of", shares_of)
    settings = replace(several.MagnifySettings(exact=exact), boundary="own", balance=balance)
    found, fractions = told(several._from_mesh(regions, settings))
    rounds = len(misses) if exact and balance == 0 else 1
    assert asked == ["free"] * rounds and fractions == pytest.approx([x / 3 for k in range(rounds) for x in (k, k + 1)])
    assert plans[0] == [2.0, 0.75]
    for factors, missed in zip(plans[1:], misses, strict=False):
        assert factors == pytest.approx([2 * (1 + missed), 0.75 * (1 + missed)])
    assert found.warnings[0] == (0, "of the layout") and len(found.warnings) == 1 + 2 * (misses[rounds - 1] > 0.005)


@pytest.mark.parametrize("flat", [True, False])
def test_targets_of_surfaces_are_their_parts_of_what_is_asked_of_all(flat):
    surfaces = [
        SimpleNamespace(
            surface=SimpleNamespace(triangles=np.zeros((n, 3), int)),
            faces=k,
            pins=None,
            subdivision=None,
            axes=None,
            was_split=False,
        )
        for k, n in enumerate((3, 2))
    ]
    parts = [(np.array([0, 2]), np.ones(2), None), (np.array([1]), np.ones(1), None)]
    exponent = np.zeros(3) if flat else np.array([-1.0, 1.0, 3.0])
    jobs = several._jobs(surfaces, parts, np.array([2.0, 3.0, 4.0]), exponent)
    full, inside = zip(*(tuple(vars(job.target).values())[:2] for job in jobs), strict=True)
    assert [f.tolist() for f in full] == [[2, 1, 3], [1, 4]]
    if flat:
        assert inside == (None, None)
    else:
        assert [i.tolist() for i in inside] == [[0, 0, 0.5], [0, 1]]


# ---- one region ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("outline", ["circle", "sides", "free", "disk"])
def test_islands_are_magnified_in_turn_and_may_grow_together(outline, monkeypatch):
    islands = [(1, island_of()), (0, island_of(2.0))]
    islands[1][1].chart.triangles = np.concatenate([HALVES] * 3)

    def one(owner, island, weights, settings):
        magnified = magnify._MagnifiedIsland(
            owner, island, weights, np.ones(2), None, island.uv + 1, outline if owner else "sides", 3
        )
        return done((magnified, (f"of {owner}",)), 0.0, 1.0)

    monkeypatch.setattr(magnify, "_islands", lambda regions: (islands, [(0, "first")]))
    monkeypatch.setattr(magnify, "_weights_of", lambda region, island: region)
    monkeypatch.setattr(magnify, "_magnified", one)
    monkeypatch.setattr(magnify, "grown_together", lambda placed: "grown")
    monkeypatch.setattr(magnify, "corner_uvs", lambda count, placed: (count, [p.uv for p in placed]))
    monkeypatch.setattr(magnify, "_report", lambda p: p.region)
    shares = SimpleNamespace(warnings=lambda: ["missed"])
    monkeypatch.setattr(magnify, "_overall", lambda magnified: shares)
    found, fractions = told(magnify._from_uv(["a", "b"], magnify.MagnifySettings()))
    assert fractions == pytest.approx([0, 0.25, 0.25, 1]) and found.corners == 2 and found.reports == [["a"], ["b"]]
    grown = [(-1, "grown")] * (outline not in ("circle", "sides"))
    assert found.warnings == [(0, "first"), (1, "of 1"), (0, "of 0"), *grown, (-1, "missed")]

    def fails(*_):
        return done(FoldedUVError("folded", kind="face", elements=np.array([1])))

    monkeypatch.setattr(magnify, "_magnified", fails)
    with pytest.raises(Refusal) as caught:
        told(magnify._from_uv(["a", "b"], magnify.MagnifySettings()))
    assert caught.value.index == 1


@pytest.mark.parametrize("painted", [[1, 1], [2, 2], [0, 2], [0, 0]])
def test_islands_that_are_painted_all_over_stay_and_are_counted(painted, monkeypatch):
    """Of the first surface that many islands are painted all over, of the second one in part."""
    whole, partly = painted
    weights = [np.ones(2)] * whole + [np.zeros(2)] + [np.array([0, 0.5])] * partly
    islands = [island_of() for _ in weights]
    regions = [SimpleNamespace(weights=np.array([0.0, 1.0]), kind="vertex")]
    monkeypatch.setattr(
        magnify, "islands_of", lambda index, region: SimpleNamespace(warnings=["told"], islands=islands)
    )
    monkeypatch.setattr(
        magnify, "_weights_of", lambda region, island: weights[next(k for k, i in enumerate(islands) if i is island)]
    )
    if not partly:
        with pytest.raises(Refusal) as caught:
            magnify._islands(regions)
        assert caught.value.index == 0
        return
    found, warnings = magnify._islands(regions)
    assert [i for _, i in found] == islands[whole + 1 :] and warnings[0] == (0, "told")
    begins = {0: [], 1: ["An island is painted"], 2: ["2 islands are painted"]}[whole]
    assert [text[: len(b)] for (_, text), b in zip(warnings[1:], begins, strict=True)] == begins


# ---- globes --------------------------------------------------------------------------------------------------


def test_layouts_are_scaled_into_the_tile_as_far_as_they_reach_beyond_it():
    uv = np.array([[0.2, 0.4], [0.8, 0.6]])
    assert globe.inside_tile(uv).tolist() == uv.tolist()
    assert globe.inside_tile(np.array([[-0.5, 0.5], [1.0, 0.5]])).tolist() == [[0, 0.5], [1, 0.5]]
    assert globe.inside_tile(np.array([[0.5, 0.0], [0.5, 2.0]])).tolist() == [[0.5, 0], [0.5, 1]]
    assert globe.inside_tile(np.array([[-1.0, -1], [1, 3]])).tolist() == [[0, 0], [1, 1]]


def test_poles_within_faces_and_folds_near_them_are_told():
    assert globe._pole_warnings(0, 0) == []
    one, two = globe._pole_warnings(1, 2)
    assert one.startswith("A pole of the projection lies within") and two.startswith("2 faces are folded")
    assert [t[:8] for t in globe._pole_warnings(2, 1)] == ["2 poles ", "A face i"]


def test_shares_of_polygons_are_split_among_their_triangles_as_on_the_sphere():
    component = SimpleNamespace(faces=np.array([7, 7, 9, 9, 4]))
    shares, on_sphere = np.array([0.1, 0.3, 0.2, 0.2, 0.2]), np.array([0.05, 0.15, 0.3, 0.1, 0.0])
    found = globe._as_on_sphere(component, shares, on_sphere)
    assert found == pytest.approx([0.1 * 0.6, 0.3 * 0.6, 0.3 * 0.6, 0.1 * 0.6, 0])


@pytest.mark.parametrize("balance", [0.0, 0.5])
@pytest.mark.parametrize("density", [None, np.array([9.0, 1.0, 2.0])])
def test_a_globe_is_mapped_with_its_holes_filled_and_laid_out_without_them(balance, density, monkeypatch):
    V = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    component = SimpleNamespace(
        vertices=V, centres=np.array([[0.0, 0, -1]]), triangles=np.array([[0, 1, 2], [0, 2, 1]]),
        members=np.array([1, 2]), fans=np.array([[1, 0, 3]]), faces=np.array([0, 1]),
        corners=np.array([[0, 1, 2], [3, 4, 5]]),
    )  # fmt: skip
    asked = []
    found = SimpleNamespace(positions=np.concatenate([V, -V[:1]]), warnings=("of the map",))

    def sphere_map(vertices, triangles, density, **options):
        asked.append((vertices, triangles, density, options))
        return done(found, 0.0, 1.0)

    def laid_out(points, polygons, shares, settings):
        asked.append((points, shares))
        return done((np.array([[0.0, 0], [0, 1], [1, 0]]), points, 1), 0.0, 1.0)

    monkeypatch.setattr(globe, "sphere_map", sphere_map)
    monkeypatch.setattr(
        globe, "replace", lambda found, positions: SimpleNamespace(**(vars(found) | {"positions": positions}))
    )
    monkeypatch.setattr(globe, "_rotation", lambda component, positions, markers: np.eye(3)[[1, 0, 2]])
    monkeypatch.setattr(
        globe, "gather_polygons", lambda *_: (SimpleNamespace(triangles=np.array([[0, 1, 2], [0, 2, 1]])), "corners")
    )
    monkeypatch.setattr(globe, "spherical_areas", lambda points, triangles: np.array([1.0, 3.0]))
    monkeypatch.setattr(
        globe, "_shares", lambda component, density: ("shares", None if density is None else density.tolist())
    )
    monkeypatch.setattr(globe, "_as_on_sphere", lambda component, shares, on_sphere: ("on the sphere", shares))
    monkeypatch.setattr(globe, "_laid_out", laid_out)
    settings = SimpleNamespace(balance=balance, quality="draft", method="transport")
    made, fractions = told(globe._globe(component, SimpleNamespace(density=density, markers=None), settings))
    (vertices, triangles, mass, options), (points, shares) = asked
    assert len(vertices) == 4 and triangles.tolist() == [[0, 1, 2], [0, 2, 1], [1, 0, 3]]
    assert mass is None if density is None else mass.tolist() == [1, 2, 1]
    assert options["polygons"].tolist() == [0, 1, 2] and options["balance"] == balance
    assert points.tolist() == V[:, [1, 0, 2]].tolist() and len(made.sphere.positions) == 3
    mine = ("shares", None if density is None else [1.0, 2.0])
    if balance == 0:
        assert shares == ("on the sphere", mine)
    else:
        assert shares == pytest.approx(np.array([1, 3]) / (4 * np.pi))
    assert fractions == pytest.approx([0, globe.MAPPING, globe.MAPPING, 1]) and made.shares == mine
    # One of the triangles is turned over in the plane, though not on the sphere.
    assert len(made.warnings) == 3 and made.warnings[0] == "of the map" and made.warnings[2].startswith("A face is")


# ---- refinement ----------------------------------------------------------------------------------------------


def refined_island(scale=1.0, spread=1.0, fixed=False, pins=None, owner=0, density=None):
    chart = chart_of(scale)
    done = SimpleNamespace(uv=spread * SQUARE[:, :2] + 3, iterations=4, residual=0.5, status="converged",
                           warnings=("w",), overlap=0.25, area_weight=2.0)  # fmt: skip
    return refinement._RefinedIsland(owner, SimpleNamespace(chart=chart, uv=SQUARE[:, :2]), pins, fixed, done, density)


def test_islands_of_no_fixed_scale_have_one_density():
    pin = SimpleNamespace(vertices=np.array([1]), places=np.array([[4.0, 3.0]]))
    islands = [refined_island(1.0, 1.0), refined_island(2.0, 1.0), refined_island(1.0, 7.0, fixed=True),
               refined_island(1.0, 2.0, pins=pin)]  # fmt: skip
    found = refinement._at_one_density(islands)
    # Areas 1, 4 and 1 in space, and 1, 1 and 4 of UVs: as large as they are together.
    sides = [np.ptp(uv, axis=0) for uv in found]
    for side, area in zip(sides, (1, 4, None, 1), strict=True):
        assert side == pytest.approx([7, 7] if area is None else [np.sqrt(area)] * 2)
    for k in (0, 1):
        assert found[k].mean(axis=0) == pytest.approx([3.5, 3.5])
    # About its pin, which stays: the corner at 4, 3 was at 5, 3.
    assert found[3].mean(axis=0) == pytest.approx(np.array([4.0, 3.0]) + (np.array([4.0, 4.0]) - [4, 3]) / 2)


def test_islands_with_pins_are_not_packed(monkeypatch):
    asked = []

    def pack(uvs, triangles, settings):
        asked.append((len(uvs), len(triangles)))
        return done(SimpleNamespace(islands=[uv + 10 for uv in uvs]))

    monkeypatch.setattr(refinement, "pack_islands", pack)
    pin = SimpleNamespace(vertices=np.array([1]), places=np.zeros((1, 2)))
    islands = [refined_island(), refined_island(pins=pin), refined_island(fixed=True), refined_island()]
    uvs = [np.full((4, 2), float(k)) for k in range(4)]
    found, _ = told(refinement._packed(islands, uvs, None))
    assert [int(uv[0, 0]) for uv in found] == [10, 1, 2, 13] and asked == [(2, 2)]


def test_what_is_wrong_with_an_island_as_a_whole_is_shown_by_its_faces():
    chart = SimpleNamespace(faces=np.array([4, 4, 5]))
    shown = refinement._shown(FoldedUVError("all", "remedy"), chart)
    assert shown.kind == "face" and list(shown.elements) == [0, 1, 2] and shown.cause == "all"
    for error in (FoldedUVError("one", kind="face", elements=[1]), MeshError("other")):
        assert refinement._shown(error, chart) is error


def test_only_surfaces_with_a_modifier_are_refined_on_it(monkeypatch):
    islands = [refined_island(owner=0), refined_island(owner=2), refined_island(owner=2)]
    asked = []

    def on_one(surface, mine, modifier, settings):
        asked.append((surface, len(mine), modifier))
        return done((["better"] * len(mine), ("told",)))

    monkeypatch.setattr(refinement, "_on_subdivision", on_one)
    found, warnings = told(refinement._on_subdivisions(["a", "b", "c"], islands, [None, "m", "n"], None))[0]
    assert found == [islands[0], "better", "better"] and warnings == [(2, "told")] and asked == [("c", 2, "n")]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("keeps", [True, False])
@pytest.mark.parametrize("balance", [0.0, 0.2])
def test_islands_are_refined_on_their_subdivided_surface_and_put_back(mirrored, keeps, balance, monkeypatch):
    pin = SimpleNamespace(vertices=np.array([1]), places=np.zeros((1, 2)))
    islands = [refined_island(spread=2.0), refined_island(pins=pin), refined_island(fixed=True)]
    if mirrored:
        islands[0].refinement.uv = islands[0].refinement.uv * [-1, 1]
    for island in islands:
        island.island.chart.triangles = HALVES
    asked = []

    def refined(surface, found, modifier, pins, boundary, areas_first):
        asked.append((boundary, areas_first, [m.uv for m in found.maps]))
        maps = [SimpleNamespace(uv=0.5 * m.uv + 7, warnings=(f"map {k}",)) for k, m in enumerate(found.maps)]
        return done(SimpleNamespace(maps=maps, warnings=("all",)))

    monkeypatch.setattr(refinement, "refined_on_subdivision", refined)
    monkeypatch.setattr(refinement, "replace", lambda of, **new: SimpleNamespace(**(vars(of) | new)))
    settings = SimpleNamespace(keep_boundary=keeps, balance=balance)
    (better, warnings), _ = told(refinement._on_subdivision(("surface", None, "pins"), islands, "modifier", settings))
    ((boundary, areas_first, uvs),) = asked
    assert (boundary, areas_first) == ("kept" if keeps else "free", balance == 0)
    # As in a mirror: what looks to the other side is mapped as if it did not.
    assert np.array_equal(uvs[0], islands[0].refinement.uv * [-1 if mirrored else 1, 1])
    np.testing.assert_allclose(better[0].refinement.uv, islands[0].refinement.uv, atol=1e-9)
    for k in (1, 2):
        np.testing.assert_allclose(better[k].refinement.uv, 0.5 * islands[k].refinement.uv + 7)
    assert better[1].refinement.warnings == ("w", "map 1") and warnings == ("all", "map 0", "map 1", "map 2")


def test_a_report_of_an_island_has_figures_before_and_after():
    pin = SimpleNamespace(vertices=np.array([1, 2]), places=np.zeros((2, 2)))
    island = refined_island(pins=pin)
    stretched = SQUARE[:, :2] * [2, 1]
    found = refinement._report(island, stretched)
    assert found["vertices"] == 4 and found["faces"] == found["triangles"] == 2 and found["pins"] == 2
    assert found["before"]["angle_mean"] == pytest.approx(1) and found["angle_mean"] == pytest.approx(2)
    assert found["overlap"] == 0.25 and found["status"] == "converged" and found["warnings"] == ["w"]
    assert refinement._report(replace(island, pins=None), stretched)["pins"] == 0


# ---- subdivided surfaces -------------------------------------------------------------------------------------


def stages_of(errors, inner=None, triangles=None):
    """A part whose errors are those of the table, by how often it was refined."""
    triangles = triangles or errors
    return SimpleNamespace(
        elements=lambda *_: None, symmetry=lambda found, uv, fixed: (uv, None), first=[0],
        mapping=SimpleNamespace(matrix=None), area_error=lambda uv: errors[int(uv)],
        inner_error=lambda uv: (inner or {}).get(int(uv), 0.0), triangle_error=lambda uv: triangles[int(uv)],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("errors", "inner", "asked", "weights", "kept"),
    [
        ([1, 0.5, 0.3, 0.009], None, 1e9, [100, 400, 1600], 3),
        # A round that wins less than a quarter is taken back, and ends it.
        ([1, 0.5, 0.3751, 0.1], {1: 0, 2: 0}, 1e9, [100, 400], 1),
        ([1, 0.5, 0.3749, 0.01], None, 1e9, [100, 400, 1600], 3),
        # Weights go up to ten thousand, or to what was asked for.
        ([1, 0.5, 0.3, 0.2, 0.1, 0.05], None, 1e9, [100, 400, 1600, 6400], 4),
        ([1, 0.5, 0.3, 0.2, 0.1], None, 500.0, [100, 400], 2),
        ([1, 0.5, 0.3], None, 50.0, [50], 1),
        # If polygons had their shares nearly all would still be wrong.
        ([1, 0.5, 0.3], {1: 0.3751}, 1e9, [100], 1),
        ([1, 0.5, 0.009], {1: 0.3749}, 1e9, [100, 400], 2),
    ],
)
@pytest.mark.parametrize("areas_first", [True, False])
def test_weights_of_areas_grow_while_that_is_worth_it(errors, inner, asked, weights, kept, areas_first, monkeypatch):
    used, nudged = [], []

    def refine(elements, matrix, start, fixed, weight, symmetry, outlines):
        used.append(weight)
        return done(SimpleNamespace(uv=np.float64(len(used))))

    def nudge(part, refined, weight, stage):
        nudged.append(weight)
        return done(refined)

    monkeypatch.setattr(subdivision, "refine_cage", refine)
    monkeypatch.setattr(subdivision, "_nudged", nudge)
    found, _ = told(
        subdivision._refined_in_stages(
            stages_of(errors, inner), SimpleNamespace(charts=[]), np.float64(0), None, asked, areas_first
        )
    )
    assert used == weights and found == kept
    assert nudged == ([weights[kept - 1]] if areas_first else [])


@pytest.mark.parametrize(
    ("errors", "kept", "count"),
    [
        ([0.0261, 0.01], 0, 0),
        ([0.0259, 0.019], 1, 1),
        ([0.019], 0, 0),
        ([0.025, 0.022, 0.0199], 2, 2),
        # What does not fall, or not far enough, is not taken.
        ([0.025, 0.0251], 0, 1),
        ([0.025, 0.025], 0, 1),
        ([0.025, 0.0249, 0.01], 0, 1),
        ([0.025, 0.0225, 0.0201, 0.0199], 3, 3),
    ],
)
def test_areas_that_nearly_do_get_there_with_a_little_more_weight(errors, kept, count):
    used = []

    def stage(start, weight):
        used.append(weight)
        return done(np.float64(len(used)))

    found, _ = told(subdivision._nudged(stages_of(errors), np.float64(0), 200.0, stage))
    assert found == kept and len(used) == count
    weight, factor = 200.0, 1.5
    for k, value in enumerate(used):
        weight *= factor
        assert value == pytest.approx(weight) and weight <= 8 * 200
        if k + 1 < len(errors) and errors[k + 1] < errors[k]:
            needed = (errors[k + 1] - 0.995 * 0.02) / (errors[k] - errors[k + 1]) * np.log(factor)
            factor = np.exp(min(needed, 8))


# ---- what is carried on to another mesh ------------------------------------------------------------------------


@pytest.mark.parametrize(("weight", "across"), [(-1.1e-9, True), (-1e-9, False), (-0.9e-9, False), (0.5, False)])
def test_corners_beyond_their_triangle_are_continued(weight, across):
    weights = np.full((2, 3, 3), 1 / 3)
    weights[1, 2, 0] = weight
    assert onto._across(SimpleNamespace(corner_weights=weights)).tolist() == [1] * across


def test_layers_of_polygons_have_what_their_first_triangles_have():
    surface = SimpleNamespace(
        corner_vertex=np.arange(7), triangles=np.array([[4, 5, 6], [0, 1, 2], [0, 2, 3]]),
        face_start=np.array([0, 4, 7]), triangle_face=np.array([1, 0, 0]),
    )  # fmt: skip
    corner, face = onto._firsts(surface)
    flat = surface.triangles.ravel()
    assert (
        flat[corner].tolist() == list(range(7)) and corner.tolist() == [3, 4, 5, 8, 0, 1, 2] and face.tolist() == [1, 0]
    )

    @dataclass(frozen=True)
    class Layer:
        domain: str
        values: np.ndarray

    assert onto._of_polygons(Layer("CORNER", 10 * np.arange(9)), corner, face).values.tolist() == [
        30,
        40,
        50,
        80,
        0,
        10,
        20,
    ]
    assert onto._of_polygons(Layer("FACE", np.array([5, 6, 7])), corner, face).values.tolist() == [6, 5]
    points = Layer("POINT", np.arange(3))
    assert onto._of_polygons(points, corner, face) is points


@pytest.mark.parametrize("size", [1.0, 3.0])
def test_offsets_turn_and_grow_as_the_surface_does(size):
    from scipy.spatial.transform import Rotation

    V, F = meshes.icosphere(1)
    V = V * [1, 1.3, 0.8]
    turn = Rotation.from_rotvec([0.4, -0.9, 0.3]).as_matrix()

    @dataclass(frozen=True)
    class Key:
        offsets: np.ndarray

    offsets = np.random.default_rng(0).normal(size=V.shape)
    target = SimpleNamespace(positions=size * V @ turn.T + 5)
    (found,) = onto._turned((Key(offsets),), V, target, SimpleNamespace(triangles=F))
    np.testing.assert_allclose(found.offsets, size * offsets @ turn.T, atol=1e-9)
    assert onto._turned((), V, target, SimpleNamespace(triangles=F)) == ()
    # Where parts grow differently all offsets still grow alike, by the root of the mean square of all edges.
    target = SimpleNamespace(positions=size * V * np.where(V[:, 2:] > 0, 3.0, 1.0))
    (found,) = onto._turned((Key(offsets),), V, target, SimpleNamespace(triangles=F))
    edges = [np.concatenate([p[F[:, k]] - p[F[:, k - 1]] for k in range(3)]) for p in (V, target.positions)]
    old, new = (np.linalg.norm(x) for x in edges)
    np.testing.assert_allclose(np.linalg.norm(found.offsets, axis=1), new / old * np.linalg.norm(offsets, axis=1))


# ---- figures of regions ----------------------------------------------------------------------------------------


def test_figures_of_a_region_are_those_of_its_triangles():
    V = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [4, 0, 0]])
    F = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 2]])
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]], [[1, 0], [3, 0], [1, 1.0]]])
    found = SimpleNamespace(positions=V, triangles=F, uv=uv, polygons=np.array([0, 0, 1]))
    measured = region_figures._Measured(
        found,
        np.array([1.0, 1.0, 1.0]),
        np.array([0.5, 0.5, 1.0]),
        np.array([0.75, 0.75, 1.5]),
        np.array([2.0, 2.0, 1.0]),
    )
    row = region_figures._row("quad", measured, np.array([True, True, False]), 512)
    assert (row.name, row.faces, row.area, row.uv_area) == ("quad", 1, 2.0, 1.0)
    assert row.surface_share == pytest.approx(2 / 3) and row.texture_share == pytest.approx(0.5)
    assert row.perimeter == pytest.approx(6) and row.uv_diameter == pytest.approx(np.sqrt(2))
    assert (row.ratio_mean, row.ratio_sd, row.shear) == (0.75, 0.0, 2.0)
    assert row.texel_density == pytest.approx(512 * np.sqrt(1 / 2))
    whole = region_figures._row("all", measured, np.ones(3, bool), 100)
    assert whole.faces == 2 and whole.ratio_mean == pytest.approx(1) and whole.shear == pytest.approx(5 / 3)
    assert whole.ratio_sd == pytest.approx(np.sqrt((2 * 0.0625 + 0.25) / 3))
    assert whole.perimeter == pytest.approx(4 + 1 + 2 + np.sqrt(5)) and whole.uv_diameter == pytest.approx(np.sqrt(10))


@pytest.mark.parametrize("corners", [3, 40, 499, 500, 999, 1000, 2400])
def test_diameters_of_round_outlines_are_their_longer_axes(corners):
    """However many corners are compared at a time."""
    angle = 2 * np.pi * np.arange(corners) / corners
    points = np.column_stack([3 * np.cos(angle), np.sin(angle)]) + [5, -7]
    apart = np.linalg.norm(points - points[0], axis=1).max()
    assert region_figures.diameter(points) == pytest.approx(apart, rel=1e-12)


def test_diameters_are_the_greatest_distances():
    rng = np.random.default_rng(0)
    for points in (rng.normal(size=(40, 2)), np.column_stack([np.arange(5.0), 2 * np.arange(5.0)]), np.ones((3, 2)),
                   np.array([[0.0, 1], [0, 5], [0, -2]]), np.array([[3.0, 1], [1, 1], [2, 1]])):  # fmt: skip
        apart = np.linalg.norm(points[:, None] - points[None], axis=2).max()
        assert region_figures.diameter(points) == pytest.approx(apart)


@pytest.mark.parametrize("count", range(4))
def test_an_island_has_a_scale_of_its_own_from_two_pins_on(monkeypatch, count):
    """One pin holds a place, and no length."""
    V, F = meshes.grid(2, 2)
    chart = SimpleNamespace(vertices=V, triangles=F, faces=np.arange(len(F)))
    rows = np.array([0, 8, 2, 6])[:count]
    pins = SimpleNamespace(vertices=rows, places=V[rows, :2]) if count else None

    def refine_island(*_, pins, **more):
        return pins
        yield

    monkeypatch.setattr(refinement, "refine_island", refine_island)
    island = SimpleNamespace(chart=chart, uv=V[:, :2])
    fixed, given = drain(refinement._improve(island, pins, RefineSettings(), None))
    assert fixed == (count > 1) and (given is None) == (count == 0)
    assert given is None or given[0].tolist() == rows.tolist()
