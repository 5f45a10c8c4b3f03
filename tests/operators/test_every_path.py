"""What holds for every operator that takes a path, by reflection: what is no file of its kind is refused in one line,
nothing hangs, and nothing changes, whatever the path is called."""

from __future__ import annotations

import os

import bpy

import numpy as np
import pytest
import scenes
from without_rights import folder_of_nobody, without_rights

STRANGE = "a\nb ü漢 'c\" .x"
NOISE = np.random.default_rng(0).bytes(600)
# The properties of operators that take paths, and what their files end with.
TAKEN = {("object.omt_similar", "index"): ".npz", ("uv.omt_preset", "filepath"): ".py"}


def paths(package):
    """Pairs of an operator and the name of a property of it that holds a path."""
    for cls in package("registration").CLASSES:
        if issubclass(cls, bpy.types.Operator):
            module, name = cls.bl_idname.split(".")
            rna = getattr(getattr(bpy.ops, module), name).get_rna_type()
            for prop in rna.properties:
                if prop.type == "STRING" and prop.subtype in {"FILE_PATH", "DIR_PATH", "FILE_NAME"}:
                    yield cls.bl_idname, prop.identifier


def good(package, name):
    """What a file of an operator holds."""
    if name == "uv.omt_preset":
        return b"op.margin = 7\nop.balance = 0.25\nop.rna_type = 3\nop.unknown = 3\n"
    from omt_uv.solver.progress import drain

    module = package("pipelines.shapes.signature_index")
    surface = package("blender.mesh").read(bpy.context.view_layer.objects.active).surface
    made = drain(package("pipelines.shapes.distance").signature_of([surface], 100))
    return module.index_of({"a/own.obj": ("", made)}).bytes()


def array(**kinds):
    """A file of numpy's: one array, or several."""
    import io

    data = io.BytesIO()
    np.savez(data, **kinds) if kinds else np.save(data, np.arange(4))
    return data.getvalue()


def bad_files(whole):
    """Files that none of the operators can take."""
    half = whole[: len(whole) // 2] if whole[:2] == b"PK" else b"op.margin = (7.0\n"
    flipped = bytearray(whole)
    for k in range(min(60, len(flipped) // 2), len(flipped), 7):
        flipped[k] ^= 255
    few = {"names": np.array(["a"]), "marks": np.array([""]), "floors": np.zeros(1)}
    return {
        "empty": b"" if whole[:2] == b"PK" else b"\0",
        "noise": NOISE,
        "half": half,
        "flipped": bytes(flipped),
        "one array": array(),
        "flat": array(**few, packed=np.zeros(1), coefficients=np.zeros(1)),
        "text": array(**few, packed=np.array(["x"]), coefficients=np.array(["x"])),
        "nested": b"op.margin = " + b"(" * 5000 + b")" * 5000,
        "other type": b"op.margin = 7\nop.quality = 3\n",
        "no choice": b"op.margin = 7\nop.quality = 'NONE'\n",
        "infinite": b"op.margin = 7\nop.balance = 1e999\n",
        "huge": b"op.margin = 7\nop.texture_size = 10 ** 400\n",
    }


def state(obj, tmp_path):
    """All that must not change."""
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    settings = {p.identifier: getattr(properties, p.identifier) for p in properties.bl_rna.properties}
    settings.pop("rna_type")
    files = {p: p.read_bytes() if p.is_file() else None for p in sorted(tmp_path.rglob("*"))}
    selected = [o.name for o in bpy.context.selected_objects]
    return settings, files, selected, [tuple(v.co) for v in obj.data.vertices], len(obj.data.uv_layers)


def refused(name, prop, path):
    """The one line with which an operator refuses a path."""
    module, operator = name.split(".")
    text = scenes.error_of(getattr(getattr(bpy.ops, module), operator), **{prop: str(path)})
    assert "Traceback" not in text and len(text.strip().splitlines()) == 1, text
    return text


def test_every_path_of_an_operator_is_looked_at(package):
    assert set(paths(package)) == set(TAKEN)


@pytest.mark.parametrize(("name", "prop"), TAKEN)
def test_what_is_no_file_of_its_kind_is_refused_and_nothing_changes(package, tmp_path, name, prop):
    obj = scenes.bump()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "own.blend"))
    obj = bpy.context.view_layer.objects.active
    (tmp_path / "folder").mkdir()
    (tmp_path / "round").symlink_to(tmp_path / "round")
    os.mkfifo(tmp_path / "pipe")
    whole = good(package, name)
    for label, data in bad_files(whole).items():
        (tmp_path / f"{label}{TAKEN[name, prop]}").write_bytes(data)
    (tmp_path / STRANGE).write_bytes(NOISE)
    names = ["own.blend", "folder", "round", "pipe", "none", "none/none", "pipe/none", STRANGE, "x" * 300]
    names += [path.name for path in tmp_path.iterdir() if path.suffix == TAKEN[name, prop]]
    assert len(names) > 15
    before = state(obj, tmp_path)
    for bad in names:
        text = refused(name, prop, tmp_path / bad)
        assert " ".join(bad.split("/")[-1].split())[:20] in text, (bad, text)
        assert state(obj, tmp_path) == before, bad


@pytest.mark.parametrize(("name", "prop"), TAKEN)
def test_a_file_without_rights_is_refused(package, name, prop):
    scenes.bump()
    whole = good(package, name)
    with folder_of_nobody() as folder:
        (folder / "shut").write_bytes(whole)
        # What an operator imports, it imports with rights.
        refused(name, prop, folder / "missing")
        (folder / "shut").chmod(0)
        with without_rights():
            assert "shut" in refused(name, prop, folder / "shut")


@pytest.mark.parametrize(("name", "prop"), TAKEN)
def test_a_file_may_be_called_anything_and_stand_beside_the_blend_file(package, tmp_path, name, prop):
    scenes.bump()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "own.blend"))
    module, operator = name.split(".")
    (tmp_path / STRANGE).write_bytes(good(package, name))
    for path in (str(tmp_path / STRANGE), f"//{STRANGE}"):
        assert getattr(getattr(bpy.ops, module), operator)(**{prop: path}) == {"FINISHED"}
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    for setting in properties.bl_rna.properties:
        properties.property_unset(setting.identifier)
