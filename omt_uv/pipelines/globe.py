"""Map closed components of surfaces to the sphere and on to the plane; the one path of operator and command line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..settings import GlobeSettings
from ..solver.errors import MeshError, ZeroAreaFaceError, plural
from ..solver.globe.exact_areas import correct_areas, equirectangular_areas
from ..solver.globe.projections import EQUIRECT
from ..solver.globe.rotation import MarkerError, along_axes, by_markers
from ..solver.globe.unfolding import Polygons, gather_polygons, unfold
from ..solver.mesh.geometry import face_areas, signed_areas
from ..solver.mesh.gluing import groups
from ..solver.mesh.polygon_areas import polygon_areas
from ..solver.mesh.spherical_geometry import spherical_areas
from ..solver.mesh.surface import Surface, chosen_triangles
from ..solver.mesh.topology import boundary_loops, graph_components, halfedges, split_fans, with_fans
from ..solver.progress import Progress, Steps, part_of
from ..solver.sphere.figures import sphere_figures
from ..solver.sphere.sphere_map import SphereMap, sphere_map
from .layout import in_turn

# Share of the work on one component that its map to the sphere takes.
MAPPING = 0.9


@dataclass(frozen=True)
class Markers:
    """Weights (n,) of the vertices that mark the north pole, a meridian for the middle of the map, and its east."""

    pole: np.ndarray
    meridian: np.ndarray | None = None
    side: np.ndarray | None = None


@dataclass(frozen=True)
class GlobeJob:
    """A surface, the polygons (f,) bool to map, a density (m,) of its triangles, and markers that turn the globe."""

    surface: Surface
    faces: np.ndarray | None = None
    density: np.ndarray | None = None
    markers: Markers | None = None


def globe_jobs(readings: Sequence, densities: Sequence, markers: Sequence) -> list[GlobeJob]:
    """One job for each Reading of a mesh, its density and its markers, None for none."""
    rows = zip(readings, densities, markers, strict=True)
    return [GlobeJob(reading.surface, reading.faces, density, mine) for reading, density, mine in rows]


@dataclass(frozen=True)
class ClosedComponent:
    """A closed component: vertices (n,3) and triangles (m,3); of the surface its corners (m,3), faces (m,),
    vertex_ids (n,) and `members` (m,), the rows of its triangles; of its holes the centres (h,3) and fans (k,3)."""

    vertices: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    faces: np.ndarray
    vertex_ids: np.ndarray
    members: np.ndarray
    centres: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    fans: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int64))

    def filled(self) -> ClosedComponent:
        """The component with fans in its holes, for the map alone; as it is where holes have no outline, since faces do
        not agree about their sides, or more than two meet in an edge: the map says so."""
        tail, head = halfedges(self.triangles)
        if len(np.unique(tail * len(self.vertices) + head)) < len(tail) or (tail == head).any():
            return self
        vertices, triangles = with_fans(self.vertices, self.triangles, boundary_loops(self.triangles))
        return replace(self, centres=vertices[len(self.vertices) :], fans=triangles[len(self.triangles) :])


@dataclass(frozen=True)
class Globe:
    """A component, its map to the sphere and that map as it was laid out: points (n,3), corners (c,) with their UVs
    (c,2), of its triangles the shares (m,) of the texture they shall have and the areas (m,) they have; warnings."""

    component: ClosedComponent
    sphere: SphereMap
    points: np.ndarray
    corners: np.ndarray
    uv: np.ndarray
    shares: np.ndarray
    areas: np.ndarray
    warnings: tuple[str, ...]

    def report(self) -> dict:
        """Figures for a report."""
        component, flow = self.component, self.sphere.flow
        n = len(component.vertices)
        on_sphere = spherical_areas(self.sphere.positions, component.triangles)
        figures = sphere_figures(component.vertices, component.triangles, self.sphere.positions[:n]).report()
        more: dict = {f"{name}_sphere": value for name, value in figures.items() if name != "area_l1"}
        if flow is not None:
            moser = sphere_figures(component.vertices, component.triangles, flow.moser[:n]).report()
            more |= {"costs": list(flow.costs), "drift": flow.drift, "moser": moser}
        return {
            "vertices": len(self.component.vertices),
            "faces": len(np.unique(self.component.faces)),
            "status": self.sphere.status,
            "iterations": self.sphere.iterations,
            "residual": self.sphere.residual,
            "area_l1_sphere": self._area_error(on_sphere),
            "area_l1": self._area_error(self.areas),
            "holes": len(component.centres),
            **more,
        }

    def _area_error(self, areas: np.ndarray) -> float:
        """Sum over the polygons of how far their shares of the areas (m,) are from what they shall have."""
        of = np.unique(self.component.faces, return_inverse=True)[1].ravel()
        return float(np.abs(np.bincount(of, areas / areas.sum() - self.shares)).sum())


@dataclass(frozen=True)
class Globes:
    """Corners (k,) and their UVs (k,2) of each surface, its globes, and warnings as in `layout.Layout`."""

    corners: list[np.ndarray]
    uv: list[np.ndarray]
    globes: list[list[Globe]]
    warnings: list[tuple[int, str]]


def project(jobs: Sequence[GlobeJob], settings: GlobeSettings) -> Steps[Globes]:
    """Map every closed component of every surface to a sphere of its own, and lay each out over the unit square.

    The axes of the surface turn the globe: Z is north, -Y the central meridian. Markers, where there are any on a
    component, do it instead.

    Raises
    ------
    Refusal : with the index of the surface and the MeshError that says why
    MarkerError : markers give no direction, or are on no component
    """
    globes = yield from in_turn([_globes(job, settings) for job in jobs])
    corners = [np.concatenate([g.corners for g in mine]) for mine in globes]
    uv = [np.concatenate([g.uv for g in mine]) for mine in globes]
    warnings = [(k, text) for k, mine in enumerate(globes) for g in mine for text in g.warnings]
    if settings.inside:
        uv = [inside_tile(mine) for mine in uv]
    if sum(map(len, globes)) > 1:
        warnings.append((-1, f"{sum(map(len, globes))} closed parts; every one has the whole texture to itself"))
    return Globes(corners=corners, uv=uv, globes=globes, warnings=warnings)


def inside_tile(uv: np.ndarray) -> np.ndarray:
    """UVs (c,2) scaled along each axis as far as it takes to lie in the unit square."""
    low, high = np.minimum(uv.min(axis=0), 0.0), np.maximum(uv.max(axis=0), 1.0)
    return (uv - low) / (high - low)


def _globes(job: GlobeJob, settings: GlobeSettings) -> Steps[list[Globe]]:
    """Globes of all components of a surface."""
    components = closed_components(job.surface, job.faces)
    if settings.fill_holes:
        components = [component.filled() for component in components]
    markers = job.markers
    if markers is not None and not any(markers.pole[p.vertex_ids].any() for p in components):
        raise MarkerError("The marker of the pole is on no part of the mesh. Mark a vertex of the surface.")
    globes = []
    for k, component in enumerate(components):
        try:
            globes.append(
                (yield from part_of(_globe(component, job, settings), k / len(components), 1 / len(components)))
            )
        except MeshError as error:
            raise _located(error, component) from error
    return globes


def closed_components(surface: Surface, faces: np.ndarray | None = None) -> list[ClosedComponent]:
    """Components of the polygons `faces` (f,) bool, which have no vertex in common, whatever the seams.

    Raises
    ------
    EmptyMeshError, NonFiniteError
    """
    chosen, triangles, owner = chosen_triangles(surface, faces)
    members = np.flatnonzero(chosen[surface.triangle_face])
    # Where fans of faces touch in a vertex alone, each has one of its own.
    vertex, given = split_fans(surface.corner_vertex[triangles], len(surface.positions))
    n = len(given)
    rows, columns = vertex[:, [0, 1]].ravel(), vertex[:, [1, 2]].ravel()
    label = graph_components(rows, columns, n)[1]
    components = []
    for mine in groups(label[vertex[:, 0]]):
        ids, local = np.unique(vertex[mine], return_inverse=True)
        local = local.reshape(-1, 3).astype(np.int64)
        components.append(
            ClosedComponent(
                vertices=surface.positions[given[ids]],
                triangles=local,
                corners=triangles[mine],
                faces=owner[mine],
                vertex_ids=given[ids],
                members=members[mine],
            )
        )
    return components


def _globe(component: ClosedComponent, job: GlobeJob, settings: GlobeSettings) -> Steps[Globe]:
    """Map a component to the sphere, turn it, and lay it out."""
    if not face_areas(component.vertices, component.triangles).any():
        raise ZeroAreaFaceError("No face of the part has an area")
    density = None if job.density is None else job.density[component.members]
    fans = component.fans
    beyond = component.faces.max() + 1 + np.arange(len(fans))
    mapping = sphere_map(
        np.concatenate([component.vertices, component.centres]),
        np.concatenate([component.triangles, fans]),
        None if density is None else np.concatenate([density, np.ones(len(fans))]),
        balance=settings.balance,
        quality=settings.quality,
        method=settings.method,
        polygons=np.concatenate([component.faces, beyond]),
    )
    found = yield from part_of(mapping, 0.0, MAPPING)
    found = replace(found, positions=found.positions[: len(component.vertices)])
    points = found.positions @ _rotation(component, found.positions, job.markers).T
    polygons, corners = gather_polygons(component.corners, component.triangles, component.faces)
    on_sphere = spherical_areas(points, component.triangles) / (4 * np.pi)
    # Where areas shall be exact, what is left of their error on the sphere need not be kept.
    shares = _as_on_sphere(component, _shares(component, density), on_sphere) if settings.balance == 0 else on_sphere
    laying = _laid_out(points, polygons, shares, settings)
    uv, points, missed = yield from part_of(laying, MAPPING, 1 - MAPPING)
    areas = signed_areas(uv, polygons.triangles)
    folded = np.unique(component.faces[(areas <= 0) & (on_sphere > 0)])
    warnings = (*found.warnings, *_pole_warnings(missed, len(folded)))
    return Globe(
        component=component,
        sphere=found,
        points=points,
        corners=corners,
        uv=uv,
        shares=_shares(component, density),
        areas=areas,
        warnings=warnings,
    )


def _laid_out(
    points: np.ndarray, polygons: Polygons, shares: np.ndarray, settings: GlobeSettings
) -> Steps[tuple[np.ndarray, np.ndarray, int]]:
    """UVs (c,2) of the corners, the points (n,3) as laid out, and how many poles were missed.

    shares (m,) of the texture are what every triangle gets in a projection that keeps areas.
    """
    yield Progress("Projection", 0.0)
    unfolded, placed = unfold(points, polygons, settings.projection)
    areas = shares
    if settings.projection == EQUIRECT:
        areas = equirectangular_areas(placed, unfolded, polygons)
    exact = yield from correct_areas(unfolded, polygons, areas, settings.projection)
    return exact.unfolding.corners(), placed, unfolded.missed


def _shares(component: ClosedComponent, density: np.ndarray | None) -> np.ndarray:
    """Shares (m,) of the texture that the triangles of a component shall have."""
    area = polygon_areas(component.vertices, component.triangles, component.faces)
    mass = area if density is None else area * density
    return mass / mass.sum()


def _as_on_sphere(component: ClosedComponent, shares: np.ndarray, on_sphere: np.ndarray) -> np.ndarray:
    """Shares (m,) of the polygons, split among their triangles as on the sphere (m,)."""
    of = np.unique(component.faces, return_inverse=True)[1].ravel()
    # Holes have a part of the sphere, and of the texture.
    whole, there = np.bincount(of, shares) * on_sphere.sum(), np.bincount(of, on_sphere)
    return on_sphere * (whole / np.maximum(there, np.finfo(float).tiny))[of]


def _rotation(component: ClosedComponent, positions: np.ndarray, markers: Markers | None) -> np.ndarray:
    """Rotation (3,3) of the map (n,3): by the markers where there are any on the component, else by the axes."""
    if markers is None or not markers.pole[component.vertex_ids].any():
        return along_axes(positions, component.vertices, component.triangles)

    def middle(weights: np.ndarray | None) -> np.ndarray | None:
        mine = None if weights is None else weights[component.vertex_ids]
        return mine @ positions if mine is not None and mine.any() else None

    return by_markers(markers.pole[component.vertex_ids] @ positions, middle(markers.meridian), middle(markers.side))


def _pole_warnings(missed: int, folded: int) -> list[str]:
    """Warnings of poles of the projection within faces, and of faces folded over near them."""
    texts = []
    if missed:
        where = plural(missed, "A pole of the projection lies", "{} poles of the projection lie")
        texts.append(f"{where} within a face, which is stretched there; subdivide the mesh, or turn the globe")
    if folded:
        who = plural(folded, "A face is", "{} faces are")
        texts.append(f"{who} folded over near a pole of the projection; subdivide the mesh, or turn the globe")
    return texts


def _located(error: MeshError, component: ClosedComponent) -> MeshError:
    """The error with indices of the surface in the place of the component's; what fills its holes has none there."""
    ids = component.faces if error.kind == "face" else component.vertex_ids
    there = error.elements < len(ids)
    elements = ids[error.elements[there.all(axis=1) if there.ndim > 1 else there]]
    if error.kind == "face":
        elements = np.unique(elements)
    if not error.kind:
        return type(error)(error.cause, error.remedy, "face", np.unique(component.faces))
    return type(error)(error.cause, error.remedy, error.kind, elements)
