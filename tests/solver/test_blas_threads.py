"""The limit of threads: one while solvers work, on whatever threads these are, and what was before afterwards."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from omt_uv.solver.blas_threads import libraries, one_blas_thread
from omt_uv.solver.progress import Progress, drain, on_thread


def counts():
    return [library.count() for library in libraries()]


@pytest.fixture
def two_threads():
    """Two threads for every library, until the end of a test."""
    np.ones((4, 4)) @ np.ones((4, 4))
    splu(sp.identity(3, format="csc"))
    before = counts()
    for library in libraries():
        library.limit(2)
    yield counts()
    for library, count in zip(libraries(), before, strict=True):
        library.limit(count)


def solver(seen):
    for _ in range(3):
        seen.append(counts())
        yield Progress("", 0.0)
    return seen


def test_solvers_have_one_thread_and_leave_what_was(two_threads):
    one = [1] * len(two_threads)
    assert drain(solver([])) == [one] * 3 and counts() == two_threads
    assert drain(on_thread(solver([]))) == [one] * 3 and counts() == two_threads


def test_the_last_of_several_gives_them_back(two_threads):
    one = [1] * len(two_threads)
    with one_blas_thread():
        with one_blas_thread():
            assert counts() == one
        assert counts() == one
    assert counts() == two_threads


def test_an_error_gives_them_back(two_threads):
    with pytest.raises(ValueError, match="no"), one_blas_thread():
        raise ValueError("no")
    assert counts() == two_threads


def test_the_libraries_of_the_wheels_are_found():
    names = str(np.show_config(mode="dicts")) if hasattr(np, "show_config") else ""
    assert len(libraries()) > 0 or "openblas" not in names.lower()
