"""Remesh a surface: a first mesh, relaxed there until vertices are uniform in its measure and triangles Delaunay.

That is what samples of the measure-preserving image and triangles of the conformal one are (B. Gu, Geometric
compression based on Ricci flow and Monge-Ampere equation, 2018), and where strategies are compared the first mesh comes
from there. Here the vertices are shared out among the components; what is done with one of them is in
`remesh_component`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.density import graded_density
from ..counts import check_vertices, real
from ..errors import CountError, positive_density
from ..progress import Progress, Steps, part_of
from .components.components import Component
from .edits.vertex_count import apportion, min_face_count, min_vertex_count
from .initial.component_maps import ComponentMaps, RemeshSource
from .initial.options import RemeshOptions
from .initial.sample_plan import min_sample_count
from .remesh_component import RemeshedComponent, remesh_component

# More vertices than this many times the input's tell nothing new about the surface.
MAX_REFINEMENT = 50
# Components with fewer vertices than this become a batch.
BATCH_BELOW = 500
# Mean step of a relaxation that has settled, in edge lengths.
CONVERGED = 0.01
DEFAULTS = RemeshOptions()
# Names of where points lie on a surface.
WHERE = ("faces", "barycentric")


@dataclass(frozen=True)
class Remesh:
    """A new mesh of a surface.

    vertices (k,3) in the units of the input; triangles (t,3), counter-clockwise as the input's; faces (k,) the input
    triangle on which the closest point of each vertex lies, and barycentric (k,3) where; iterations: rounds of
    relaxation; residual: mean step of the last one, in edge lengths; status: "converged" or "rounds".
    """

    vertices: np.ndarray
    triangles: np.ndarray
    faces: np.ndarray
    barycentric: np.ndarray
    iterations: int
    residual: float
    status: str
    warnings: tuple[str, ...]


def remesh(
    source: RemeshSource, count: int, options: RemeshOptions = DEFAULTS, density: np.ndarray | None = None
) -> Steps[Remesh]:
    """Remesh a surface with (m,3) triangles by `count` vertices, or faces, nearly equilateral; steps of a `Remesh`.

    Parameters
    ----------
    source : the surface and its features; its maps are made once and serve again with other counts and options
    count : of what `options.count_of` names, reached exactly; closed surfaces have an even number of faces
    density : (m,) > 0, how many vertices per area every input triangle gets, in proportion; 1 by default

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError, OrientationError : see `components.split_components`
    CountError : fewer than the topology, boundaries and features take, or more than this machine has memory for
    DensityError : a density that is not positive and finite
    """
    yield Progress("Parts", 0.0)
    check_vertices(real(count) if options.counts_vertices else real(count) / 2)
    level = _checked_density(density, len(source.triangles))
    with source.frame.named():
        return (yield from _in_frame(source, count, options, source.frame.density(level)))


def _in_frame(source: RemeshSource, count: int, options: RemeshOptions, level: np.ndarray) -> Steps[Remesh]:
    """`remesh` with a density (m,) of the triangles in the surface's own frame; errors name these."""
    frame, found = source.frame, source.components
    if options.grading > 0 and np.ptp(level) > 0:
        samples = count if options.counts_vertices else max(count // 2, 1)
        level = graded_density(level, frame.vertices, frame.triangles, options.grading, samples)
    warnings = list(found.warnings)
    if count > MAX_REFINEMENT * len(source.vertices if options.counts_vertices else source.triangles):
        warnings.append(
            f"{count} {options.count_of} are more than {MAX_REFINEMENT} times the input's; they add no detail"
        )
    small = _small(found.components, level, count if options.counts_vertices else count / 2)
    results = yield from _all_components(source.maps_with_batches(small), level, count, options)
    warnings += summed_up([w for r in results for w in r.warnings])
    made = sum(len(r.triangles) for r in results)
    if not options.counts_vertices and made != count:
        warnings.append(f"Closed surfaces have an even number of triangles: {made} instead of {count}")
    return _joined(results, source, warnings, options.rounds)


def _checked_density(density: np.ndarray | None, m: int) -> np.ndarray:
    if density is None:
        return np.ones(m)
    density = np.asarray(density, float)
    if density.shape != (m,):
        raise ValueError(f"density must have one value for each of {m} triangles, not the shape {density.shape}")
    return positive_density(density)


def _small(components: list[Component], density: np.ndarray, vertex_count: float) -> np.ndarray:
    """The components (k,) bool whose share of so many vertices is small."""
    measure = np.array([float(c.area @ density[c.faces]) for c in components])
    return vertex_count * measure < BATCH_BELOW * measure.sum()


def _all_components(
    maps: list[ComponentMaps], density: np.ndarray, count: int, options: RemeshOptions
) -> Steps[list[RemeshedComponent]]:
    """Remesh all components; what takes more than was thought makes the others do with less.

    Raises CountError where there are not enough vertices, or faces, for all.
    """
    few = f"{count} {options.count_of} are too few:"
    # Corners are kept where the count allows it.
    for corners in (True, False):
        least = _min_counts(maps, options, corners and options.preserve_boundary)
        if least.sum() <= count:
            break
    else:
        raise CountError(f"{few} this topology, with its boundaries and features, takes at least {least.sum()}")
    while least.sum() <= count:
        results, least = yield from _with_min_counts(maps, density, count, least, options)
        if results:
            return results
    raise CountError(f"{few} edges of this surface, with its boundaries and features, collapse to {least.sum()}")


def _with_min_counts(
    maps: list[ComponentMaps], density: np.ndarray, count: int, least: np.ndarray, options: RemeshOptions
) -> Steps[tuple[list[RemeshedComponent], np.ndarray]]:
    """Remesh all components, the smallest first, so that larger ones make up for those that take more than their share.

    An empty list where that leaves too little for the others; and what every component takes at least as far as is
    known, (k,).
    """
    least = least.copy()
    measure = np.array([float(m.component.area @ density[m.component.faces]) for m in maps])
    left = np.argsort(measure, kind="stable")
    results: list[RemeshedComponent] = [None] * len(maps)  # type: ignore[list-item]
    done = 0.0
    while len(left):
        k, share = left[0], float(measure[left[0]] / measure.sum())
        target = int(apportion(count, measure[left], least[left])[0])
        steps = remesh_component(maps[k], target, density[maps[k].component.faces], options)
        results[k] = yield from part_of(steps, done, share)
        made = len(results[k].points if options.counts_vertices else results[k].triangles)
        if made > target:
            least[k] = made
        count -= made
        left, done = left[1:], done + share
        if count < least[left].sum():
            return [], least
    return results, least


def _min_counts(maps: list[ComponentMaps], options: RemeshOptions, corners: bool) -> np.ndarray:
    """Vertices, or faces, that every component takes at least, (k,)."""
    vertex_counts = [max(min_vertex_count(m.component), min_sample_count(m, corners)) for m in maps]
    if options.counts_vertices:
        return np.array(vertex_counts)
    return np.array([min_face_count(m.component, n) for m, n in zip(maps, vertex_counts, strict=True)])


def summed_up(texts: list[str]) -> list[str]:
    """Every text once, and how often it was said."""
    return [text if (k := texts.count(text)) == 1 else f"{text} ({k} times)" for text in dict.fromkeys(texts)]


def _joined(results: list[RemeshedComponent], source: RemeshSource, warnings: list[str], rounds: int) -> Remesh:
    frame, found = source.frame, source.components
    first = np.cumsum([0] + [len(r.points) for r in results])
    residual = max((r.residual for r in results), default=0.0)
    points = np.concatenate([r.points for r in results]) * found.size + found.centre
    faces, barycentric = frame.on_given(*(np.concatenate([getattr(r, x) for r in results]) for x in WHERE))
    return Remesh(
        vertices=frame.places(points),
        triangles=np.concatenate([r.triangles + k for r, k in zip(results, first[:-1], strict=True)]),
        faces=faces,
        barycentric=barycentric,
        iterations=rounds,
        residual=residual,
        status="converged" if residual < CONVERGED else "rounds",
        warnings=tuple(warnings),
    )
