"""Read the objects of a file that a command works on: by name, by scene, and what is linked or left out."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .common import Y_IS_UP, CommandError, refusals, warn_of

if TYPE_CHECKING:
    from ..files.in_place.plain_obj import PlainObj
    from ..files.loaded import Loaded
    from ..pipelines.reading import Reading

# Options that ask for what Blender alone has of a file, or shows of it.
OF_SCENES = ("object", "scene", "uv_layer", "keep_free", "centre", "start_group", "corners", "mark_seams", "preview")


def read_plain_file(options: argparse.Namespace) -> tuple[PlainObj, Reading] | None:
    """The mesh of an OBJ file and its Reading where its UVs can be had without Blender, which takes longer to start.

    None where the file, or what is asked for, leaves something to Blender.
    """
    if {path.suffix.lower() for path in (options.input, options.output)} != {".obj"} or options.subdivision != "auto":
        return None
    if any(getattr(options, name) for name in OF_SCENES):
        return None
    import numpy as np

    from ..files.in_place.plain_obj import read_plain
    from ..pipelines.reading import Y_UP, Reading
    from ..solver.mesh.surface import Surface

    found = read_plain(options.input)
    if found is None:
        return None
    mesh = found.mesh
    surface = Surface(
        positions=mesh.positions.astype(float) + 0.0,
        corner_vertex=mesh.corner_vertex,
        face_start=mesh.face_start,
        triangles=found.triangles,
        triangle_face=found.triangle_face,
        seams=np.zeros((0, 2), np.int64),
        sharp=found.sharp,
    )
    pinned = None if found.uv is None else np.zeros(len(mesh.corner_vertex), bool)
    return found, Reading(surface, np.ones(len(mesh.face_start) - 1, bool), found.uv, pinned, axes=Y_UP)


def read_file(options: argparse.Namespace, layer: str = "") -> list:
    """Pairs of object and Reading of a UV layer (the active one by default) of the chosen meshes with faces."""
    from ..blender.mesh import one_for_each_mesh, read, weld_split_vertices
    from ..files.loaded import compare
    from ..files.meshes import load
    from ..pipelines.reading import Y_UP

    path = options.input
    objects = load(path)
    _tell(options, compare(path, objects))
    unique = one_for_each_mesh(_chosen(options, objects))
    pairs = []
    for obj in unique:
        with refusals(name=obj.name):
            reading = read(obj, layer)
        if path.suffix.lower() in Y_IS_UP:
            reading = replace(reading, axes=Y_UP)
        if path.suffix.lower() in (".glb", ".gltf"):
            reading = weld_split_vertices(reading)
        if reading.faces.any():
            pairs.append((obj, reading))
        elif len(unique) > 1:
            options.told.append(f"{obj.name} has no faces and is left alone")
            warn_of(options.told[-1])
    if not pairs:
        raise CommandError(f"{path}: The mesh has no faces. Give a file with faces.")
    return pairs


def of_file(options: argparse.Namespace, path: Path) -> argparse.Namespace:
    """Options of a command that reads several files, for one of them: names of objects are those of IN, or of every
    file of a folder."""
    chosen = options.object if path == options.input or path.is_relative_to(options.input) else []
    return argparse.Namespace(**{**vars(options), "input": path, "object": chosen})


def _tell(options: argparse.Namespace, loaded: Loaded) -> None:
    """Warn of what the file holds that was not read, in one line.

    Raises
    ------
    CommandError : `--strict` does not let that pass
    """
    texts = list(loaded.texts)
    output = getattr(options, "output", None)
    if loaded.moved and output is not None and output.suffix.lower() not in (".blend", options.input.suffix.lower()):
        texts.append(f"Single precision rounds coordinates by up to {loaded.loss:.2g} in {output.name}")
    if texts and options.strict:
        raise CommandError(f"{options.input}: {'; '.join(texts)}. Nothing was written, as --strict asks.")
    texts = [*texts, *([loaded.moved] if loaded.moved else [])]
    if texts:
        options.told.append(f"{options.input.name}: {'; '.join(texts)}")
        warn_of(options.told[-1])


def _chosen(options: argparse.Namespace, objects: list) -> list:
    """Those of the objects that `--object` and `--scene` name, without linked ones where `--skip-linked` says so.

    Raises
    ------
    CommandError : there is no such object or scene, or nothing is left
    """
    import bpy

    from ..blender.mesh import linked

    if options.scene:
        scene = bpy.data.scenes.get(options.scene)
        if scene is None:
            every = ", ".join(s.name for s in bpy.data.scenes)
            raise CommandError(f"{options.input}: there is no scene {options.scene!r}. It has {every}.")
        objects = [obj for obj in objects if obj.name in scene.objects]
    if options.object:
        names = [obj.name for obj in objects]
        missing = [name for name in options.object if name not in names]
        if missing:
            raise CommandError(
                f"{options.input}: there is no mesh {missing[0]!r}. It has {', '.join(names) or 'none'}."
            )
        objects = [obj for obj in objects if obj.name in options.object]
    if options.skip_linked:
        skipped = [obj for obj in objects if linked(obj)]
        for obj in skipped:
            options.told.append(f"{obj.name} {linked(obj)} and is left out")
            warn_of(options.told[-1])
        objects = [obj for obj in objects if obj not in skipped]
    if not objects:
        raise CommandError(f"{options.input}: No mesh is left to work on. Choose other objects.")
    return objects
