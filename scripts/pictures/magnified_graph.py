"""Draw a radial graph of 200 nodes on a square grid of 10,201 vertices, and magnify its crowded centre four times.

After Zhao et al. 2013, figure 9: the picture itself is warped through the map, the outline of the square stays.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import matplotlib
import numpy as np
from PIL import Image, ImageDraw
from textures import typeface

from benchmarks.cases import meshes
from omt_uv.solver.analysis.density import from_vertices, region_share
from omt_uv.solver.editing.image_warp import warp_image
from omt_uv.solver.editing.magnify import magnify_region
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.progress import drain

CELLS = 100  # of the grid along one side: 101 * 101 vertices
FACTOR = 4.0
RADIUS = 0.15  # of the centre that is magnified
# Nodes of each ring about the root, and the ring's radius: the centre is crowded.
RINGS = ((12, 0.055), (34, 0.105), (61, 0.27), (92, 0.43))
PIXELS = 2048
INK = (38, 44, 56)
PAPER = (250, 249, 246)
FAINT = (216, 214, 208)
EDGE = (132, 140, 152)


def graph():
    """Places (200,2) of the nodes in the unit square, the ring (200,) of each, and edges to the parents (199,2)."""
    places, ring, edges = [np.array([0.5, 0.5])], [0], []
    before = [(0, 0.0)]
    for k, (count, radius) in enumerate(RINGS, start=1):
        angles = 2 * np.pi * (np.arange(count) + 0.5 * (k % 2)) / count
        now = []
        for angle in angles.tolist():
            parent = min(before, key=lambda p: abs((p[1] - angle + np.pi) % (2 * np.pi) - np.pi))[0]
            edges.append((parent, len(places)))
            now.append((len(places), angle))
            places.append(0.5 + radius * np.array([np.cos(angle), np.sin(angle)]))
            ring.append(k)
        before = now
    return np.array(places), np.array(ring), np.array(edges)


def drawn(grid_every=10):
    """The graph over a faint grid as a picture (h,w,3), lowest row first."""
    places, ring, edges = graph()
    image = Image.new("RGB", (PIXELS, PIXELS), PAPER)
    draw = ImageDraw.Draw(image)
    for k in range(0, CELLS + 1, grid_every):
        x = k / CELLS * (PIXELS - 1)
        draw.line([x, 0, x, PIXELS], fill=FAINT, width=3)
        draw.line([0, x, PIXELS, x], fill=FAINT, width=3)
    at = places * PIXELS
    for a, b in edges:
        draw.line([*at[a], *at[b]], fill=EDGE, width=5)
    colours = matplotlib.colormaps["viridis"](np.linspace(0.05, 0.85, len(RINGS) + 1))
    font = typeface(15)
    for k, (x, y) in enumerate(at.tolist()):
        r = 17 if k else 24
        fill = tuple(int(255 * c) for c in colours[ring[k]][:3])
        draw.ellipse([x - r, y - r, x + r, y + r], fill=fill, outline=INK, width=3)
        draw.text((x, y), str(k), "white" if ring[k] < 3 else INK, font, anchor="mm")
    return np.asarray(image)[::-1]


def magnified():
    """Old and new corner UVs (m,3,2) of the grid, and the shares before and after."""
    V, F = meshes.grid(CELLS, CELLS)
    uv = V[:, :2]
    t = np.clip((1.25 * RADIUS - np.linalg.norm(uv - 0.5, axis=1)) / (0.5 * RADIUS), 0, 1)
    weights = from_vertices(t * t * (3 - 2 * t), F)
    result = drain(magnify_region(uv, F, weights, FACTOR))
    return uv[F], result.uv[F], *(region_share(weights, signed_areas(x, F)) for x in (uv, result.uv))


def make(path: Path, pixels=720):
    """Write the graph before and after, side by side."""
    old, new, before, after = magnified()
    picture = drawn()
    plate = Image.new("RGB", (2 * pixels + 30, pixels + 56), "white")
    draw = ImageDraw.Draw(plate)
    captions = (f"centre {100 * before:.1f} % of the picture", f"magnified {FACTOR:g} x: {100 * after:.1f} %")
    for k, (image, caption) in enumerate(zip((picture, warp_image(picture, old, new)), captions, strict=True)):
        small = Image.fromarray(image[::-1]).resize((pixels, pixels), Image.Resampling.LANCZOS)
        plate.paste(small, (k * (pixels + 30), 0))
        middle = k * (pixels + 30) + pixels / 2, pixels + 28
        draw.text(middle, caption, "#333333", typeface(24, bold=False), anchor="mm")
    plate.quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)


if __name__ == "__main__":
    make(Path(sys.argv[1]))
