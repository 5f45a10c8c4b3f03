"""What pipelines share: packing into tiles, the way back to corners, and what is said of islands that overlap."""

import dataclasses

import meshes
import numpy as np
import pytest

from omt_uv.errors import UserError
from omt_uv.pipelines import layout
from omt_uv.pipelines.layout import PlacedIsland, Refusal, UnwrapJob, corner_uvs, grown_together, pack_islands
from omt_uv.pipelines.reading import Reading
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.settings import FIRST_TILE, Settings
from omt_uv.solver.analysis.facing import SceneAxes
from omt_uv.solver.canonical.markers import MapMarkers
from omt_uv.solver.editing.uv_islands import uv_islands
from omt_uv.solver.errors import EmptyMeshError
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain


def square(shift=(0.0, 0.0), owner=0):
    """A flat square as an island of its own, laid out where it lies and then moved."""
    V, F = meshes.grid(2, 2)
    island = uv_islands(triangle_surface(V, F), V[F.ravel(), :2]).islands[0]
    return PlacedIsland(owner=owner, chart=island.chart, uv=island.uv + shift, before=island.uv)


def test_every_udim_tile_has_its_own_origin_and_holds_what_the_first_holds():
    island = square()
    first = drain(pack_islands([island.uv], [island.chart.triangles], Settings()))
    origins = set()
    for tile in range(FIRST_TILE, FIRST_TILE + 100):
        settings = Settings(tile=tile)
        found = drain(pack_islands([island.uv], [island.chart.triangles], settings))
        assert np.array_equal(found.islands[0], first.islands[0] + settings.tile_origin)
        origins.add(settings.tile_origin)
    assert origins == {(column, row) for column in range(10) for row in range(10)}


def test_nothing_to_pack_is_packed_as_nothing():
    assert drain(pack_islands([], [], Settings())).islands == []


def test_corners_come_once_and_in_order_also_where_a_surface_has_no_island():
    islands = [square((3, 0), owner=2), square(), square((0, 5), owner=2)]
    corners, uv = corner_uvs(3, islands)
    assert [len(k) for k in corners] == [24, 0, 24]
    for mine in corners:
        assert (np.diff(mine) > 0).all()
    assert uv[1].shape == (0, 2)
    # Two islands that have the same corners: the first one counts.
    assert np.array_equal(uv[2], uv[0] + (3, 0))


def test_islands_that_grew_into_each_other_are_told():
    apart = [square(), square((2, 0))]
    apart = [PlacedIsland(owner=0, chart=i.chart, uv=i.uv, before=i.uv) for i in apart]
    assert grown_together(apart) == "" and grown_together(apart[:1]) == ""
    moved = [apart[0], PlacedIsland(owner=0, chart=apart[1].chart, uv=apart[1].uv - (1.5, 0), before=apart[1].uv)]
    assert "Islands grew into each other, by 50." in grown_together(moved)
    # What lay on one another before has not grown.
    there = [PlacedIsland(owner=0, chart=i.chart, uv=i.uv, before=i.uv) for i in moved]
    assert grown_together(there) == ""


def test_a_refusal_is_what_a_user_can_mend_and_names_the_surface():
    V, F = meshes.grid(2, 2)
    jobs = [UnwrapJob(triangle_surface(V, F)), UnwrapJob(triangle_surface(V, F), np.zeros(len(F), bool))]
    with pytest.raises(Refusal) as caught:
        drain(lay_out(jobs, Settings(quality="draft")))
    assert caught.value.index == 1 and isinstance(caught.value.error, EmptyMeshError)
    assert isinstance(caught.value, UserError) and str(caught.value) == str(caught.value.error)


def test_different_surfaces_in_one_run_have_one_texel_density():
    surfaces = [meshes.grid(4, 4), meshes.hemisphere(5, 16), meshes.cone(4, 12)]
    layout = drain(lay_out([UnwrapJob(triangle_surface(V, F)) for V, F in surfaces], Settings(quality="draft")))
    ratio = []
    for (V, F), corners, uv in zip(surfaces, layout.corners, layout.uv, strict=True):
        assert np.array_equal(corners, np.arange(F.size)) and uv.min() >= 0 and uv.max() <= 1
        ratio.append(np.abs(signed_areas(uv, np.arange(F.size).reshape(-1, 3))).sum() / face_areas(V, F).sum())
    assert ratio == pytest.approx([layout.packing.scale**2] * 3, rel=1e-6)


def test_faces_that_are_not_unwrapped_are_packed_around():
    """Of two squares, the one that is not chosen stays where its UVs are."""
    V, F = meshes.grid(4, 4)
    V, F = np.concatenate([V, V + [3, 0, 0]]), np.concatenate([F, F + len(V)])
    surface = triangle_surface(V, F)
    faces = np.arange(len(F)) < len(F) // 2
    uv = 0.6 * V[F.ravel(), :2] - [1.8, 0]
    job = UnwrapJob(surface, faces, uv=uv)
    stays = uv[np.repeat(~faces, 3)]
    for around in (True, False):
        layout = drain(lay_out([job], Settings(quality="draft", pack_around=around)))
        low, high = layout.uv[0].min(axis=0), layout.uv[0].max(axis=0)
        # Both may be beside one another along a diagonal.
        apart = np.hypot(*np.clip(np.maximum(low - stays.max(axis=0), stays.min(axis=0) - high), 0, None))
        assert (apart >= 4 / 1024 - 1e-9) == around


def test_islands_stand_upright_in_the_layout():
    """A wall that is mapped askew, in an object that says where up is."""
    V, F = meshes.grid(6, 3)
    for up, height in (((0.0, 0.0, 1.0), 2), ((1.0, 0.0, 0.0), 0)):
        wall = V[:, [0, 2, 1]]
        layout = drain(
            lay_out([UnwrapJob(triangle_surface(wall, F), axes=SceneAxes(up=up))], Settings(quality="draft"))
        )
        rise = np.polyfit(wall[F.ravel(), height], layout.uv[0][:, 1], 1)[0]
        side = np.polyfit(wall[F.ravel(), height], layout.uv[0][:, 0], 1)[0]
        assert rise > 0 and side == pytest.approx(0, abs=1e-6 * rise)
        np.testing.assert_allclose(0.5 * (layout.uv[0].min(axis=0) + layout.uv[0].max(axis=0)), 0.5)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_a_head_that_lies_has_the_layout_of_one_that_stands(up):
    """On its back or on its face, as where a file's up is taken for another one."""
    V, F = meshes.head(30)
    surface = triangle_surface(V * [1, 1, 1.4], F)
    lying, standing = (
        drain(lay_out([UnwrapJob(surface, axes=axes)], Settings(max_shear=1.3)))
        for axes in (
            SceneAxes((up, 0.0, 0.0), (0.0, 0.0, -up)),
            SceneAxes((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
        )
    )
    np.testing.assert_array_equal(lying.maps[0].seams, standing.maps[0].seams)
    np.testing.assert_allclose(lying.uv[0], standing.uv[0], atol=2e-3)
    assert lying.maps[0].axes.up == pytest.approx((0, 0, 1), abs=0.02)


@pytest.mark.parametrize("tile, origin", [(1001, (0, 0)), (1002, (1, 0)), (1013, (2, 1))])
def test_islands_that_stay_are_packed_around_in_their_own_tile(monkeypatch, tile, origin):
    """The packer works in the unit square: what stays is told it there, and what is packed goes to the tile."""
    told = []

    def pack(islands, triangles, margin, texture_size, staying):
        yield from ()
        told.append((margin, texture_size, staying))
        return layout.Packing(list(islands), 1.0, "shelves", 0.0)

    monkeypatch.setattr(layout, "pack", pack)
    island, index = np.array([[0.1, 0.1], [0.4, 0.1], [0.1, 0.4]]), np.array([[0, 1, 2]])
    settings = Settings(margin=7, texture_size=512, tile=tile)
    found = drain(layout.pack_islands([island], [index], settings, [(island + 0.5 + origin, index)]))
    ((margin, size, ((points, triangles),)),) = told
    assert (margin, size) == (7, 512) and triangles is index
    np.testing.assert_allclose(points, island + 0.5)
    np.testing.assert_allclose(found.islands[0], island + origin)


def bar(angle):
    """A flat strip, ten times as long as wide, turned in its plane."""
    V, F = meshes.grid(20, 2, 10.0, 1.0)
    cos, sin = np.cos(angle), np.sin(angle)
    return triangle_surface(V @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]), F)


def test_islands_that_may_be_turned_fill_more():
    job = UnwrapJob(bar(0.0))
    upright, turned = (drain(lay_out([job], Settings(turn_to_fit=fit))) for fit in (False, True))
    assert turned.packing.coverage > 1.5 * upright.packing.coverage
    np.testing.assert_allclose(upright.corners[0], turned.corners[0])


def test_what_markers_say_is_not_turned():
    flat = meshes.grid(20, 2, 10.0, 1.0)[0][:, :2] @ np.array([[1, 1, -1, -1], [1, -1, -1, 1]])
    none = np.zeros(0, int)
    marked = UnwrapJob(bar(0.3), markers=MapMarkers(none, none, flat.argmax(axis=0)))
    settings = [Settings(boundary="rectangle", turn_to_fit=fit) for fit in (False, True)]
    upright, fitted = (drain(lay_out([marked], each)) for each in settings)
    np.testing.assert_array_equal(upright.uv[0], fitted.uv[0])
    both = [drain(lay_out([UnwrapJob(bar(0.0)), marked], each)) for each in settings]
    (along, _), (other, _) = (np.linalg.svd(np.diff(one.uv[1][[0, 5]], axis=0))[2] for one in both)
    assert abs(along @ other) == pytest.approx(1, abs=1e-3) or abs(along @ other) == pytest.approx(0, abs=1e-3)
    assert both[1].packing.scale > 1.05 * both[0].packing.scale


def test_a_job_has_all_of_what_was_read_that_it_has_a_name_for():
    """Each field of a reading, whichever they are, and what is given beside it."""
    names = {field.name for field in dataclasses.fields(UnwrapJob)}
    of = Reading(**{field.name: object() for field in dataclasses.fields(Reading)} | {"uv": None, "pinned": None})
    job = UnwrapJob.of(of, "levels", "avoided", "marked")
    shared = names & {field.name for field in dataclasses.fields(Reading)} - {"subdivision"}
    assert shared >= {"surface", "faces", "axes", "was_split"}
    assert all(getattr(job, name) is getattr(of, name) for name in shared)
    assert (job.subdivision, job.avoid, job.markers, job.pins) == ("levels", "avoided", "marked", None)
