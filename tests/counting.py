"""Counts that say how much work was done, the same on every machine."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass

from omt_uv.solver import linear


@dataclass
class Tally:
    """Sparse factorisations, and the nonzeros of all their factors."""

    factorisations: int = 0
    nonzeros: int = 0


@contextmanager
def counted():
    """A `Tally` of what is factored meanwhile."""
    tally, original = Tally(), linear.splu

    def counting(*arguments, **options):
        factors = original(*arguments, **options)
        tally.factorisations += 1
        tally.nonzeros += factors.nnz
        return factors

    linear.splu = counting
    try:
        yield tally
    finally:
        linear.splu = original
