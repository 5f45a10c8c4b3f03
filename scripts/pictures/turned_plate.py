"""Draw docs/pictures/turned.png: one click on bodies of revolution, beside Smart UV Project and Minimum Stretch.

    python scripts/pictures/turned_plate.py [OUT.png]

A bottle, a bowl, a wine glass, a vase, a pawn and a plate: profiles turned about their axes, with rows as near to one
another as a modeller would have them.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hard_plate
import renders
from scipy.interpolate import PchipInterpolator

ROWS = 36
SECTORS = 48
PROFILES = {
    "bottle": [(0, 0.05), (0.75, 0), (0.85, 0.15), (0.85, 1.7), (0.7, 2.1), (0.3, 2.5), (0.25, 3.1), (0.3, 3.15),
               (0.3, 3.25)],
    "bowl": [(0, 0), (0.5, 0), (0.55, 0.1), (0.9, 0.3), (1.3, 0.8), (1.4, 1.2), (1.34, 1.2), (1.22, 0.82),
             (0.84, 0.36), (0, 0.12)],
    "glass": [(0, 0), (1, 0.02), (0.9, 0.1), (0.15, 0.25), (0.1, 0.6), (0.1, 1.6), (0.4, 1.8), (0.9, 2.3), (1, 2.9),
              (0.85, 3.5), (0.8, 3.5), (0.94, 2.9), (0.84, 2.35), (0.35, 1.88), (0, 1.8)],
    "vase": [(0, 0), (0.5, 0), (0.8, 0.5), (0.9, 1.1), (0.6, 1.8), (0.3, 2.2), (0.35, 2.5), (0.5, 2.6)],
    "pawn": [(0, 0), (1, 0), (1.05, 0.15), (0.8, 0.35), (0.45, 0.6), (0.35, 1.2), (0.55, 1.45), (0.3, 1.55),
             (0.5, 1.9), (0.35, 2.25), (0, 2.4)],
    "plate": [(0, 0.05), (0.5, 0), (0.6, 0.05), (1, 0.2), (1.02, 0.23), (1, 0.25), (0.6, 0.1), (0, 0.08)],
}  # fmt: skip
VIEWS = dict.fromkeys(PROFILES, renders.View("Z", 30, 20)) | {"plate": renders.View("Z", 50, 20)}


def smooth(profile):
    """A smooth line through radii and heights, in rows as far from one another."""
    radius, height = np.array(profile, float).T
    along = np.append(0.0, np.cumsum(np.hypot(np.diff(radius), np.diff(height))))
    even = np.linspace(0, along[-1], ROWS + 1)
    return list(zip(*(PchipInterpolator(along, x)(even).tolist() for x in (radius, height)), strict=True))


def body(name):
    """A profile turned about Z."""
    return hard_plate.turned(smooth(PROFILES[name]), SECTORS)


if __name__ == "__main__":
    bodies = {name: partial(body, name) for name in PROFILES}
    hard_plate.draw(bodies, VIEWS, "docs/pictures/turned.png")
