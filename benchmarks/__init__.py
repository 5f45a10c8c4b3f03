"""Benchmarks: figures as ratios within one run, since machines differ and are shared; `python benchmarks/run.py`.

Imports the package, and `tests/support` for meshes and counts of work; `rivals` and what uses it need bpy.
Main modules: `run` (the command), `part` (what a part is), `cases`, `rivals`, `tables`, and one module each in `parts`.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

# Processor times are comparable only when one thread does the work; numpy reads this once, when it is imported.
os.environ.setdefault("OMP_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[1]
_SUPPORT = str(ROOT / "tests" / "support")
if _SUPPORT not in sys.path:
    sys.path.insert(0, _SUPPORT)
