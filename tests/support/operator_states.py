"""States of a file in which operators are called, most of which they refuse: two objects each, so that it shows of
which one they complain; and all that an operator says and leaves besides the meshes."""

from __future__ import annotations

import re
from collections.abc import Callable

import bpy

import scenes
from sphere_shapes import blob

# Operators, and what they are called with.
CALLS: list[tuple[str, dict]] = [
    ("uv.omt_unwrap", {"quality": "DRAFT", "max_shear": 0.0}),
    ("uv.omt_unwrap", {"quality": "DRAFT", "boundary": "RECTANGLE", "corner_group": "gone", "keep_free": "part"}),
    ("uv.omt_refine", {"quality": "DRAFT"}),
    ("uv.omt_magnify", {"quality": "DRAFT", "weight_group": "part", "source": "UV"}),
    ("uv.omt_magnify", {"quality": "DRAFT", "weight_group": "gone", "source": "MESH"}),
    ("uv.omt_magnify", {"quality": "DRAFT", "region": "ATTRIBUTE", "attribute": "gone", "source": "UV"}),
    ("uv.omt_magnify", {"quality": "DRAFT", "weight_group": "part", "further": "gone=2", "source": "UV"}),
    ("uv.omt_magnify", {"quality": "DRAFT", "weight_group": "part", "source": "AUTO"}),
    ("uv.omt_sphere", {"quality": "DRAFT", "fill_holes": False}),
    ("uv.omt_sphere", {"quality": "DRAFT", "orientation": "GROUPS", "pole_group": "gone"}),
    ("uv.omt_sphere", {"quality": "DRAFT", "weight_group": "gone"}),
    ("uv.omt_seams", {"max_shear": 0.0, "extremities": 0}),
    ("uv.omt_density_set", {"density": 40.0}),
    ("uv.omt_density_get", {}),
    ("uv.omt_flow", {"start": (0.5, 0.5), "move": (0.0, 0.05), "radius": 0.2}),
    ("uv.omt_stack", {}),
    ("uv.omt_symmetrize", {}),
    ("uv.omt_rectify", {}),
    ("uv.omt_measure", {}),
    *(("uv.omt_regions", {"kind": kind}) for kind in ("GROUPS", "MATERIALS")),
    ("uv.omt_regions", {"kind": "ATTRIBUTE", "attribute": "gone"}),
    ("uv.omt_worst", {}),
    ("uv.omt_attributes", {}),
    ("uv.omt_overlay", {"show": "SHEAR"}),
    ("uv.omt_histogram", {}),
    ("uv.omt_layout_image", {"size": 32}),
    ("uv.omt_checker", {"size": 256}),
    ("uv.omt_checker_remove", {}),
    *(("uv.omt_remedy", {"action": kind}) for kind in ("MERGE", "DISSOLVE", "NORMALS", "APPLY_LEVEL")),
    ("uv.omt_region_add", {}),
    ("uv.omt_region_remove", {}),
    ("object.omt_weights", {"kind": "GAUSSIAN", "weight_group": "new"}),
    ("object.omt_remesh", {"target_vertices": 40}),
    ("object.omt_remesh", {"target_vertices": 40, "density": "WEIGHTS", "weight_group": "gone"}),
    ("object.omt_compare", {}),
    ("object.omt_diagram", {"domain": "SQUARE"}),
    ("object.omt_distance", {}),
    *(("object.omt_strain", {"of": kind}) for kind in ("UV", "OBJECT", "KEY")),
    ("object.omt_match", {}),
    ("object.omt_landmarks_suggest", {"most": 3}),
    ("object.omt_landmarks_clear", {}),
    ("object.omt_flow", {"move": (0.0, 0.0, 0.05), "samples": 1}),
    ("object.omt_volume", {"tets": 100}),
    ("object.omt_similar", {"index": "/gone.npz"}),
    ("mesh.omt_partition", {"cells": 3, "relax": 0, "write": "ATTRIBUTE"}),
    ("mesh.omt_partition", {"cells": 3, "relax": 0, "write": "FACE_SETS", "capacity_group": "part"}),
    *(("mesh.omt_partition", {"cells": 3, "relax": 0, "write": kind}) for kind in ("MESH", "POINTS")),
    ("uv.omt_queue", {}),
]  # fmt: skip
# What takes long is called where it is refused at once.
LONG = {"object.omt_match", "object.omt_volume", "object.omt_remesh", "uv.omt_queue", "object.omt_landmarks_suggest",
        "object.omt_flow", "uv.omt_sphere", "object.omt_diagram"}  # fmt: skip


def _patches(uvs: bool = True) -> list:
    """Two curved patches, B is wider, with groups of which one is empty."""
    found = [scenes.bump(3, 2, 0.4, "A"), scenes.bump(4, 2, 0.3, "B", offset=1.5)]
    for obj in found:
        if uvs:
            scenes.set_uv(obj, 0.3 * scenes.seen_from_above(obj))
        obj.vertex_groups.new(name="none")
    found[1].vertex_groups.new(name="part").add([0, 1, 5, 6], 0.8, "REPLACE")
    scenes.select(found)
    return found


def _one_without(faces: int) -> None:
    A, _ = _patches()
    A.data.clear_geometry()
    if faces:
        A.data.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)], [], [(0, 1, 2), (0, 1, 3)][:faces])
        scenes.without_chosen_edges(A.data)


def _one_without_uvs() -> None:
    _, B = _patches()
    B.data.uv_layers.remove(B.data.uv_layers[0])


def _in_parts() -> None:
    """Two patches, each with a smaller one beside it that comes first."""
    for obj in _patches():
        mesh = obj.data
        points, faces = [tuple(v.co) for v in mesh.vertices], [tuple(p.vertices) for p in mesh.polygons]
        mesh.clear_geometry()
        apart = [(-1.5, 0, 0), (-1, 0, 0.1), (-1.1, 0.4, 0), (-1.4, 0.5, 0.2)]
        mesh.from_pydata([*apart, *points], [], [(0, 1, 2, 3), *(tuple(v + 4 for v in face) for face in faces)])
        scenes.without_chosen_edges(mesh)
        scenes.set_uv(obj, 0.2 + 0.2 * scenes.seen_from_above(obj))
        group = obj.vertex_groups.get("part") or obj.vertex_groups.new(name="part")
        group.add([0, 5, 6], 0.7, "REPLACE")


def _both_without() -> None:
    for obj in _patches():
        obj.data.clear_geometry()


def _edited(chosen: tuple[list, list]) -> None:
    objects = _patches()
    scenes.edit(*objects, faces=[])
    bpy.ops.object.mode_set(mode="OBJECT")
    for obj, faces in zip(objects, chosen, strict=True):
        for polygon in obj.data.polygons:
            polygon.select = polygon.index in faces
    bpy.ops.object.mode_set(mode="EDIT")


def _changed(change: Callable) -> None:
    """Two patches of which the second is changed."""
    _, B = _patches()
    change(B)
    B.data.update()


def _not_finite(obj) -> None:
    obj.data.vertices[3].co.x = float("nan")


def _in_one_place(obj) -> None:
    for vertex in obj.data.vertices:
        vertex.co = (0.0, 0.0, 0.0)


def _folded(obj) -> None:
    uv = scenes.uv_of(obj)
    uv[:6] = uv[:6, ::-1] + 0.2
    scenes.set_uv(obj, uv)


def _three_at_an_edge(obj) -> None:
    mesh = obj.data
    points, faces = [tuple(v.co) for v in mesh.vertices], [tuple(p.vertices) for p in mesh.polygons]
    mesh.clear_geometry()
    mesh.from_pydata([*points, (2.0, 0.5, 1.0)], [], [*faces, (1, 6, len(points)), (6, 1, len(points))])
    scenes.without_chosen_edges(mesh)


def _bodies() -> None:
    """Two closed bodies without UVs."""
    for k, name in enumerate("AB"):
        V, F = blob(1, seed=k + 1)
        obj = scenes.add(V * [1.0, 1.3, 0.8] + [3 * k, 0, 0], F, name)
        obj.vertex_groups.new(name="part").add([0, 1, 2, 3], 1.0, "REPLACE")
    scenes.select(list(bpy.data.objects))


def _shared() -> None:
    A, B = _patches()
    A.data = B.data


def _beside_a_curve() -> None:
    A, _ = _patches()
    curve = bpy.data.objects.new("Curve", bpy.data.curves.new("Curve", "CURVE"))
    bpy.context.collection.objects.link(curve)
    scenes.select([A, curve])


def _hidden() -> None:
    _, B = _patches()
    B.hide_set(True)


def _painted() -> None:
    _patches()
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")


def _scaled(obj) -> None:
    obj.scale = (1.0, 0.0, 1.0)
    bpy.context.view_layer.update()


STATES: dict[str, Callable] = {
    "nothing": lambda: None,
    "patches": _patches,
    "without UVs": lambda: _patches(uvs=False),
    "one without UVs": _one_without_uvs,
    "in parts": _in_parts,
    "one without vertices": lambda: _one_without(0),
    "one with faces of no area": lambda: _one_without(2),
    "both without vertices": _both_without,
    "no faces selected": lambda: _edited(([], [])),
    "faces of one selected": lambda: _edited(([], [0, 1, 4])),
    "not finite": lambda: _changed(_not_finite),
    "in one place": lambda: _changed(_in_one_place),
    "flat by its scale": lambda: _changed(_scaled),
    "folded": lambda: _changed(_folded),
    "three faces at an edge": lambda: _changed(_three_at_an_edge),
    "bodies": _bodies,
    "one mesh": _shared,
    "beside a curve": _beside_a_curve,
    "one hidden": _hidden,
    "weight paint": _painted,
}
# Where what takes long is not refused at once.
GOOD = {"patches", "without UVs", "one without UVs", "in parts", "folded", "bodies", "one mesh", "one hidden",
        "faces of one selected", "beside a curve", "one with faces of no area", "weight paint"}  # fmt: skip
# Whole numbers count things; others hang on the last digits.
NUMBER = re.compile(r"\d+(\.\d+)?(e[-+]?\d+| %)|\d+\.\d+")
SPACES = re.compile(r"\s+")


def plain(text: str) -> str:
    """Words of a text, without paths and numbers that are not whole."""
    text = re.sub(r"\S*/\S*", "/", text.replace("Error: ", ""))
    return SPACES.sub(" ", NUMBER.sub("#", text)).strip()


def selected(obj) -> str:
    """How many vertices, edges and faces of an object are selected."""
    obj.update_from_editmode()
    mesh = obj.data.copy()
    found = [sum(item.select for item in items) for items in (mesh.vertices, mesh.edges, mesh.polygons)]
    bpy.data.meshes.remove(mesh)
    return f"{obj.name} {' '.join(map(str, found))}"


def with_few_samples(package, monkeypatch) -> None:
    """Hundreds of thousands of points take most of the time of so small meshes."""
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 500)
    monkeypatch.setitem(package("solver.maps.overlap").overlap_share.__kwdefaults__, "samples", 2000)


def begin(make: Callable) -> None:
    """A file that is empty but for what a state makes; quicker than to open one."""
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    data = bpy.data
    kinds = (data.objects, data.meshes, data.curves, data.images, data.materials, data.collections, data.node_groups)
    data.batch_remove([item for kind in kinds for item in kind])
    make()


def left(state) -> list[str]:
    """What the panel has been told, what is selected and active in which mode, and what there is in the file."""
    summary, active = state.summary, bpy.context.view_layer.objects.active
    found = [f"mode {bpy.context.mode}", f"active {active.name if active else ''}"]
    found.append("selected " + ", ".join(obj.name for obj in bpy.context.selected_objects))
    found += [selected(obj) for obj in bpy.data.objects if obj.type == "MESH"]
    found.append(" ".join(f"{kind} {len(getattr(bpy.data, kind))}"
                          for kind in ("objects", "meshes", "images", "materials", "libraries", "texts")))  # fmt: skip
    if summary is not None:
        found += [f"title {summary.title}", "rows " + ", ".join(name for name, _ in summary.rows)]
        found.append(f"about {', '.join(summary.objects)}; beyond {', '.join(sorted(summary.beyond))}")
        found += [f"notice {plain(n.text)} [{n.action}]" for n in summary.notices]
        found.append(f"refused {summary.refused}; error {plain(state.error) if summary.refused else ''}")
    return found


def told(capfd, state, name: str, arguments: dict) -> list[str]:
    """What an operator says where it is called, and what it leaves that was not there before."""
    module, operator = name.split(".")
    before = left(state)
    capfd.readouterr()
    try:
        why = " ".join(getattr(getattr(bpy.ops, module), operator)(**arguments))
    except RuntimeError as error:
        why = str(error)
    lines = [line for line in capfd.readouterr().out.splitlines() if line.startswith(("Info", "Warn"))]
    return [plain(why), *sorted(set(map(plain, lines))), *(line for line in left(state) if line not in before)]
