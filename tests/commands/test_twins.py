"""A choice does the same in the window and on the command line, and something else than its default, for every one."""

from __future__ import annotations

import math

import bpy

import pytest
import scenes
import twin_scenes

DRAFT = ("--quality draft --max-shear 0", {"quality": "DRAFT", "max_shear": 0.0})
CUT = ("--quality draft --max-shear 1.25", {"quality": "DRAFT", "max_shear": 1.25})
CHARTS = ("--quality draft --seams charts", {"quality": "DRAFT", "seams": "CHARTS"})
DISK = ("--quality draft --max-shear 0 --fill-holes --boundary disk",
        {"quality": "DRAFT", "max_shear": 0.0, "fill_holes": True, "boundary": "DISK"})  # fmt: skip
RECTANGLE = (DISK[0].replace("disk", "rectangle"), DISK[1] | {"boundary": "RECTANGLE"})
REFINED = ("--quality draft", {"quality": "DRAFT"})
MAGNIFIED = ("--quality draft --weights region --source uv --factor 1.5",
             {"quality": "DRAFT", "weight_group": "region", "source": "UV", "factor": 1.5})  # fmt: skip
ALONE = (MAGNIFIED[0].replace("uv", "mesh"), MAGNIFIED[1] | {"source": "MESH"})
MESHED = ("--vertices 40", {"target_vertices": 40, "hide_original": False})
CURVED = ("--vertices 40 --density curvature", MESHED[1] | {"density": "CURVATURE"})
PAINTED = ("--vertices 40 --density region",
           MESHED[1] | {"density": "WEIGHTS", "weight_group": "region"})  # fmt: skip
GLOBE = ("--quality draft", {"quality": "DRAFT", "inside": False})
MARKED = ("--quality draft --pole pole --meridian meridian",
          {"quality": "DRAFT", "inside": False, "orientation": "GROUPS", "pole_group": "pole",
           "meridian_group": "meridian"})  # fmt: skip
BENT = ("--kind mean", {"kind": "MEAN", "show": False})
CELLS = ("--cells 6 --relax 0", {"cells": 6, "relax": 0})
TETS = ("", {"tets": 150})
MOVED = ("", {"move": (0.0, 0.0, 0.25)})
TURNED = ("", {"rotate": (0.0, 0.0, 0.75)})
PUSHED = ("", {"move": (0.05, 0.0)})
MATCHED = ("", {"mode": "TRANSFER"})

# Command: operator, and rows of objects, what is chosen besides, words of the command, arguments of the operator. No
# words: there is no such option, or test_what_options_choose follows it to the same settings.
ROWS: dict = {
    "unwrap": ("uv.omt_unwrap", [
        ("Closed", DRAFT, None, {"balance": 0.75}),
        ("Closed", DRAFT, None, {"max_shear": 1.0625}),
        ("Closed", CUT, "--keep-free region", {"keep_free": "region"}),
        ("Closed", DRAFT, None, {"seams": "CHARTS"}),
        ("Closed", CHARTS, None, {"margin": 40}),
        ("Closed", CHARTS, None, {"texture_size": 64}),
        ("Closed", DRAFT, "--udim 1013", {"tile": 1013}),
        ("Closed", CHARTS, None, {"pack": False}),
        ("Closed", DRAFT, None, {"kind": "CONFORMAL"}),
        ("Closed", DRAFT, None, {"kind": "POLAR"}),
        ("Closed", DRAFT, "--mark-seams", {"mark_seams": True}),
        ("Closed", DRAFT, "--uv-layer other", {"uv_layer": "other"}),
        ("Band", DRAFT, "--boundary square --fill-holes", {"boundary": "SQUARE", "fill_holes": True}),
        ("Band", DRAFT, "--fill-holes", {"fill_holes": True}),
        ("Band", DRAFT, None, {"seams": "EXISTING"}),
        ("Band", DISK, "--centre centre", {"centre_group": "centre"}),
        ("Band", DISK, "--start start", {"start_group": "start"}),
        ("Band", RECTANGLE, "--corners corners", {"corner_group": "corners"}),
        ("Band", RECTANGLE, None, {"aspect": 2.5}),
        ("Seamed", CUT, None, {"cut_further": True}),
        ("Smooth", DRAFT, "--subdivision off", {"use_subdivision": False}),
        ("Cubes", DRAFT, None, {"pack_around": True}),
        ("Closed", CHARTS, None, {"turn_to_fit": True}),
    ]),
    "refine": ("uv.omt_refine", [
        ("Closed", REFINED, None, {"balance": 0.75}),
        ("Band", REFINED, "--keep-boundary", {"keep_boundary": True}),
        ("Smooth", REFINED, "--subdivision off", {"use_subdivision": False}),
        ("Closed", REFINED, None, {"pack": True}),
        ("Closed", ("", REFINED[1] | {"pack": True}), None, {"margin": 40}),
        ("Closed", ("", REFINED[1] | {"pack": True}), None, {"texture_size": 64}),
        ("Closed", ("", REFINED[1] | {"pack": True}), None, {"tile": 1013}),
    ]),
    "magnify": ("uv.omt_magnify", [
        ("Band", MAGNIFIED, "--factor 2", {"factor": 2.0}),
        ("Band", MAGNIFIED, None, {"exact": False}),
        ("Band", MAGNIFIED, "--source mesh", {"source": "MESH"}),
        ("Smooth", ALONE, None, {"boundary": "SQUARE"}),
        ("Band", MAGNIFIED, "--cascade 2", {"cascade": 2}),
        ("Smooth", ALONE, None, {"margin": 40}),
        ("Smooth", ALONE, None, {"texture_size": 64}),
        ("Closed", MAGNIFIED, None, {"weight_group": "second"}),
        ("Closed", MAGNIFIED, "--weights height", {"region": "ATTRIBUTE", "attribute": "height"}),
        ("Closed", ("--quality draft --source uv", MAGNIFIED[1]), "--region region=1.25 --region second=0.5",
         {"factor": 1.25, "further": "second=0.5"}),
        ("Smooth", ALONE, None, {"tile": 1013}),
        ("Smooth", ALONE, "--subdivision off", {"use_subdivision": False}),
    ]),
    "sphere": ("uv.omt_sphere", [
        ("Closed", GLOBE, "--projection lambert", {"projection": "LAMBERT"}),
        ("Closed", GLOBE, None, {"projection": "OCTAHEDRAL"}),
        ("Closed", GLOBE, None, {"balance": 0.75}),
        ("Closed", GLOBE, "--method flow", {"method": "FLOW"}),
        ("Closed", GLOBE, None, {"method": "MOSER"}),
        ("Closed", GLOBE, "--weights region", {"weight_group": "region"}),
        ("Closed", ("--quality draft --weights region", GLOBE[1] | {"weight_group": "region"}), "--weight-factor 5",
         {"weight_factor": 5.0}),
        ("Closed", GLOBE, "--pole pole", {"orientation": "GROUPS", "pole_group": "pole"}),
        ("Closed", GLOBE, "--pole pole --meridian meridian", MARKED[1]),
        ("Closed", MARKED, "--east east", {"east_group": "east"}),
        ("Closed", GLOBE, "--uv-layer other", {"uv_layer": "other"}),
        ("Band", GLOBE, "--fill-holes", {"fill_holes": True}),
        ("Closed", GLOBE, None, {"inside": True}),
    ]),
    "remesh": ("object.omt_remesh", [
        ("Closed", CURVED, "--factor 0.25", {"amount": 0.25}),
        ("Closed", PAINTED, "--factor 2", {"weight_factor": 2.0}),
        ("Closed", PAINTED, None, {"grading": 0.25}),
        ("Closed", MESHED, "--sharp 20", {"use_preserve_sharp": True, "sharp_angle": math.radians(20)}),
        ("Closed", MESHED, None, {"use_preserve_seams": False}),
        ("Band", MESHED, None, {"use_preserve_boundary": False}),
    ]),
    "seams": ("uv.omt_seams", [
        ("Closed", ("--max-shear 0", {"max_shear": 0.0}), None, {"max_shear": 1.125}),
        ("Closed", ("--max-shear 1.25", {"max_shear": 1.25}), "--keep-free region", {"keep_free": "region"}),
        ("Band", ("--max-shear 0", {"max_shear": 0.0}), "--fill-holes", {"fill_holes": True}),
        ("Closed", ("", {"max_shear": 0.0}), None, {"extremities": 0}),
    ]),
    "weights": ("object.omt_weights", [
        ("Closed", BENT, "--kind saliency", {"kind": "SALIENCY"}),
        ("Closed", BENT, "--kind gaussian", {"kind": "GAUSSIAN"}),
        ("Closed", BENT, "--kind sharpness", {"kind": "SHARPNESS"}),
        ("Closed", BENT, "--group mine", {"weight_group": "mine"}),
        ("Closed", BENT, "--low 0.25", {"low": 0.25}),
        ("Closed", BENT, "--high 0.75", {"high": 0.75}),
        ("Closed", BENT, "--invert", {"invert": True}),
    ]),
    "flow": ("object.omt_flow", [
        ("Closed", MOVED, None, {"move": (0.125, 0.25, 0.0)}),
        ("Closed", MOVED, None, {"rotate": (0.0, 0.0, 0.5)}),
        ("Closed", MOVED, None, {"radius": 0.5}),
        ("Closed", TURNED, None, {"path": "STRAIGHT"}),
        ("Closed", TURNED, None, {"samples": 2}),
        ("Closed", MOVED, None, {"keep_group": "second"}),
        ("Closed", MOVED, None, {"walls": "BALL"}),
        ("Closed", MOVED, None, {"walls": "MESH", "wall_object": "Wall"}),
        ("Closed", MOVED, None, {"result": "MESH"}),
        ("Closed", MOVED, None, {"frames": 3}),
    ]),
    "volume": ("object.omt_volume", [
        ("Closed", TETS, None, {"domain": "CUBE"}),
        ("Closed", TETS, None, {"domain": "BODY", "body": "Wall"}),
        ("Closed", TETS, None, {"method": "FLOW"}),
        ("Closed", TETS, None, {"result": "ATTRIBUTE"}),
        ("Closed", ("", TETS[1] | {"result": "SHELLS"}), None, {"shells": 2}),
        ("Closed", ("", TETS[1] | {"result": "POINTS"}), None, {"points": 50}),
        ("Closed", ("", TETS[1] | {"result": "POINTS", "points": 50}), None, {"seed": 3}),
        ("Closed", ("", TETS[1] | {"result": "SLICE"}), None, {"axis": "Z"}),
        ("Closed", ("", TETS[1] | {"result": "SLICE"}), None, {"place": 0.25}),
    ]),
    "match": ("object.omt_match", [
        ("Wall Closed", MATCHED, None, {"mode": "CHECKER"}),
        ("Wall Closed", MATCHED, None, {"transfer": {"UV"}}),
        ("Wall Closed", MATCHED, None, {"balance": 0.0}),
        ("Wall Closed", MATCHED, None, {"mirrored": True}),
        ("Wall Closed", MATCHED, None, {"use_polish": False}),
        ("Wall Closed", MATCHED, None, {"features": 2.0}),
        ("Wall Closed", ("", {"mode": "WRAP"}), None, {"shape_key": "Mine"}),
        ("Wall Closed", ("", {"mode": "MORPH"}), None, {"factor": 0.25}),
    ]),
    "density": ("uv.omt_density_set", [
        ("Closed", ("", {}), None, {"unit": "M"}),
        ("Closed", ("", {}), None, {"texture_size": 512}),
        ("Closed", ("", {}), None, {"density": 2.5}),
        ("Closed", ("", {}), None, {"scope": "ALL"}),
    ]),
    "push": ("uv.omt_flow", [
        ("Closed", PUSHED, None, {"start": (0.75, 0.5)}),
        ("Closed", PUSHED, None, {"move": (0.0, 0.05)}),
        ("Closed", PUSHED, None, {"radius": 0.5}),
    ]),
    "checker": ("uv.omt_checker", [
        ("Closed", ("", {"size": 256}), None, {"kind": "CIRCLES"}),
        ("Closed", ("", {"size": 256}), None, {"kind": "WORLD"}),
        ("Closed", ("", {"size": 256}), None, {"size": 512}),
    ]),
    "layout": ("uv.omt_layout_image", [
        ("Closed", ("", {"size": 32}), None, {"kind": "AREA"}),
        ("Closed", ("", {"size": 32}), None, {"kind": "SHEAR"}),
        ("Closed", ("", {"size": 32}), None, {"size": 48}),
    ]),
    "overlay": ("uv.omt_overlay", [
        ("Closed", ("", {}), None, {"show": "SHEAR"}),
        ("Closed", ("", {}), None, {"show": "NONE"}),
    ]),
    "diagram": ("object.omt_diagram", [
        ("Smooth", ("", {}), None, {"domain": "SQUARE"}),
        ("Smooth", ("", {}), None, {"domain": "RECTANGLE"}),
        ("Closed", ("", {}), None, {"domain": "SPHERE"}),
    ]),
    "stack": ("uv.omt_stack", [("Cubes", ("", {}), "--no-mirrored", {"mirrored": False})]),
    "symmetrize": ("uv.omt_symmetrize", [
        ("Cubes", ("", {}), "--halves stacked", {"halves": "STACKED"}),
        ("Cubes", ("", {}), "--axis y", {"axis": "Y"}),
        ("Cubes", ("", {}), "--axis z", {"axis": "Z"}),
    ]),
    "partition": ("mesh.omt_partition", [
        ("Closed", CELLS, "--cells 9", {"cells": 9}),
        ("Closed", CELLS, "--relax 2", {"relax": 2}),
        ("Closed", CELLS, "--capacity region", {"capacity_group": "region"}),
        ("Closed", CELLS, "--seed 3", {"seed": 3}),
        *(("Closed", CELLS, f"--write {what}", {"write": what.upper()})
          for what in ("materials", "seams", "attribute", "mesh", "points")),
    ]),
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory, package):
    made = tmp_path_factory.mktemp("twins")
    twin_scenes.prepare(made)
    return made


@pytest.fixture
def commanded(run, folder):
    """What a command leaves, where it takes one object alone."""

    def made(name, obj, words):
        (folder / "out.blend").unlink(missing_ok=True)
        status, _, err = run(name, folder / "rich.blend", "-o", folder / "out.blend", "--object", obj, *words.split())
        if status:
            return {"refused": err}
        bpy.ops.wm.open_mainfile(filepath=str(folder / "out.blend"))
        return twin_scenes.left()

    return made


@pytest.fixture
def operated(folder):
    """What an operator leaves, with some objects selected."""

    def made(name, objects, arguments):
        twin_scenes.begin(folder, objects)
        why = twin_scenes.refusal(name, arguments)
        return twin_scenes.left() if why is None else {"refused": why}

    return made


def differ(one, other):
    """What is not the same in two results."""
    if "refused" in one or "refused" in other:
        return ["refused"] if ("refused" in one) != ("refused" in other) else []
    found: list = sorted(one.keys() ^ other.keys())
    for name in one.keys() & other.keys():
        a, b = one[name], other[name]
        found += [(name, key) for key in a.keys() | b.keys() if a.get(key) != b.get(key)]
    return found


@pytest.mark.parametrize("name", ROWS)
def test_a_choice_changes_what_comes_out_alike_in_the_window_and_on_the_command_line(name, commanded, operated):
    operator, rows = ROWS[name]
    base: dict = {}
    wrong = []
    for obj, (words, arguments), more, choice in rows:
        key = (obj, words, str(arguments))
        if key not in base:
            base[key] = operated(operator, obj, arguments)
        found = commanded(name, obj, f"{words} {more}") if more is not None else None
        here = operated(operator, obj, arguments | choice) if choice is not None else found
        if not differ(base[key], here):
            wrong.append(("changes nothing", obj, arguments, more, choice, here.get("refused")))
        if found is not None and (apart := differ(found, here)):
            wrong.append(("not alike", obj, words, more, choice, apart, found.get("refused"), here.get("refused")))
    assert not wrong, "\n".join(map(str, wrong))


# Operators whose properties are settings: read-only ones, those of a window, and what looks into files.
OTHERS = {"uv.omt_measure", "uv.omt_regions", "uv.omt_density_get", "uv.omt_worst", "uv.omt_live", "uv.omt_live_end",
          "uv.omt_preset", "uv.omt_notices", "uv.omt_remedy", "uv.omt_queue", "wm.omt_help", "object.omt_similar",
          "object.omt_landmarks", "object.omt_landmarks_suggest", "object.omt_landmarks_clear", "object.omt_strain",
          }  # fmt: skip
# Properties that are looked at elsewhere: pictures, empties, and names that stand in for others.
ELSEWHERE = {
    "uv.omt_magnify": {"balance", "max_shear", "use_image", "image", "image_size", "detail", "detail_box"},
    "uv.omt_sphere": {"image", "image_layout"},
    "object.omt_flow": {"handles"},
    "uv.omt_seams": {"use_subdivision"},
    "object.omt_remesh": {"count_of", "target_faces", "edge_length", "density_attribute", "levels", "ratio",
                          "preserve_attributes", "use_modifiers", "hide_original", "strategy",
                          "use_preserve_materials"},
    "object.omt_match": {"domain", "landmark_prefix"},
    # Libraries that may not be there.
    "object.omt_volume": {"library"},
}  # fmt: skip


def test_every_property_of_every_operator_is_chosen(package):
    chosen: dict[str, set] = {}
    for operator, rows in ROWS.values():
        mine = chosen.setdefault(operator, set(ELSEWHERE.get(operator, ())))
        for _, (_, arguments), _, choice in rows:
            mine |= {*arguments, *(choice or ())}
    classes = [c for c in package("registration").CLASSES if issubclass(c, bpy.types.Operator)]
    names = {scenes.name_of(c) for c in classes}
    for name in names - OTHERS:
        module, verb = name.split(".")
        own = getattr(getattr(bpy.ops, module), verb).get_rna_type().properties
        there = {p.identifier for p in own if p.identifier != "rna_type" and not p.is_readonly}
        assert there <= chosen.get(name, set()), (name, there - chosen.get(name, set()))
