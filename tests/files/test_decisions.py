"""Small questions with yes or no of files, objects and runs: each just on either side of every one of its bounds."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import bpy

import bmesh
import numpy as np
import pytest
import scenes


@pytest.mark.parametrize("extent", [1e-20, 1e-3, 1.0, 1e6, 1e30])
def test_positions_are_far_where_rounding_is_more_than_a_millionth_of_the_extent(package, extent):
    loaded = package("files.loaded")
    body = extent * np.array([[0, 0, 0], [1, 0.2, 0], [0, 1, 0.3]])
    for share, far in ((0.0, False), (0.4, False), (2.5, True)):
        # Numbers of single precision have 24 digits of two.
        shift = share * loaded.ROUNDED * 2**24 * extent
        assert loaded._is_far((body + [shift, 0, 0]).astype(np.float32)) == far, share
    assert not loaded._is_far(np.zeros((0, 3), np.float32)) and not loaded._is_far(np.full((3, 3), np.nan, np.float32))
    # What is no number is not counted.
    assert not loaded._is_far(np.append(body, [[np.inf, 0, 0]], axis=0).astype(np.float32))
    assert loaded._is_far(np.full((4, 3), 1e6, np.float32)) and not loaded._is_far(np.zeros((4, 3), np.float32))


@pytest.mark.parametrize(
    "index, ascend", [([0, 0, 1, 2], True), ([0, 0, 0, 0], True), ([0, 1, 0, 2], False), ([1, 0, 0, 0], False)]
)
def test_materials_ascend_where_no_face_has_an_earlier_one_than_the_face_before(package, index, ascend):
    obj = scenes.bump(2, 2)
    for _ in range(3):
        obj.data.materials.append(None)
    obj.data.polygons.foreach_set("material_index", index)
    assert package("files.export")._materials_ascend(obj.data) == ascend


@pytest.mark.parametrize("smooth", [[False] * 4, [False, True, False, False], [True] * 4])
def test_a_mesh_is_smooth_where_any_face_is(package, smooth):
    obj = scenes.bump(2, 2)
    obj.data.polygons.foreach_set("use_smooth", smooth)
    assert package("files.export")._is_smooth(obj.data) == any(smooth)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("moved", [None, 0, 1, 2, 3])
def test_an_edge_is_a_seam_of_uvs_where_either_of_its_ends_has_two(package, moved, turned):
    """Of two triangles with an edge in common; a corner that is not on it does not count, nor do edges of one face, or
    faces that look to different sides."""
    bm = bmesh.new()
    a, b, c, d = (bm.verts.new(p) for p in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)))
    bm.faces.new((a, b, c))
    other = bm.faces.new((c, b, d))
    layer = bm.loops.layers.uv.new("UV")
    for face in bm.faces:
        for loop in face.loops:
            loop[layer].uv = loop.vert.co[:2]
    if turned:
        bm.faces.remove(other)
        other = bm.faces.new((b, c, d))
        for loop in other.loops:
            loop[layer].uv = loop.vert.co[:2]
    if moved is not None and moved < 3:
        other.loops[moved][layer].uv = (5, 5)
    (shared,) = [edge for edge in bm.edges if len(edge.link_faces) == 2]
    asked = package("files.export")._is_uv_seam(shared, layer)
    if not turned:
        assert asked == (moved in (0, 1))
    assert not any(package("files.export")._is_uv_seam(edge, layer) for edge in bm.edges if edge != shared)
    bm.free()


@pytest.mark.parametrize(
    "suffix, layers, split",
    [
        (".glb", 0, True),
        (".GLTF", 0, True),
        (".ply", 0, False),
        (".PLY", 1, True),
        (".obj", 1, False),
        (".blend", 1, False),
    ],
)
def test_vertices_are_split_by_formats_with_one_uv_for_each(package, suffix, layers, split):
    obj = SimpleNamespace(data=SimpleNamespace(uv_layers=[None] * layers))
    assert package("commands.remesh")._is_split(Path(f"a{suffix}"), obj) == split


def test_faces_are_the_same_where_all_their_corners_are(package):
    same = package("pipelines.shapes.strain").same_polygons

    def surface(n=4, corners=(0, 1, 2, 3), start=(0, 4)):
        return SimpleNamespace(positions=np.zeros((n, 3)), corner_vertex=np.array(corners), face_start=np.array(start))

    assert same(surface(), surface())
    assert not same(surface(), surface(5)) and not same(surface(), surface(corners=(0, 1, 3, 2)))
    assert same(surface(), surface(corners=(2, 3, 0, 1))) and same(surface(0, (), (0,)), surface(0, (), (0,)))
    two = (0, 1, 2, 3, 2, 1, 0), (0, 3, 3, 7)
    assert same(surface(4, *two), surface(4, (2, 0, 1, 0, 3, 2, 1), two[1]))
    assert not same(surface(4, *two), surface(4, (2, 0, 1, 0, 3, 1, 2), two[1]))
    assert not same(surface(), surface(start=(0, 3, 4))) and not same(surface(), surface(corners=(0, 1, 2)))


@pytest.mark.parametrize(
    "value, finite",
    [
        (0.0, True),
        (-2.9e38, True),
        (3.5e38, False),
        (-3.5e38, False),
        (float("nan"), False),
        ((1.0, 2.0), True),
        ((1.0, float("inf")), False),
        ((), True),
    ],
)
def test_numbers_are_finite_below_the_largest_of_blender(package, value, finite):
    assert package("operators.base")._is_finite(value) == finite


def test_an_index_is_whole_where_its_arrays_belong_together(package):
    module = package("pipelines.shapes.signature_index")
    whole = module.SignatureIndex(("a", "b"), ("1", "2"), np.zeros((2, 5, 4)), np.zeros(2), np.zeros((2, 3, 2)))
    assert module._is_whole(whole) and module._is_whole(replace(whole, packed=np.zeros((2, 5, 3))))
    spoilt = [
        {"names": ("a",)}, {"marks": ("1", "2", "3")}, {"marks": ("1", 2)}, {"names": (None, "b")},
        {"packed": np.zeros((3, 5, 4))}, {"packed": np.zeros((2, 4))}, {"packed": np.zeros((2, 5, 5))},
        {"packed": np.zeros((2, 5, 4), int)}, {"packed": np.full((2, 5, 4), np.nan)}, {"floors": np.zeros(3)},
        {"floors": np.zeros((2, 1))}, {"floors": np.full(2, np.inf)}, {"floors": np.float64(0)},
        {"coefficients": np.zeros((2, 3, 3))}, {"coefficients": np.zeros((1, 3, 2))},
        {"coefficients": np.zeros((2, 2))},
    ]  # fmt: skip
    for change in spoilt:
        assert not module._is_whole(replace(whole, **change)), change


@pytest.mark.parametrize("retry", [False, True])
def test_a_run_is_over_where_it_failed_or_its_results_are_there(package, tmp_path, retry):
    manifest = package("batch.manifest")
    (tmp_path / "a").write_bytes(b"12345")

    def asked(state, **sizes):
        outputs = {str(tmp_path / name): ("hash", size) for name, size in sizes.items()}
        return manifest._is_over({"state": state, "outputs": json.dumps(outputs) if outputs else None}, retry)

    assert asked("failed") == asked("set aside") == (not retry)
    assert asked("done") and asked("done", a=5)
    assert not asked("done", a=4) and not asked("done", a=6) and not asked("done", a=5, b=0)
    assert not asked("running", a=5) and not asked("waiting")


@pytest.mark.parametrize(
    "size, changed, kind, same",
    [(5, 7, "own", True), (5, 8, "own", True), (5, 8, "another", False), (6, 7, "own", False)],
)
def test_an_input_is_the_same_by_its_size_and_its_time_or_its_hash(package, tmp_path, size, changed, kind, same):
    """And a file whose time alone is another has that time afterwards."""
    manifests, plans = package("batch.manifest"), package("batch.plan")
    path = tmp_path / "a"
    path.write_bytes(b"12345")
    plan, record = plans.BatchPlan("unwrap", (), tmp_path / "out"), package("batch.child").Record
    first = plans.FileTask("a", path, 5, 7, None)
    with manifests.Manifest(tmp_path / "x.manifest.sqlite") as manifest:
        manifest.due(plan, [first], retry=False)
        manifest.end(plan, first, record(0, 0.0, input_hash=plans.hash_of(path) if kind == "own" else "0"))
        due = manifest.due(plan, [plans.FileTask("a", path, size, changed, None)], retry=False)
        assert (not due) == same
        (row,) = manifest.rows()
        assert row["changed"] == (changed if same else 7)


def test_an_attribute_fits_where_there_is_none_or_one_of_its_kind(package):
    fits = package("blender.shapes.match_objects")._fits
    mesh = scenes.bump().data
    mesh.attributes.new("heat", "FLOAT", "POINT")

    def layer(name="heat", domain="POINT", data_type="FLOAT"):
        return SimpleNamespace(name=name, domain=domain, data_type=data_type)

    assert fits(mesh, layer()) and fits(mesh, layer("other", "FACE", "INT"))
    assert not fits(mesh, layer(domain="FACE")) and not fits(mesh, layer(data_type="INT"))


@pytest.mark.parametrize(
    "shown, kind", [(True, "IMAGE_EDITOR"), (False, "UV"), (True, "UV"), (False, "IMAGE_EDITOR"), (None, "VIEW_3D")]
)
def test_an_editor_shows_uvs_by_its_space_or_its_kind(package, shown, kind):
    space = SimpleNamespace() if shown is None else SimpleNamespace(show_uvedit=shown)
    context = SimpleNamespace(space_data=space, area=SimpleNamespace(ui_type=kind))
    assert package("display.overlay")._shows_uvs(context) == (bool(shown) or kind == "UV")
    assert not package("display.overlay")._shows_uvs(SimpleNamespace(space_data=None, area=None))


def test_figures_are_of_a_subdivided_surface_where_any_object_is(package):
    asked, plain, fine = (
        package("pipelines.distortion").on_subdivision,
        SimpleNamespace(subdivision=None),
        SimpleNamespace(subdivision=2),
    )
    assert not asked([]) and not asked([plain, plain]) and asked([plain, fine]) and asked([fine])


@pytest.mark.parametrize("over, refined", [(-1, True), (0, True), (1, False)])
def test_cages_are_refined_up_to_so_many_corners(package, over, refined):
    module = package("pipelines.subdivision")
    corners = module.REFINED_QUADS + over
    assert module.refinable(SimpleNamespace(corner_vertex=np.zeros(corners))) == refined
    assert not module.refinable(SimpleNamespace(corner_vertex=np.zeros(0))) and bpy.app.version
