"""A file with something for every choice of commands and operators to change, and all that a run leaves in it."""

from __future__ import annotations

from pathlib import Path

import bpy

import numpy as np
import scenes
from sphere_shapes import blob


def _group(obj, name: str, vertices, weight: float = 1.0) -> None:
    obj.vertex_groups.new(name=name).add([int(v) for v in vertices], weight, "REPLACE")


def _some_uv(obj, seams: str = "CHARTS") -> None:
    """Islands of a draft, pulled, so that there is something to refine."""
    scenes.select([obj])
    bpy.ops.uv.omt_unwrap(quality="DRAFT", max_shear=0.0, seams=seams)
    uv = scenes.uv_of(obj)
    scenes.set_uv(obj, uv * [0.5, 0.5] + 0.1 * uv**2)


def closed(name: str, at: float, seed: int = 1):
    """A closed body of several islands, with two UV maps, groups, landmarks and two materials."""
    V, F = blob(1, seed=seed)
    obj = scenes.add(V * [1.0, 1.3, 0.8] * (1 + 0.2 * V[:, :1]), F, name)
    obj.location.x = at
    x, y, z = V.T
    order = np.argsort(z)
    _group(obj, "region", order[-6:])
    _group(obj, "second", order[:7])
    for axis, vertex in zip(("pole", "meridian", "east"), (z.argmin(), x.argmax(), y.argmax()), strict=True):
        _group(obj, axis, [vertex])
    for k, vertex in enumerate((x.argmax(), x.argmin(), y.argmax(), z.argmax())):
        _group(obj, f"LM_{k}", [vertex])
    for k, vertex in enumerate((x.argmax(), y.argmin(), y.argmax(), z.argmin())):
        _group(obj, f"mark {k}", [vertex])
    for name in ("one", "two"):
        obj.data.materials.append(bpy.data.materials.get(name) or bpy.data.materials.new(name))
    for face, left in zip(obj.data.polygons, V[F].mean(axis=1)[:, 0] < 0, strict=True):
        face.material_index = int(left)
    height = obj.data.attributes.new("height", "FLOAT", "POINT")
    height.data.foreach_set("value", (z - z.min()).astype(np.float32))
    _some_uv(obj)
    for vertex in obj.data.vertices:
        vertex.select = vertex.index in order[-6:].tolist()
    return obj


def band(name: str, at: float):
    """A curved patch with a hole in it, whose outline has marked vertices."""
    obj = scenes.bump(6, 5, 0.7, name)
    obj.location.x = at
    mesh = obj.data
    faces = [tuple(p.vertices) for p in mesh.polygons if p.index != 14]
    points = np.array([v.co[:] for v in mesh.vertices]) * [1.4, 1.0, 1.0]
    bpy.data.objects.remove(obj)
    obj = scenes.add(points, faces, name)
    obj.location.x = at
    _group(obj, "corners", [0, 5, 41, 36])
    _group(obj, "start", [37])
    _group(obj, "centre", [10])
    _group(obj, "region", [8, 9, 15, 16])
    _some_uv(obj, "AUTO")
    return obj


def seamed(name: str, at: float):
    """A closed body that is opened by its own seams, and shears."""
    V, F = blob(1, seed=2)
    obj = scenes.add(V * [0.8, 0.8, 1.7], F, name)
    obj.location.x = at
    _some_uv(obj, "AUTO")
    scenes.select([obj])
    bpy.ops.uv.omt_seams(max_shear=0.0)
    return obj


def smooth(name: str, at: float):
    """An open patch with a Subdivision Surface modifier."""
    obj = scenes.bump(4, 3, 0.8, name)
    obj.location.x = at
    _group(obj, "region", [6, 7, 11])
    _some_uv(obj, "AUTO")
    obj.modifiers.new("Smooth", "SUBSURF").levels = 2
    return obj


def cubes(name: str, at: float):
    """Two patches and their mirror images, islands on islands, one of them pinned."""
    y, x = np.mgrid[0:3, 0:3] / 2.0
    flat = np.stack([x, y + 0.3 * x * y, 0.4 * x * (1 - y)], axis=-1).reshape(-1, 3)
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
    points = np.concatenate([flat + [0.2, 0, 0], flat * [-1, 1, 1] - [0.2, 0, 0], flat + [0.2, 2, 0]])
    faces = np.concatenate([quads, quads[:, [0, 3, 2, 1]] + 9, quads + 18])
    obj = scenes.add(points, faces, name)
    obj.location.x = at
    uv = scenes.seen_from_above(obj)
    scenes.set_uv(obj, (0.15 * uv + 0.4 + 0.05 * np.sin(9 * uv[:, ::-1])).astype(np.float32))
    scenes.pin(obj, [18, 20])
    return obj


def prepare(folder: Path) -> None:
    """rich.blend with all of these, other.blend with another closed body, one.blend with a closed body alone."""
    scenes.open_empty()
    closed("Other", 0.0, 3)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "other.blend"))
    scenes.open_empty()
    makers = {"Closed": closed, "Band": band, "Seamed": seamed, "Smooth": smooth, "Cubes": cubes}
    for k, (name, make) in enumerate(makers.items()):
        make(name, 3.0 * k)
    # Walls around the closed body.
    V, F = blob(1, seed=1)
    wall = scenes.add(V * [1.6, 2.0, 1.4] * (1 + 0.2 * V[:, :1]), F, "Wall")
    for k, vertex in enumerate((V[:, 0].argmax(), V[:, 0].argmin(), V[:, 1].argmax(), V[:, 2].argmax())):
        _group(wall, f"LM_{k}", [vertex])
        _group(wall, f"mark {k}", [vertex])
    _some_uv(wall)
    scenes.select([])
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "rich.blend"))


def begin(folder: Path, objects: str) -> None:
    """Open rich.blend with some objects selected."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "rich.blend"))
    scenes.select([bpy.data.objects[obj] for obj in objects.split()])


def refusal(name: str, arguments: dict) -> str | None:
    """Run an operator: why it refused, None where it did not."""
    module, operator = name.split(".")
    try:
        assert getattr(getattr(bpy.ops, module), operator)(**arguments) == {"FINISHED"}
    except RuntimeError as error:
        return str(error)
    return None


def told(capfd, name: str, arguments: dict) -> tuple[str | None, list[str]]:
    """Run an operator: why it refused, and the lines of what it told."""
    capfd.readouterr()
    why = refusal(name, arguments)
    return why, [line for line in capfd.readouterr().out.splitlines() if line.startswith(("Info", "Warn"))]


def left() -> dict:
    """Everything about the mesh objects of the file that is open, and its images."""
    found = {image.name: {"size": tuple(image.size), "pixels": _pixels(image)} for image in bpy.data.images}
    for obj in (o for o in bpy.data.objects if o.type == "MESH"):
        mine = scenes.state(obj)
        mine["matrix"] = np.round(obj.matrix_world, 6).tolist()
        mine["groups named"] = [g.name for g in obj.vertex_groups]
        mine["named"] = [m.name if m else "" for m in obj.data.materials]
        mine["hidden"] = obj.hide_get()
        for key in obj.data.shape_keys.key_blocks if obj.data.shape_keys else ():
            points = np.zeros(3 * len(key.data), np.float32)
            key.data.foreach_get("co", points)
            mine[f"key {key.name}"] = (round(key.value, 5), points.tobytes())
        found[obj.name] = mine
    return found


def _pixels(image) -> bytes:
    pixels = np.zeros(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.tobytes()
