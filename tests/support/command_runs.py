"""Words for every command that works on meshes, with all the files it takes and writes, in a folder of their own."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import bpy

import numpy as np
import scenes
from sphere_shapes import blob

# What the options that hold paths are for; a new one has to be named here.
READ = {"input", "target", "other", "others", "handles", "index", "image"}
WRITTEN = {"output", "report", "preview", "histogram", "plot", "attributes", "image_out", "image_output", "made"}
FOLDERS = ("average", "library")
# What writes an .npz.
ARRAYS = ("library", "signature")
GROUP = "region"


def commands(package) -> dict[str, argparse.ArgumentParser]:
    """The parsers of all commands but those of batches, which have tests of their own."""
    (every,) = (a for a in package("cli").parser()._actions if isinstance(a, argparse._SubParsersAction))
    return {name: command for name, command in every.choices.items() if not command.get_default("alone")}


def paths_of(command: argparse.ArgumentParser) -> list[argparse.Action]:
    """The options of a command that hold paths."""
    return [action for action in command._actions if action.type is Path]


def body(name: str, at: float = 0.0, seed: int = 1) -> bpy.types.Object:
    """A closed body with a UV map, a region and landmarks: every command has something to work on."""
    V, F = blob(1, seed=seed)
    obj = scenes.add(V * [1.0, 1.3, 0.8], F, name)
    obj.location.x = at
    obj.vertex_groups.new(name=GROUP).add(np.flatnonzero(V[:, 2] > 0.3).tolist(), 1.0, "REPLACE")
    scenes.set_uv(obj, np.random.default_rng(0).random((len(obj.data.loops), 2)))
    scenes.select([obj])
    bpy.ops.uv.omt_unwrap(quality="DRAFT", max_shear=0.0)
    return obj


def prepare(run, folder: Path) -> None:
    """Files for all commands: in.blend, other.blend, two.blend with two meshes, an image, handles, a folder of
    shapes and its index."""
    for name in ("in", "other"):
        scenes.open_empty()
        body(name)
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"))
    body("in", at=5.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "two.blend"))
    (folder / "handles.json").write_text(json.dumps([{"vertices": [0], "move": [0, 0, 0.1]}]))
    image = bpy.data.images.new("image", 32, 16)
    image.filepath_raw, image.file_format = str(folder / "image.png"), "PNG"
    image.save()
    (folder / "shapes").mkdir()
    for name in ("a", "b"):
        (folder / "shapes" / f"{name}.blend").write_bytes((folder / "in.blend").read_bytes())
    assert run("library", folder / "shapes", "-o", folder / "index.npz")[0] == 0


def words(name: str, folder: Path, given: str = "", **replaced: str) -> list:
    """A complete call of a command, with everything that it can write.

    given : IN instead of in.blend, or of the folder of shapes; replaced : files by the options that hold them
    """
    file = {**FILES, "input": given or ("shapes" if name in FOLDERS else "in.blend"), **replaced}

    def at(key: str) -> Path:
        return folder / file[key]

    return [name, at("input"), *(at(word[1:]) if word[:1] == "@" else word for word in CALLS[name].split())]


FILES = {"output": "out.blend", "report": "report.json", "preview": "preview.png", "histogram": "histogram.png",
         "plot": "plot.png", "attributes": "out.blend", "image_out": "image_out.png", "image_output": "image_out.png",
         "target": "other.blend", "other": "other.blend", "others": "other.blend", "handles": "handles.json",
         "index": "index.npz", "image": "image.png", "npz": "out.npz",
         "made": "made.png"}  # fmt: skip
CALLS = {
    "unwrap": "-o @output --quality draft --max-shear 0 --report @report --preview @preview",
    "refine": "-o @output --quality draft --report @report --preview @preview",
    "magnify": "-o @output --quality draft --weights region --factor 1.5 --source uv --image @image "
    "--image-output @image_output --report @report --preview @preview",
    "weights": "-o @output --kind gaussian",
    "seams": "-o @output",
    "sphere": "-o @output --quality draft --image @image --image-out @image_out --report @report --preview @preview",
    "measure": "--histogram @histogram --preview @preview --attributes @attributes",
    "compare": "@others --plot @plot",
    "remesh": "-o @output --vertices 60 --report @report --preview @preview",
    "flow": "-o @output --handles @handles --report @report",
    "stack": "-o @output --preview @preview",
    "symmetrize": "-o @output --preview @preview",
    "rectify": "-o @output --preview @preview",
    "queue": "-o @output --quality draft --max-shear 0 --preview @preview",
    "test-texture": "-o @made --kind area --size 64",
    "diagram": "-o @made --size 64",
    "volume": "-o @output --tets 200 --report @report",
    "match": "@target -o @output --report @report",
    "average": "-o @output --report @report",
    "partition": "-o @output --cells 4 --relax 0 --report @report --preview @preview",
    "distance": "@other",
    "signature": "-o @npz",
    "library": "-o @npz",
    "similar": "--index @index",
}  # fmt: skip


def without(words: list, *options: str) -> list:
    """The words of a call without options and what stands behind each."""
    left = list(words)
    for option in set(options) & set(map(str, words)):
        del left[left.index(option) : left.index(option) + 2]
    return left


def contents(folder: Path) -> dict[str, bytes | None]:
    """Every file of a folder, and of those in it, with its bytes; folders have none."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None
            for path in sorted(folder.rglob("*"))}  # fmt: skip
