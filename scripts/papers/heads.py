"""Write procedurally varied heads, each open at the neck: a stand-in for the scanned faces of B. Gu 2018; and put
expressions on them, for those of Su 2015."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from omt_uv.solver.mesh.topology import boundary_loops, graph_components, halfedges

# Bumps on a head: where, as direction (x to the side, y to the front, z up), width, and height, each varied.
FEATURES = (
    ("nose", (0.0, 1.0, -0.05), 0.13, 0.24),
    ("tip", (0.0, 1.0, -0.18), 0.09, 0.12),
    ("brow", (0.32, 0.95, 0.18), 0.22, 0.05),
    ("eye", (0.33, 0.92, 0.04), 0.14, -0.07),
    ("cheek", (0.5, 0.85, -0.25), 0.25, 0.06),
    ("chin", (0.0, 0.9, -0.62), 0.22, 0.16),
    ("lips", (0.0, 1.0, -0.38), 0.14, 0.06),
    ("mouth", (0.0, 1.0, -0.385), 0.035, -0.05),
    ("ear", (1.0, -0.05, -0.05), 0.16, 0.20),
    ("lobe", (1.0, 0.08, -0.05), 0.09, -0.10),
    ("skull", (0.0, -0.8, 0.5), 0.7, 0.16),
)
# What moves on a face by expression, on both sides where it is beside the middle: where, as direction in files (x to
# the side, y up, z to the front), width, and which way.
EXPRESSIONS = {
    "smile": (
        ((0.38, -0.40, 0.9), 0.16, (0.16, 0.12, 0.02)),
        ((0.5, -0.15, 0.85), 0.2, (0.02, 0.06, 0.12)),
        ((0.0, -0.42, 1.0), 0.14, (0.0, -0.03, -0.06)),
    ),
    "frown": (
        ((0.34, -0.44, 0.9), 0.16, (0.03, -0.20, 0.02)),
        ((0.2, 0.28, 0.95), 0.2, (-0.10, -0.14, 0.06)),
        ((0.0, -0.6, 0.9), 0.18, (0.0, 0.06, 0.12)),
    ),
    "surprise": (
        ((0.0, -0.45, 1.0), 0.16, (0.0, -0.08, -0.34)),
        ((0.0, -0.75, 0.8), 0.28, (0.0, -0.22, 0.0)),
        ((0.33, 0.3, 0.92), 0.26, (0.0, 0.2, 0.06)),
    ),
}
# A scan reaches this far from the tip of the nose, as those of faces do.
SCAN = 1.05
# Rows from the crown to the neck, and columns around.
ROWS = 88
COLUMNS = 120


def head(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) and triangles (m,3) of a head: about 21,000 triangles, a disk with the neck as boundary."""
    rng = np.random.default_rng(seed)
    polar = np.pi * np.linspace(0, 0.86, ROWS)[1:]
    around = 2 * np.pi * np.arange(COLUMNS) / COLUMNS
    t, u = (x.ravel() for x in np.meshgrid(polar, around, indexing="ij"))
    way = np.concatenate([[[0, 0, 1]], np.stack([np.sin(t) * np.sin(u), np.sin(t) * np.cos(u), np.cos(t)], 1)])
    radius = np.ones(len(way))
    for _, place, width, height in FEATURES:
        # Not quite symmetric, as no face is.
        for side in (1, -1) if place[0] else (1,):
            centre = np.array(place) * [side, 1, 1] + rng.normal(size=3) * 0.02
            angle = np.arccos(np.clip(way @ (centre / np.linalg.norm(centre)), -1, 1))
            radius += height * rng.uniform(0.6, 1.4) * np.exp(-((angle / (width * rng.uniform(0.85, 1.15))) ** 2))
    waves = rng.normal(size=(5, 3)) * 3
    radius += 0.008 * np.sin(way @ waves.T + rng.random(5) * 6).sum(1)
    V = way * radius[:, None] * rng.uniform(0.9, 1.1, 3) * [0.8, 0.95, 1.15]
    # In files Y is up, and what looks at us is in front.
    return V[:, [0, 2, 1]] * [-1, 1, 1], _triangles()


def with_expression(V: np.ndarray, kind: str, strength: float) -> np.ndarray:
    """Positions (n,3) of a head that makes a face of this kind."""
    way = V / np.linalg.norm(V, axis=1, keepdims=True)
    moved = V.copy()
    for place, width, move in EXPRESSIONS[kind]:
        for side in (1, -1) if place[0] else (1,):
            centre = np.array(place) * [side, 1, 1]
            angle = np.arccos(np.clip(way @ (centre / np.linalg.norm(centre)), -1, 1))
            moved += strength * np.exp(-((angle / width) ** 2))[:, None] * np.array(move) * [side, 1, 1]
    return moved


def nose(V: np.ndarray) -> int:
    """The vertex at the tip of the nose."""
    way = V / np.linalg.norm(V, axis=1, keepdims=True)
    middle = (np.abs(way[:, 0]) < 0.2) & (np.abs(way[:, 1] + 0.1) < 0.25)
    return int(np.argmax(np.where(middle, V[:, 2], -np.inf)))


def hairline(V: np.ndarray) -> int:
    """The vertex in the middle of the hairline."""
    way = V / np.linalg.norm(V, axis=1, keepdims=True)
    return int((way @ [0.0, 0.62, 0.78]).argmax())


def scan(V: np.ndarray, F: np.ndarray) -> tuple[np.ndarray, np.ndarray, int, int]:
    """The front of a head, as a scanner sees it: positions (n,3), triangles (m,3), the tip of the nose, and the vertex
    of the boundary that is lowest in front."""
    tip = nose(V)
    near = (np.linalg.norm(V - V[tip], axis=1) < SCAN)[F].all(axis=1)
    label = graph_components(*halfedges(F[near]), len(V))[1]
    faces = F[near][label[F[near][:, 0]] == label[tip]]
    used, local = np.unique(faces, return_inverse=True)
    faces = local.reshape(-1, 3)
    loop = max(boundary_loops(faces), key=len)
    low = V[used[loop]] @ [0, 1, -0.5]
    return V[used], faces, int(np.searchsorted(used, tip)), int(loop[low.argmin()])


def _triangles() -> np.ndarray:
    """Triangles (m,3): a fan at the crown, and rows below."""
    j = np.arange(COLUMNS)
    fan = np.stack([np.zeros(COLUMNS, int), 1 + j, 1 + (j + 1) % COLUMNS], 1)
    i = np.arange(ROWS - 2)[:, None] * COLUMNS + 1
    a, b = (i + j).ravel(), (i + (j + 1) % COLUMNS).ravel()
    rows = [np.stack([a, a + COLUMNS, b + COLUMNS], 1), np.stack([a, b + COLUMNS, b], 1)]
    # As directions are listed, these look inwards.
    return np.concatenate([fan, *rows])[:, ::-1]


def write_heads(folder: Path, count: int) -> None:
    """Write heads as .obj, but for those that are there."""
    folder.mkdir(parents=True, exist_ok=True)
    for k in range(count):
        path = folder / f"head_{k:05}.obj"
        if path.exists():
            continue
        V, F = head(k)
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in V.tolist()]
        path.write_text("\n".join(lines + [f"f {a} {b} {c}" for a, b, c in (F + 1).tolist()]) + "\n")
