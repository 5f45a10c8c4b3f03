"""Every number that an operator says, in words or in the panel, is the one that a plain formula gives of the scene."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import bpy

import numpy as np
import plain_figures as plain
import pytest
import scenes
from operator_runs import lines_told, numbers
from sphere_shapes import blob


@pytest.fixture
def said(package, capfd):
    """Run an operator: the numbers of the words it reports, and the rows it leaves in the panel."""

    def run(name, **arguments):
        told = [line for line in lines_told(capfd, name, **arguments) if line.startswith("Info: ")]
        summary = package("session.last_run").state.summary
        return numbers(" ".join(told)), dict(summary.rows) if summary else {}

    return run


def squares():
    """A square of 2 x 2 and one of 1 x 1, a quarter above the corner of it."""
    found = []
    for name, side, height in (("Large", 2.0, 0.0), ("Small", 1.0, 0.25)):
        k = np.linspace(0, side, 9)
        x, y = np.meshgrid(k, k)
        points = np.column_stack([x.ravel(), y.ravel(), np.full(81, height)])
        a = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
        found.append(scenes.add(points, np.column_stack([a, a + 1, a + 10, a + 9]), name))
    return found


def spheres(*counts):
    """Objects of so many closed bodies each."""
    found = []
    V, F = blob(1, seed=1)
    for k, count in enumerate(counts):
        points = np.concatenate([V * [1, 1.3, 0.8] + [3 * i, 5 * k, 0] for i in range(count)])
        faces = np.concatenate([F + i * len(V) for i in range(count)])
        found.append(scenes.add(points, faces, f"Bodies {k}"))
    scenes.select(found)
    return found


def test_distortion_is_that_of_the_faces(package, said):
    plain.two_patches()
    # The second lies on the first by a part of it.
    B = bpy.data.objects["B"]
    scenes.set_uv(B, scenes.uv_of(B) - [1.05, 0.0])
    P, UV, *_ = plain.read()
    area, signed, shear = plain.areas(P), plain.signed(UV), plain.shears(P, UV)
    ratio = signed / np.abs(signed).sum() / (area / area.sum())
    told, rows = said("uv.omt_measure")
    density = np.sqrt(np.abs(signed).sum() / area.sum())
    good = signed > 0
    assert numbers(rows["Area error"]) == pytest.approx([100 * np.abs(ratio - 1) @ area / area.sum()], abs=0.006)
    assert numbers(rows["Shear"]) == pytest.approx([shear[good] @ area[good] / area[good].sum()], abs=6e-4)
    assert numbers(rows["Folded faces"]) == [(~good).sum()] and numbers(rows["Islands"]) == [2]
    texels = numbers(rows["Texel density"])[0] * (100 if "cm" in rows["Texel density"] else 1)
    assert texels == pytest.approx(package("settings").DEFAULT_TEXTURE_SIZE * density, rel=1e-3)
    covered = plain.overlap(UV)
    assert covered > 0.2 and numbers(rows["Overlap"])[0] / 100 == pytest.approx(covered, abs=0.03)
    # The words say the same.
    for name in ("Area error", "Shear"):
        assert any(value == pytest.approx(numbers(rows[name])[0], abs=0.051) for value in told), (name, told)


def test_distances_are_those_of_both_ways(package, said, monkeypatch):
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 20_000)
    large, small = squares()
    scenes.select([large, small])
    diagonal, height = np.sqrt(8), 0.25
    hausdorff, ways = np.sqrt(2 + height**2), (height**2 + 1 / 3, height**2)
    told, _ = said("object.omt_distance")
    expected = [100 * hausdorff / diagonal, 100 * np.sqrt(np.mean(ways)) / diagonal, height]
    assert told == pytest.approx(expected, rel=2e-3)
    # The other way round lengths are shares of the small one's diagonal.
    scenes.select([small, large])
    told, _ = said("object.omt_distance")
    assert told == pytest.approx([2 * expected[0], 2 * expected[1], hausdorff], rel=2e-3)


def test_the_rows_of_a_diagram_are_about_its_cells(package, said):
    first = scenes.bump(4, 3, name="First")
    obj = scenes.bump(offset=3.0)
    scenes.select([first, obj])
    told, rows = said("object.omt_diagram", domain="SQUARE")
    made = bpy.data.objects["Bump_cells"]
    assert rows["Cells"] == str(len(made.data.polygons)) and told[-1] == len(made.data.polygons)
    assert len(made.data.polygons) == len(obj.data.vertices)
    operator = scenes.stand_in("object.omt_diagram", domain="SQUARE")
    found = package("pipelines.measuring.diagrams").diagram
    reading = package("blender.mesh").read(obj)
    found = package("solver.progress").drain(found(reading.surface, reading.faces, "square"))
    operator.finish(bpy.context, (obj, replace(found, residual=0.025)))
    assert dict(operator.said)["Area error"] == "2.5 %"


def test_regions_are_counted(said):
    obj = scenes.bump()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    for count in (1, 2, 3):
        obj.vertex_groups.new(name=f"group {count}").add(list(range(9 * count)), 1.0, "REPLACE")
        assert said("uv.omt_regions", kind="GROUPS")[0] == [count]


@pytest.mark.parametrize("kind", ["MATERIALS", "GROUPS", "ATTRIBUTE"])
@pytest.mark.parametrize("bare", [0, 1])
def test_regions_are_those_of_all_objects_also_where_one_has_none(said, kind, bare):
    objects = [scenes.bump(4, 3, name="First"), scenes.bump(4, 3, name="Second", offset=2.0)]
    for obj in objects:
        scenes.set_uv(obj, scenes.seen_from_above(obj, 0.2))
    mesh = objects[1 - bare].data
    if kind == "MATERIALS":
        for name in ("red", "blue"):
            mesh.materials.append(bpy.data.materials.new(name))
        mesh.polygons[2].material_index = 1
    elif kind == "GROUPS":
        for k in range(2):
            objects[1 - bare].vertex_groups.new(name=f"group {k}").add(list(range(9 + k)), 1.0, "REPLACE")
    else:
        mesh.attributes.new("kind", "INT", "FACE").data.foreach_set("value", [1 + k % 2 for k in range(12)])
    # Faces without a material are a region of their own; those without a value are none.
    told, _ = said("uv.omt_regions", kind=kind, attribute="kind" if kind == "ATTRIBUTE" else "")
    assert told == [3 if kind == "MATERIALS" else 2]


@pytest.mark.parametrize("count", [1, 2])
def test_faces_of_empty_slots_are_a_region_beside_those_of_materials(said, count):
    for k in range(count):
        obj = scenes.bump(4, 3, name=f"Patch {k}", offset=2.0 * k)
        scenes.set_uv(obj, scenes.seen_from_above(obj, 0.2))
        obj.data.materials.append(bpy.data.materials.new(f"own {k}"))
        obj.data.materials.append(None)
        for face in range(5):
            obj.data.polygons[face].material_index = 1
    assert said("uv.omt_regions", kind="MATERIALS")[0] == [count + 1]


@pytest.mark.parametrize("count", [2, 5])
def test_parts_that_are_opened_are_counted_over_all_objects(said, count):
    found = spheres(count, 1)
    told, _ = said("uv.omt_seams", max_shear=0.0, extremities=0)
    assert told == [count + 1, sum(edge.use_seam for obj in found for edge in obj.data.edges)]


def test_worst_faces_are_counted(said):
    plain.two_patches()
    for figure in ("AREA", "SHEAR", "FOLDS"):
        told, _ = said("uv.omt_worst", figure=figure, share=10.0)
        scenes.leave_edit()
        assert told == [sum(p.select for obj in bpy.data.objects for p in obj.data.polygons)] and told[0] > 1, figure


def test_what_was_selected_does_not_narrow_the_worst(said):
    plain.two_patches()
    told, _ = said("uv.omt_worst", figure="AREA", share=10.0)
    for _ in range(2):
        # In Edit Mode now, with these faces alone selected.
        assert said("uv.omt_worst", figure="AREA", share=10.0)[0] == told


@pytest.mark.parametrize("unit,metres", [("CM", 0.01), ("M", 1.0), ("IN", 0.0254)])
@pytest.mark.parametrize("scale", [1.0, 0.01])
def test_densities_are_pixels_for_every_length(said, unit, metres, scale):
    bpy.context.scene.unit_settings.scale_length = scale
    plain.two_patches()
    P, UV, *_ = plain.read()
    density = 512 * np.sqrt(np.abs(plain.signed(UV)).sum() / plain.areas(P).sum()) / scale * metres
    told, _ = said("uv.omt_density_get", unit=unit, texture_size=512)
    assert told == pytest.approx([density, 512], rel=1e-3)


@pytest.mark.parametrize("unit", ["CM", "M", "IN"])
def test_a_density_that_was_measured_is_set_in_the_unit_and_for_the_texture_that_it_was_measured_in(said, unit):
    plain.two_patches()
    told, _ = said("uv.omt_density_get", unit=unit, texture_size=640)
    taken = bpy.context.window_manager.operator_properties_last("uv.omt_density_set")
    assert (taken.unit, taken.texture_size) == (unit, 640) and taken.density == pytest.approx(told[0], rel=1e-3)
    given = {name: getattr(taken, name) for name in ("density", "unit", "texture_size")}
    assert bpy.ops.uv.omt_density_set(**{**given, "density": 3 * taken.density}) == {"FINISHED"}
    again, _ = said("uv.omt_density_get", unit=unit, texture_size=640)
    assert again[0] == pytest.approx(3 * told[0], rel=1e-3)


def test_cells_are_counted_and_their_areas_are_equal(said):
    found = spheres(1, 1)
    told, rows = said("mesh.omt_partition", cells=5, write="ATTRIBUTE")
    assert told[0] == float(rows["Cells"]) == 10
    worst = 0.0
    for obj in found:
        (name,) = (a.name for a in obj.data.attributes if a.domain == "FACE" and a.data_type == "INT"
                   and not a.name.startswith(".") and a.name != "material_index")  # fmt: skip
        cell = np.array([d.value for d in obj.data.attributes[name].data])
        share = np.bincount(cell - cell.min(), [p.area for p in obj.data.polygons])
        worst = max(worst, np.abs(share / share.mean() - 1).max())
    assert numbers(rows["Of whole faces"])[0] == pytest.approx(100 * worst, rel=0.06)


def test_strain_is_that_of_the_faces(said):
    plain.two_patches()
    bpy.context.view_layer.objects.active = bpy.data.objects["A"]
    scenes.select([bpy.data.objects["A"]])
    P, UV, *_ = plain.read("A")
    shear = np.where(plain.signed(UV) > 0, plain.shears(P, UV), np.inf)
    size = np.where(np.isfinite(shear), (shear - 1) / (shear + 1), 1.0)
    told, _ = said("object.omt_strain", of="UV")
    assert told[-1] == pytest.approx(size @ plain.areas(P) / plain.areas(P).sum(), abs=6e-4)


def test_landmarks_are_counted(said):
    found = spheres(1, 1)
    assert said("object.omt_landmarks_suggest", most=4)[0][0] == len(found[0].children) == len(found[1].children)
    there = len(found[0].children) + len(found[1].children)
    assert said("object.omt_landmarks_clear")[0] == [there] and not found[0].children


def test_a_new_mesh_is_counted(said):
    spheres(1, 1)
    _, rows = said("object.omt_remesh", target_vertices=80)
    made = [obj.data for obj in bpy.context.selected_objects]
    assert len(made) == 2
    assert rows["Vertices"] == str(sum(len(m.vertices) for m in made))
    assert rows["Triangles"] == str(sum(len(m.polygons) for m in made))
    angles = []
    for mesh in made:
        P = np.array([[mesh.vertices[v].co[:] for v in p.vertices] for p in mesh.polygons])
        side = [P[:, (k + 1) % 3] - P[:, k] for k in range(3)]
        side = [s / np.linalg.norm(s, axis=1)[:, None] for s in side]
        angles.append(np.min([np.arccos(-np.einsum("md,md->m", side[k], side[k - 1])) for k in range(3)], axis=0))
    least = np.degrees(np.percentile(np.concatenate(angles), 1))
    assert numbers(rows["Angles, 99 %"])[0] == pytest.approx(least, abs=0.06)
    following = bpy.context.view_layer.objects.active
    told, _ = said("object.omt_compare")
    shown = bpy.context.view_layer.objects.active
    assert shown != following and told[-1] == len(shown.data.vertices)


@pytest.mark.parametrize("name", ["uv.omt_stack", "uv.omt_rectify"])
def test_islands_that_changed_are_counted(said, name):
    found = [scenes.bump(3, 2, 0.0, f"Flat {k}", 2.0 * k) for k in range(3)]
    scenes.select(found)
    for k, obj in enumerate(found):
        uv = scenes.seen_from_above(obj, 0.2)
        scenes.set_uv(obj, uv + [0.1 * k, 0.2] + 0.01 * np.sin(9 * uv[:, ::-1] + k))
    before = [scenes.uv_of(obj) for obj in found]
    told, _ = said(name)
    assert told == [sum((scenes.uv_of(obj) != uv).any() for obj, uv in zip(found, before, strict=True))]


def test_a_preview_shows_what_the_histogram_shows(said):
    seen = []
    for factor in (1.0, 3.0):
        plain.two_patches()
        for obj in bpy.context.selected_objects:
            uv = scenes.uv_of(obj)
            scenes.set_uv(obj, uv * [factor, 1.0] + 0.1 * factor * uv[:, ::-1] ** 2)
        said("uv.omt_histogram")
        image = bpy.data.images["OMT UV Histogram"]
        preview = np.array(image.preview.image_pixels_float[:])
        assert preview.size and np.ptp(preview) > 0.2
        seen.append(preview)
        for obj in list(bpy.data.objects):
            bpy.data.objects.remove(obj)
    assert seen[0].shape != seen[1].shape or np.abs(seen[0] - seen[1]).max() > 0.2


def test_a_report_is_about_what_is_selected(package):
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    parent.scale = (1.0, 2.0, 4.0)
    obj = scenes.bump(4, 3)
    obj.parent, obj.scale = parent, (3.0, 1.0, 0.5)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    scenes.cube("Not selected")
    scenes.select([obj])
    bpy.context.view_layer.update()
    (line,) = (x for x in package("operators.report").report_text(bpy.context).splitlines() if x.startswith("mesh "))
    mesh = obj.data
    expected = [1, len(mesh.vertices), len(mesh.edges), len(mesh.polygons), len(mesh.uv_layers)]
    assert numbers(line) == pytest.approx([*expected, 3.0, 2.0, 2.0])


@pytest.mark.parametrize("count", [1, 3, 4, 14])
def test_what_is_said_of_many_objects_is_said_once(package, count):
    """But for numbers; other words of the same objects, and what is about none of them, stand beside it."""
    base, state = package("operators.base"), package("session.last_run").state
    objects, told = [SimpleNamespace(name=f"Part {k}") for k in range(count)], []
    operator = SimpleNamespace(report=lambda kind, text: told.append((kind, text)))
    before = list(state.notices)
    state.notices.clear()
    every = [(k, f"{195 + k} boundary vertices lie on others") for k in range(count)]
    try:
        base.warn(
            operator, objects, [*every, (0, "1.5 is much"), (0, "1.5 is much"), (-1, "2 of none"), (-1, "3 of none")]
        )
        notices = [notice.text for notice in state.notices]
    finally:
        state.notices[:] = before
    assert all(kind == {"WARNING"} for kind, _ in told) and len(notices) == len(told)
    named = [text for _, text in told if "boundary" in text]
    if count > 3:
        assert named == [f"Part 0 and {count - 1} other objects: 195 boundary vertices lie on others"]
        assert named[0] in notices
    else:
        assert named == [f"Part {k}: {195 + k} boundary vertices lie on others" for k in range(count)]
    assert [text for _, text in told if "boundary" not in text] == [
        "Part 0: 1.5 is much (2 islands)",
        "2 of none",
        "3 of none",
    ]


@pytest.mark.parametrize("counts", [(1,), (5,), (1, 4), (2, 2, 2), (6, 1, 1), (1, 1, 1, 1), (3, 1, 2, 2, 1)], ids=str)
def test_several_texts_of_one_object_are_no_more_objects(package, counts):
    """The same is said once for all from four objects on, however often it is said of each."""
    base, state = package("operators.base"), package("session.last_run").state
    objects, told = [SimpleNamespace(name=f"Part {k}") for k in range(len(counts))], []
    operator = SimpleNamespace(report=lambda kind, text: told.append(text))
    texts = [(k, f"{10 * k + j} edges are bent") for k, count in enumerate(counts) for j in range(count)]
    before = list(state.notices)
    try:
        base.warn(operator, objects, texts)
    finally:
        state.notices[:] = before
    if len(counts) > base.MOST_NAMED:
        assert told == [f"Part 0 and {len(counts) - 1} other objects: 0 edges are bent"]
    else:
        assert told == [f"Part {k}: {text}" for k, text in texts]


@pytest.mark.parametrize("own", [(), ("Shear",), ("Shear", "Overlap"), ("Area error", "Shear", "Folded faces")])
def test_rows_that_an_operator_says_itself_stand_for_those_measured_and_are_never_marked(package, monkeypatch, own):
    """A sign of what is out of bounds belongs to the figure that was judged, not to another one of its name."""
    base, last_run = package("operators.base"), package("session.last_run")
    obj = scenes.bump(4, 4)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    measured = last_run.Figures(
        (("Area error", "a"), ("Shear", "b"), ("Islands", "1")), frozenset({"Area error", "Shear"})
    )
    overlap = last_run.Figures((("Overlap", "c"),), frozenset({"Overlap"}))
    monkeypatch.setattr(base, "figures_of", lambda *of: measured)
    operator = scenes.stand_in("uv.omt_refine")
    monkeypatch.setattr(type(operator), "_gate", lambda self, readings: overlap)
    monkeypatch.setattr(type(operator), "finish", lambda self, context, result: None)
    operator.said = tuple((name, "own") for name in own)
    operator._finish(bpy.context, None, 1.0)
    summary = last_run.state.summary
    names = [name for name, _ in summary.rows]
    assert len(names) == len(set(names)) and dict(summary.rows).items() >= dict.fromkeys(own, "own").items()
    assert summary.beyond == {"Area error", "Shear", "Overlap"} - set(own)
    assert names[: len(own)] == list(own) and set(names) == {"Area error", "Shear", "Islands", "Overlap", "Time", *own}
