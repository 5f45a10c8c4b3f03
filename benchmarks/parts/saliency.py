"""Time saliency on 50,000 vertices, and show what turning and scaling change, and a bump against its plane."""

from __future__ import annotations

import meshes
import numpy as np

from benchmarks.part import Part
from benchmarks.tables import Table, missed
from benchmarks.timing import timed
from omt_uv.solver.analysis.saliency import saliency

SIZES = (50_000, 200_000)
TIME_GOAL = 2.0  # seconds at SIZES[0] vertices
INVARIANCE_GOAL = 1e-6  # relative to the greatest saliency


def saliency_table(args) -> Table:
    """One row for every size, of a head and of a bump."""
    table = Table(
        "Saliency; change: of any vertex by a rotation, a scale and a shift, over the greatest; bump / plane: least "
        "saliency on a bump over the greatest of the plane around it",
        {"model": 15, "vertices": 9, "time": 8, "change": 10, "bump / plane": 12, "missed goals": 20},
    )
    random = np.random.default_rng(0)
    for size in SIZES:
        side = int(np.sqrt(size))
        for name, (V, F), r in (("head", meshes.head(side), None), ("bump", *_bump(side))):
            s, seconds = timed(lambda V=V, F=F: saliency(V, F))
            q, _ = np.linalg.qr(random.normal(size=(3, 3)))
            turned = saliency(137 * V @ (q * np.sign(np.linalg.det(q))) + 20, F)
            change = float(np.abs(turned - s).max() / s.max())
            contrast = None if r is None else float(s[r < 0.03].min() / max(s[r > 0.3].max(), 1e-300))
            goals = {
                "time": seconds > TIME_GOAL * len(V) / SIZES[0],
                "change": change > INVARIANCE_GOAL,
                "bump": contrast is not None and contrast <= 1,
            }
            table.add(
                model=name,
                vertices=len(V),
                time=seconds,
                change=change,
                **{"bump / plane": "" if contrast is None else contrast},
                **missed(**goals),
            )
    return table


def _bump(side):
    """A plane with a bump, and the distance (n,) of its vertices from the bump's middle."""
    V, F = meshes.grid(side - 1, side - 1)
    r = np.linalg.norm(V[:, :2] - [0.4, 0.5], axis=1)
    V[:, 2] = 0.06 * np.exp(-((r / 0.06) ** 2))
    return (V, F), r


PARTS = (Part("saliency", "its time, and what turning and scaling change", saliency_table),)
