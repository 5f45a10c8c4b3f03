"""What is read, chosen and written where something like it stands beside it: a second layer with pins of its own, a
scale that is nearly even, elements that were chosen before, materials of the object and of the mesh, sides turned back.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations, product

import bpy

import numpy as np
import pytest
import scenes
from mathutils import Matrix

MODES = ("OBJECT", "EDIT")
KINDS = ("vertex", "edge", "face")


@pytest.mark.parametrize(("mode", "active", "asked"), list(product(MODES, ("A", "B"), ("A", "B", "", "none"))))
def test_uvs_and_pins_are_those_of_the_layer_that_is_named_whichever_is_active(package, mode, active, asked):
    mesh = package("blender.mesh")
    obj = scenes.bump(2, 2)
    uv, pinned = {}, {}
    for k, name in enumerate("AB"):
        uv[name] = scenes.seen_from_above(obj, 0.3 + 0.2 * k)
        scenes.set_uv(obj, uv[name], name)
        pinned[name] = scenes.pin(obj, [k, 4 + k], name)
    obj.data.uv_layers.active = obj.data.uv_layers[active]
    if mode == "EDIT":
        scenes.edit(obj)
    found = mesh.read(obj, asked)
    meant = asked if asked in uv else active
    np.testing.assert_array_equal(found.uv, uv[meant])
    np.testing.assert_array_equal(found.pinned, pinned[meant])
    # What is written to one of them leaves the other one, and which is active.
    mesh.write_uv(obj, meant, np.arange(3), np.full((3, 2), 0.5))
    (other,) = {"A", "B"} - {meant}
    np.testing.assert_array_equal(scenes.uv_of(obj, other), uv[other])
    assert (scenes.uv_of(obj, meant)[:3] == 0.5).all() and obj.data.uv_layers.active.name == active


@pytest.mark.parametrize("off", [0.0, 1e-4, 1e-3, 1e-2, -0.1])
def test_a_scale_that_is_nearly_even_is_taken_as_it_is(package, off):
    obj = scenes.bump()
    obj.scale = scales = np.array([2.0, 2.0 * (1 + off), 2.0 * (1 - off / 2)])
    bpy.context.view_layer.update()
    np.testing.assert_allclose(package("blender.mesh").stretch(obj), np.diag(scales), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("count", [6, 7, 8])
def test_a_layer_is_refused_where_there_are_eight_and_before_anything_is_made(package, count):
    mesh = package("blender.mesh")
    obj = scenes.bump(1, 1)
    for k in range(count):
        obj.data.uv_layers.new(name=f"{k}")
    mesh.check_target(obj, "")
    mesh.check_target(obj, "3")
    if count < 8:
        mesh.check_target(obj, "New")
    else:
        with pytest.raises(mesh.TargetError, match="8 UV layers, the most"):
            mesh.check_target(obj, "New")


def chosen(obj, kind):
    """Indices of the selected elements of a kind, and how many there are."""
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    elements = {"vertex": obj.data.vertices, "edge": obj.data.edges, "face": obj.data.polygons}[kind]
    return [element.index for element in elements if element.select]


@pytest.mark.parametrize(("mode", "kind", "before"), list(product(MODES, KINDS, ("all", "none", "some"))))
def test_what_an_error_is_about_is_chosen_and_nothing_of_what_was_chosen_before(package, mode, kind, before):
    obj = scenes.bump(3, 3)
    # One vertex is of no edge.
    obj.data.vertices.add(1)
    scenes.edit(obj, faces={"all": None, "none": [], "some": [8]}[before])
    if before == "all":
        bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
        bpy.ops.mesh.select_all(action="SELECT")
    bpy.context.scene.tool_settings.mesh_select_mode = (True, True, True)
    if mode == "OBJECT":
        scenes.leave_edit()
    edges = obj.data.edges
    ends = [tuple(edges[k].vertices) for k in (0, 3)]
    elements = {"vertex": np.array([0, 5]), "edge": np.array(ends), "face": np.array([0, 4])}[kind]
    package("blender.mesh").select_elements(obj, kind, elements)
    assert chosen(obj, kind) == {"vertex": [0, 5], "edge": [0, 3], "face": [0, 4]}[kind]
    expected = {
        "vertex": {0, 5},
        "edge": {v for pair in ends for v in pair},
        "face": {v for k in (0, 4) for v in obj.data.polygons[k].vertices},
    }[kind]
    assert set(chosen(obj, "vertex")) == expected
    if kind == "vertex":
        assert chosen(obj, "face") == []


@pytest.mark.parametrize("off", [0.0, 1e-4, 1e-3, 1e-2])
def test_objects_share_a_new_mesh_only_at_one_scale_along_every_axis(package, off):
    remesh = package("blender.remesh_objects")
    first = scenes.bump()
    found = [first]
    for k, axes in enumerate([(1, 1, 1), (1 + off, 1 / (1 + off), 1)]):
        obj = bpy.data.objects.new(f"{k}", first.data)
        bpy.context.collection.objects.link(obj)
        obj.matrix_world = Matrix.Rotation(0.3 + k, 4, "X") @ Matrix.Diagonal((*axes, 1))
        found.append(obj)
    bpy.context.view_layer.update()
    together = [[obj.name for obj in group] for group in remesh.alike(found, applied=False)]
    assert together == ([["Bump", "0", "1"]] if off == 0 else [["Bump", "0"], ["1"]])
    assert len(remesh.alike(found, applied=True)) == 3


@pytest.fixture(scope="module")
def remeshed(package):
    """A level of a curved patch, made once."""
    from omt_uv.solver.progress import drain

    settings = package("settings").RemeshSettings(count=30)
    scenes.open_empty()
    request = package("blender.remesh_objects").read_request(scenes.bump(), settings)
    return request, drain(package("pipelines.remesh").remesh_series(request.job, settings))


def made_of(package, remeshed, change=lambda level: level):
    remesh = package("blender.remesh_objects")
    request, series = remeshed
    series = replace(series, levels=[change(level) for level in series.levels])
    obj = scenes.bump()
    names = remesh.new_objects([obj], request, series, remesh.carried_attributes(request, series))
    return obj, [bpy.data.objects[name] for name in names]


def test_triangles_that_are_to_look_back_are_turned_over_and_no_others(package, remeshed):
    def some_back(level):
        return replace(level, back=np.arange(len(level.triangles)) % 3 == 1)

    _, (plain,) = made_of(package, remeshed)
    _, (turned,) = made_of(package, remeshed, some_back)
    normals = [np.array([p.normal[:] for p in obj.data.polygons]) for obj in (plain, turned)]
    same = (normals[0] * normals[1]).sum(axis=1)
    np.testing.assert_allclose(same, np.where(np.arange(len(same)) % 3 == 1, -1, 1), atol=1e-5)


@pytest.mark.parametrize("links", list(permutations(("DATA", "OBJECT"))), ids=str)
def test_a_new_object_has_each_material_where_the_old_one_has_it(package, remeshed, links):
    obj = scenes.bump()
    for k, link in enumerate(links):
        obj.data.materials.append(bpy.data.materials.new(f"of the mesh {k}"))
        obj.material_slots[k].link = link
        if link == "OBJECT":
            obj.material_slots[k].material = bpy.data.materials.new(f"of the object {k}")
    remesh = package("blender.remesh_objects")
    request, series = remeshed
    (name,) = remesh.new_objects([obj], request, series, remesh.carried_attributes(request, series))
    new = bpy.data.objects[name]
    assert [slot.link for slot in new.material_slots] == list(links)
    assert [slot.material for slot in new.material_slots] == [slot.material for slot in obj.material_slots]
    assert list(new.data.materials) == list(obj.data.materials)


@pytest.mark.parametrize("order", list(permutations("abc")), ids="".join)
def test_a_family_has_its_source_first_and_then_the_finest_whatever_their_names(package, order):
    remesh = package("blender.remesh_objects")
    source = scenes.bump(3, 3, name="b and a half")
    assert remesh.family(source) == []
    made = [scenes.bump(2 + k, 2, name=name) for k, name in enumerate(order)]
    for obj in made:
        obj[remesh.SOURCE] = source
    for asked in (source, *made):
        assert remesh.family(asked) == [source, *reversed(made)]


@pytest.mark.parametrize(("old", "new"), list(product((False, True), repeat=2)))
def test_folds_that_a_new_object_has_from_the_old_one_are_said_to_be(package, old, new):
    objects = []
    for name, folded in (("Old", old), ("New", new)):
        obj = scenes.bump(4, 4, name=name)
        uv = scenes.seen_from_above(obj, 0.5)
        if folded:
            # One face turned over.
            uv[:4, 0] = 0.25 - uv[:4, 0]
        scenes.set_uv(obj, uv)
        objects.append(obj)
    ((*told,),) = package("blender.remesh_objects").carried_gate(objects[0], ["New"])
    assert [text for text in told if "folded" in text] == (
        [f"New: 1 face is folded in the UVs{', as before' if old else ''}"] if new else []
    )


@pytest.mark.parametrize("there", [5, 6, 7])
@pytest.mark.parametrize("name", ["0", "New"])
def test_a_uv_map_that_is_there_already_needs_no_room(package, there, name):
    match, kinds = package("blender.shapes.match_objects"), package("pipelines.attributes")
    obj = scenes.bump(1, 1)
    for k in range(there):
        obj.data.uv_layers.new(name=f"{k}")
    layers = tuple(kinds.Layer(of, "CORNER", "FLOAT2", np.zeros((4, 2), np.float32)) for of in (name, "1"))
    none = np.zeros(0, bool)
    marks = kinds.Marks(np.zeros((0, 2), np.int64), none, none, np.zeros(0))
    given = kinds.Attributes(np.zeros(1, int), np.ones(1, bool), marks, layers)
    match.check_room(obj, given, {"uv"})
    for k in range(there, 8):
        obj.data.uv_layers.new(name=f"{k}")
    if name == "New":
        with pytest.raises(match.MatchError, match="more than 8 UV maps"):
            match.check_room(obj, given, {"uv"})
    else:
        match.check_room(obj, given, {"uv"})


@pytest.mark.parametrize(("first", "active", "rendered"), list(product("AB", "AB", "AB")))
def test_which_layers_are_active_and_rendered_is_kept_whatever_their_order(package, first, active, rendered):
    obj = scenes.bump(2, 2)
    for name in sorted("AB", reverse=first == "B"):
        scenes.set_uv(obj, scenes.seen_from_above(obj, 0.5), name)
        obj.data.color_attributes.new(f"of {name}", "BYTE_COLOR", "CORNER")
    obj.data.uv_layers.active = obj.data.uv_layers[active]
    obj.data.uv_layers[rendered].active_render = True
    obj.data.attributes.active_color_name, obj.data.attributes.default_color_name = f"of {active}", f"of {rendered}"
    read = package("blender.read_attributes").read_attributes
    other = scenes.bump(2, 2, name="Other")
    package("blender.write_attributes").write_attributes(other, read(obj.data, ()))
    assert other.data.uv_layers.active.name == active
    assert [layer.name for layer in other.data.uv_layers if layer.active_render] == [rendered]
    there = other.data.attributes
    assert (there.active_color_name, there.default_color_name) == (f"of {active}", f"of {rendered}")


@pytest.mark.parametrize("seed", range(4))
def test_marks_go_to_the_edges_that_they_name_in_whatever_order(package, seed):
    kinds, writing = package("pipelines.attributes"), package("blender.write_attributes")
    obj = scenes.bump(3, 3)
    ends = np.array([edge.vertices[:] for edge in obj.data.edges])
    rng = np.random.default_rng(seed)
    some = rng.permutation(len(ends))[:10]
    edges = np.where(rng.random((10, 1)) > 0.5, ends[some], ends[some][:, ::-1])
    seam, sharp, crease = rng.random(10) > 0.5, rng.random(10) > 0.5, rng.random(10).astype(np.float32)
    layers = (
        kinds.Layer("count", "EDGE", "INT", np.arange(1, 11)[:, None].astype(np.int32)),
        kinds.Layer("way", "EDGE", "FLOAT_VECTOR", rng.random((10, 3)).astype(np.float32)),
    )
    writing._write_marks(obj.data, kinds.Marks(edges, seam, sharp, crease, layers))
    for name, expected in (("use_seam", seam), ("use_edge_sharp", sharp)):
        found = np.array([getattr(edge, name) for edge in obj.data.edges])
        assert (found[some] == expected).all() and found.sum() == expected.sum()
    for name, key, expected in (
        ("crease_edge", "value", crease), ("count", "value", layers[0].values), ("way", "vector", layers[1].values),
    ):  # fmt: skip
        width = expected.size // 10
        found = np.zeros(width * len(ends), np.float32 if name != "count" else np.int32)
        obj.data.attributes[name].data.foreach_get(key, found)
        found = found.reshape(len(ends), width)
        np.testing.assert_array_equal(found[some], expected.reshape(10, width))
        assert not np.delete(found, some, axis=0).any()


@pytest.mark.parametrize(("layers", "active"), [(1, 0), (2, 0), (2, 1), (3, 1), (3, 2)])
def test_what_goes_into_a_file_is_the_active_layer_among_all(package, layers, active):
    obj = scenes.bump(2, 2)
    uv = [scenes.seen_from_above(obj, 0.2 + 0.1 * k) for k in range(layers)]
    for k in range(layers):
        scenes.set_uv(obj, uv[k], f"{k}")
    obj.data.uv_layers.active_index = active
    found = package("files.saving")._imported(obj)
    assert found.layer == active and len(found.layers) == layers
    np.testing.assert_array_equal(found.uv, uv[active])
    for mine, theirs in zip(found.layers, uv, strict=True):
        np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize("chosen", [(), (0,), (1,), (0, 1), (0, 1, 2), (2,), (0, 2)])
def test_figures_are_those_of_exactly_the_objects_that_are_chosen_or_of_none(package, chosen):
    last_run = package("session.last_run")
    objects = [scenes.bump(name=f"{k}", offset=2.0 * k) for k in range(3)]
    scenes.select(objects[:2])
    assert bpy.ops.uv.omt_unwrap(quality="DRAFT", max_shear=0.0) == {"FINISHED"}
    scenes.select([objects[k] for k in chosen])
    assert last_run.look_again() == ("" if chosen in ((), (0, 1)) else "others are selected")
    last_run.forget()


@pytest.mark.parametrize("levels", [0, 1, 2])
def test_the_panel_has_the_texel_density_of_what_is_rendered(package, levels):
    last_run, read = package("session.last_run"), package("blender.mesh").read
    density, evaluated = package("pipelines.texel_density"), package("pipelines.subdivision").evaluated
    obj = scenes.cube()
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.5, (0.1, 0.2)) + 0.05 * np.arange(24)[:, None] % 0.3)
    if levels:
        modifier = obj.modifiers.new("Smooth", "SUBSURF")
        modifier.levels = modifier.render_levels = levels
    rows = dict(last_run.figures([read(obj)], 1024, 1.0).rows)
    texels = density.Texels(1024, 1.0)
    expected, plain = (density.texel_density([r], texels) for r in (evaluated(read(obj)), read(obj)))
    assert rows["Texel density"] == last_run.density_text(expected)
    assert (expected == pytest.approx(plain, rel=0.05)) == (levels == 0)


def test_levels_of_detail_each_have_the_features_that_they_can_show(package, remeshed, monkeypatch):
    remesh, drain = package("pipelines.remesh"), package("solver.progress").drain
    request, series = remeshed
    shown, seen = [np.array([[0, 1], [1, 2]]), np.array([[0, 1], [2, 3]]), np.array([[0, 1], [1, 2]])], []

    def level(job, source, *_):
        seen.append(source)
        yield from ()
        return series.levels[0]

    features = iter(shown)
    monkeypatch.setattr(remesh, "_features", lambda *_: (next(features), ()))
    monkeypatch.setattr(remesh, "_level", level)
    monkeypatch.setattr(remesh, "_crossings", lambda *_: ())
    drain(remesh.remesh_series(request.job, package("settings").RemeshSettings(count=40, levels=3)))
    assert [source.features.tolist() for source in seen] == [x.tolist() for x in shown]
    # Where they are the same, so are the maps.
    assert seen[0] is seen[2]


@pytest.mark.parametrize("links", list(product(("DATA", "OBJECT"), repeat=2)), ids=str)
def test_a_checker_keeps_materials_where_they_were_and_takes_only_its_own_away(package, links):
    checker = package("blender.checker")
    first = scenes.bump(2, 2)
    for k in range(2):
        first.data.materials.append(bpy.data.materials.new(f"of the mesh {k}"))
    second = bpy.data.objects.new("Second", first.data)
    bpy.context.collection.objects.link(second)
    for obj in (first, second):
        for k, link in enumerate(links):
            obj.material_slots[k].link = link
            if link == "OBJECT":
                obj.material_slots[k].material = bpy.data.materials.new(f"{obj.name} {k}")
    objects = (first, second)
    before = [[(slot.link, slot.material) for slot in obj.material_slots] for obj in objects]
    # What nobody uses is not the checker's.
    unused = bpy.data.materials.new("unused"), bpy.data.images.new("unused", 8, 8)
    for obj in objects:
        checker.put(obj, "COLOR_GRID", 64)
    assert all(checker.has_checker(slot.material) for obj in objects for slot in obj.material_slots)
    # What is of the mesh is given back to both at once, what is of an object to that one.
    checker.take_off(first)
    assert [(slot.link, slot.material) for slot in first.material_slots] == before[0]
    assert [checker.has_checker(slot.material) for slot in second.material_slots] == [k == "OBJECT" for k in links]
    checker.take_off(second)
    checker.tidy()
    assert [[(slot.link, slot.material) for slot in obj.material_slots] for obj in objects] == before
    assert unused[0].name in bpy.data.materials and unused[1].name in bpy.data.images
    assert not [m for m in (*bpy.data.materials, *bpy.data.images) if checker.has_checker(m)]


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_colours_of_several_objects_are_those_that_each_has_alone(package, count):
    overlay, read = package("display.overlay"), package("blender.mesh").read
    objects = [scenes.bump(2 + k, 3, 0.3 + 0.2 * k, name=f"{k}", offset=2.0 * k) for k in range(count)]
    for obj in objects:
        scenes.set_uv(obj, scenes.seen_from_above(obj, 0.3))

    def colours(some):
        overlay.show(bpy.context, [(obj, read(obj)) for obj in some], "SHEAR")
        name = package("blender.colour_attributes").ATTRIBUTE
        found = []
        for obj in some:
            values = np.zeros(4 * len(obj.data.loops), np.float32)
            obj.data.attributes[name].data.foreach_get("color", values)
            found.append(values)
        overlay.hide(bpy.context)
        return found

    together = colours(objects)
    for obj, found in zip(objects, together, strict=True):
        np.testing.assert_array_equal(found, colours([obj])[0])


@pytest.mark.parametrize("coloured", [0, 1, 2])
def test_colours_are_hidden_by_undo_only_where_no_mesh_has_them_any_more(package, coloured):
    overlay, read = package("display.overlay"), package("blender.mesh").read
    objects = [scenes.bump(2, 2, name=name) for name in "AB"]
    for obj in objects:
        scenes.set_uv(obj, scenes.seen_from_above(obj, 0.3))
    overlay.show(bpy.context, [(obj, read(obj)) for obj in objects], "AREA")
    for obj in objects[coloured:]:
        package("blender.colour_attributes").remove_colours(obj)
    overlay._after_undo()
    assert overlay.kind() == ("AREA" if coloured else "NONE")
    overlay.hide(bpy.context)


def test_colours_of_a_library_stay_in_it(package, tmp_path):
    colours, overlay = package("blender.colour_attributes"), package("display.overlay")
    obj = scenes.bump(2, 2)
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.3))
    colours.write_colours(obj, np.arange(4), np.zeros((4, 3)))
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {obj})
    scenes.open_empty()
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (source, target):
        target.objects = list(source.objects)
    (linked,) = target.objects
    bpy.context.collection.objects.link(linked)
    own = scenes.bump(2, 2, name="Own")
    scenes.set_uv(own, scenes.seen_from_above(own, 0.3))
    overlay.show(bpy.context, [(own, package("blender.mesh").read(own))], "AREA")
    overlay.hide(bpy.context)
    assert colours.has_colours(linked.data) and not colours.has_colours(own.data)
