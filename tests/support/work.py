"""Count how much work was done: figures that are the same on every machine."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass

from omt_uv.solver.linalg import sparse as linear
from omt_uv.solver.linalg.multigrid import Multigrid


@dataclass
class Work:
    """Sparse factorisations, the nonzeros of all their factors, and cycles of multigrid."""

    factorisations: int = 0
    nonzeros: int = 0
    cycles: int = 0


@contextmanager
def counted_work():
    """The `Work` of what is solved meanwhile."""
    work, original, cycle = Work(), linear.splu, Multigrid.cycle

    def counting(*arguments, **options):
        factors = original(*arguments, **options)
        work.factorisations += 1
        work.nonzeros += factors.nnz
        return factors

    def cycling(self, b, level=0):
        work.cycles += level == 0
        return cycle(self, b, level)

    linear.splu, Multigrid.cycle = counting, cycling
    try:
        yield work
    finally:
        linear.splu, Multigrid.cycle = original, cycle
