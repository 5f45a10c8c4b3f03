"""Errors say what is wrong, where, and what to do about it."""

import numpy as np
import pytest

from omt_uv.solver.errors import FEW, DensityError, MeshError, first_of, positive_density


@pytest.mark.parametrize(
    ("kind", "elements", "text"),
    [
        ("", [], "It is so."),
        ("vertex", [4], "It is so (1 vertex: 4)."),
        ("vertex", [4, 5], "It is so (2 vertices: 4, 5)."),
        ("edge", [[1, 2]], "It is so (1 edge: [1, 2])."),
        ("face", range(7), "It is so (7 faces: 0, 1, 2, 3, 4, ...)."),
    ],
)
def test_messages(kind, elements, text):
    error = MeshError("It is so", kind=kind, elements=list(elements))
    assert str(error) == text and error.kind == kind
    np.testing.assert_array_equal(error.elements, list(elements))


@pytest.mark.parametrize("count", [*range(FEW + 3), 40])
@pytest.mark.parametrize("of_edges", [False, True])
def test_dots_stand_for_elements_that_are_not_named_and_for_no_others(count, of_edges):
    elements = np.arange(2 * count).reshape(-1, 2) if of_edges else np.arange(count)
    named = [str(x) for x in elements.tolist()]
    text = first_of(elements)
    assert text == ", ".join(named[:FEW]) + ", ..." * (count > FEW)
    assert all(name in text for name in named) == (count <= FEW)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_densities_are_positive(bad):
    np.testing.assert_array_equal(positive_density([1, 2]), [1.0, 2.0])
    with pytest.raises(DensityError) as caught:
        positive_density([1, bad])
    assert caught.value.elements.tolist() == [1]
