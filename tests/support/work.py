"""Counts that say how much work was done, the same on every machine."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass

from omt_uv.solver.linalg import sparse as linear
from omt_uv.solver.linalg.multigrid import Multigrid


@dataclass
class Tally:
    """Sparse factorisations, the nonzeros of all their factors, and cycles of multigrid."""

    factorisations: int = 0
    nonzeros: int = 0
    cycles: int = 0


@contextmanager
def counted():
    """A `Tally` of what is factored meanwhile."""
    tally, original, cycle = Tally(), linear.splu, Multigrid.cycle

    def counting(*arguments, **options):
        factors = original(*arguments, **options)
        tally.factorisations += 1
        tally.nonzeros += factors.nnz
        return factors

    def cycling(self, b, level=0):
        tally.cycles += level == 0
        return cycle(self, b, level)

    linear.splu, Multigrid.cycle = counting, cycling
    try:
        yield tally
    finally:
        linear.splu, Multigrid.cycle = original, cycle
