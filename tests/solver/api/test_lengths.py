"""What a script gives for every face, vertex or corner has as many values as there are of these, and what names
vertices names such as there are: one too few or too many is told by the name of the argument, and never taken."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

import omt_uv.solver as omt

V, F = meshes.bumpy(4, 3)
BALL, TRIANGLES = meshes.icosphere(1)
UV = V[F][:, :, :2]
PAINTED = np.clip(1.5 - 3 * np.hypot(*(V[:, :2] - V[:, :2].mean(axis=0)).T), 0, 1)
NOTHING = np.zeros(F.size, bool)
# Calls with one argument left open: its name, as errors tell it, and a value of it that goes.
EACH = {
    "unwrap density": ("density", np.linspace(1, 2, len(F)), lambda x: omt.unwrap(V, F, density=x)),
    "unwrap pins": ("pins", NOTHING, lambda x: omt.unwrap(V, F, pins=(x, UV))),
    "unwrap places of pins": ("uv", UV.reshape(-1, 2), lambda x: omt.unwrap(V, F, pins=(NOTHING, x))),
    "refine uv": ("uv", UV.reshape(-1, 2), lambda x: omt.refine(V, F, x)),
    "magnify uv": ("uv", UV.reshape(-1, 2), lambda x: omt.magnify(V, F, x, PAINTED, 1.5)),
    "magnify weights": ("weights", PAINTED, lambda x: omt.magnify(V, F, UV, x, 1.5)),
    "sphere_map density": ("density", np.ones(len(TRIANGLES)), lambda x: omt.sphere_map(BALL, TRIANGLES, density=x)),
    "remesh density": ("density", np.ones(len(F)), lambda x: omt.remesh(V, F, 20, density=x)),
    "distortion uv": ("uv", UV.reshape(-1, 2), lambda x: omt.distortion(V, F, x)),
}
PAIRS = {
    "unwrap seams": ("seams", lambda x: omt.unwrap(V, F, seams=x)),
    "remesh features": ("features", lambda x: omt.remesh(V, F, 20, features=x)),
}
OTHERS = {
    "one fewer": lambda x: x[:-1],
    "one more": lambda x: np.concatenate([x, x[:1]]),
    "twice as many": lambda x: np.concatenate([x, x]),
    "none": lambda x: x[:0],
}


@pytest.mark.parametrize("name", EACH)
def test_as_many_as_there_are_go_and_no_others(name):
    argument, good, call = EACH[name]
    call(good)
    call(good.tolist())
    for change in OTHERS.values():
        with pytest.raises(ValueError, match=rf"^{argument} .*{len(good)}"):
            call(change(good))


@pytest.mark.parametrize("name", [name for name, (_, good, _) in EACH.items() if good.ndim == 1])
def test_one_number_for_all_or_a_table_is_none_for_each(name):
    argument, good, call = EACH[name]
    for other in (good[0], good[:, None], np.column_stack([good, good])):
        with pytest.raises(ValueError, match=f"^{argument} must have the shape"):
            call(other)


@pytest.mark.parametrize("name", PAIRS)
def test_edges_are_of_vertices_that_are_there(name):
    argument, call = PAIRS[name]
    for good in ((), np.zeros((0, 2)), [(0, 1)], np.array([F[0, :2], F[1, 1:]])):
        call(good)
    for bad in ([(0, len(V))], [(-1, 0)], [(0, 1), (1, 10**9)]):
        with pytest.raises(ValueError, match=f"^{argument} name vertices that are not among the {len(V)} given"):
            call(bad)
