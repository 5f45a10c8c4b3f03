"""Write a folder of meshes to try a batch on: sizes by a power law, three of a hundred broken.

usage: make_meshes.py FOLDER [--count 2000] [--most 200000] [--seed 0]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

LEAST = 60
# Of sizes: the share of meshes with more than n faces falls as n^-EXPONENT.
EXPONENT = 1.0
BROKEN = 0.03


def grid(rows, columns, closed):
    """Triangles (m,3) of a grid of vertices, which is closed around its columns if asked for."""
    last = columns if closed else columns - 1
    i, j = (x.ravel() for x in np.meshgrid(np.arange(rows - 1), np.arange(last), indexing="ij"))
    a, b = i * columns + j, i * columns + (j + 1) % columns
    return np.concatenate([np.stack([a, b, b + columns], 1), np.stack([a, b + columns, a + columns], 1)])


def bumps(rng, directions):
    """Heights (n,) that vary smoothly with directions (n,3)."""
    waves = rng.normal(size=(6, 3)) * 2
    return 1 + 0.06 * np.sin(directions @ waves.T + rng.random(6) * 6).sum(1)


def shape(rng, faces):
    """A tube, a dome, or a torus of about so many faces, with bumps: positions and triangles."""
    n = max(round((faces / 2) ** 0.5), 4)
    kind = rng.choice(["tube", "dome", "torus"])
    if kind == "torus":
        u, v = (x.ravel() for x in np.meshgrid(np.arange(n) / n, np.arange(n) / n, indexing="ij"))
        u, v = 2 * np.pi * u, 2 * np.pi * v
        V = np.stack([(2 + np.cos(v)) * np.cos(u), (2 + np.cos(v)) * np.sin(u), np.sin(v)], 1)
        F = grid(n + 1, n, True) % (n * n)
    else:
        low = 0.15 if kind == "tube" else 0.02
        t, u = (x.ravel() for x in np.meshgrid(np.linspace(low, 0.6, n), np.arange(n) / n, indexing="ij"))
        t, u = np.pi * t, 2 * np.pi * u
        V = np.stack([np.sin(t) * np.cos(u), np.sin(t) * np.sin(u), np.cos(t)], 1)
        F = grid(n, n, True)
    return V * bumps(rng, V)[:, None], F


def text_of(V, F):
    """The mesh as the text of an .obj file."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in V.tolist()]
    return "\n".join(lines + [f"f {a} {b} {c}" for a, b, c in (F + 1).tolist()]) + "\n"


def broken(rng, V, F):
    """Text of a file that cannot be done: name of what is wrong, and the text."""
    V, F = V.copy(), F.copy()
    kind = rng.choice(["empty", "no faces", "noise", "a point", "no numbers", "words"])
    if kind == "a point":
        V[:] = 1.0
    elif kind == "no numbers":
        V[:] = np.nan
    texts = {"empty": "", "no faces": text_of(V, F[:0]), "noise": rng.bytes(500).hex(), "words": "this is no mesh\n"}
    return kind, texts.get(str(kind)) or ("" if kind == "empty" else text_of(V, F))


def write_meshes(folder, count=2000, most=200_000, seed=0):
    """Write the files; numbers of faces (count,), 0 for those that are broken."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    faces = np.minimum(LEAST * rng.random(count) ** (-1 / EXPONENT), most).astype(int)
    bad = rng.permutation(count) < round(BROKEN * count)
    for k in range(count):
        V, F = shape(rng, faces[k])
        name, text = broken(rng, V, F) if bad[k] else ("", text_of(V, F))
        (folder / f"{k:05}{'_' + name.replace(' ', '_') if name else ''}.obj").write_text(text)
    return np.where(bad, 0, faces)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--most", type=int, default=200_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    faces = write_meshes(**vars(options))
    print(f"{len(faces)} files, {(faces == 0).sum()} of them broken, {faces.sum()} faces, {faces.max()} at most")


if __name__ == "__main__":
    main()
