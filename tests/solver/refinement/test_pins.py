"""Pins: what contradicts is refused, their energy is a square, and maps are laid to them."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import PinError
from omt_uv.solver.maps.energy import elements
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.continuation import MapProblem
from omt_uv.solver.refinement.hessian_blocks import Assembly
from omt_uv.solver.refinement.pins import PinEnergy, Pins, aligned_to_pins, check_pins, move_pins
from omt_uv.solver.refinement.projected_newton import FreeMotion


def test_pins_are_sorted_and_given_once():
    pins = check_pins(np.array([5, 2, 5]), np.array([[1.0, 2], [0, 1], [1, 2]]), 9)
    np.testing.assert_array_equal(pins.vertices, [2, 5])
    np.testing.assert_array_equal(pins.places, [1j, 1 + 2j])


@pytest.mark.parametrize(
    ("vertices", "places", "named"),
    [
        ([1, 4], [[0, 0], [np.inf, 0]], [4]),
        ([1, 4, 4], [[0, 0], [1, 0], [2, 0]], [4]),
        ([1, 4, 6], [[0, 0], [1, 0], [0, 0]], [1, 6]),
    ],
)
def test_pins_that_contradict_are_named(vertices, places, named):
    with pytest.raises(PinError) as caught:
        check_pins(np.array(vertices), np.array(places, float), 9)
    np.testing.assert_array_equal(caught.value.elements, named)


def test_pins_of_another_chart_are_a_mistake():
    with pytest.raises(ValueError, match="of this chart"):
        check_pins(np.array([9]), np.zeros((1, 2)), 9)


def test_the_energy_is_its_own_quadratic_model():
    random = np.random.default_rng(0)
    w, step = random.normal(size=(2, 9, 2)) @ [1, 1j]
    term = PinEnergy(Pins(np.array([1, 4]), np.array([1j, 2])), 30.0, 0.5)
    gradient, vertices, rows = term.derivatives(w)
    squares = (((rows * step[vertices]).sum(axis=1).real) ** 2).sum()
    assert term.energy(w + step) == pytest.approx(term.energy(w) + (gradient.conj() * step).real.sum() + squares / 2)
    assert term.limit(w, step) == np.inf


def test_a_similarity_of_the_places_is_found_exactly():
    w = np.random.default_rng(1).normal(size=(9, 2)) @ [1, 1j]
    aim = (0.3 - 2j) * w + 5
    np.testing.assert_allclose(aligned_to_pins(w, Pins(np.array([0, 3, 7]), aim[[0, 3, 7]])), aim)


def grid_problem():
    V, F = meshes.grid(6, 6)
    faces = elements(V, F, face_areas(V, F))
    free = FreeMotion(np.zeros(len(V), bool))
    return MapProblem(faces, Assembly(F, len(V)), free, boundary_loops(F)[0], False), V[:, :2] @ [1, 1j]


def test_moved_pins_are_in_place_and_stay():
    problem, w = grid_problem()
    pins = Pins(np.array([0, 6, 42, 48]), np.array([0, 1.3, 0.1 + 0.8j, 1 + 1.1j]))
    fixed, moved = drain(move_pins(problem, w, pins))
    np.testing.assert_array_equal(moved[pins.vertices], pins.places)
    assert (problem.faces.areas(moved) > 0).all() and fixed.scale_free
    assert not fixed.motion.free[pins.vertices].any() and fixed.motion.free.sum() == 2 * (49 - 4)


def test_pins_that_are_in_place_move_nothing():
    problem, w = grid_problem()
    pins = Pins(np.array([3, 20, 45]), w[[3, 20, 45]])
    np.testing.assert_allclose(drain(move_pins(problem, w, pins))[1], w, atol=1e-14)


@pytest.mark.parametrize("unit", [2.0**-12, 1.0, 2.0**12])
def test_pins_that_would_turn_a_face_over_are_named(unit):
    problem, w = grid_problem()
    w, face = unit * w, problem.faces.triangles[30]
    pins = Pins(np.concatenate([face, [0, 6, 42, 48]]), w[np.concatenate([face[[1, 0, 2]], [0, 6, 42, 48]])])
    with pytest.raises(PinError, match="without a fold") as caught:
        drain(move_pins(problem, w, pins))
    assert np.isin(caught.value.elements, face).all()


@pytest.mark.parametrize(("unit", "place"), [(2.0**-10, 0), (2.0**10, 0), (1.0, 4096 - 2048j)])
def test_pins_move_a_map_alike_in_every_unit_and_place(unit, place):
    problem, w = grid_problem()
    # One goes past its neighbours, which have to make way.
    pins = Pins(np.array([0, 6, 24, 42, 48]), np.array([0, 1.3, 0.9 + 0.5j, 0.1 + 0.8j, 1 + 1.1j]))
    _, moved = drain(move_pins(problem, w, pins))
    assert (problem.faces.areas(moved) > 0).all() and moved[25].real > 0.9 > aligned_to_pins(w, pins)[25].real
    _, other = drain(move_pins(problem, unit * w + place, Pins(pins.vertices, unit * pins.places + place)))
    np.testing.assert_allclose((other - place) / unit, moved, atol=1e-9 if place == 0 else 1e-6)
