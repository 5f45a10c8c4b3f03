"""Load what an unwrap needs before the first click, once the tab is looked at, a little at a time.

A second of imports would be the first thing that an artist sees of the extension, and Blender's start would wait for
it if they came with that. Between two of them Blender draws and listens.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

import bpy

PACKAGE = __package__.rpartition(".")[0]
# What takes longest by itself, then what an unwrap imports, in its order.
MODULES = (
    "scipy.sparse",
    "scipy.spatial",
    ".solver.analysis.facing",
    ".solver.refinement.continuation",
    ".pipelines.reading",
    ".solver.packing.pack_square",
    ".solver.cutting.crease_sides",
    ".solver.cutting.disk_charts",
    ".solver.refinement.refine",
    ".solver.parameterization.chart_map",
    ".pipelines.layout",
    ".pipelines.unwrap",
    ".solver.seams.search",
    ".solver.parameterization.thinned",
    ".solver.parameterization.pockets",
    ".solver.seams.limbs",
    ".blender.mesh",
    ".blender.vertex_groups",
    ".blender.seams",
    ".blender.fingerprint",
    ".pipelines.subdivision",
    ".pipelines.texel_density",
    ".pipelines.gate",
)
# Seconds until the first, and between two.
PAUSE = 0.1

_left: list[Iterator[str]] = []


def begin() -> None:
    """Load it all, but once, and where there is a window that somebody looks at."""
    if not (bpy.app.background or _left):
        _left.append(iter(MODULES))
        bpy.app.timers.register(_load_next, first_interval=PAUSE, persistent=True)


def forget() -> None:
    """Load no more."""
    if bpy.app.timers.is_registered(_load_next):
        bpy.app.timers.unregister(_load_next)
    _left.clear()


def _load_next() -> float | None:
    """Load the next module; seconds until the one after it, None where nothing is left or can be loaded."""
    name = next(_left[0], None)
    if name is None:
        return None
    try:
        import_module(name, PACKAGE)
    except ImportError:
        # Whoever clicks is told what is missing, and what to do.
        return None
    return PAUSE
