"""What belongs to one object and not to another, with islands that are written in advance."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import done, told

from omt_uv.pipelines import magnify as magnified
from omt_uv.pipelines import refine as refinement
from omt_uv.pipelines.arranging import actions
from omt_uv.pipelines.layout import Refusal, grown_together
from omt_uv.solver.errors import MeshError, PinError


def island(owner, number):
    chart = SimpleNamespace(vertices=("vertices", number), triangles=("triangles", number))
    return SimpleNamespace(owner=owner, island=SimpleNamespace(uv=np.full((1, 2), number), chart=chart))


def reading(low, high):
    positions = np.array([[0, 0, 0], [0.0, low, 0], [0, high, 0], [0, 99, 0]])
    return SimpleNamespace(surface=SimpleNamespace(positions=positions, corner_vertex=np.array([1, 2])))


def test_each_object_has_a_middle_and_islands_of_its_own(monkeypatch):
    found = [island(2, 0), island(0, 1), island(2, 2), island(0, 3)]
    readings = [reading(-1.0, 3.0), reading(0.0, 1.0), reading(5.0, 6.0)]
    calls = []

    def halves(jobs, normal, at, on_one_another):
        calls.append(
            ([v[1] for v, _, _ in jobs], [int(uv[0, 0]) for *_, uv in jobs], normal.tolist(), at, on_one_another)
        )
        return SimpleNamespace(uv=[uv + 100 for *_, uv in jobs], partner=np.array([0, -1])[: len(jobs)])

    monkeypatch.setattr(actions, "islands_of", lambda readings: found)
    monkeypatch.setattr(actions, "halves", halves)
    monkeypatch.setattr(actions, "arranged", lambda *given, apart=True: given)
    count, _, uv, changed, warnings = actions.symmetrize_islands(readings, 1, True)
    axis = [0.0, 1.0, 0.0]
    assert calls == [([1, 3], [1, 3], axis, 1.0, True), ([0, 2], [0, 2], axis, 5.5, True)]
    assert count == 3 and [int(x[0, 0]) for x in uv] == [100, 101, 102, 103] and changed == 2
    assert len(warnings) == 1 and warnings[0][0] == -1 and warnings[0][1].startswith("2 islands have none there")

    def refused(jobs, *more):
        raise MeshError("No")

    monkeypatch.setattr(actions, "halves", refused)
    found[:] = [one for one in found if one.owner == 2]
    with pytest.raises(Refusal) as caught:
        actions.symmetrize_islands(readings, 0, False)
    assert caught.value.index == 2


def test_islands_without_uvs_before_had_nothing_in_common():
    square, chart = np.array([[0.0, 0], [1, 0], [0, 1]]), SimpleNamespace(triangles=np.array([[0, 1, 2]]))
    new = SimpleNamespace(before=None, uv=square, chart=chart)
    old = SimpleNamespace(before=square + 3, uv=square, chart=chart)
    assert "Islands grew into each other" in grown_together([new, old])
    assert not grown_together([old, SimpleNamespace(before=square + 3, uv=square, chart=chart)])


@pytest.mark.parametrize("keeps", [True, False])
def test_an_outline_that_folds_is_told_as_such_where_it_was_to_be_kept(keeps, monkeypatch):
    error, asked = PinError("Pins fold", kind="vertex", elements=[3]), []

    def refine(*mesh, **given):
        asked.append(given["pins"])
        return done(error)

    monkeypatch.setattr(refinement, "refine_island", refine)
    V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])
    chart = SimpleNamespace(vertices=V, triangles=F, faces=np.zeros(1, int))
    one = SimpleNamespace(chart=chart, uv=2 * V[:, :2])
    pins = SimpleNamespace(vertices=np.array([1]), places=np.array([[5.0, 5]]))
    settings = SimpleNamespace(keep_boundary=keeps, balance=0.5, quality="draft")
    with pytest.raises(PinError) as caught:
        told(refinement._improve(one, pins, settings, None))
    vertices, places = asked[0]
    assert vertices.tolist() == ([1, 0, 2] if keeps else [1])
    assert places.tolist() == [[5, 5], [0, 0], [0, 2]][: len(vertices)]
    if keeps:
        assert "cannot be kept" in str(caught.value) and caught.value.elements == [3] and caught.value.kind == "vertex"
    else:
        assert caught.value is error


@pytest.mark.parametrize("pinned", [None, [False, False], [False, True]])
def test_surfaces_without_a_pin_are_unwrapped_as_if_nobody_had_pinned_anything(pinned, monkeypatch):
    asked = []
    pins = None if pinned is None else SimpleNamespace(pinned=np.array(pinned))
    region = SimpleNamespace(
        surface=SimpleNamespace(triangles=np.zeros((4, 3), int)),
        faces="faces",
        pins=pins,
        subdivision=None,
        axes=None,
        was_split=False,
    )
    rows, area, weights = np.array([1, 3]), np.array([1.0, 3.0]), np.array([0.0, 1.0])
    monkeypatch.setattr(magnified, "region_triangles", lambda region: (rows, area, weights))

    def lay_out(jobs, settings):
        asked.extend([jobs, settings.boundary])
        return done(RuntimeError("enough"))

    monkeypatch.setattr(magnified, "lay_out", lay_out)
    with pytest.raises(RuntimeError, match="enough"):
        told(magnified._from_mesh([region], magnified.MagnifySettings(factor=1.2)))
    (job,), boundary = asked
    assert job.pins is (pins if pinned and any(pinned) else None)
    full = [value for value in vars(job.target).values() if isinstance(value, np.ndarray)]
    assert full[0][[0, 2]].tolist() == [1, 1] and full[0][3] > full[0][1] and full[1].tolist() == [0, 0, 0, 1]
    assert boundary != "own"


@pytest.mark.parametrize(
    ("pinned", "keeps", "fixed"), [(0, False, False), (1, False, False), (2, False, True), (0, True, True)]
)
def test_two_pins_fix_how_large_an_island_is(pinned, keeps, fixed, monkeypatch):
    asked = []
    monkeypatch.setattr(
        refinement, "refine_island", lambda *mesh, **given: asked.append(given["pins"]) or done("found")
    )
    V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])
    one = SimpleNamespace(chart=SimpleNamespace(vertices=V, triangles=F, faces=np.zeros(1, int)), uv=V[:, :2])
    pins = SimpleNamespace(vertices=np.arange(pinned), places=V[:pinned, :2]) if pinned else None
    settings = SimpleNamespace(keep_boundary=keeps, balance=0.5, quality="draft")
    assert told(refinement._improve(one, pins, settings, None))[0] == (fixed, "found")
    assert (asked[0] is None) == (not pinned and not keeps)
