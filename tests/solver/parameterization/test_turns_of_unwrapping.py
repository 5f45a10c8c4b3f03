"""What an unwrapping decides, with cuts and maps written in advance: which charts go together, which again, what is
told, and how far it is."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import done, told

from omt_uv.solver.canonical.markers import ChartMarkers
from omt_uv.solver.cutting.disk_charts import DiskCharts
from omt_uv.solver.errors import FoldedUVError, MeshError, PinError, PrecisionError
from omt_uv.solver.mesh.charts import Chart
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization import chart_map as chart_maps
from omt_uv.solver.parameterization import unwrap as unwrapping
from omt_uv.solver.parameterization.chart_indices import ChartPins, CornerPins
from omt_uv.solver.parameterization.chart_map import ChartMap, no_map
from omt_uv.solver.parameterization.options import MapOptions, UnwrapOptions
from omt_uv.solver.parameterization.shear_bound import BoundedShear
from omt_uv.solver.parameterization.unwrap import CutCharts, SurfaceMap, map_small_charts
from omt_uv.solver.progress import Progress, RunLog, drain


def chart(k=0, columns=2, rows=2):
    """A chart of a grid, the k-th of a surface of such grids."""
    V, F = meshes.grid(columns, rows)
    m, n = len(F), len(V)
    return Chart(V, F, 3 * m * k + np.arange(3 * m).reshape(-1, 3), m * k + np.arange(m), n * k + np.arange(n))


def mapped(size=1.0, **given):
    figures = {"area_l1": 0.0, "area_sd": 0.0, "angle_mean": 1.0, "folds": 0} | given
    return ChartMap(uv=size * meshes.grid(2, 2)[0][:, :2], **figures)


def surface(count=1):
    V, F = meshes.grid(2, 2)
    return triangle_surface(
        np.concatenate([V + [2 * k, 0, 0] for k in range(count)]), np.concatenate([F + 9 * k for k in range(count)])
    )


def cut(count=1, **given):
    charts = [chart(k) for k in range(count)]
    none = {"pins": [None] * count, "targets": [None] * count, "joined": charts, "pairs": {}, "maps": {}}
    return CutCharts(surface=surface(count), prepared=DiskCharts(charts, None, ("repaired",)), **none | given)


def task(count=1, markers=None, pins=None, cut_anew=False, **options):
    return unwrapping._Task(surface(count), UnwrapOptions(**options), pins, None, markers, cut_anew)


# ---- the whole ----------------------------------------------------------------------------------------------


@pytest.fixture
def whole(monkeypatch):
    """An unwrapping of a surface whose steps are written; the names of those that were taken, in turn."""

    def run(
        *,
        search=True,
        quality="standard",
        pins=None,
        target=None,
        parts=1,
        settled=False,
        worth=True,
        given=False,
        short=True,
        **options,
    ):
        taken, maps = [], [mapped()]
        made = cut(search=SimpleNamespace(axes="axes") if search else None)

        def step(name, value):
            def taking(*words, **_):
                taken.append(name)
                # Polygons and folds are counted at the end.
                for fraction in (1.0,) if name in ("finish", "room") else (0.0, 1.0):
                    yield Progress(name, fraction)
                return value(*words) if callable(value) else value

            return taking

        def bound(first, *words):
            again = first == "apart"
            return BoundedShear(
                prepared=made.prepared,
                maps=maps * (parts if again else 1),
                ended_early=settled,
                is_short=short or again,
                warnings=("again" if again else "missed",),
            )

        bounds = iter(["first", "apart"])

        def bounding(*_, of_pieces=False, may_part=False):
            first = next(bounds)
            assert of_pieces == (first == "apart" and parts > 1)
            # Pieces are asked for once.
            assert may_part == (first == "first" and pins is None and target is None and options.boundary == "free")
            return step("bound", lambda *_: bound(first))()

        monkeypatch.setattr(unwrapping, "cut_charts", step("cut", made))
        monkeypatch.setattr(unwrapping, "bound_shear", bounding)
        monkeypatch.setattr(unwrapping, "in_pieces", step("pieces", (made.prepared, maps * parts)))
        monkeypatch.setattr(unwrapping, "is_worth_bounding", lambda *_: worth)
        monkeypatch.setattr(unwrapping, "cut_for_a_map", lambda *_: ["further"])
        monkeypatch.setattr(unwrapping, "_with_room", step("room", lambda task, charts, maps, surface: maps))
        monkeypatch.setattr(unwrapping._Task, "map_symmetric", step("map", maps))
        monkeypatch.setattr(unwrapping._Task, "finished", step("finish", lambda task, charts, maps, s: (charts, maps)))
        options = UnwrapOptions(quality=quality, **options)
        ready = {"cut": made} if given else {}
        found, fractions = told(unwrapping.unwrap(surface(), options=options, pins=pins, target=target, **ready))
        assert fractions == sorted(fractions) and fractions[-1] <= 1
        return found, taken, fractions

    return run


PINS = CornerPins(np.zeros(24, bool), np.zeros((24, 2)))


@pytest.mark.parametrize(
    ("given", "steps"),
    [
        ({"search": False}, ["cut", "map", "finish"]),
        ({"search": False, "given": True}, ["map", "finish"]),
        ({}, ["cut", "map", "bound", "pieces", "finish"]),
        ({"quality": "draft"}, ["cut", "map", "pieces", "finish"]),
        ({"quality": "draft", "parts": 2}, ["cut", "map", "pieces", "finish"]),
        ({"pins": PINS}, ["cut", "map", "bound", "finish"]),
        ({"target": "target"}, ["cut", "map", "bound", "finish"]),
        ({"parts": 2}, ["cut", "map", "bound", "pieces", "bound", "finish"]),
        ({"parts": 2, "worth": False}, ["cut", "map", "bound", "pieces", "finish"]),
        ({"short": False}, ["cut", "map", "bound", "pieces", "bound", "finish"]),
        ({"short": False, "parts": 2}, ["cut", "map", "bound", "pieces", "bound", "finish"]),
        ({"short": False, "parts": 2, "worth": False}, ["cut", "map", "bound", "pieces", "finish"]),
        ({"short": False, "settled": True}, ["cut", "map", "bound", "pieces", "finish"]),
        ({"parts": 2, "settled": True}, ["cut", "map", "bound", "pieces", "finish"]),
        ({"search": False, "boundary": "disk"}, ["cut", "map", "finish", "room"]),
        ({"search": False, "boundary": "disk", "kind": "conformal"}, ["cut", "map", "finish"]),
        ({"boundary": "disk"}, ["cut", "map", "bound", "finish", "room"]),
    ],
)
def test_steps_of_an_unwrapping(given, steps, whole):
    found, taken, _ = whole(**given)
    assert taken == steps
    searched = "bound" in steps
    missed = () if not searched else ("missed",) if steps.count("bound") == 1 else ("again",)
    assert found.warnings == ("repaired", *(("further",) if searched else ()), *missed)
    assert len(found.maps) == (given.get("parts", 1) if "pieces" in steps else 1)
    # How the surface stands is known where seams were searched.
    assert found.axes == ("axes" if given.get("search", True) else None)


def test_progress_of_an_unwrapping_goes_to_its_end_by_its_parts(whole):
    fractions = [whole(**given)[2] for given in ({"search": False}, {}, {"given": True, "search": False})]
    assert fractions[0][1:5] == pytest.approx([0, 0.15, 0.15, 1.0])
    assert fractions[1][1:9] == pytest.approx([0, 0.15, 0.15, 0.745, 0.745, 0.95, 0.95, 0.975])
    assert fractions[2][1:3] == pytest.approx([0, 1.0])


# ---- folds that stay ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("folds", "free", "freed"), [((0, 0), (), []), ((2, 0), (0,), [0]), ((2, 3), (2, 2), [1])])
def test_charts_that_stay_folded_get_a_free_boundary_where_that_folds_fewer(folds, free, freed, monkeypatch):
    asked = []

    def map_charts(self, charts):
        asked.append((self.options.boundary, [c.faces[0] for c in charts]))
        return (yield from done([mapped(folds=k, size=9.0) for k in free]))

    monkeypatch.setattr(unwrapping._Task, "map_charts", map_charts)
    monkeypatch.setattr(unwrapping._Task, "finished", lambda self, charts, maps, given: done((charts, maps)))
    charts, maps = [chart(0), chart(1)], [mapped(folds=k, warnings=("before",)) for k in folds]
    found = drain(unwrapping._with_room(task(2, boundary="disk"), charts, maps, surface(2)))
    assert asked == ([("free", [8 * k for k in range(2) if folds[k]])] if any(folds) else [])
    for k in range(2):
        if k in freed:
            (text,) = found[k].warnings
            assert found[k].uv.max() == 9 and "The disk has no room" in text and f"({folds[k]} face" in text
        else:
            assert found[k] is maps[k]


def test_maps_stay_where_a_free_boundary_has_none(monkeypatch):
    def refuse(self, charts):
        raise MeshError("No")
        yield

    monkeypatch.setattr(unwrapping._Task, "map_charts", refuse)
    maps = [mapped(folds=1)]
    assert drain(unwrapping._with_room(task(boundary="square"), [chart()], maps, surface())) is maps


# ---- charts -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "seams", "searches", "knows_faces"),
    [
        ({}, "auto", False, False),
        ({"max_shear": 1.3}, "auto", True, True),
        ({"boundary": "disk"}, unwrapping.OUTLINED, False, False),
        ({"boundary": "disk", "seams": "existing"}, "existing", False, False),
        ({"seams": "existing", "max_shear": 1.3}, "existing", False, True),
        ({"seams": "existing"}, "existing", False, True),
        ({"fill_holes": True}, "auto", False, False),
    ],
)
def test_charts_are_cut_as_the_options_say(options, seams, searches, knows_faces, monkeypatch):
    asked = []

    def disk_charts(surface, faces, *, seams, search, **given):
        asked.append((seams, search is not None, given["fill_holes"], given["sieve"]))
        return (yield from done(DiskCharts([chart()], None, ())))

    monkeypatch.setattr(unwrapping, "disk_charts", disk_charts)
    monkeypatch.setattr(unwrapping, "cut_alike", lambda surface, faces, prepared, given: done(prepared))
    found = drain(unwrapping.cut_charts(surface(), options=UnwrapOptions(**options)))
    assert asked == [(seams, knows_faces, options.get("fill_holes", False), unwrapping.MANY)]
    assert (found.search is not None) == searches and len(found.joined) == 1 and not found.maps


def test_charts_go_together_that_are_small_and_free_and_nobodys_image(monkeypatch):
    several = [cut(3, pins=[None, "pins", None]), cut(2, pairs={1: (0, None)})]
    assert [c.alike for c in several] == [[0, 2], [0]]
    asked = []

    def together(charts, targets, options):
        asked.append([c.faces[0] for c in charts])
        return done([mapped(k + 1.0) if k != 1 else None for k in range(len(charts))])

    monkeypatch.setattr(unwrapping, "map_together", together)
    found = drain(map_small_charts(several, UnwrapOptions()))
    assert asked == [[0, 16, 0]]
    assert [{k: m.uv.max() for k, m in c.maps.items()} for c in found] == [{0: 1.0}, {0: 3.0}]
    for options in (UnwrapOptions(boundary="disk"), UnwrapOptions(kind="conformal")):
        asked.clear()
        drain(map_small_charts(several, options))
        assert asked == [[]]


@pytest.mark.parametrize("anew", [False, True])
@pytest.mark.parametrize("pinned", [False, True])
@pytest.mark.parametrize("error", [FoldedUVError, PrecisionError, PinError])
def test_what_has_no_map_is_cut_further_or_refused_with_the_elements_of_the_surface(error, pinned, anew, monkeypatch):
    def fail(*_, **__):
        raise error("No", kind="face", elements=np.array([1, 3]))
        yield

    monkeypatch.setattr(unwrapping, "map_completed", fail)
    pins = CornerPins(np.arange(48) == 30, np.zeros((48, 2))) if pinned else None
    steps = task(2, pins=pins, cut_anew=anew).map_one(chart(1))
    if anew and not pinned and error is not PinError:
        found = drain(steps)
        assert isinstance(found.failure, error) and found.failure.elements.tolist() == [9, 11]
        assert found.folds == 8 and np.isinf(found.area_l1) and not found.uv.any() and found.status == "failed"
        return
    with pytest.raises(error) as caught:
        drain(steps)
    assert caught.value.elements.tolist() == [9, 11]


def test_one_map_gets_the_options_pins_and_target_of_its_chart(monkeypatch):
    asked = []

    def complete(chart, **given):
        asked.append(given)
        return done(mapped())

    monkeypatch.setattr(unwrapping, "map_completed", complete)
    pins = CornerPins(np.arange(48) == 30, np.arange(96.0).reshape(48, 2))
    mine = task(2, pins=pins, balance=0.25)
    drain(mine.map_one(chart(0)))
    drain(mine.map_one(chart(1)))
    assert [a["pins"] is None for a in asked] == [True, False] and asked[1]["pins"].places.tolist() == [[60.0, 61.0]]
    assert all(a["options"] is mine.options and a["target"] is None for a in asked)


@pytest.fixture
def alone(monkeypatch):
    """Charts that are mapped one by one, those of the same size as if they were equal; the numbers of them."""
    asked = []

    def map_one(self, chart, start):
        assert start is None
        asked.append(int(chart.faces[0] // 8))
        return done(mapped(len(asked)), 0.0, 1.0)

    monkeypatch.setattr(unwrapping._Task, "map_one", map_one)
    monkeypatch.setattr(unwrapping, "map_together", lambda charts, *_: done([None] * len(charts), 0.0, 1.0))
    monkeypatch.setattr(unwrapping, "mirrored_map", lambda chart_map, images: replace(chart_map, status="mirrored"))
    monkeypatch.setattr(
        unwrapping, "equal_chart_map", lambda chart, target, alone: alone[0][2] if len(alone) > 1 else None
    )
    return asked


def test_charts_are_mapped_alone_that_are_not_mapped_nor_images_nor_equal(alone):
    cuts = cut(6, pairs={3: (1, None)}, maps={0: mapped(50.0)}, pins=[None] * 4 + ["pins", None])
    found, fractions = told(task(6).map_all(cuts))
    # The first is there, the fourth is the second's image, the last is equal to one that went alone.
    assert alone == [1, 2, 4] and [m.uv.max() for m in found] == [50, 1, 2, 1, 3, 1]
    assert [m.status for m in found] == ["", "", "", "mirrored", "", ""]
    # Of the five sixths that small charts leave each has a fifth of what is left.
    begun = 4 / 6
    assert fractions == pytest.approx(
        [x for k in range(3) for x in (begun + k * (1 - begun) / 5, begun + (k + 1) * (1 - begun) / 5)]
    )


def test_markers_tell_charts_apart_that_are_alike(alone):
    cuts = cut(4, pairs={3: (1, None)})
    found, fractions = told(task(4, markers=SimpleNamespace()).map_all(cuts))
    assert alone == [0, 1, 2, 3] and fractions == pytest.approx([0, 1 / 4, 1 / 4, 1 / 2, 1 / 2, 3 / 4, 3 / 4, 1])
    assert all(m.status == "" for m in found)


def test_small_charts_are_first_tried_together(alone, monkeypatch):
    monkeypatch.setattr(unwrapping, "map_together", lambda charts, *_: done([mapped(7.0)] * 2 + [None], 0.5, 1.0))
    found, fractions = told(task(3).map_all(cut(3)))
    assert [m.uv.max() for m in found] == [7, 7, 1] and alone == [2]
    assert fractions[:2] == pytest.approx([0.5, 1.0]) and fractions[-1] == pytest.approx(1.0)


# ---- quads cut alike ----------------------------------------------------------------------------------------


def joined(k):
    """A chart whose quads are cut along other diagonals than in the surface."""
    c = chart(k)
    return replace(c, faces=c.faces[::-1].copy())


@pytest.fixture
def symmetric(monkeypatch):
    def run(area=0.0, *, count=2, changed=(1,), found=True, pairs=None, failure=None, closer=0.005, **options):
        calls = []
        charts = [chart(k) for k in range(count)]
        cuts = cut(count, joined=[joined(k) if k in changed else charts[k] for k in range(count)], pairs=pairs or {})

        def map_all(self, given):
            calls.append(("all", given.joined is given.prepared.charts))
            return done([mapped(k + 1.0, failure=failure) for k in range(count)])

        def as_given(chart, chart_map, density, goal):
            calls.append(("given", int(chart.faces[0] // 8), goal))
            return mapped(20.0, area_l1=area) if found else None

        def map_closer(self, chart, joined, target, chart_map, found):
            calls.append(("closer", int(chart.faces[0] // 8)))
            return done(mapped(30.0))

        monkeypatch.setattr(unwrapping._Task, "map_all", map_all)
        monkeypatch.setattr(unwrapping._Task, "map_closer", map_closer)
        monkeypatch.setattr(unwrapping, "as_given", as_given)
        monkeypatch.setattr(unwrapping, "mirror_partners", lambda charts, targets: {})
        maps = drain(task(count, **options).map_symmetric(cuts))
        return [m.uv.max() for m in maps], calls

    return run


def test_charts_with_other_diagonals_are_measured_with_those_given(symmetric):
    assert symmetric(changed=()) == ([1, 2], [("all", False)])
    assert symmetric(0.01) == ([1, 20], [("all", False), ("given", 1, 0.008)])
    assert symmetric(0.0101) == ([1, 30], [("all", False), ("given", 1, 0.008), ("closer", 1)])
    # An image, and what has one, stay as they are; so do other qualities and balances.
    assert symmetric(0.0101, pairs={1: (0, None)})[0] == [1, 20]
    assert symmetric(0.0101, changed=(0,), pairs={1: (0, None)})[0] == [20, 2]
    assert symmetric(0.0101, quality="exact")[1][-1] == ("given", 1, 0.0003)
    assert symmetric(0.0101, balance=0.5)[1][-1] == ("given", 1, np.inf)


@pytest.mark.parametrize("given", [{"found": False}, {"failure": MeshError("No")}])
def test_charts_are_mapped_as_they_were_where_that_has_no_map(symmetric, given):
    maps, calls = symmetric(**given)
    assert maps == [1, 2] and calls[-1] == ("all", True) and calls[0] == ("all", False)
    assert any(c[0] == "given" for c in calls) == ("found" in given)


@pytest.mark.parametrize(("area", "better"), [(0.019, True), (0.02, False), (0.021, False), (None, False)])
def test_what_is_closer_is_taken_where_it_is(area, better, monkeypatch):
    asked = []

    def again(chart, uv, options, target):
        asked.append(options.quality)
        return done(uv + 1)

    monkeypatch.setattr(unwrapping, "refined_again", again)
    found = mapped(area_l1=0.02)
    closer = None if area is None else mapped(5.0, area_l1=area)
    monkeypatch.setattr(
        unwrapping, "as_given", lambda chart, chart_map, density, goal: closer if goal == 0.02 else None
    )
    got = drain(task().map_closer(chart(), joined(0), None, mapped(), found))
    assert got is (closer if better else found) and asked == ["closer"]


@pytest.mark.parametrize(
    ("quality", "balance", "sparing"), [("standard", 0, True), ("exact", 0, False), ("standard", 0.1, False)]
)
def test_only_standard_maps_are_sparing(quality, balance, sparing, monkeypatch):
    monkeypatch.setattr(unwrapping, "with_known_maps", lambda map_charts: ("known", map_charts))
    found = task(quality=quality, balance=balance).sparing
    assert (found is not None) == sparing
    if sparing:
        assert found[0] == "known" and found[1].__self__.options == UnwrapOptions(quality="promised")


def test_charts_by_themselves_get_their_own_order_back(monkeypatch):
    given = chart()
    order = np.random.default_rng(1).permutation(9)
    place = np.argsort(order)
    mixed = replace(
        given, vertices=given.vertices[order], triangles=place[given.triangles], vertex_ids=given.vertex_ids[order]
    )

    def map_symmetric(self, cuts):
        return done([replace(mapped(), uv=c.vertices[:, :2].copy()) for c in cuts.prepared.charts])

    monkeypatch.setattr(unwrapping._Task, "map_symmetric", map_symmetric)
    (found,) = drain(task().map_charts([mixed]))
    assert np.array_equal(found.uv, mixed.vertices[:, :2])
    assert drain(task().map_charts([])) == []


# ---- one chart ----------------------------------------------------------------------------------------------


def test_charts_without_a_map_are_counted_or_their_error_is_raised():
    fine, none = mapped(), no_map(chart(), PrecisionError("No"))
    assert unwrapping.cut_for_a_map([fine, fine], [fine]) == []
    assert unwrapping.cut_for_a_map([none, fine], [fine])[0].startswith("An island along its seams has no map")
    assert unwrapping.cut_for_a_map([none, none], [fine])[0].startswith("2 islands along their seams have no map")
    with pytest.raises(PrecisionError, match="Cut the chart into less elongated pieces with"):
        unwrapping.cut_for_a_map([none], [fine, none])


def test_the_corners_of_a_surface_have_the_places_of_their_charts():
    found = SurfaceMap([chart(0), chart(1)], [mapped(), mapped(2.0)], np.zeros((0, 2), int))
    corners, uv = found.corner_uv()
    flat = meshes.grid(2, 2)[0][:, :2][meshes.grid(2, 2)[1].ravel()]
    assert corners.tolist() == list(range(48)) and np.array_equal(uv, np.concatenate([flat, 2 * flat]))
    row = found.report()[1]
    assert (row["vertices"], row["faces"], row["triangles"], row["weight"]) == (9, 8, 8, 0.0)
    assert not {"uv", "area_weight", "failure"} & row.keys()


@pytest.mark.parametrize(
    ("boundary", "marked", "small", "corners", "aspect"),
    [
        ("free", (), False, None, 1.0),
        ("disk", (), False, None, 1.0),
        ("square", (), False, "sharpest", 1.0),
        ("rectangle", (), False, "rectangle", 0.5),
        ("rectangle", (0, 2, 8, 6), False, [0, 2, 8, 6], 0.5),
        ("square", (0, 2, 8), False, "sharpest", 1.0),
        ("square", (), True, None, 1.0),
    ],
)
def test_disks_have_the_corners_that_are_marked_or_found(boundary, marked, small, corners, aspect, monkeypatch):
    from omt_uv.solver.canonical import rectangles
    from omt_uv.solver.conformal import disk_map

    monkeypatch.setattr(disk_map, "sharpest_corners", lambda *_: "sharpest")
    monkeypatch.setattr(rectangles, "rectangle_corners", lambda *_: "rectangle")
    monkeypatch.setattr(rectangles, "natural_aspect", lambda *_: 0.5)
    given, log = chart(), RunLog()
    if small:
        given = replace(
            given,
            vertices=given.vertices[[0, 1, 4]],
            triangles=np.array([[0, 1, 2]]),
            corners=given.corners[:1],
            faces=given.faces[:1],
        )
    found = chart_maps._disk_mesh(
        given.vertices, given, MapOptions(boundary=boundary), None, log, ChartMarkers(corners=marked)
    )
    assert (found.corners if isinstance(corners, str) or corners is None else found.corners.tolist()) == corners
    assert found.aspect == aspect and found.boundary == ("free" if small else boundary)
    assert [("only three" in text) for text in log.warnings] == [True] * small
    own = chart_maps._disk_mesh(
        given.vertices, given, MapOptions(boundary="rectangle", aspect=3.0), None, RunLog(), ChartMarkers()
    )
    assert own.aspect == (1.0 if small else 3.0)


@pytest.mark.parametrize(
    ("centre", "corners", "said"),
    [(-1, (), False), (0, (), True), (3, (), True), (-1, (1, 2, 3), True), (-1, (1, 2), False)],
)
def test_markers_that_a_map_does_not_keep_are_told(centre, corners, said, monkeypatch):
    monkeypatch.setattr(ChartMarkers, "turned", lambda self, uv: uv + 1)
    uv, log = np.zeros((3, 2)), RunLog()
    for fixed, pins in ((None, None), (np.zeros(4), None), (None, "pins")):
        found = chart_maps._turned(
            uv, SimpleNamespace(corners=fixed), ChartMarkers(centre=centre, corners=corners), pins, log
        )
        assert found.any() == (fixed is None and pins is None)
    assert len(log.warnings) == 3 * said


def test_pins_are_for_maps_by_areas_with_a_free_boundary():
    pins = ChartPins(np.array([0]), np.zeros((1, 2)), np.zeros((8, 3, 2)))
    chart_maps._refuse_pins(pins, MapOptions())
    chart_maps._refuse_pins(None, MapOptions(kind="polar", boundary="disk"))
    for options in (MapOptions(kind="polar"), MapOptions(boundary="disk")):
        with pytest.raises(PinError):
            chart_maps._refuse_pins(pins, options)


@pytest.mark.parametrize("squeezed", [False, True])
@pytest.mark.parametrize("error", [None, FoldedUVError, PrecisionError])
@pytest.mark.parametrize("boundary", ["free", "disk"])
def test_what_a_domain_has_no_room_for_is_mapped_freely(boundary, error, squeezed, monkeypatch):
    asked, V, F = [], *meshes.grid(2, 2)

    def refine(vertices, triangles, uv, options, **given):
        asked.append((options.boundary, options.balance, options.quality, uv[0, 0]))
        if len(asked) == 1 and error is not None:
            raise error("no way", kind="face", elements=[3])
        yield Progress("A", 0.0)
        flat = V[:, :2].copy()
        if squeezed and len(asked) == 1:
            flat[4] = flat[0] * 0.9999999 + flat[5] * 1e-7
        return SimpleNamespace(uv=flat)

    monkeypatch.setattr(chart_maps, "refine", refine)
    monkeypatch.setattr(chart_maps, "mean_value_sites", lambda *_: np.full((9, 2), 5.0))
    options = chart_maps.RefinementOptions(boundary=boundary, balance=0.25, quality="draft")
    disk = SimpleNamespace(
        vertices=V, triangles=F, target=np.full(8, 1 / 8), loop=np.arange(3), region=None, polygons=None
    )
    log = RunLog()
    steps = chart_maps._refined(disk, V[:, :2], options, False, None, log)
    if boundary == "free" and error is not None:
        with pytest.raises(error) as caught:
            drain(steps)
        assert "another one along it" in caught.value.remedy and list(caught.value.elements) == [3]
        return
    drain(steps)
    again = boundary == "disk" and (squeezed or error is not None)
    assert asked == [(boundary, 0.25, "draft", 0.0)] + [("free", 0.25, "draft", 5.0)] * again
    assert [text.startswith("The disk has no room for this chart (") for text in log.warnings] == [True] * again
    if again:
        assert ("no way" in log.warnings[0]) == (error is not None)
