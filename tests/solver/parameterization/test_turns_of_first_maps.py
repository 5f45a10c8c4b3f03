"""Which first map a chart gets, and whose corners are opened, with maps written in advance."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import worked

from omt_uv.solver.analysis import region_density
from omt_uv.solver.errors import EmptyRegionError, MeshError, ShareError, SoftRegionError
from omt_uv.solver.parameterization import chart_map as chart_maps
from omt_uv.solver.parameterization import convex_maps
from omt_uv.solver.parameterization.options import MapOptions
from omt_uv.solver.parameterization.polygons import convexity
from omt_uv.solver.progress import RunLog, drain


@pytest.fixture
def first(monkeypatch):
    """The first map of a chart, and what was tried for it, where maps are there or not as is written."""

    def run(
        *,
        boundary="free",
        draft=False,
        size=10,
        flat=None,
        touches=False,
        good=False,
        even=None,
        roomy=None,
        evened=None,
        coarse=None,
    ):
        tried, log = [], RunLog()

        def given(name, value):
            def taking(*_, **__):
                tried.append(name)
                return value

            return taking

        monkeypatch.setattr(chart_maps, "unroll", given("unroll", flat))
        monkeypatch.setattr(chart_maps, "touches_itself", lambda *_: touches)
        monkeypatch.setattr(
            chart_maps, "good_enough", lambda disk, flat, draft, apart, goal: "good" if good and apart else None
        )
        monkeypatch.setattr(chart_maps, "flat_initial_map", given("even", even))
        monkeypatch.setattr(chart_maps, "roomy_initial_map", given("roomy", roomy))
        monkeypatch.setattr(chart_maps, "evened_initial_map", given("evened", evened))

        def coarse_map(disk, balance, log, draft):
            tried.append(f"coarse {draft}")
            return worked(coarse)

        monkeypatch.setattr(chart_maps, "coarse_initial_map", coarse_map)
        # Drafts come without the coarser mesh that takes the place of a start with next to no room.
        direct = "direct_initial_map" if draft else "roomier_initial_map"
        monkeypatch.setattr(chart_maps, direct, lambda *_: (tried.append("direct"), worked("direct"))[1])
        disk = SimpleNamespace(boundary=boundary, vertices=np.zeros((size, 3)), triangles=None, loop=None)
        found = drain(chart_maps._initial_map(disk, 0.0, log, draft, 0.1))
        return found, tried, log.warnings

    return run


FLAT = np.ones((3, 2))


def test_what_can_be_unrolled_is_unless_it_touches_itself(first):
    found, tried, _ = first(flat=FLAT)
    assert found.uv is FLAT and found.apart and tried == ["unroll"]
    assert first(flat=FLAT, touches=True)[1] == ["unroll", "roomy", "direct"]
    # What needs no refinement may touch itself.
    assert first(flat=FLAT, touches=True, good=True)[1] == ["unroll"]
    assert first(boundary="disk")[1] == ["evened", "direct"]


def test_drafts_are_flattened_where_they_are_small(first):
    above = 5000
    assert first(draft=True, even="even", size=above)[:2] == ("even", ["unroll", "even"])
    assert first(draft=True, size=above)[1][:2] == ["unroll", "even"]
    assert "even" not in first(draft=True, even="even", size=above + 1)[1]
    assert first(even="even")[1] == ["unroll", "roomy", "direct"]


def test_others_get_room_or_are_evened(first):
    assert first(roomy="roomy")[:2] == ("roomy", ["unroll", "roomy"])
    assert first(boundary="square", evened="evened")[:2] == ("evened", ["evened"])
    assert "roomy" not in first(draft=True, roomy="roomy")[1]
    assert first(draft=True, boundary="disk", evened="evened", size=5000)[:2] == ("evened", ["evened"])
    assert "evened" not in first(draft=True, boundary="disk", evened="evened", size=5001)[1]


@pytest.mark.parametrize("draft", [False, True])
def test_large_charts_come_by_way_of_coarser_ones(draft, first):
    above = 600 if draft else 5000
    assert not [t for t in first(draft=draft, size=above)[1] if t.startswith("coarse")]
    found, tried, told = first(draft=draft, size=above + 1, coarse="coarse")
    assert found == "coarse" and tried[-1] == f"coarse {draft}" and not told
    found, tried, told = first(draft=draft, size=above + 1)
    assert found == "direct" and tried[-2:] == [f"coarse {draft}", "direct"] and not told
    found, _, told = first(draft=draft, size=above + 1, coarse=MeshError("Too thin"))
    assert found == "direct" and told == ["Too thin; refined without a coarser mesh"]


# ---- corners that are opened --------------------------------------------------------------------------------


def chart_map(name, mean, folds=0):
    return SimpleNamespace(name=name, angle_mean=mean, folds=folds, uv=None)


@pytest.fixture
def opened(monkeypatch):
    """Which of the maps of a chart is taken: as it was, opened as far as is spared, or refined again from there."""

    def run(*, before=1.5, kept=(1.5, 0), again=(1.4, 0), folded=3, sides=4, flat=False, **options):
        asked = []
        monkeypatch.setattr(convexity, "reflex_triangles", lambda drawn, charts, uvs: np.array([folded] * len(charts)))
        monkeypatch.setattr(convex_maps, "chart_target", lambda *_: None)
        monkeypatch.setattr(convex_maps, "with_dents_told", lambda drawn, chart, one: one)
        spared, refined = chart_map("kept", *kept), None if again is None else chart_map("again", *again)

        def keep(self, maps, which):
            return [refined if maps[0] is refined else spared]

        def open_(self, k, old, folded):
            asked.append((old.name, folded))
            return worked(refined)

        monkeypatch.setattr(convex_maps._Opening, "kept", keep)
        monkeypatch.setattr(convex_maps._Opening, "opened", open_)
        monkeypatch.setattr(convex_maps._Opening, "folded", lambda self, k, one: one.folds)
        old = chart_map("old", before)
        monkeypatch.setattr(convex_maps, "_is_isometry", lambda one: flat)
        quads = SimpleNamespace(face_start=np.array([0, sides]))
        (found,) = drain(convex_maps.with_convex_polygons(quads, [None], [old], [None], MapOptions(**options)))
        return found.name, asked

    return run


def test_corners_are_opened_as_far_as_is_spared_and_further_where_that_shears(opened):
    kept = 1.06
    # What shears hardly more, and folds nothing, is taken as it is.
    assert opened(kept=(kept * 1.5 * 0.999, 0)) == ("kept", [])
    assert opened(kept=(kept * 1.5 * 1.001, 0)) == ("again", [("old", 3)])
    assert opened(kept=(1.5, 1)) == ("again", [("old", 3)])
    # Of both the one with fewer folds, then with less shear.
    assert opened(kept=(9.0, 0), again=(1.4, 1))[0] == "kept" and opened(kept=(1.45, 1), again=(1.4, 1))[0] == "again"
    assert opened(kept=(9.0, 0), again=None)[0] == "kept" and opened(folded=0) == ("kept", [])
    # Triangles, and maps without any shear, stay as they are.
    assert opened(sides=3) == opened(flat=True) == ("old", [])


@pytest.mark.parametrize("options", [{"boundary": "disk"}, {"balance": 0.3}, {"quality": "exact"}])
def test_where_little_is_spared_corners_are_always_opened_further(options, opened):
    assert opened(kept=(1.0, 0), again=(5.0, 2), **options) == ("again", [("old", 3)])


@pytest.mark.parametrize(
    ("pinned", "options", "opens"),
    [
        (False, {}, True),
        (True, {}, False),
        (False, {"quality": "draft"}, False),
        (False, {"boundary": "disk"}, True),
        (False, {"boundary": "square"}, False),
        (False, {"boundary": "rectangle"}, False),
    ],
)
@pytest.mark.parametrize("state", ["good", "as folded", "no start", "no map", "off"])
def test_corners_are_refined_again_where_nobody_chose_them(state, pinned, options, opens, monkeypatch):
    V, F = meshes.grid(1, 1)
    monkeypatch.setattr(convexity, "keep_convex", lambda *_: {} if state == "no start" else {0: V[:, :2]})
    refused = MeshError("No")
    monkeypatch.setattr(convex_maps, "refined_again", lambda *_: worked(refused if state == "no map" else V[:, :2]))
    monkeypatch.setattr(convex_maps, "cut_as_mapped", lambda chart, uv: chart)
    monkeypatch.setattr(convex_maps, "_fixed", lambda *_: None)
    monkeypatch.setattr(convex_maps, "_as_before", lambda uv, old, triangles: uv)
    monkeypatch.setattr(convex_maps, "measured_map", lambda *_: "figures")
    monkeypatch.setattr(convex_maps, "with_figures", lambda old, uv, figures: "found")
    monkeypatch.setattr(convex_maps, "_keeps", lambda *_: state != "off")
    monkeypatch.setattr(convex_maps._Opening, "folded", lambda self, k, found: 3 if state == "as folded" else 2)
    chart = SimpleNamespace(triangles=F)
    task = convex_maps._Opening(None, [chart], ["pins" if pinned else None], MapOptions(**options), [None], {})
    old = SimpleNamespace(uv=V[:, :2], area_weight=1.0)
    assert drain(task.opened(0, old, 3)) == ("found" if opens and state == "good" else None)


# ---- shares -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("before", "target", "weights", "error", "words"),
    [
        (0.2, 0.5, (0, 1), None, ""),
        (0.0, 0.0, (0, 1), EmptyRegionError, "no area"),
        (0.3, 1.2, (0, 1), ShareError, "The region has 30 % of the area; 4 times that is 120 % of the texture"),
        (0.25, 1.0, (0, 1), ShareError, "leaves nothing"),
        (0.2, 0.8, (0, 0.8), SoftRegionError, "With weights from 0 to 0.8 the region cannot have 80 %"),
        (0.2, 0.1, (0.1, 1), SoftRegionError, "With weights from 0.1 to 1 the region cannot have 10 %"),
        (0.2, 0.11, (0.1, 1), None, ""),
    ],
)
def test_shares_that_no_map_can_have_are_refused_by_what_is_in_their_way(before, target, weights, error, words):
    region = np.array(weights, float)
    if error is None:
        region_density._check_share(region, before, target, 4.0)
        return
    with pytest.raises(error, match=words) as caught:
        region_density._check_share(region, before, target, 4.0)
    if target >= 1:
        assert f"Choose a factor below {1 / before:.3g}" in caught.value.remedy
