"""Draw docs/pictures/match.png: heads wrapped onto others, a ring onto a knot, and a rig on a mesh of other topology.

python scripts/pictures/match_plate.py [OUT.png]
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/support"), str(ROOT / "scripts/papers")]

import meshes
import poses
import scenes
from PIL import Image
from scipy.spatial import cKDTree

from omt_uv.display.raster import cover
from omt_uv.pipelines.shapes.landmark_pairs import LandmarkPoint, Pairs
from omt_uv.pipelines.shapes.match import MatchJob, largest_part
from omt_uv.pipelines.shapes.wrap import wrap_surfaces
from omt_uv.solver.mesh.geometry import vertex_normals
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain
from omt_uv.solver.registration.results import RegistrationOptions
from omt_uv.solver.remeshing import RemeshOptions, RemeshSource, remesh

PIXELS = 400
SAMPLES = 2
# Directions to the right, up and towards the camera.
VIEWS = {
    "max_planck": np.array([[-1.0, 0, 0], [0, 1, 0], [0, 0, -1]]),
    "suzanne": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "david": np.array([[-0.77, -0.64, 0], [0, 0, 1], [-0.64, 0.77, 0]]),
    "tube": np.array([[1.0, 0, 0], [0, 0.8, 0.6], [0, -0.6, 0.8]]),
    "body": np.array([[0.85, 0.53, 0], [0, 0, 1], [0.53, -0.85, 0]]),
}
# Of each pair: eyes, tip of the nose, mouth, chin, forehead, ears, back of the head; of Suzanne both corners of an eye.
LANDMARKS = {
    "max_planck": [(57, 30, 11), (-2, 30, 8), (31, -17, -38), (34, -47, -14), (31, -91, -12), (32, 88, 8),
                   (-58, 0, 107), (113, -2, 102), (42, 68, 198)],
    "david": [(-0.23, 0.34, -0.06), (-0.36, 0.16, -0.05), (-0.41, 0.31, -0.31), (-0.34, 0.27, -0.41),
              (-0.31, 0.24, -0.59), (-0.32, 0.34, 0.13), (-0.22, -0.39, -0.14), (0.36, 0.19, -0.13),
              (0.31, -0.47, 0.12)],
    "suzanne": [
        (-0.58, -0.68, 0.26), (-0.16, -0.77, 0.26), (0.17, -0.77, 0.26), (0.58, -0.68, 0.26),
        (-0.0, -0.82, -0.22), (-0.0, -0.65, -0.83), (0.0, -0.65, -0.93), (-0.0, -0.4, 0.72), (1.07, 0.4, 0.18),
        (-1.07, 0.4, 0.18), (0.0, 0.75, 0.51)],
    "planck, as suzanne": [
        (70, 30, 10), (45, 24, 5), (14, 24, 8), (-15, 29, 9), (31, -17, -38), (34, -47, -14), (31, -91, -12),
        (31, 94, 11), (-58, 0, 107), (113, -2, 102), (42, 68, 198)],
}  # fmt: skip
PAIRS = ((("suzanne", "suzanne"), ("max_planck", "planck, as suzanne")), (("max_planck",) * 2, ("david",) * 2))
# Levels of the subdivision surface of Suzanne.
LEVELS = 2
SQUARES = 16
CLAY = np.array([0.8, 0.8, 0.8])
LIGHT = np.array([0.3, 0.4, 0.86])
# Vertices of the body that a rig comes to, and turns of its bones.
VERTICES = 1500
POSE = (("spine", "X", 15), ("elbow.L", "Y", -55), ("hand.R", "Z", 50), ("knee.L", "X", -50), ("foot.L", "X", 60))
COLOURS = np.array([(0.35, 0.55, 0.8), (0.9, 0.65, 0.3), (0.45, 0.7, 0.45), (0.8, 0.45, 0.45), (0.65, 0.55, 0.8)])


def drawn(V, F, view, colour=None) -> np.ndarray:
    """A picture (h,w,3) of a mesh; colour: of the vertices (n,3), or a function of the pixels that are covered."""
    P, size = V @ view.T, PIXELS * SAMPLES
    middle, extent = (P.max(0) + P.min(0)) / 2, 1.05 * np.ptp(P, axis=0)[:2].max()
    at = ((P[:, :2] - middle[:2]) * [1, -1] / extent + 0.5) * size
    found = cover(at[F], P[F][..., 2], (size, size))
    normal = np.einsum("kc,kcd->kd", found.weights, (vertex_normals(V, F) @ view.T)[F[found.triangles]])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    picture = np.ones((size * size, 3))
    paint = CLAY if colour is None else colour(found)
    picture[found.pixels] = paint * np.clip(0.3 + 0.7 * normal @ LIGHT, 0.1, 1)[:, None]
    return picture.reshape(PIXELS, SAMPLES, PIXELS, SAMPLES, 3).mean(axis=(1, 3))


def checker(places, F):
    """Squares by places (n,3) in the unit box."""

    def paint(found):
        at = np.einsum("kc,kcd->kd", found.weights, places[F[found.triangles]])
        odd = np.floor(at * SQUARES).astype(int).sum(axis=1) % 2 == 1
        return np.where(odd[:, None], 0.25 + 0.75 * at, 0.93)

    return paint


def smooth(colours, F):
    """Colours (n,3) of the vertices."""
    return lambda found: np.einsum("kc,kcd->kd", found.weights, colours[F[found.triangles]])


def head(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n,3) and triangles (m,3) of a model, or of Blender's Suzanne, subdivided, without her eyes."""
    if name != "suzanne":
        return meshes.load_model(name)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    monkey = bpy.context.object
    monkey.modifiers.new("smooth", "SUBSURF").levels = LEVELS
    vertices, triangles = poses.shape_of(monkey)
    part = largest_part(triangle_surface(vertices, triangles, np.zeros((0, 2), np.int64)), name)
    return part.vertices, part.triangles


def heads(pair) -> list[np.ndarray]:
    """A checker on one head, the same on the other, and the one in the shape of the other."""
    sides, points, edges, options = [], [], np.zeros((0, 2), np.int64), RegistrationOptions()
    for name, key in pair:
        V, F = head(name)
        at = cKDTree(V).query(np.array(LANDMARKS[key]))[1].tolist()
        sides.append((V, F))
        points.append(tuple(LandmarkPoint(str(k), vertex=v) for k, v in enumerate(at)))
    (V, F), (W, G) = sides
    surfaces = [triangle_surface(*side, edges) for side in sides]
    job = MatchJob(surfaces[0], surfaces[1], Pairs(points[0], points[1]), options, edges)
    found = drain(wrap_surfaces(job))
    print(f"fit {100 * found.fit:.3f} %, faces that meet {found.intersections}, flipped {found.found.flipped}")
    places = (V - V.min(0)) / np.ptp(V, axis=0).max()
    (first, _), (second, _) = pair
    back = np.einsum("kc,kcd->kd", found.source_barycentric, places[F[found.source_faces]])
    return [
        drawn(V, F, VIEWS[first], checker(places, F)),
        drawn(W, G, VIEWS[second], checker(back, G)),
        drawn(found.wrapped, F, VIEWS[second]),
    ]


def tube(major: int, minor: int, knotted: bool):
    """A tube that closes, vertices (n,3), triangles (m,3), and seams (s,2) once along it and twice around it; knotted:
    a trefoil instead of a ring."""
    t, angle = 2 * np.pi * np.arange(major) / major, 2 * np.pi * np.arange(minor) / minor
    turns, waves = (2, 3) if knotted else (1, 0)
    ring = np.column_stack([np.cos(turns * t), np.sin(turns * t), 0 * t])
    axis = (2 + np.cos(waves * t) * knotted)[:, None] * ring + np.sin(waves * t)[:, None] * [0, 0, 1]
    out = np.cos(waves * t)[:, None] * ring + np.sin(waves * t)[:, None] * [0, 0, 1]
    along = np.roll(axis, -1, axis=0) - np.roll(axis, 1, axis=0)
    aside = np.cross(out, along / np.linalg.norm(along, axis=1, keepdims=True))
    radius = 0.45 if knotted else 0.8
    V = axis[:, None] + radius * (np.cos(angle)[:, None] * out[:, None] - np.sin(angle)[:, None] * aside[:, None])
    i, j = (x.ravel() for x in np.meshgrid(np.arange(major), np.arange(minor), indexing="ij"))
    a, b, c, d = (((i + p) % major) * minor + (j + q) % minor for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)))
    seams = [np.column_stack([a, b])[j == 0], *(np.column_stack([a, d])[i == k] for k in (0, major // 2))]
    F = np.concatenate([np.column_stack([a, c, b]), np.column_stack([a, d, c])])
    return V.reshape(-1, 3), F, np.concatenate(seams)


def charts() -> list[np.ndarray]:
    """A ring and a knot of other topology, cut alike, with one checker, and the ring in the shape of the knot."""
    (V, F, seams), (W, G, others) = tube(60, 24, False), tube(181, 20, True)
    surfaces = (triangle_surface(V, F, seams), triangle_surface(W, G, others))
    job = MatchJob(*surfaces, Pairs((), ()), RegistrationOptions(domain="charts"), np.zeros((0, 2), np.int64))
    found = drain(wrap_surfaces(job))
    print(f"ring and knot: fit {100 * found.fit:.3f} %, faces that meet {found.intersections}, "
          f"flipped {found.found.flipped}")  # fmt: skip
    places = (V - V.min(0)) / np.ptp(V, axis=0).max()
    back = np.einsum("kc,kcd->kd", found.source_barycentric, places[F[found.source_faces]])
    view = VIEWS["tube"]
    return [
        drawn(V, F, view, checker(places, F)),
        drawn(W, G, view, checker(back, G)),
        drawn(found.wrapped, F, view),
    ]


def rig() -> list[np.ndarray]:
    """A body with the weights of its rig, a remesh of it with those that came over, and both in one pose."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    body, armature = poses.rigged()
    rest, corner = poses.shape_of(body)
    found = drain(remesh(RemeshSource(rest, corner, np.zeros((0, 2), np.int64)), VERTICES, RemeshOptions()))
    other = scenes.add(found.vertices, found.triangles, "Other")
    for obj, V in ((body, rest), (other, found.vertices)):
        for k, vertex in enumerate(cKDTree(V).query(poses.LANDMARKS)[1].tolist()):
            obj.vertex_groups.new(name=f"LM_{k}").add([vertex], 1.0, "REPLACE")
    scenes.select([body, other])
    bpy.ops.object.omt_match(transfer={"GROUPS"})
    other.modifiers.new("rig", "ARMATURE").object = armature
    weights = [_weights(obj, armature) for obj in (body, other)]
    sums = weights[1].sum(axis=1)
    poses.pose(armature, POSE)
    posed, shape = poses.shape_of(body)[0], poses.shape_of(other)[0]
    truth = np.einsum("nc,ncd->nd", found.barycentric, posed[corner[found.faces]])
    off = np.linalg.norm(shape - truth, axis=1) / np.linalg.norm(np.ptp(posed, axis=0))
    print(f"posed: {100 * off.mean():.3f} % off, 95 % below {100 * np.quantile(off, 0.95):.3f} %, "
          f"at most {100 * off.max():.3f} %; weights sum to {sums.min():.6f} ... {sums.max():.6f}")  # fmt: skip
    tone = COLOURS[np.arange(weights[0].shape[1]) % len(COLOURS)]
    paints = [w / np.maximum(w.sum(axis=1, keepdims=True), 1e-12) @ tone for w in weights]
    view, F = VIEWS["body"], found.triangles
    return [
        drawn(rest, corner, view, smooth(paints[0], corner)),
        drawn(posed, corner, view, smooth(paints[0], corner)),
        drawn(shape, F, view, smooth(paints[1], F)),
    ]


def _weights(obj, armature) -> np.ndarray:
    """Weights (n,b) of the armature's bones."""
    numbers = {obj.vertex_groups[bone.name].index: k for k, bone in enumerate(armature.data.bones)}
    found = np.zeros((len(obj.data.vertices), len(numbers)))
    for vertex in obj.data.vertices:
        for element in vertex.groups:
            if element.group in numbers:
                found[vertex.index, numbers[element.group]] = element.weight
    return found


def main(out: Path) -> None:
    """All rows, one above the other."""
    from omt_uv.registration import register, unregister

    register()
    rows = [np.concatenate(row, axis=1) for row in (*(heads(pair) for pair in PAIRS), charts(), rig())]
    unregister()
    whole = np.rint(255 * np.clip(np.concatenate(rows), 0, 1)).astype(np.uint8)
    Image.fromarray(whole).quantize(128).save(out, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/pictures/match.png")
