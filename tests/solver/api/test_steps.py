"""The generators of the front door: they say how far they are, and may be closed at any time."""

from __future__ import annotations

import inspect
import itertools
from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.solver.api import steps
from omt_uv.solver.progress import drain


def tilted_square():
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0]])
    return V, np.array([[0, 1, 2, 3]])


@pytest.mark.parametrize("name", ["unwrap", "refine", "remesh"])
def test_they_can_be_closed_before_their_end(name):
    V, F = tilted_square()
    more = {"unwrap": (), "refine": (V[F][:, :, :2],), "remesh": (20,)}[name]
    run = getattr(steps, name)(V, F, *more)
    next(run)
    run.close()
    with pytest.raises(StopIteration):
        next(run)


def test_seams_that_were_cut_are_returned():
    V = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    F = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    result = drain(steps.unwrap(V, F))
    # A tetrahedron comes open along a tree that reaches its four vertices.
    assert result.seams.shape == (3, 2) and len(np.unique(result.seams)) == 4
    assert result.figures.folds == 0 and result.figures.overlap == 0


@pytest.mark.parametrize("seed", range(5))
def test_islands_laid_side_by_side_keep_their_shapes_in_rows_of_a_square(seed):
    rng = np.random.default_rng(seed)
    sizes = rng.uniform(0.2, 2, (9, 2)) * ([4, 0.2] if seed == 4 else [1, 1])
    uv = np.concatenate([rng.uniform(0, 1, (5, 2)) * size + rng.normal(size=2) for size in sizes])
    islands = np.array_split(rng.permutation(45).reshape(9, 5).ravel(), 9)
    found = steps._side_by_side(uv, islands)
    low, high = (np.array([f(found[i], axis=0) for i in islands]) for f in (np.min, np.max))
    given = np.array([np.ptp(uv[i], axis=0) for i in islands])
    for i in islands:
        np.testing.assert_allclose(found[i] - found[i[0]], uv[i] - uv[i[0]], atol=1e-12)
    side = np.sqrt(given.prod(axis=1).sum())
    for j in range(9):
        for k in range(j):
            apart = np.maximum(low[j] - high[k], low[k] - high[j]).max()
            assert apart >= 0.01 * side * (1 - 1e-9)
    # Rows are as wide as the square, or as the widest island, at most, and the next island had no room in one.
    wide = max(side, given[:, 0].max())
    assert (low >= 0).all() and high[:, 0].max() <= wide * (1 + 1e-9)
    order = np.argsort(-given[:, 1], kind="stable")
    for one, other in itertools.pairwise(order):
        if low[other, 0] == 0:
            assert high[one, 0] + 0.01 * side + given[other, 0] > wide
        else:
            assert low[other, 1] == low[one, 1]


def telling(name, function, said):
    """A function whose results say one thing more, which is kept; as it is if they say nothing."""

    def more(found):
        if not isinstance(getattr(found, "warnings", None), tuple):
            return found
        said.append(f"{name} has said {len(said)}")
        return replace(found, warnings=(*found.warnings, said[-1]))

    def whole(run):
        return more((yield from run))

    def told(*given, **options):
        found = function(*given, **options)
        return whole(found) if inspect.isgenerator(found) else more(found)

    return told


@pytest.mark.parametrize("name", ["unwrap", "refine", "magnify"])
def test_whatever_a_part_of_it_says_a_step_says(monkeypatch, name):
    """Two islands and whatever is called for them."""
    V, F = meshes.quad_grid(4, 3)[0], np.array(meshes.quad_grid(4, 3)[1])
    V, F = np.concatenate([V, V + [9, 0, 0]]), np.concatenate([F, F + len(V)])
    weights = (V[:, 0] % 9 < np.median(V[:, 0] % 9)).astype(float)
    more = {"unwrap": (), "refine": (V[F][:, :, :2],), "magnify": (V[F][:, :, :2], weights, 1.2)}[name]
    said = []
    for part, function in list(vars(steps).items()):
        # What a density says is said by what asks for it.
        if inspect.isfunction(function) and function.__module__ != steps.__name__ and part != "target_density":
            monkeypatch.setattr(steps, part, telling(part, function, said))
    monkeypatch.setattr(steps.unwrapping, "unwrap", telling("a map", steps.unwrapping.unwrap, said))
    found = drain(getattr(steps, name)(V, F, *more))
    assert len(said) >= (1 if name == "unwrap" else 3)
    assert set(said) <= set(found.warnings) and len(set(found.warnings)) == len(found.warnings)
