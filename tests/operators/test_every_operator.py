"""What holds for every operator, by reflection: no operator can be added that does not keep to it."""

from __future__ import annotations

import math

import bpy

import pytest
import scenes


def operators(package):
    """Triples of module, name and class of every operator."""
    classes = [c for c in package("registration").CLASSES if issubclass(c, bpy.types.Operator)]
    return [(*c.bl_idname.split("."), c) for c in classes]


def test_every_float_refuses_nan_and_what_blender_makes_of_infinity(package):
    obj = scenes.bump()
    tried = 0
    for module, name, _ in operators(package):
        operator = getattr(getattr(bpy.ops, module), name)
        for prop in (p for p in operator.get_rna_type().properties if p.type == "FLOAT"):
            for value in (math.nan, math.inf) if prop.hard_max > 3e38 else (math.nan,):
                given = (value,) * prop.array_length if prop.is_array else value
                with pytest.raises(RuntimeError, match=f"{prop.name} is not a finite number"):
                    operator(**{prop.identifier: given})
                assert not obj.data.uv_layers and list(bpy.data.objects) == [obj]
                tried += 1
    assert tried >= 12


def enums(package):
    """Every enum property of operators, groups of properties, and what the extension adds to Blender's own types."""
    owners = [getattr(getattr(bpy.ops, m), n).get_rna_type() for m, n, _ in operators(package)]
    owners += [c.bl_rna for c in package("registration").CLASSES if issubclass(c, bpy.types.PropertyGroup)]
    own = [(o, p) for o in owners for p in o.properties]
    for kind in ("Scene", "Object", "Mesh", "WindowManager", "Image", "Window", "Screen"):
        rna = getattr(bpy.types, kind).bl_rna
        own += [(rna, p) for p in rna.properties if p.is_runtime]
    return [(o, p) for o, p in own if p.type == "ENUM" and len(p.enum_items)]


def test_every_choice_has_a_number_a_word_and_a_default_of_its_own(package):
    """Two items of one number are one choice: the second could never be made."""
    found = enums(package)
    assert len(found) > 20
    for owner, prop in found:
        items, name = list(prop.enum_items), f"{owner.identifier}.{prop.identifier}"
        assert len({i.value for i in items}) == len(items) == len({i.identifier for i in items}), name
        assert len({i.name for i in items}) == len(items), name
        # None is told as another one is.
        assert all(i.description for i in items) and len({i.description for i in items}) == len(items), name
        assert prop.is_enum_flag or prop.default in {i.identifier for i in items}, name


# What reads meshes, or looks at none.
READ_ONLY = {
    "uv.omt_measure",
    "uv.omt_regions",
    "uv.omt_histogram",
    "uv.omt_density_get",
    "uv.omt_layout_image",
    "object.omt_diagram",
    "object.omt_remesh",
}
OTHERS = {
    "uv.omt_preset",
    "wm.omt_copy_report",
    "wm.omt_help",
    "uv.omt_notices",
    "uv.omt_checker_remove",
    "uv.omt_live_end",
    "uv.omt_queue_stop",
    "object.omt_compare",
}
# What is about the active object alone, or finds something else wrong with it.
OF_THE_ACTIVE = {"uv.omt_region_add", "uv.omt_region_remove", "object.omt_distance", "object.omt_strain"}
# What takes long as it is set.
SMALL = {"object.omt_remesh": {"target_vertices": 50}, "uv.omt_layout_image": {"size": 32}}
# What works on two objects; tests/operators/shapes links one of them.
PAIRS = {
    "object.omt_match",
    "object.omt_landmarks",
    "object.omt_landmarks_suggest",
    "object.omt_landmarks_clear",
    "object.omt_similar",
}


@pytest.mark.parametrize("override", [False, True], ids=["linked", "override"])
def test_linked_meshes_are_refused_by_name_by_every_operator_that_writes(package, tmp_path, override):
    """Never said to be done: Blender would not save it."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
    bpy.context.object.name = "Far"
    bpy.context.object.vertex_groups.new(name="region").add(list(range(9)), 1.0, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, data):
        data.objects = ["Far"]
    obj = data.objects[0]
    bpy.context.scene.collection.objects.link(obj)
    if override:
        obj = obj.override_create(remap_local_usages=True)
        obj.data.override_create(remap_local_usages=True)
    before = scenes.uv_of(obj).copy()
    # Before it comes one that could be written to.
    near = scenes.bump(name="A near one", offset=5.0)
    near.vertex_groups.new(name="region").add(list(range(9)), 1.0, "REPLACE")
    scenes.set_uv(near, scenes.seen_from_above(near))
    kept = scenes.state(near)
    names = {cls.bl_idname for *_, cls in operators(package)}
    assert names > READ_ONLY | OTHERS | PAIRS
    for name in sorted(names - OTHERS - PAIRS):
        module, operator = name.split(".")
        run = getattr(getattr(bpy.ops, module), operator)
        obj.hide_set(False)
        for other in bpy.context.view_layer.objects:
            other.select_set(other == obj)
        bpy.context.view_layer.objects.active = obj
        if name in READ_ONLY:
            assert run(**SMALL.get(name, {})) == {"FINISHED"}, name
            continue
        with pytest.raises(RuntimeError, match=r"^Error: Far is (linked from|a library)"):
            run()
        assert (scenes.uv_of(obj) == before).all() and not any(edge.use_seam for edge in obj.data.edges), name
        assert not obj.data.color_attributes and len(obj.vertex_groups) == 1, name
        near.select_set(True)
        bpy.context.view_layer.objects.active = near
        if name in OF_THE_ACTIVE:
            continue
        with pytest.raises(RuntimeError, match=r"^Error: Far is (linked from|a library)"):
            run()
        assert scenes.state(near) == kept and len(near.vertex_groups) == 1, name
