"""Of several things which all are what something is about: each is told by its own name, any is not all, and the sum or
the greatest is not that of the first. Where there is one of them alone, none of this can be seen."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from types import SimpleNamespace

import bpy

import meshes
import numpy as np
import pytest
import scenes
from readings import reading

COUNTS = (1, 2, 3)


@pytest.mark.parametrize("count", COUNTS)
def test_every_linked_object_that_is_left_out_is_warned_of_by_its_name(package, monkeypatch, count):
    selection, said = package("commands.selection"), []
    monkeypatch.setattr(package("blender.mesh"), "linked", lambda obj: "is linked" if obj.far else "")
    monkeypatch.setattr(selection, "warn_of", said.append)
    objects = [SimpleNamespace(name=f"{k}", far=k < count) for k in range(count + 1)]
    options = argparse.Namespace(input="x", scene="", object=[], skip_linked=True, told=["before"])
    assert selection._chosen(options, objects) == objects[count:]
    assert said == options.told[1:] == [f"{k} is linked and is left out" for k in range(count)]


@pytest.mark.parametrize("places", [(1e6,), (1e6, 1e8), (1e8, 1e6), (1e6, 3e6, 1e7)])
def test_the_loss_of_several_meshes_is_that_of_the_farthest(package, tmp_path, places):
    objects = [scenes.bump(2, 2, name=f"Far {k}", offset=place) for k, place in enumerate(places)]
    found = package("files.loaded").compare(tmp_path / "in.fbx", [*objects, *objects[:1]])
    assert found.loss == np.spacing(np.float32(max(places) + 1)) / 2 and f"{found.loss:.2g}" in found.texts[-1]


@pytest.mark.parametrize("folded", [(1,), (1, 0, 2), (2, 2), (0, 1, 0)])
def test_folded_faces_of_all_new_meshes_are_counted(package, folded):
    attributes = SimpleNamespace(left=(), custom_normals=False)
    request = SimpleNamespace(attributes=attributes, evaluated=False)
    carried = [SimpleNamespace(folded=k) for k in folded]
    texts = package("blender.remesh_objects").lost(SimpleNamespace(modifiers=[]), request, carried)
    count = sum(folded)
    assert texts == [f"{'A face' if count == 1 else f'{count} faces'} of the new mesh {'is' if count == 1 else 'are'}"
                     " folded in a UV map"]  # fmt: skip


@pytest.mark.parametrize("pinned", [[], [0], [0, 3], None])
def test_a_surface_is_unwrapped_with_its_pins_where_any_corner_is_pinned(package, pinned):
    surface = reading(*meshes.grid(2, 1)).surface
    marks = np.isin(np.arange(len(surface.corner_vertex)), pinned or [])
    pins = None if pinned is None else SimpleNamespace(pinned=marks)
    region = SimpleNamespace(
        surface=surface, faces=None, pins=pins, subdivision="modifier", axes="axes", was_split=False
    )
    rows = np.arange(len(surface.triangles))
    parts = [(rows, np.ones(len(rows)), None)]
    (job,) = package("pipelines.regions.several")._jobs([region], parts, np.ones(len(rows)), np.zeros(len(rows)))
    assert job.pins is (pins if pinned else None) and (job.subdivision, job.axes) == ("modifier", "axes")


@pytest.mark.parametrize("inside", [(), (0,), (1,), (0, 1)])
def test_seams_of_which_an_end_lies_elsewhere_are_no_seams_of_a_part(package, inside):
    surface = reading(*meshes.grid(3, 1)).surface
    used = np.array([5, 6, 7])
    ends = np.array([[5, 6], [7, 5]]) if inside == (0, 1) else np.array([[0, 1], [2, 3]])
    for k in inside:
        ends[:, k] = (5, 7)
    part = SimpleNamespace(used=used)
    found = package("pipelines.shapes.match")._seams(replace(surface, seams=ends), part)
    assert used[found].tolist() == [row for row in ends.tolist() if set(row) <= set(used.tolist())]


def test_a_shape_is_not_compared_with_itself(package, monkeypatch):
    index = package("pipelines.shapes.signature_index")
    pairs = []
    monkeypatch.setattr(index, "prepared", lambda k: k)
    monkeypatch.setattr(
        index, "distance_of", lambda a, b, _: pairs.append((a, b)) or SimpleNamespace(distance=10 * a + b, raw=1.0)
    )
    for block in ((0, 3, 0, 3), (0, 2, 2, 4), (1, 3, 0, 4)):
        pairs.clear()
        found = index.block_distances(list(range(4)), block)
        above = [(i, j) for i in range(*block[:2]) for j in range(*block[2:]) if j > i]
        assert pairs == above
        expected = [[10 * i + j if j > i else 0 for j in range(*block[2:])] for i in range(*block[:2])]
        assert found[0].tolist() == expected and (found[1] == (found[0] > 0)).all()


@pytest.mark.parametrize("count", COUNTS)
def test_what_stands_beside_the_table_of_a_page_is_no_column_of_it(package, tmp_path, count):
    plain = {"path": "/in/a", "state": "done", "status": 0, "seconds": 2.0, "processor": 1.5, "memory": 10**9,
             "size": 1000, "tries": 1, "host": "h", "version": "1", "message": "", "warnings": "[]",
             "words": json.dumps(["omt", "a"]), "report": "{}", "preview": ""}  # fmt: skip
    rows = [{"name": f"{k}", **plain} for k in range(count)]
    begin, end = package("batch.page_text").PAGE.split("DATA_OF_THE_BATCH")
    table = json.loads(package("batch.pages").page_of(rows, tmp_path, "title")[len(begin) : -len(end)])
    assert not {"words", "picture", "preview", "report"} & set(table["columns"])
    assert table["words"] == ["omt a"] * count and len(table["pictures"]) == len(table["rows"]) == count
    assert all(len(line) == len(table["columns"]) == len(set(table["columns"])) for line in table["rows"])


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize(("jobs", "memory"), [(1, 0), (3, 10**9)])
def test_choices_of_a_batch_reach_what_carries_it_out(package, monkeypatch, apart, jobs, memory):
    made = []
    monkeypatch.setattr(package("batch.pool"), "LocalPool", lambda *given: made.append(given))
    options = argparse.Namespace(scheduler="", jobs=jobs, total_memory=memory, apart=apart, start=("go",))
    package("commands.batches.batch")._runner(options, "plan")
    assert made == [("plan", ("go",), jobs, memory, not apart)]


@pytest.mark.parametrize("loaded", [False, True])
def test_an_image_is_found_by_its_name_whether_its_pixels_have_been_asked_for_or_not(package, tmp_path, loaded):
    saved = bpy.data.images.new("saved", 4, 4)
    saved.filepath_raw, saved.file_format = str(tmp_path / "saved.png"), "PNG"
    saved.save()
    image = bpy.data.images.load(str(tmp_path / "saved.png"))
    assert not image.has_data
    if loaded:
        _ = image.pixels[0]
    assert package("files.images").named(image.name) == image


def test_a_reach_that_is_changed_while_it_is_dragged_begins_from_uvs_as_they_were():
    obj = scenes.bump()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    before = scenes.uv_of(obj)
    operator = scenes.stand_in("uv.omt_flow", radius=0.3)
    operator.begin_drag(bpy.context)
    operator._drag.to(np.array([0.5, 0.5]), np.array([0.6, 0.5]))
    assert np.abs(scenes.uv_of(obj) - before).max() > 0.05
    event = SimpleNamespace(type="WHEELUPMOUSE", value="PRESS", mouse_region_x=0, mouse_region_y=0)
    assert operator.modal(bpy.context, event) == {"RUNNING_MODAL"}
    operator._drag.restore()
    np.testing.assert_array_equal(scenes.uv_of(obj), before)
