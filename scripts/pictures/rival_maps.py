"""Map one object by every method that is compared: ours, Blender's own, and maps that other programs wrote to files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import bpy

import numpy as np

from benchmarks.parts.clicks import uv_of
from benchmarks.rivals import METHODS
from benchmarks.timing import timed
from omt_uv.blender.mesh import read
from omt_uv.blender.seams import mark_seams
from omt_uv.files.meshes import load
from omt_uv.pipelines.layout import UnwrapJob
from omt_uv.pipelines.reading import Reading
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.settings import DEFAULT_MAX_SHEAR, Settings
from omt_uv.solver.analysis.feature_edges import value_jumps
from omt_uv.solver.maps.distortion import distortion, face_distortion
from omt_uv.solver.mesh.geometry import cross2, face_areas
from omt_uv.solver.mesh.topology import boundary_edges
from omt_uv.solver.progress import drain

SAME_UV = 1e-6  # corners of one vertex closer than this, relative to the extent of the map, are one place in it
NEGLIGIBLE = 1e-14  # share of the surface below which a triangle has no meaningful Jacobian
MARGIN = 4 / 1024  # between islands, for methods that pack as they map


@dataclass(frozen=True)
class DrawnMap:
    """Positions (n,3), triangles (m,3), their UVs (m,3,2) and polygons (m,), edges (k,2) that are cut, seconds."""

    V: np.ndarray
    F: np.ndarray
    uv: np.ndarray
    polygons: np.ndarray
    cut: np.ndarray
    seconds: float


def ours(obj, axes=None, **settings) -> DrawnMap:
    """One click on the object in Object Mode, with its seams, and settings other than the defaults; axes: how it
    stands, if not as it says."""
    reading = read(obj)
    job = UnwrapJob(reading.surface, reading.faces, axes=axes or reading.axes)
    chosen = Settings(**{"max_shear": DEFAULT_MAX_SHEAR} | settings)
    layout, seconds = timed(lambda: drain(lay_out([job], chosen)))
    return mapped(replace(reading, uv=uv_of(reading.surface, layout)), seconds)


def blender_unwrap(obj, seams, method) -> DrawnMap:
    """Blender's Unwrap by one of METHODS, cut along the seams (k,2) alone."""
    obj.data.edges.foreach_set("use_seam", np.zeros(len(obj.data.edges), bool))
    mark_seams(obj, seams)
    options = {"fill_holes": True, "correct_aspect": False, "margin": MARGIN} | METHODS[method]
    return _in_edit_mode(obj, lambda: bpy.ops.uv.unwrap(**options))


def smart_project(obj) -> DrawnMap:
    """Blender's Smart UV Project as it comes, with a margin."""
    return _in_edit_mode(obj, lambda: bpy.ops.uv.smart_project(island_margin=MARGIN))


def from_file(path: Path) -> DrawnMap:
    """The map that another program wrote to a file."""
    obj = load(path)[0]
    return mapped(read(obj), 0.0)


def mapped(reading: Reading, seconds: float) -> DrawnMap:
    """What is drawn and measured of a reading with UVs."""
    surface, uv = reading.surface, np.asarray(reading.uv, float)
    F = surface.corner_vertex[surface.triangles]
    cut = value_jumps(F, surface.triangles, uv, SAME_UV * np.ptp(uv, axis=0).max())
    return DrawnMap(surface.positions, F, uv[surface.triangles], surface.triangle_face, cut, seconds)


def _in_edit_mode(obj, work: Callable[[], object]) -> DrawnMap:
    """Do the work on all faces of the object, as an artist would; only the work is timed."""
    if not obj.data.uv_layers:
        obj.data.uv_layers.new(name="UVMap")
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    _, seconds = timed(work)
    bpy.ops.object.mode_set(mode="OBJECT")
    return mapped(read(obj), seconds)


@dataclass(frozen=True)
class Figures:
    """Mean shear, symmetric Dirichlet energy (4 is isometric), area error, length of the cut edges over the root of the
    surface's area, islands."""

    shear: float
    energy: float
    area: float
    seam: float
    islands: int

    def caption(self) -> str:
        """One line under a picture."""
        return f"shear {self.shear:.2f}   seam {self.seam:.1f}   sd {self.energy:.2f}   area error {self.area:.3f}"


def figures_of(found: DrawnMap) -> Figures:
    """The figures that captions show."""
    counted = distortion(found.V, found.F, found.uv, overlap=False, polygons=found.polygons)
    ends = found.V[found.cut]
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() / np.sqrt(face_areas(found.V, found.F).sum())
    energy = symmetric_dirichlet(found.V, found.F, found.uv)
    return Figures(counted.angle_mean, energy, counted.area_l1, float(length), counted.charts)


def shear_of(found: DrawnMap) -> np.ndarray:
    """Mean ratio of the singular values of every triangle (m,), or of its polygon."""
    return face_distortion(found.V, found.F, found.uv, polygons=found.polygons)[1]


def outline(found: DrawnMap) -> np.ndarray:
    """Lines (k,2,2) around the islands of a map."""
    place = np.round(found.uv / (SAME_UV * np.ptp(found.uv, axis=(0, 1)).max())).astype(np.int64)
    key = np.concatenate([found.F[..., None], place], axis=2).reshape(-1, 3)
    _, first, corner = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return found.uv.reshape(-1, 2)[first][boundary_edges(corner.reshape(-1, 3))]


def symmetric_dirichlet(V, F, uv) -> float:
    """Area-weighted mean of |J|^2 + |J^-1|^2 over triangles, at the best common scale: 4 is isometric."""
    area = face_areas(V, F)
    real = area > NEGLIGIBLE * area.sum()
    e1, e2 = V[F[real, 1]] - V[F[real, 0]], V[F[real, 2]] - V[F[real, 0]]
    length = np.linalg.norm(e1, axis=1)
    along = (e2 * e1).sum(1) / length
    rise = 2 * area[real] / length
    du = (uv[real, 1] - uv[real, 0]) / length[:, None]
    dv = (uv[real, 2] - uv[real, 0] - du * along[:, None]) / rise[:, None]
    determinant = np.abs(cross2(du, dv))
    determinant = np.maximum(determinant, 1e-9 * np.median(determinant))
    square = (du**2).sum(1) + (dv**2).sum(1)
    weight = area[real] / area[real].sum()
    return float(2 * np.sqrt((weight @ square) * (weight @ (square / determinant**2))))
