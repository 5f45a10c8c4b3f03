"""From which sizes on, and how near to what is looked for, charts start in another way: either side of bounds."""

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import worked

from omt_uv.solver.parameterization import initial_map
from omt_uv.solver.progress import RunLog, drain


class Reached(Exception):
    """Where a search is told to stop."""


def reached(what="", *_, **__):
    raise Reached(what)


def sized(count, **given):
    """A disk that is known by its number of vertices alone."""
    fixed = {"boundary": "free", "is_far": False, "vertices": np.zeros((count, 3)), "triangles": None, "target": None}
    fixed |= {"loop": np.arange(9), "corners": None, "region": None, "aspect": 1.0, "order": None, "domain": None}
    fixed |= {"buried": False}
    return SimpleNamespace(**fixed | {"embedded": "embedded", "bent": "bent", "spread": 0.0} | given)


@pytest.mark.parametrize("bent, embedded, start", [(1.0, 2.0, "bent"), (2.0, 1.0, "embedded"), (1.0, 1.0, "bent")])
def test_what_covers_itself_is_bent_or_embedded_with_the_less_energy(bent, embedded, start, monkeypatch):
    monkeypatch.setattr(initial_map, "_evenly_flattened", lambda *_: "flat")
    monkeypatch.setattr(initial_map, "is_one_to_one", lambda *_: False)
    monkeypatch.setattr(initial_map, "elements", lambda *_: "faces")
    known = {("faces", "bent", 30.0): bent, ("faces", "embedded", 30.0): embedded}
    monkeypatch.setattr(initial_map, "_energy", lambda *given: known[given])
    assert initial_map.flat_initial_map(sized(10), RunLog()).uv == start
    assert initial_map.flat_initial_map(sized(10, bent=None), RunLog()).uv == "embedded"


@pytest.mark.parametrize("spread, flat", [(0.499, "flat"), (0.501, None)])
def test_what_scales_unevenly_is_not_flattened(spread, flat, monkeypatch):
    taken = []
    monkeypatch.setattr(initial_map, "is_one_to_one", lambda uv, *_: taken.append(uv) or True)
    disk = sized(10, flat=SimpleNamespace(uv="flat"), spread=spread)
    found = initial_map.flat_initial_map(disk, RunLog())
    assert (None if found is None else found.uv) == flat and taken == ([flat] if flat else [])


@pytest.mark.parametrize(
    "count, what, reaches",
    [
        (400, "elements", False),
        (401, "elements", True),
        (9000, "elements", True),
        (9001, "elements", False),
        (5000, "_roomy_flat", True),
        (5001, "_roomy_flat", False),
    ],
)
def test_charts_of_a_middle_size_are_given_room(count, what, reaches, monkeypatch):
    monkeypatch.setattr(initial_map, "elements", lambda *_: None)
    monkeypatch.setattr(initial_map, "_roomy_flat", lambda *_: "flat")
    monkeypatch.setattr(initial_map, "evened_tutte", lambda *_: None)
    monkeypatch.setattr(initial_map, what, reached)
    with pytest.raises(Reached) if reaches else nullcontext():
        initial_map.roomy_initial_map(sized(count), RunLog())


@pytest.mark.parametrize("spread, bound", [(0.499, initial_map.ROOM), (0.5, initial_map.SQUEEZED)])
def test_what_sprawls_is_evened_until_it_is_not_squeezed(spread, bound, monkeypatch):
    asked = []
    monkeypatch.setattr(initial_map, "elements", lambda *_: None)
    monkeypatch.setattr(initial_map, "_roomy_flat", lambda *_: None)
    monkeypatch.setattr(initial_map, "evened_tutte", lambda *given: asked.append(given))
    assert initial_map.roomy_initial_map(sized(2000, spread=spread), RunLog()) is None
    ((*_, weight, limit, _, sprawls),) = asked
    assert (weight, limit, sprawls()) == (30, bound, spread == 0.5)


@pytest.mark.parametrize("count, tried", [(9000, True), (9001, False)])
def test_charts_up_to_a_middle_size_are_evened(count, tried, monkeypatch):
    monkeypatch.setattr(initial_map, "elements", lambda *_: None)
    monkeypatch.setattr(initial_map, "is_crowded", lambda *_: False)
    monkeypatch.setattr(initial_map, "evened_sites", lambda *_: "evened")
    found = initial_map.evened_initial_map(sized(count, boundary="disk"), RunLog(), large=False)
    assert (found is not None) == tried


@pytest.mark.parametrize("count, tried", [(9000, False), (9001, True)])
def test_larger_ones_in_a_domain_are_evened_where_they_are_mapped_by_themselves(count, tried, monkeypatch):
    monkeypatch.setattr(initial_map, "elements", lambda *_: None)
    monkeypatch.setattr(initial_map, "is_crowded", lambda *_: False)
    monkeypatch.setattr(initial_map, "evened_sites", lambda *_: "evened")
    monkeypatch.setattr(initial_map, "initial_map", lambda *_: worked("transported"))
    found = drain(initial_map.direct_initial_map(sized(count, boundary="disk"), RunLog()))
    assert (found.uv == "evened") if tried else (found == "transported")


@pytest.mark.parametrize("count, embedded", [(200_000, [True]), (200_001, [False, True])])
@pytest.mark.parametrize("given", [{}, {"draft": True}, {"flat": "flat"}, {"far": True}])
def test_a_coarser_mesh_of_very_large_charts_is_embedded_first(count, embedded, given, monkeypatch):
    asked = []

    def coarse(*words, embedded=None, **rest):
        asked.append(embedded)
        return worked(None)

    monkeypatch.setattr(initial_map, "_coarse_initial_map", coarse)
    disk = sized(count, is_far=given.pop("far", False))
    bare = "flat" not in given and not disk.is_far
    assert drain(initial_map.coarse_initial_map(disk, 0.0, RunLog(), **given)) is None
    # Of drafts the coarser mesh alone is, whatever their size.
    assert asked == ([False, True] if given.get("draft") else embedded if bare else [True])


@pytest.mark.parametrize("energy, tries", [(49.9, 1), (50.0, 2)])
def test_a_start_from_a_coarser_embedding_that_is_hopeless_is_made_anew(energy, tries, monkeypatch):
    asked = []
    monkeypatch.setattr(
        initial_map,
        "_coarse_initial_map",
        lambda *_, **given: (asked.append(given["embedded"]), worked(SimpleNamespace(uv=len(asked))))[1],
    )
    monkeypatch.setattr(initial_map, "map_energy", lambda *_: energy)
    found = drain(initial_map.coarse_initial_map(sized(200_001), 0.0, RunLog()))
    assert found.uv == tries and len(asked) == tries


@pytest.mark.parametrize("energy, even", [(49.9, None), (50.0, "even")])
def test_only_a_hopeless_embedding_gives_way_to_one_that_scales_evenly(energy, even, monkeypatch):
    monkeypatch.setattr(initial_map, "map_energy", lambda *_: energy)
    monkeypatch.setattr(initial_map, "_evenly_flattened", lambda *_: "even")
    monkeypatch.setattr(initial_map, "is_one_to_one", lambda *_: True)
    assert initial_map._even_start(sized(9), "flat") == even
    monkeypatch.setattr(initial_map, "is_one_to_one", lambda *_: False)
    assert initial_map._even_start(sized(9), "flat") is None


@pytest.mark.parametrize(
    "far, draft, goal, enough, again",
    [(False, False, 8, 0.25, 5000), (True, False, 5, 0.4, 20_000), (False, True, 4, 0.25, 3000)],
)
def test_meshes_are_coarsened_by_a_factor_and_only_where_it_pays(far, draft, goal, enough, again, monkeypatch):
    count, asked = int(again / enough), []

    def coarsened(vertices, triangles, flat, target, wished, *_):
        asked.append(wished)
        return worked(SimpleNamespace(kept=np.arange(kept), triangles=None, mass=None, region=None))

    monkeypatch.setattr(initial_map, "give_back_of", lambda *_: None)
    monkeypatch.setattr(initial_map, "density_of_vertices", lambda *_: None)
    monkeypatch.setattr(initial_map, "coarsen_disk", coarsened)
    monkeypatch.setattr(initial_map, "boundary_loops", lambda *_: [np.arange(9)])
    for name in ("coarse_initial_map", "direct_initial_map", "_draft_start"):
        monkeypatch.setattr(initial_map, name, lambda *_, name=name: reached(name))
    for more in (-1, 0, 1, 2):
        kept = again + more
        disk = sized(count + (8 if more == 2 else 0), is_far=far, boundary="disk" if far else "free")
        steps = initial_map._coarse_initial_map(disk, 0.0, RunLog(), np.zeros((len(disk.vertices), 2)), draft, True)
        try:
            found = drain(steps) or "none"
        except Reached as there:
            found = str(there)
        direct = "_draft_start" if draft else "direct_initial_map"
        pays = kept <= enough * len(disk.vertices)
        assert found == ("none" if not pays else direct if more <= 0 else "coarse_initial_map")
    assert asked == [count // goal] * 3 + [(count + 8) // goal]


@pytest.mark.parametrize("apart, usable", [(0.9e-7, False), (1.1e-7, True)])
def test_sites_that_lie_too_close_together_are_none(apart, usable, monkeypatch):
    V, F, uv = np.zeros((3, 3)), np.array([[0, 1, 2]]), np.array([[0, 0], [apart, 0], [0, 0.5]])
    monkeypatch.setattr("omt_uv.solver.conformal.disk_map.conformal_disk", lambda *_: worked(SimpleNamespace(uv=uv)))
    disk = SimpleNamespace(vertices=V, triangles=F, corners=None, aspect=1.0)
    _, sites, trouble = drain(initial_map._conformal_sites(disk, RunLog()))
    assert (sites is not None) == usable == (trouble == "")


@pytest.mark.parametrize(
    ("count", "boundary", "again", "goal"),
    [
        (40_000, "disk", False, (8000, 20_000)),
        (10_005, "disk", False, (2001, 20_000)),
        (6000, "disk", False, (2000, 20_000)),
        (1000, "disk", False, (400, 20_000)),
        (20_000, "free", False, (4000, 20_000)),
        (20_001, "free", False, (6667, 5000)),
        (6667, "free", True, (2222, 5000)),
        (6667, "disk", True, (2000, 20_000)),
    ],
)
def test_how_far_disks_are_coarsened_whose_target_is_far_from_their_areas(count, boundary, again, goal):
    assert initial_map._goal(sized(count, boundary=boundary, is_far=True), False, again) == goal


@pytest.mark.parametrize(("draft", "goal"), [(True, (2000, 3000)), (False, (1000, 5000))])
def test_how_far_others_are_coarsened_is_as_it_was(draft, goal):
    assert initial_map._goal(sized(8000), draft, True) == goal
