"""Green's functions of plates: those of slivers are told apart from nothing, though double precision does not."""

import numpy as np
from scipy.sparse import csr_matrix

from omt_uv.solver.seams.predicted_scale import _inverse


def test_a_plate_that_rounding_makes_singular_has_an_answer():
    rows = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 2.0]])
    rows[1, 1] = np.nextafter(1.0, 0.0)
    green = _inverse(csr_matrix(rows), np.array([0, 1, 3]), 4)
    assert np.isfinite(green).all() and (green == green.T).all()
    assert abs(green[3, 3] - 0.5) < 1e-8
    assert not green[2].any()
