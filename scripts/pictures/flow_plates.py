"""Draw bodies before and after they flowed: a ball squashed and stretched, a muscle that bulges.

python scripts/pictures/flow_plates.py docs/pictures/flow.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from omt_uv.solver.flows.enclosed_volume import component_volumes
from omt_uv.solver.flows.flow_map import flow
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.progress import drain
from omt_uv.solver.volumes.shells import icosphere

LIGHT = np.array([0.4, -0.7, 0.6]) / np.linalg.norm([0.4, -0.7, 0.6])


def handle(V, chosen, shift):
    """A handle of the chosen vertices that shifts them."""
    rows = np.flatnonzero(chosen)
    return FlowHandle(V[rows], V[rows] + shift, rows)


def squash_and_stretch():
    """A ball, squashed and stretched, by its two poles."""
    V, F = icosphere(5)
    top, low = V[:, 2] > 0.97, V[:, 2] < -0.97
    yield "ball", V, F
    for name, d in (("squashed", -0.45), ("stretched", 0.7)):
        handles = (handle(V, top, [0, 0, d]), handle(V, low, [0, 0, -d]))
        yield name, drain(flow(V, handles, FlowOptions(radius=0.35), F)).positions, F


def muscle():
    """A spindle between two tendons, which shortens and bulges."""
    V, F = icosphere(5)
    V = V * [0.28, 0.28, 1.5]
    V[:, :2] *= (0.35 + 0.65 * np.exp(-((V[:, 2] / 0.8) ** 2)))[:, None] / 1.0
    yield "muscle", V, F
    ends = [(V[:, 2] > 1.15, -0.4), (V[:, 2] < -1.15, 0.4)]
    handles = tuple(handle(V, chosen, [0, 0, d]) for chosen, d in ends)
    yield "contracted", drain(flow(V, handles, FlowOptions(radius=0.22), F)).positions, F


def draw(axes, V, F, name, size):
    """One body, lit from the side, with its volume."""
    corner = V[F]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    shade = 0.35 + 0.65 * np.clip(normal @ LIGHT, 0, 1)
    stripes = np.where(np.floor(F.min(axis=1) / 40) % 2 == 0, 1.0, 0.9)
    colours = (shade * stripes)[:, None] * np.array([0.95, 0.55, 0.4])
    axes.add_collection3d(Poly3DCollection(corner, facecolors=np.clip(colours, 0, 1), edgecolors="none"))
    for limits in (axes.set_xlim, axes.set_ylim, axes.set_zlim):
        limits(-size, size)
    axes.set_box_aspect((1, 1, 1), zoom=1.5)
    axes.view_init(8, -80)
    axes.set_axis_off()
    axes.set_title(f"{name}\nvolume {abs(component_volumes(V, F)[0][0]):.4f}", fontsize=9)


def main(path: Path):
    shapes = [*squash_and_stretch(), *muscle()]
    figure, places = plt.subplots(1, len(shapes), figsize=(2.4 * len(shapes), 3), subplot_kw={"projection": "3d"})
    for axes, (name, V, F) in zip(places, shapes, strict=True):
        draw(axes, V, F, name, 1.6)
    figure.tight_layout()
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
