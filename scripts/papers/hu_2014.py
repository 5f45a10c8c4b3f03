"""Hu, Zou, Hua 2014, tables 1 and 2, figures 3 and 4: volumes of maps of insides, and of registrations.

usage: hu_2014.py [--tets 5000] [--bodies 3]        needs TetGen; writes build/papers/hu_2014
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build" / "papers" / "hu_2014"
# Steps of the paper's flow that its figure 4 shows.
STEPS = (0, 15, 30, 50)
# Organs: middles and half axes of ellipsoids in the body.
ORGANS = {
    "left": ((0.35, 0.1, 0.1), (0.22, 0.16, 0.3)),
    "right": ((-0.35, 0.1, 0.1), (0.22, 0.16, 0.3)),
    "low": ((0.0, -0.3, -0.2), (0.3, 0.2, 0.2)),
}
# Points in the box around a body, of which those inside tell how organs overlap.
SAMPLES = 40_000
# Directions from the middle at which surfaces have landmarks.
LANDMARKS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 1], [-1, 1, -1]])


def body() -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) and triangles (m,3) of a smooth body, with bulges and no symmetry."""
    from omt_uv.solver.volumes.shells import icosphere

    V, F = icosphere(4)
    x, y, z = V.T
    return V * (1 + 0.25 * (x**4 + y**4 + z**4 - 0.6) + 0.12 * x * y + 0.08 * z)[:, None] * [1.0, 0.85, 1.15], F


def pushed(seed: int, points: np.ndarray) -> np.ndarray:
    """Points (n,3) carried by a flow without divergence that chance has chosen: the same for all points."""
    from omt_uv.solver.flows.flow_map import flow
    from omt_uv.solver.flows.handles import FlowHandle
    from omt_uv.solver.flows.options import FlowOptions
    from omt_uv.solver.mesh.spherical_geometry import fibonacci_sphere
    from omt_uv.solver.progress import drain

    rng = np.random.default_rng(seed)
    places = 0.7 * fibonacci_sphere(8)
    moves = rng.normal(size=places.shape)
    moves *= 0.15 / np.linalg.norm(moves, axis=1)[:, None]
    handles = tuple(FlowHandle(p[None], (p + m)[None]) for p, m in zip(places, moves, strict=True))
    return drain(flow(points, handles, FlowOptions(radius=0.25, diagonal=3.4, mend=False))).positions


def inside(points: np.ndarray) -> dict[str, np.ndarray]:
    """Which points (n,3) of the body lie in each organ."""
    return {name: np.square((points - middle) / axes).sum(axis=1) < 1 for name, (middle, axes) in ORGANS.items()}


def mapped_into(source, target, count: int):
    """The map of the inside of one body into another, with the landmarks of both."""
    from omt_uv.pipelines.volumes.volume import VolumeBody, VolumeSettings, mapped_volume
    from omt_uv.solver.progress import drain

    V, F = body()
    rows = (V / np.linalg.norm(V, axis=1)[:, None] @ (LANDMARKS / np.linalg.norm(LANDMARKS, axis=1)[:, None]).T).argmax(
        0
    )
    names = {f"LM_{k}": np.array([row]) for k, row in enumerate(rows)}
    bodies = (VolumeBody("from", source, F, names), VolumeBody("to", target, F, names))
    return drain(mapped_volume(bodies[0], VolumeSettings("body", "newton", count), bodies[1])).map, rows


def tables(count: int, bodies: int) -> None:
    """Bodies that a known flow without divergence has made of one, mapped back into it."""
    from omt_uv.solver.mesh.geometry import nearest_rotations
    from omt_uv.solver.volumes.transfer import TetLocation

    V, _ = body()
    diagonal = np.linalg.norm(np.ptp(V, axis=0))
    first, second = [], []
    for seed in range(bodies):
        W = pushed(seed, V)
        # Into the deformed body: what should come out is known at every point.
        there, rows = mapped_into(V, W, count)
        off = np.linalg.norm(there.positions - pushed(seed, there.points), axis=1).mean() / diagonal
        first.append((there.shares, off, there.inverted))
        # Organs, carried along to the deformed body, and back by the map.
        inner = TetLocation(there.points, there.tets)
        points = np.random.default_rng(seed).uniform(V.min(axis=0), V.max(axis=0), (SAMPLES, 3))
        points = points[inner(points)[1].min(axis=1) > 0]
        truth, carried = inside(points), pushed(seed, points)
        back, _ = mapped_into(W, V, count)
        at = TetLocation(back.points, back.tets).values(carried, back.positions)
        middles = W[rows].mean(axis=0), V[rows].mean(axis=0)
        turn = nearest_rotations((V[rows] - middles[1]).T @ (W[rows] - middles[0]))
        rigid = (carried - middles[0]) @ turn.T + middles[1]
        dices = [[dice(truth[name], inside(x)[name]) for name in ORGANS] for x in (rigid, at)]
        second.append((back.shares, back.inverted, *dices[0], *dices[1]))
        print(f"{seed}: {first[-1]} {second[-1]}", flush=True)
    volume, off, inverted = np.mean(first, axis=0)
    print(f"\ntable 1, {bodies} deformations: volume distortion {100 * volume:.2f} %, displacement {100 * off:.2f} %, ")
    print(f"inverted {inverted:.1f}; the paper: 12.9 %, 2.32 %")
    volume, inverted, *dices = np.mean(second, axis=0)
    print(f"table 2: volume distortion {100 * volume:.2f} %, inverted {inverted:.1f}; the paper: 3.0 %")
    for k, name in enumerate(ORGANS):
        print(f"  Dice of {name:6} rigid {dices[k]:.3f}   registered {dices[k + len(ORGANS)]:.3f}")


def dice(one: np.ndarray, other: np.ndarray) -> float:
    """Twice what is in both over what is in each."""
    return 2 * float((one & other).sum()) / float(one.sum() + other.sum())


def figures(count: int) -> None:
    """Figure 3: histograms of logarithms of volume ratios; figure 4: a cut, coloured by them, as the flow goes on."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from omt_uv.solver.progress import drain
    from omt_uv.solver.volumes.body_map import harmonic, volume_map
    from omt_uv.solver.volumes.domains import BallDomain
    from omt_uv.solver.volumes.meshing import TetMesh
    from omt_uv.solver.volumes.paper_flow import paper_flow
    from omt_uv.solver.volumes.slices import dilation, plane_slice
    from omt_uv.solver.volumes.tet_newton import inverted

    V, F = body()
    ours = drain(volume_map(V, F, count=count))
    mesh, edge = TetMesh(ours.points, ours.tets), BallDomain(np.arange(len(V)))
    flowed = drain(paper_flow(mesh.points, mesh.tets, harmonic(mesh, ours.positions[: len(V)]), edge, STEPS[-1], STEPS))
    maps = {f"flow, step {k}": at for k, at in zip(STEPS, flowed.kept, strict=True)} | {"ours": ours.positions}
    figure, places = plt.subplots(2, len(maps), figsize=(3 * len(maps), 5.6))
    for (name, at), (top, low) in zip(maps.items(), places.T, strict=True):
        count_inverted = inverted(at, mesh.tets)
        cut = plane_slice(mesh.points, at, mesh.tets, np.array([0.0, 1.0, 0.0]), 0.02)
        x, _, z = cut.vertices.T
        shown = low.tripcolor(x, z, cut.triangles, facecolors=cut.dilation, cmap="RdBu_r", vmin=-1, vmax=1)
        low.set_aspect("equal")
        low.axis("off")
        logs = np.clip(dilation(mesh.points, at, mesh.tets), -2, 2)
        top.hist(logs, np.linspace(-2, 2, 61), color="#3566a8")
        top.set_yscale("log")
        top.set_title(f"{name}\n{count_inverted} inverted", fontsize=10)
        print(f"{name:16} inverted {count_inverted:5}   mean abs log2 {np.abs(logs).mean():.4f}")
    figure.colorbar(
        shown, ax=places[1], orientation="horizontal", fraction=0.05, label="log2 of volume there over here"
    )
    FOLDER.mkdir(parents=True, exist_ok=True)
    figure.savefig(FOLDER / "volumes.png", dpi=80)
    print(f"plots: {FOLDER / 'volumes.png'}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tets", type=int, default=5000)
    parser.add_argument("--bodies", type=int, default=3)
    options = parser.parse_args()
    figures(options.tets)
    tables(options.tets, options.bodies)


if __name__ == "__main__":
    main()
