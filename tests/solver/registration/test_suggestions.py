"""Landmarks are suggested where something stands out: where nothing does there are none, and no surface is an error."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from sphere_shapes import blob

from omt_uv.solver.errors import EmptyMeshError, NonFiniteError
from omt_uv.solver.registration import suggestions
from omt_uv.solver.registration.suggestions import suggest_landmarks

BODY, ROUND = blob(3, seed=1), blob(1, seed=2)


@pytest.mark.parametrize("pair", [(ROUND, BODY), (BODY, ROUND), (ROUND, ROUND)], ids=["first", "second", "both"])
def test_where_nothing_stands_out_there_are_none(pair):
    found = suggest_landmarks(*pair)
    assert len(found.source) == len(found.target) == len(found.difference) == 0


@pytest.mark.parametrize("most", [1, 4])
def test_a_surface_has_its_own_places_the_least_different_first(most):
    found = suggest_landmarks(BODY, BODY, most)
    assert len(found.source) == most and found.source.tolist() == found.target.tolist()
    np.testing.assert_allclose(found.difference, 0, atol=1e-12)


@pytest.mark.parametrize("side", [0, 1])
def test_what_is_no_surface_is_refused(side):
    V, F = BODY
    strange = V.copy()
    strange[F[7, 1]] = np.nan
    for wrong, error in (((V, F[:0]), EmptyMeshError), ((0 * V, F), EmptyMeshError), ((strange, F), NonFiniteError)):
        with pytest.raises(error) as raised:
            suggest_landmarks(*((wrong, BODY) if side == 0 else (BODY, wrong)))
    assert raised.value.elements.tolist() == [F[7, 1]]


@pytest.mark.parametrize("turned", [False, True])
def test_no_place_that_stands_out_has_a_neighbour_that_does_more(turned):
    """Along a boundary, too, where an edge has a face on one side alone, whichever way round."""
    V, F = meshes.grid(6, 5)
    F = F[:, ::-1] if turned else F
    value = np.random.default_rng(0).random(len(V))
    ends = np.concatenate([F[:, [k, (k + 1) % 3]] for k in range(3)])
    highest = [value[np.append(ends[ends[:, 0] == v, 1], ends[ends[:, 1] == v, 0])].max() for v in range(len(V))]
    # Far enough apart for all of them to be taken.
    found = suggestions._peaks(value, 10 * V, F)
    assert sorted(found.tolist()) == np.flatnonzero(value >= highest).tolist()


@pytest.mark.parametrize("seed", range(3))
def test_places_that_are_each_others_best_and_look_otherwise_are_no_pair(seed):
    """As those of a body that is inside out, where all normals are against one another."""
    V, F = blob(3, seed=seed)
    found = suggest_landmarks((V, F), (V, F[:, ::-1]), 40)
    assert (found.difference < suggestions.MOST_DIFFERENCE).all()
    assert not set(zip(found.source.tolist(), found.target.tolist(), strict=True)) & {(v, v) for v in range(len(V))}
    assert len(suggest_landmarks((V, F), (V, F), 40).source) > len(found.source)


@pytest.mark.parametrize("seed", range(3))
def test_pairs_are_the_same_from_either_side_and_fewer_are_the_first_of_more(seed):
    V, F = blob(3, seed=seed)
    other = V + 0.05 * np.sin(3 * V[:, [1, 2, 0]])
    found, back = suggest_landmarks((V, F), (other, F), 40), suggest_landmarks((other, F), (V, F), 40)
    assert len(found.source) > 5 and (np.diff(found.difference) >= 0).all()
    for side in (found.source, found.target):
        assert len(np.unique(side)) == len(side)
    assert found.source.tolist() == back.target.tolist() and found.target.tolist() == back.source.tolist()
    few = suggest_landmarks((V, F), (other, F), 4)
    assert few.source.tolist() == found.source[:4].tolist() and few.target.tolist() == found.target[:4].tolist()


@pytest.mark.parametrize("size", [0.2, 0.3])
def test_of_places_near_each_other_the_one_that_stands_out_most_is_taken(size):
    V, F = meshes.grid(9, 9)
    value, place = np.random.default_rng(1).random(len(V)), size * V
    found, every = suggestions._peaks(value, place, F), suggestions._peaks(value, 10 * V, F)
    assert 0 < len(found) < len(every) < suggestions.PEAKS and set(found) < set(every)
    away = np.linalg.norm(place[every][:, None] - place[found], axis=2)
    near = away <= suggestions.APART
    assert (near[np.isin(every, found)].sum(axis=1) == 1).all()
    # What is left out has a greater one beside it.
    assert (near & (value[found] >= value[every][:, None])).any(axis=1).all()
