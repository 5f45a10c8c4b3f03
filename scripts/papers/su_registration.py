"""Zhengyu Su 2015, section 4.3, figures 16 and 17: seven poses of one body, all 21 pairs matched by landmarks.

usage: su_registration.py [--vertices 3000] [--pairs 21]      needs bpy; writes build/papers/su_registration
Pairs that are there are not matched again: delete the folder to start anew.
"""

from __future__ import annotations

import argparse
from itertools import combinations
from pathlib import Path

import numpy as np
from common import BUILD, told

FOLDER = BUILD / "su_registration"
# Balances of the maps to the sphere: ours, and the conformal ones of the rival.
OURS = 0.5
ANGLES = 1.0
NAMES = {"ours": "#3566a8", "conformal, harmonic": "#d55e00"}


def pair_figures(names: tuple[str, str], bodies, corner: np.ndarray) -> dict[str, np.ndarray]:
    """Figures and histograms of the match of one pose with another, and of the harmonic map between conformal ones."""
    from omt_uv.solver.progress import drain
    from omt_uv.solver.registration.register import register
    from omt_uv.solver.strain.figures import match_figures

    source, target = (bodies[name] for name in names)
    own, other = ((pose.vertices, pose.triangles) for pose in (source, target))
    landmarks = _landmarks(source, target)
    maps = tuple(_map(name, bodies[name], OURS) for name in names)
    found = drain(register(own, other, landmarks, maps=(maps[0], maps[1])))
    there = found.forward.positions(*other)
    truth = np.einsum("nc,ncd->nd", source.barycentric, target.body[corner[source.faces]])
    off = 100 * np.linalg.norm(there - truth, axis=1) / np.linalg.norm(np.ptp(target.body, axis=0))
    image = (found.forward.faces, found.forward.barycentric)
    plain, plain_image, plain_there = _harmonic(names, bodies, landmarks)
    ours, theirs = match_figures(own, other, image, there), match_figures(own, other, plain_image, plain_there)
    figures = {
        "mean %": off.mean(),
        "p95 %": np.quantile(off, 0.95),
        "met": found.met.sum(),
        "flipped %": 100 * found.flipped,
        "curvature": ours.mean_curvature,
        "area": ours.mean_area,
        "harmonic: flipped %": 100 * plain,
        "harmonic: mean %": 100 * np.linalg.norm(plain_there - truth, axis=1).mean()
        / np.linalg.norm(np.ptp(target.body, axis=0)),
        "harmonic: curvature": theirs.mean_curvature,
        "harmonic: area": theirs.mean_area,
    }  # fmt: skip
    histograms = np.array([[ours.curvature, ours.area], [theirs.curvature, theirs.area]])
    return {"figures": np.array(list(figures.values())), "names": np.array(list(figures)), "histograms": histograms}


def _landmarks(source, target):
    """The landmarks of two poses, as points of their remeshes."""
    from omt_uv.solver.mesh.closest_point import ClosestPoint
    from omt_uv.solver.mesh.geometry import vertex_normals
    from omt_uv.solver.registration.landmarks import Landmarks

    sides: list = []
    for pose in (source, target):
        near = np.linalg.norm(pose.vertices[:, None] - pose.landmarks, axis=2).argmin(axis=0)
        closest = ClosestPoint(pose.vertices, pose.triangles, 0.01)
        at = closest(pose.landmarks, vertex_normals(pose.vertices, pose.triangles)[near])
        sides += [at.faces, at.barycentric]
    return Landmarks(*sides)


def _harmonic(names: tuple[str, str], bodies, landmarks):
    """Share of the area that is flipped by the harmonic map between the conformal images, landmarks fixed (the thesis'
    rival); and where the source's vertices lie on the target: triangles and coordinates, and positions (n,3)."""
    from omt_uv.solver.linalg.sparse import solve_spd
    from omt_uv.solver.mesh.geometry import face_areas, halfedge_lengths, laplacian_from_lengths
    from omt_uv.solver.mesh.point_location import locate
    from omt_uv.solver.mesh.spherical_geometry import normalized, signed_volumes
    from omt_uv.solver.registration.alignment import rotation_of_pairs

    source, target = (bodies[name] for name in names)
    first, second = (_map(name, bodies[name], ANGLES) for name in names)
    corners = target.triangles[landmarks.target_faces]
    places = normalized(np.einsum("kc,kcd->kd", landmarks.target_barycentric, second[corners]))
    # A landmark is the vertex next to it.
    fixed = source.triangles[landmarks.source_faces, landmarks.source_barycentric.argmax(axis=1)]
    first = first @ rotation_of_pairs(first[fixed], places).rotation.T
    n, free = len(first), np.setdiff1d(np.arange(len(first)), fixed)
    lengths = halfedge_lengths(first, source.triangles).reshape(-1, 3)
    stiffness = laplacian_from_lengths(lengths, source.triangles, n, least=1e-6)
    shift = np.zeros_like(first)
    shift[fixed] = places - first[fixed]
    shift[free] = solve_spd(stiffness[free][:, free], -(stiffness[free][:, fixed] @ shift[fixed]))
    moved = normalized(first + shift)
    area = face_areas(source.vertices, source.triangles)
    flipped = area[signed_volumes(moved, source.triangles) <= 0].sum() / area.sum()
    faces, weights = locate(second, target.triangles, moved)
    return flipped, (faces, weights), np.einsum("nc,ncd->nd", weights, target.vertices[target.triangles[faces]])


def _map(name: str, pose, balance: float) -> np.ndarray:
    """The map (n,3) of a pose to the sphere, kept in the folder."""
    from omt_uv.solver.progress import drain
    from omt_uv.solver.sphere.sphere_map import sphere_map

    path = FOLDER / f"map_{name}_{len(pose.vertices)}_{balance:g}.npy"
    if not path.exists():
        np.save(path, drain(sphere_map(pose.vertices, pose.triangles, balance=balance)).positions)
    return np.load(path)


def draw(histograms: np.ndarray, path: Path) -> None:
    """Histograms (2,2,BINS), ours and the rival's, of both ratios, means over the pairs, as the thesis has them."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from omt_uv.solver.strain.figures import BINS, MOST

    edges = np.linspace(1, MOST, BINS + 1)
    figure, places = plt.subplots(1, 2, figsize=(9, 3.2))
    for k, (place, title) in enumerate(zip(places, ("curvature difference", "area distortion"), strict=True)):
        for values, (name, colour) in zip(histograms, NAMES.items(), strict=True):
            place.stairs(100 * values[k], edges, label=name, color=colour, fill=name == "ours", alpha=0.75)
        place.set_yscale("log")
        place.set_xlabel(title)
        place.set_ylabel("% of the area")
        place.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    print(f"plots: {path}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vertices", type=int, default=3000, help="of every remesh")
    parser.add_argument("--pairs", type=int, default=21, help="new ones to match at most")
    options = parser.parse_args()
    from poses import poses

    corner, bodies = poses(options.vertices, FOLDER)
    rows, histograms, left = [], [], options.pairs
    for names in combinations(bodies, 2):
        path = FOLDER / f"{'_'.join(names)}_{options.vertices}.npz"
        if not path.exists() and left:
            np.savez(path, **pair_figures(names, bodies, corner))
            left -= 1
        if path.exists():
            kept = np.load(path)
            rows.append({"pair": " ".join(names)} | dict(zip(kept["names"], kept["figures"].tolist(), strict=True)))
            histograms.append(kept["histograms"])
    rows.append({"pair": "mean"} | {key: float(np.mean([row[key] for row in rows])) for key in list(rows[0])[1:]})
    told(FOLDER, "pairs", rows)
    draw(np.mean(histograms, axis=0), FOLDER / "histograms.png")


if __name__ == "__main__":
    main()
