"""Large crowded bodies: seams of a thinned surface are led along the edges of the whole, which keeps the bound."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import bodies
import meshes
import numpy as np
import pytest
import short_cuts
from scripted_steps import worked

from omt_uv.solver.analysis.seam_costs import seam_costs
from omt_uv.solver.cutting.component import fingerprint
from omt_uv.solver.errors import ZeroAreaFaceError
from omt_uv.solver.mesh.charts import sound_disks, strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_edges, graph_components, pair_keys
from omt_uv.solver.parameterization import thinned
from omt_uv.solver.parameterization.options import ShearBound, UnwrapOptions
from omt_uv.solver.parameterization.shear_search import ShearSearch
from omt_uv.solver.parameterization.thinned import ThinnedSearch
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.seams.coarse_surface import coarsening
from omt_uv.solver.seams.fine_paths import led_along
from omt_uv.solver.seams.search import SeamSearch

BODY = bodies.limbed(4)


def shape_of(edges, n):
    """How many parts edges (e,2) are in, how many loops they close, and their tips."""
    vertices, degree = np.unique(edges, return_counts=True)
    parts = len(np.unique(graph_components(*edges.T, n)[1][vertices]))
    return parts, len(edges) - len(vertices) + parts, set(vertices[degree == 1].tolist())


@pytest.mark.parametrize("count", [150, 400, len(BODY[0])])
@pytest.mark.parametrize("slits", [(), (1,), (1, -1)])
def test_what_is_led_along_edges_branches_and_closes_as_it_did(count, slits):
    component = short_cuts.component_of(*BODY)
    coarse = coarsening(component.positions, component.triangles, count // 4).ended(count)
    V, F = coarse.positions, coarse.triangles
    outline = outline_above(triangle_surface(V, F), 0.1)
    begins = [int(outline[0, 0]), int(outline[len(outline) // 2, 0])]
    edges = np.concatenate(
        [outline, *(meshes.climbed(V, F, begin, 4, up) for begin, up in zip(begins, slits, strict=False))]
    )
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    found = component.ends[led_along(component, coarse, edges)]
    parts, loops, tips = shape_of(edges, len(V))
    assert shape_of(found, len(BODY[0])) == (parts, loops, {int(coarse.kept[tip]) for tip in tips})


def search_of(surface, **given):
    """A search that may be thinned, of a surface for a spread that cuts have to be made for."""
    costs = cache(lambda: seam_costs(surface))
    spread = np.full(len(surface.face_start) - 1, 0.02)
    return ThinnedSearch(spread, surface, costs, **({"asked": 0.01, "thinned": []} | given))


def found_by(monkeypatch, seams_of, rehearsed=1.0, **given):
    """What a search of the body finds where the plain one has a first edge, and what it remembers."""
    surface = triangle_surface(*BODY)
    component = short_cuts.component_of(*BODY)
    plain = np.arange(len(component.ends)) < 1

    def searched(self, component, base):
        kept = SimpleNamespace(rehearsed=rehearsed, polygons=component.polygons)
        self.memory[fingerprint(component)] = kept
        return worked(plain)

    monkeypatch.setattr(SeamSearch, "_searched", searched)
    monkeypatch.setattr(thinned, "LARGE", 1000)
    monkeypatch.setattr(thinned, "THINNED", 400)
    search = search_of(surface, seams_of=seams_of, **given)
    return component, plain, drain(search._searched(component, plain & False)), search


def outline_above(surface, height):
    """Edges (k,2) around what of a surface is above a height."""
    V, F = surface.positions, surface.corner_vertex[surface.triangles]
    return boundary_edges(F[V[F].mean(axis=1)[:, 2] > height])


def loop(surface, avoid):
    """Seams around a small surface."""
    return worked(outline_above(surface, 0.1))


def test_seams_of_a_thinned_surface_take_the_place_of_what_was_found_first(monkeypatch):
    component, plain, edges, search = found_by(monkeypatch, loop)
    charts = strict_charts(replace(triangle_surface(*BODY), seams=component.vertex_ids[component.ends[edges]]))
    assert len(charts) == 2 and sound_disks(charts).all() and not edges[plain].all()
    assert not search.memory and np.array_equal(*search.thinned, component.polygons)


def test_a_slit_that_hangs_on_no_other_seam_is_left_out(monkeypatch):
    def seams_of(surface, avoid):
        V, F = surface.positions, surface.corner_vertex[surface.triangles]
        outline = outline_above(surface, 0.1)
        return worked(np.concatenate([outline, meshes.climbed(V, F, int(np.argmax(V[:, 2])), 2, -1)]))

    component, _, edges, _ = found_by(monkeypatch, seams_of)
    parts, loops, tips = shape_of(component.ends[edges], component.vertex_count)
    assert (parts, loops, tips) == (1, 1, set())


REFUSED = {
    "an error": lambda surface, avoid: worked(ZeroAreaFaceError("No face has an area", kind="face", elements=[0])),
    "no seams": lambda surface, avoid: worked(np.zeros((0, 2), np.int64)),
    "no disks": loop,
}


@pytest.mark.parametrize("seams_of", [*REFUSED.values(), None], ids=[*REFUSED, "nobody to ask"])
def test_what_is_no_use_leaves_what_was_found_first(monkeypatch, seams_of):
    if seams_of is loop:
        monkeypatch.setattr(thinned, "led_along", lambda component, *_: np.zeros(len(component.ends), bool))
    _, plain, edges, search = found_by(monkeypatch, seams_of)
    assert np.array_equal(edges, plain) and len(search.memory) == 1 and not search.thinned


@pytest.mark.parametrize("rehearsed, is_thinned", [(None, False), (0.0115, False), (0.0116, True)])
def test_only_what_a_rehearsal_is_far_from_the_bound_with_is_thinned(monkeypatch, rehearsed, is_thinned):
    search = found_by(monkeypatch, loop, rehearsed)[-1]
    assert bool(search.thinned) == is_thinned


@pytest.mark.parametrize("what", ["nothing", "size", "again", "density", "holes", "sharp", "mirror", "near mirror"])
def test_what_hangs_on_single_edges_is_not_thinned(monkeypatch, what):
    surface, component, given = triangle_surface(*BODY), short_cuts.component_of(*BODY), {}
    monkeypatch.setattr(thinned, "LARGE", component.vertex_count - (what != "size"))
    mirror = {"mirror": SimpleNamespace(exact=True), "near mirror": SimpleNamespace(exact=False)}.get(what)
    monkeypatch.setattr(ThinnedSearch, "_mirror", lambda self, component: mirror)
    if what == "holes":
        component = replace(component, polygons=np.where(component.members == 0, -1, component.polygons))
    surface = replace(surface, sharp=component.vertex_ids[component.ends[:1]]) if what == "sharp" else surface
    given |= {"share": np.ones(len(BODY[1]))} if what == "again" else {}
    given |= {"density": np.ones(len(BODY[1]))} if what == "density" else {}
    assert search_of(surface, **given)._may_be_thinned(component) == (what in ("nothing", "near mirror"))


def test_a_thinned_body_keeps_the_bound_and_what_missed_it_keeps_its_seams(monkeypatch):
    seen = []
    monkeypatch.setattr(thinned, "LARGE", 1300)
    monkeypatch.setattr(thinned, "THINNED", 1200)
    monkeypatch.setattr(thinned, "CROWDED", 0.0)
    plain = ThinnedSearch._of_thinned

    def of_thinned(self, component, seams_of):
        edges = yield from plain(self, component, seams_of)
        seen.append((component, edges))
        return edges

    monkeypatch.setattr(ThinnedSearch, "_of_thinned", of_thinned)
    found = drain(unwrap(triangle_surface(*BODY), options=UnwrapOptions(max_shear=1.2)))
    ((component, edges),) = seen
    area = np.array([chart.vertices.shape[0] for chart in found.charts])
    assert sound_disks(found.charts).all() and not found.warnings and area.sum() >= len(BODY[0])
    mean = [one.angle_mean for one in found.maps]
    assert max(mean) <= 1.2 and all(one.folds == 0 for one in found.maps)
    ids = component.vertex_ids[component.ends[edges]]
    assert np.isin(pair_keys(*ids.T), pair_keys(*np.sort(found.seams, axis=1).T)).all()


def test_charts_are_known_by_the_polygons_that_were_thinned():
    search = ShearSearch(triangle_surface(*BODY), None, ShearBound(1.2), None, {})
    chart = SimpleNamespace(faces=np.array([3, 4]))
    assert not search.is_thinned(chart)
    search.thinned.append(np.array([4, 5]))
    assert not search.is_thinned(chart)
    search.thinned.append(np.array([3]))
    assert search.is_thinned(chart)
