"""A coarse surface opened along a cut is the same surface, cut there; what it shears foretells the fine map."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import edge_lengths, face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import halfedges, pair_keys, twins
from omt_uv.solver.parameterization import shear_search
from omt_uv.solver.parameterization.chart_map import local_shear
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.shear_search import ShearSearch
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.seams import search as search_module
from omt_uv.solver.seams.rehearsal import _along, opened


def rehearsals(monkeypatch, surface, bound, **options):
    """What an unwrap rehearsed, and what it came to: coarse cuts with the square of log(shear), and its map."""
    seen = []
    of = search_module.Rehearsal.of

    def watched(self, found):
        value = yield from of(self, found)
        seen.append((self, found, value))
        return value

    monkeypatch.setattr(search_module.Rehearsal, "of", watched)
    found = drain(unwrap(surface, options=UnwrapOptions(max_shear=bound, **options)))
    return seen, found


def silent():
    """A rehearsal that has no map."""
    return None
    yield


def mean_shear(found):
    parts = [local_shear(chart, one, True) for chart, one in zip(found.charts, found.maps, strict=True)]
    return sum(a @ s for s, a in parts) / sum(a.sum() for _, a in parts)


@pytest.mark.parametrize("mesh", [meshes.two_bumps(), meshes.icosphere(4)])
def test_an_opened_surface_is_the_coarse_one_cut_along_its_steps(monkeypatch, mesh):
    seen, _ = rehearsals(monkeypatch, triangle_surface(*mesh), 1.3)
    assert len(seen)
    for rehearsal, found, value in seen:
        coarse = found.setting.coarse
        opening = opened(found, np.zeros((0, 2), np.int64))
        area = face_areas(opening.positions, opening.triangles).sum()
        whole = face_areas(coarse.positions, coarse.triangles).sum()
        assert abs(area - whole) < 0.06 * whole
        assert np.isin(pair_keys(*opening.seams.T), pair_keys(*halfedges(opening.triangles))).all()
        # Every triangle has the neighbours that it had: nothing was torn by flips.
        assert (twins(opening.triangles) < 0).sum() <= 2 * (twins(coarse.triangles) < 0).sum()
        if len(found.cut.steps) and rehearsal.component.on_boundary().any():
            (chart,) = strict_charts(triangle_surface(opening.positions, opening.triangles, opening.seams))
            assert len(chart.vertices) > len(opening.positions)
        assert value is None or 0 <= value < 1


def test_a_symmetric_cut_is_rehearsed_on_a_surface_that_is_its_own_image(monkeypatch):
    seen, _ = rehearsals(monkeypatch, triangle_surface(*meshes.two_bumps()), 1.3)
    assert any(found.mirror is not None for _, found, _ in seen)
    for _, found, _ in seen:
        if found.mirror is None:
            continue
        P = opened(found, np.zeros((0, 2), np.int64)).positions
        image = P * [-1, 1, 1] + [1, 0, 0]
        order, images = np.lexsort(np.round(P, 9).T), np.lexsort(np.round(image, 9).T)
        assert np.allclose(P[order], image[images], atol=1e-9)


def test_a_step_across_an_edge_flips_it_and_one_in_a_triangle_that_is_flipped_goes_around():
    P = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 0]], dtype=float)
    F = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 2]])
    flipped, seams = _along(P, F, np.array([[1, 3]]))
    assert sorted(map(tuple, np.sort(seams, axis=1))) == [(1, 3)]
    assert np.isclose(face_areas(P, flipped).sum(), face_areas(P, F).sum())
    # Across 0 2 and across 1 2: both are of the first triangle.
    both, seams = _along(P, F, np.array([[1, 3], [0, 4]]))
    assert np.array_equal(both, F)
    assert set(map(tuple, np.sort(seams, axis=1))) <= set(map(tuple, np.sort(np.stack(halfedges(F), 1), axis=1)))
    # Vertices that are not beside each other are joined by the shortest way.
    _, seams = _along(P, F, np.array([[3, 4]]))
    used, degree = np.unique(seams, return_counts=True)
    assert set(used[degree == 1]) == {3, 4}


def test_a_rehearsal_foretells_the_map(monkeypatch):
    """The square of log(shear), of the cut that the search went by; what comes in pieces for its room shears less."""
    monkeypatch.setattr("omt_uv.solver.parameterization.shear_bound.COMPACT", np.inf)
    for bound in (1.3, 1.4):
        seen, found = rehearsals(monkeypatch, triangle_surface(*meshes.two_bumps(60)), bound)
        reached = np.log(mean_shear(found)) ** 2
        assert mean_shear(found) <= bound + 0.005
        told = [value for _, _, value in seen if value is not None]
        assert 0.5 < min(told, key=lambda value: abs(np.log(value / reached))) / reached < 1.5


def test_what_coarse_triangles_shear_by_themselves_is_not_cut_for(monkeypatch):
    """Where a longer cut does not lower what is rehearsed, the shorter one is mapped."""

    def stuck(self, surface, density):
        return 0.2
        yield

    monkeypatch.setattr(ShearSearch, "rehearsed", lambda *_: silent())
    predicted = drain(unwrap(triangle_surface(*meshes.two_bumps()), options=UnwrapOptions(max_shear=1.4))).seams
    monkeypatch.setattr(ShearSearch, "rehearsed", stuck)
    seen, found = rehearsals(monkeypatch, triangle_surface(*meshes.two_bumps()), 1.4)
    assert any(value for _, _, value in seen) and np.array_equal(found.seams, predicted)


def test_what_is_small_is_mapped_and_not_rehearsed(monkeypatch):
    seen, found = rehearsals(monkeypatch, triangle_surface(*meshes.two_bumps(20)), 1.3)
    assert all(value is None for _, _, value in seen) and mean_shear(found) <= 1.305


@pytest.mark.parametrize("bound", [1.3, 1.4])
def test_what_maps_do_not_need_is_taken_back(monkeypatch, bound):
    """Where rehearsals had told twice what the maps shear, and so asked for longer cuts than the bound does."""
    rehearsed = ShearSearch.rehearsed

    def doubled(self, *arguments):
        told = yield from rehearsed(self, *arguments)
        return None if told is None else 2 * told

    monkeypatch.setattr(ShearSearch, "rehearsed", doubled)
    monkeypatch.setattr("omt_uv.solver.parameterization.shear_bound.COMPACT", np.inf)
    surface, length = triangle_surface(*meshes.two_bumps(60)), []
    for slack in (0.0, shear_search.SLACK):
        monkeypatch.setattr(shear_search, "SLACK", slack)
        found = drain(unwrap(surface, options=UnwrapOptions(max_shear=bound)))
        assert mean_shear(found) <= bound
        length.append(edge_lengths(surface.positions, found.seams).sum())
    assert length[1] < 0.97 * length[0]


def test_the_bar_rises_while_cuts_are_taken_back(monkeypatch):
    seen = []
    drain(
        unwrap(triangle_surface(*meshes.two_bumps(60)), options=UnwrapOptions(max_shear=1.4)),
        lambda p: seen.append(p.fraction),
    )
    assert (np.diff(seen) >= -1e-9).all() and seen[-1] <= 1
