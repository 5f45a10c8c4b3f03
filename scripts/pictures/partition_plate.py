"""Draw docs/pictures/partition.png: a head in panels, a portrait stippled, an armadillo with scales.

python scripts/pictures/partition_plate.py [OUT.png]
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/support")]

import meshes
from PIL import Image
from renders import VIEWS, render_colours, towards_camera

from omt_uv.solver.mesh.geometry import face_normals, vertex_normals
from omt_uv.solver.mesh.spherical_geometry import fibonacci_sphere
from omt_uv.solver.partition.cut_mesh import CellMesh, cut_along_cells
from omt_uv.solver.partition.division import Division, DivisionOptions, divide
from omt_uv.solver.progress import drain

PIXELS = 620
# To the light, rightwards, upwards and to who looks; how many ways to the sky are tried, and its share of the light.
LIGHT = np.array([-0.6, 0.55, 0.6])
SKY = 48
SKY_LIGHT = 0.4
# The light is as wide as this over its distance, and so many points of it are tried.
LAMP = 0.15
LAMPS = 10
BRIGHTNESS = 1.1
CONTRAST = 1.2
PANELS = 200
DOTS = 7000
# Density where it is white; the cosine below which faces are seen edge on; the radius of dots over the width of the
# smallest cells.
FAINTEST = 0.03
EDGE_ON = 0.1
CLOSENESS = 0.5
SCALES = 900
TONES = np.array([[0.93, 0.89, 0.80], [0.80, 0.62, 0.42], [0.56, 0.67, 0.70], [0.86, 0.78, 0.62], [0.70, 0.76, 0.68]])


def fans(mesh: CellMesh) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (t,3) of the polygons of a cut mesh, as corners, and the cell (t,) of each."""
    size = np.diff(mesh.face_start) - 2
    first = np.repeat(mesh.face_start[:-1], size)
    step = np.arange(len(first)) - np.repeat(np.cumsum(size) - size, size)
    return np.stack([first, first + step + 1, first + step + 2], axis=1), np.repeat(mesh.cell, size)


def shrunk(V, F, division: Division, factor: float, lift=lambda along: 0 * along):
    """The cells apart, (n,3), (t,3): about their sites times `factor`, lifted along the normal by `lift` of the place
    in the cell downwards, in radii; and the cell (t,) of every triangle."""
    mesh = cut_along_cells(V, F, division)
    triangles, cell = fans(mesh)
    at = division.sites.positions(V, F)[np.repeat(mesh.cell, np.diff(mesh.face_start))]
    smooth = vertex_normals(V, F)
    normal = np.einsum("cd,cdk->ck", mesh.barycentric, smooth[F[np.repeat(mesh.triangle, np.diff(mesh.face_start))]])
    radius = np.sqrt(division.asked.mean() / np.pi)
    step = mesh.positions[mesh.corner_vertex] - at
    down = np.array([0.0, -1, 0]) - normal * -normal[:, [1]]
    along = (step * down).sum(axis=1) / radius
    return at + factor * step + radius * lift(along)[:, None] * normal, triangles, cell


def panels(path):
    """Equal panels with grooves."""
    V, F = meshes.load_model("max_planck")
    division = drain(divide(V, F, PANELS, options=DivisionOptions(relax=10)))
    P, T, cell = shrunk(V, F, division, 0.95, lambda along: 0.02 + 0 * along)
    inside = vertex_normals(V, F)
    body = V - 0.004 * np.ptp(V, axis=0).max() * inside
    colours = np.concatenate([TONES[(cell * 7) % len(TONES)], np.full((len(F), 3), 0.12)])
    render_colours(
        np.concatenate([P, body]), np.concatenate([T, F + len(P)]), colours, VIEWS["max_planck"], path, PIXELS
    )


def portrait_darkness(V, F, view):
    """How dark (m,) each face is in a portrait, from 0 to 1: lit from the upper left, in its own shadow, and by what it
    sees of a sky; nothing behind."""
    from mathutils.bvhtree import BVHTree

    up, towards = towards_camera(view)
    right = np.cross(up, towards)
    tree = BVHTree.FromPolygons(V.tolist(), F.tolist())
    normal, size = face_normals(V, F), np.ptp(V, axis=0).max()
    smooth = vertex_normals(V, F)[F].mean(axis=1)
    start = V[F].mean(axis=1) + 1e-3 * size * normal
    key = LIGHT @ np.stack([right, up, towards]) / np.linalg.norm(LIGHT)
    lamp = key + LAMP * fibonacci_sphere(LAMPS)

    def seen(origin, way):
        return np.array([tree.ray_cast(o, w)[0] is None for o, w in zip(origin.tolist(), way.tolist(), strict=True)])

    open_share, whole = np.zeros(len(F)), np.zeros(len(F))
    for way in fibonacci_sphere(SKY):
        cosine = np.clip(normal @ way, 0, 1)
        ahead = np.flatnonzero(cosine > 0)
        open_share[ahead] += cosine[ahead] * seen(start[ahead], np.tile(way, (len(ahead), 1)))
        whole += cosine
    reached = np.mean([seen(start, np.tile(way, (len(F), 1))) for way in lamp], axis=0)
    lit = np.clip(smooth @ key, 0, 1) * reached
    tone = SKY_LIGHT * (open_share / np.maximum(whole, 1e-9)) ** 2 + (1 - SKY_LIGHT) * lit
    return (1 - np.clip(BRIGHTNESS * tone, 0, 1)) ** CONTRAST


def stipples(path):
    """Dots of one size by the darkness of a portrait, on white."""
    V, F = meshes.load_model("david")
    view = VIEWS["david"]
    facing = face_normals(V, F) @ towards_camera(view)[1]
    # Dots on slopes come closer in the picture; behind there are none.
    density = (FAINTEST + portrait_darkness(V, F, view)) * np.maximum(facing, 0)
    front, density, whole = F[facing > EDGE_ON], density[facing > EDGE_ON], F
    used, front = np.unique(front, return_inverse=True)
    V, F, body = V[used], front.reshape(-1, 3), V
    division = drain(divide(V, F, DOTS, density, DivisionOptions(relax=6)))
    at, normal = division.sites.positions(V, F), face_normals(V, F)[division.sites.triangle]
    # Where it is darkest dots nearly touch.
    size = CLOSENESS * np.sqrt(np.quantile(division.asked / density[division.sites.triangle], 0.01))
    side = np.cross(normal, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side, axis=1)[:, None]
    angle = 2 * np.pi * np.arange(8) / 8
    ring = np.cos(angle)[:, None, None] * side + np.sin(angle)[:, None, None] * np.cross(normal, side)
    corners = (at + 0.5 * size * normal + size * ring).transpose(1, 0, 2).reshape(-1, 3)
    fan = np.array([[0, k, k + 1] for k in range(1, 7)])
    dots = (8 * np.arange(len(at))[:, None, None] + fan).reshape(-1, 3)
    colours = np.concatenate([np.full((len(whole), 3), 1.0), np.full((len(dots), 3), 0.05)])
    both = np.concatenate([body, corners]), np.concatenate([whole, dots + len(body)])
    render_colours(*both, colours, view, path, PIXELS, unlit=True)


def scales(path):
    """Cells that overlap downwards, each with a dark border."""
    V, F = meshes.load_model("armadillo")
    division = drain(divide(V, F, SCALES, options=DivisionOptions(relax=3)))
    base, T, cell = shrunk(V, F, division, 1.06, lambda along: 0.10 + 0.10 * along)
    top, _, _ = shrunk(V, F, division, 0.84, lambda along: 0.17 + 0.10 * along)
    tone = 0.88 + 0.12 * np.random.default_rng(0).random(SCALES)
    light, dark = (np.array(colour) * tone[cell, None] for colour in ([0.62, 0.70, 0.42], [0.30, 0.38, 0.20]))
    colours = np.concatenate([dark, light, np.full((len(F), 3), [0.24, 0.30, 0.17])])
    n = len(base)
    faces = np.concatenate([T, T + n, F + 2 * n])
    render_colours(np.concatenate([base, top, V]), faces, colours, VIEWS["armadillo"], path, PIXELS)


def main(out: Path) -> None:
    """Render the three and put them side by side."""
    with tempfile.TemporaryDirectory() as folder:
        images = []
        for k, draw in enumerate((panels, stipples, scales)):
            draw(Path(folder) / f"{k}.png")
            image = Image.open(Path(folder) / f"{k}.png").convert("RGBA")
            images.append(Image.alpha_composite(Image.new("RGBA", image.size, "white"), image).convert("RGB"))
        whole = Image.new("RGB", (sum(i.width for i in images), images[0].height), "white")
        for k, image in enumerate(images):
            whole.paste(image, (sum(i.width for i in images[:k]), 0))
        whole.quantize(128).save(out, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/pictures/partition.png")
