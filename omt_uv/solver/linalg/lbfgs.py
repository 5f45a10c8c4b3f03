"""Find directions of descent for many vertices at once, by L-BFGS (Nocedal, Wright 2006, algorithm 7.4)."""

from __future__ import annotations

from collections import deque

import numpy as np

# Steps that are remembered.
MEMORY = 7


class LBFGS:
    """Steps and changes of the gradient that are remembered; `reset` where these no longer tell anything."""

    def __init__(self):
        self.pairs: deque = deque(maxlen=MEMORY)
        self.last: tuple[np.ndarray, np.ndarray] | None = None

    def reset(self) -> None:
        """Forget all steps and gradients: the next direction is the negative gradient times the diagonal."""
        self.pairs.clear()
        self.last = None

    def direction(self, x: np.ndarray, gradient: np.ndarray, diagonal: np.ndarray) -> np.ndarray:
        """Step (n,3) from x (n,3) against the gradient; diagonal (n,1) of the inverse Hessian to start from."""
        if self.last is not None:
            s, y = x - self.last[0], gradient - self.last[1]
            product = float((s * y).sum())
            if product > 1e-12 * np.sqrt(float((s * s).sum() * (y * y).sum())):
                self.pairs.append((s, y, 1 / product))
        self.last = (x.copy(), gradient.copy())
        q, alphas = gradient.copy(), []
        for s, y, r in reversed(self.pairs):
            alphas.append(r * float((s * q).sum()))
            q -= alphas[-1] * y
        q = diagonal * q
        for (s, y, r), alpha in zip(self.pairs, reversed(alphas), strict=True):
            q += (alpha - r * float((y * q).sum())) * s
        return -q
