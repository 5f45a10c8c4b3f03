"""Map insides of bodies, and make of them what artists use: the one path of object.omt_volume and the command
volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...solver.errors import HandleError, LibraryError, MeshError, TetrahedraError
from ...solver.progress import Steps, part_of
from ...solver.volumes.body_map import VolumeMap, into_body, volume_map
from ...solver.volumes.envelope import filled
from ...solver.volumes.registration import registered
from ...solver.volumes.slices import dilation
from ...solver.volumes.transfer import TetLocation

BODY = "body"
TETWILD = "tetwild"


@dataclass(frozen=True)
class VolumeBody:
    """Positions (n,3) and triangles (m,3) of a closed body, vertices (k,) of its landmarks by their names, and the
    polygon (m,) of every triangle, None where these are the polygons."""

    name: str
    positions: np.ndarray
    triangles: np.ndarray
    landmarks: dict[str, np.ndarray]
    polygons: np.ndarray | None = None


@dataclass(frozen=True)
class VolumeSettings:
    """domain: "ball", "cube" or "body"; method: "newton" or "flow"; count: tetrahedra, about; library: "tetgen" keeps
    the surface, "tetwild" takes any, and replaces it."""

    domain: str = "ball"
    method: str = "newton"
    count: int = 40_000
    library: str = "tetgen"


@dataclass(frozen=True)
class MappedVolume:
    """A map of the inside; ball: positions (n,3) in the ball, where the domain is another body, or the map itself;
    surface: places (k,3) in the domain of the vertices of the body's own surface."""

    map: VolumeMap
    ball: np.ndarray
    surface: np.ndarray

    def report(self) -> dict[str, float | int | str]:
        """Figures for a report."""
        logs = dilation(self.map.points, self.map.positions, self.map.tets)
        histogram, _ = np.histogram(logs, np.linspace(-2, 2, 41))
        return {
            "domain": self.map.domain,
            "points": len(self.map.points),
            "tetrahedra": len(self.map.tets),
            "inverted": self.map.inverted,
            "share_error": self.map.shares,
            "vertex_share_error": self.map.around_vertices,
            "steps": self.map.steps,
            "log2_dilation_histogram": histogram.tolist(),
        }


def mapped_volume(body: VolumeBody, settings: VolumeSettings, other: VolumeBody | None = None) -> Steps[MappedVolume]:
    """Map the inside of a body; to the other one where the domain is "body", landmarks of one name onto one another.

    Raises
    ------
    MeshError : those of `solver.volumes.volume_map`; elements are vertices, edges and polygons of the body
    HandleError : the domain is "body", and there is none, or landmarks contradict each other
    """
    domain = "ball" if settings.domain == BODY else settings.domain
    width = 0.35 if settings.domain == BODY else 1.0
    whole = body
    body, first = yield from part_of(_mapped(body, domain, settings), 0.0, width)
    if settings.domain != BODY:
        return MappedVolume(first, first.positions, _own(whole, first))
    if other is None:
        raise HandleError("There is no other body to map to", "Choose one")
    other, second = yield from part_of(_mapped(other, domain, settings), width, width)
    placed = None
    names = sorted(body.landmarks.keys() & other.landmarks.keys())
    if len(names) >= 3:
        mine = np.stack([first.positions[body.landmarks[name]].mean(axis=0) for name in names])
        theirs = np.stack([second.positions[other.landmarks[name]].mean(axis=0) for name in names])
        found = yield from part_of(registered(first.positions, mine, theirs), 2 * width, 0.1)
        placed = found.positions
    mapped = yield from part_of(into_body(first, second, placed), 0.8, 0.2)
    # Points inside have moved, and their places in the ball with them.
    ball = TetLocation(first.points, first.tets).values(mapped.points, first.positions if placed is None else placed)
    return MappedVolume(mapped, ball, _own(whole, mapped))


def _own(body: VolumeBody, found: VolumeMap) -> np.ndarray:
    """Places (k,3) in the domain of the body's own vertices (k,3), which come first where its surface was kept."""
    k = len(body.positions)
    if k <= len(found.points) and np.array_equal(found.points[:k], body.positions):
        return found.positions[:k]
    return TetLocation(found.points, found.tets).values(body.positions, found.positions)


def _mapped(body: VolumeBody, domain: str, settings: VolumeSettings) -> Steps[tuple[VolumeBody, VolumeMap]]:
    """A body, as it is after a library has replaced its surface, and its map."""
    if settings.library != TETWILD:
        try:
            found = yield from volume_map(body.positions, body.triangles, domain, settings.method, settings.count)
        except MeshError as error:
            if error.kind != "face" or body.polygons is None:
                raise
            polygons = np.unique(body.polygons[error.elements])
            raise type(error)(error.cause, error.remedy, error.kind, polygons) from error
        return body, found
    new = filled(body.positions, body.triangles, settings.count)
    _, nearest = cKDTree(new.vertices).query(body.positions)
    marks = {name: np.unique(nearest[rows]) for name, rows in body.landmarks.items()}
    try:
        steps = volume_map(new.vertices, new.triangles, domain, settings.method, mesh=new.mesh, held=False)
        found = yield from steps
    except LibraryError:
        raise
    except MeshError as error:
        # Its elements are those of a surface that nobody has.
        raise TetrahedraError(f"Around the tetrahedra of fTetWild: {error}") from error
    return VolumeBody(body.name, new.vertices, new.triangles, marks), found
