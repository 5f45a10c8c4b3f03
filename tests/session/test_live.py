"""A live session: it follows, comes to rest, gives back what was there, and notices when the mesh is another."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes
from uv_scenes import plain


@pytest.fixture
def session(package):
    made = []

    def start(*objects):
        pairs = [(obj, package("blender.mesh").read(obj)) for obj in objects]
        made.append(package("session.live").Session(bpy.context, pairs))
        return made[-1]

    yield start
    for each in made:
        each.close()


def test_what_follows_is_closed_once_by_whoever_ends_it(package):
    following, closed, kept = package("session.following"), [], []
    live = SimpleNamespace(close=lambda: closed.append(live))
    following.begin(live, kept.append)
    following.keep("a context")
    assert kept == ["a context"] and not closed and following.current is live
    following.end()
    assert closed == [live] and following.current is None
    # Nothing is on any more.
    following.end()
    following.keep("another")
    assert closed == [live] and kept == ["a context"]


def test_it_comes_to_rest_and_gives_back_every_bit(session):
    obj = plain()
    before = scenes.uv_of(obj)
    live = session(obj)
    rounds = 0
    while live.follow(0.3):
        rounds += 1
        assert rounds < 200
    assert rounds > 0 and not np.array_equal(scenes.uv_of(obj), before)
    live.restore()
    assert (scenes.uv_of(obj) == before).all()


def test_a_mesh_that_changed_is_left_alone(package, session):
    obj = plain()
    live = session(obj)
    obj.data.uv_layers.remove(obj.data.uv_layers[0])
    with pytest.raises(package("session.run").Disturbed, match="mesh was changed"):
        live.follow(0.5)
    live.restore()


def test_objects_without_uvs_are_refused_by_their_index(package, session):
    with pytest.raises(package("pipelines.layout").Refusal) as caught:
        session(plain("A"), scenes.bump(name="B"))
    assert caught.value.index == 1


def test_figures_of_several_islands_are_those_of_all_their_faces(package, session):
    """Polygons of different objects have the same numbers, and are not the same."""
    first, second = plain("A"), plain("B")
    second.scale = 1.5, 0.7, 1.0
    bpy.context.view_layer.update()
    live = session(first, second)
    found = live.figures()
    single = [session(obj).figures() for obj in (first, second)]
    assert found.area_l1 >= min(f.area_l1 for f in single) - 1e-9 and found.folds == sum(f.folds for f in single)
    V, F, uv, polygons = [], [], [], []
    for island in live._islands:
        begin = sum(map(len, V))
        V.append(island.chart.vertices)
        F.append(island.chart.triangles + begin)
        uv.append(island.live_map.uv[island.chart.triangles])
        polygons += [(len(V), face) for face in island.chart.faces]
    label = np.unique(polygons, axis=0, return_inverse=True)[1].ravel()
    asked = package("solver.maps.distortion").distortion(
        *map(np.concatenate, (V, F, uv)), overlap=False, polygons=label
    )
    for name in ("area_l1", "area_sd", "angle_mean", "folds"):
        assert getattr(found, name) == pytest.approx(getattr(asked, name)), name


@pytest.mark.parametrize("left_out", [(), ("A",), ("B",), ("A", "B")], ids=str)
def test_islands_are_packed_where_they_are_all_that_the_objects_have(package, left_out):
    objects = [two_islands(name) for name in "AB"]
    pairs = [(obj, package("blender.mesh").read(obj)) for obj in objects]
    for obj, reading in pairs:
        reading.faces[:9] = obj.name not in left_out
    live = package("session.live").Session(bpy.context, pairs)
    before = [scenes.uv_of(obj) for obj in objects]
    assert live.pack(package("settings").Settings()) == (not left_out)
    after = [scenes.uv_of(obj) for obj in objects]
    changed = [not np.array_equal(a, b) for a, b in zip(before, after, strict=True)]
    assert any(changed) == (not left_out)
    if not left_out:
        every = np.concatenate([uv.reshape(-1, 2) for uv in after])
        assert every.min() >= 0 and every.max() <= 1
    live.close()


def two_islands(name):
    """Two squares of nine quads, one beside the other."""
    y, x = np.mgrid[0:4, 0:4]
    a = (y[:-1, :-1] * 4 + x[:-1, :-1]).ravel()
    faces = np.column_stack([a, a + 1, a + 5, a + 4])
    points = np.column_stack([x.ravel(), y.ravel(), 0.2 * np.sin(x.ravel() + y.ravel())])
    obj = scenes.add(np.concatenate([points, points + [5, 0, 0]]), np.concatenate([faces, faces + 16]).tolist(), name)
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.1))
    return obj


def test_every_island_has_its_turn_however_short_the_slices(session):
    obj = two_islands("Pair")
    uv = scenes.uv_of(obj)
    scenes.set_uv(obj, np.where(uv[:, :1] > 0.3, [0.3, 0], [0, 0]) + uv * [0.5, 1.0])
    before, live, half = scenes.uv_of(obj), session(obj), len(scenes.uv_of(obj)) // 2
    for _ in range(60):
        live.follow(0.0, 0.0)
        moved = (scenes.uv_of(obj) != before).any(axis=1)
        if moved[:half].any() and moved[half:].any():
            return
    raise AssertionError("one island took all the time")


@pytest.mark.parametrize("ends_after, changed", [(0, 1), (1, 2), (99, 2)])
def test_a_slice_takes_islands_in_turn_until_it_is_over(package, session, monkeypatch, ends_after, changed):
    """By a clock that stands still for so many islands, and is beyond the end then."""
    objects = [plain("A"), plain("B")]
    before = [scenes.uv_of(obj) for obj in objects]
    live, asked = session(*objects), []

    class Clock:
        def monotonic(self):
            return 100.0 if sum(asked) > ends_after else 0.0

    for island in live._islands:
        follow = island.live_map.follow

        def counted(*given, follow=follow):
            asked.append(1)
            return follow(given[0], given[1], 1.0)

        monkeypatch.setattr(island.live_map, "follow", counted)
    monkeypatch.setattr(package("session.live"), "time", Clock())
    assert live.follow(0.3, 50.0)
    moved = [not np.array_equal(scenes.uv_of(obj), uv) for obj, uv in zip(objects, before, strict=True)]
    assert len(asked) == sum(moved) == changed


def patch_with_pins(vertices=(3, 20)):
    obj = scenes.bump(5, 4)
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.4, (0.2, 0.1)))
    scenes.pin(obj, vertices)
    return obj


@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize("subdivided", [False, True])
def test_soft_pins_or_hard_ones_areas_are_those_asked_for(package, soft, subdivided):
    obj = patch_with_pins()
    obj.modifiers.new("Smooth", "SUBSURF").levels = 2
    pairs = [(obj, package("blender.mesh").read(obj))]
    live = package("session.live").Session(bpy.context, pairs, soft, subdivided)
    expected = package("pipelines.subdivision").target_of(pairs[0][1]).density if subdivided else None
    live.close()
    (density,) = (island.density for island in live._islands)
    assert (density is None) == (not subdivided)
    if subdivided:
        assert np.sort(density / density.mean()) == pytest.approx(np.sort(expected / expected.mean()), rel=1e-6)


@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize("pins", [(), (7,), (3, 20)])
def test_islands_with_pins_are_not_packed_again(package, soft, pins):
    obj = patch_with_pins(pins)
    pairs = [(obj, package("blender.mesh").read(obj))]
    live = package("session.live").Session(bpy.context, pairs, soft)
    before = scenes.uv_of(obj)
    assert live.pack(package("settings").Settings()) == (not pins)
    assert (scenes.uv_of(obj) == before).all() == bool(pins)
    live.close()


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 0, 1], [1, 2, 0]])
def test_pins_have_places_of_their_own_in_whatever_order_they_come(package, session, order, monkeypatch):
    obj = patch_with_pins((2, 9, 20))
    live = session(obj)
    module, asked = package("session.live"), []

    def live_map(*given):
        asked.append(given)

    ((owner, island, pins),) = module._islands([(obj, package("blender.mesh").read(obj))])
    monkeypatch.setattr(module, "LiveMap", live_map)
    turned = replace(pins, vertices=pins.vertices[order], places=pins.places[order])
    made = live._live(owner, island, turned)
    vertices, places = asked[0][3]
    by_vertex = dict(zip(pins.vertices.tolist(), pins.places.tolist(), strict=True))
    assert [by_vertex[v] for v in vertices.tolist()] == places.tolist()
    # One corner stands for each, in the same order.
    corner = np.array([loop.vertex_index for loop in obj.data.loops])
    of_chart = island.chart.vertices
    for pin, v in zip(made.pin_corners, vertices, strict=True):
        np.testing.assert_allclose(obj.data.vertices[corner[pin]].co[:], of_chart[v], atol=1e-6)


def test_faces_of_islands_that_lie_among_others_are_counted_apart(package, session):
    """Numbers of polygons that an island has, and those that it leaves out, are no others' for that."""
    objects = []
    for k in range(2):
        obj = scenes.bump(4, 4 + k, 0.4 + 0.1 * k, "AB"[k], offset=3.0 * k)
        uv = 0.2 * scenes.seen_from_above(obj, shift=(-3.0 * k, 0.1 * k))
        right = np.repeat([face.index % 4 >= 2 for face in obj.data.polygons], 4)
        scenes.set_uv(obj, np.where(right[:, None], uv * [0.7, 1.3] + [0.5, 0.0], uv))
        objects.append(obj)
    scenes.select(objects)
    live = session(*objects)
    assert len(live._islands) == 4
    asked, given = package("solver.maps.distortion"), []
    true = asked.distortion

    def distortion(*words, **more):
        given.append(more["polygons"])
        return true(*words, **more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(asked, "distortion", distortion)
        live.figures()
    # Two triangles of each face, and no number twice.
    (polygons,) = given
    assert np.unique(polygons, return_counts=True)[1].tolist() == [2] * (16 + 20)
