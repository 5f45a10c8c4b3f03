"""Named errors: what is wrong, where it is, and what to do about it."""

from __future__ import annotations

import numpy as np


class MeshError(ValueError):
    """Input that has no valid map.

    Parameters
    ----------
    cause : what is wrong, one sentence without final punctuation
    remedy : what the user can do, one sentence without final punctuation
    kind : "vertex", "edge", "face" or "" (the mesh as a whole)
    elements : indices into the *input* mesh; (k,) vertices or polygons, (k,2) vertex pairs for edges
    """

    remedy = ""

    def __init__(self, cause: str, remedy: str = "", kind: str = "", elements=()):
        self.cause = cause
        self.remedy = remedy or type(self).remedy
        self.kind = kind
        self.elements = np.asarray(elements, dtype=np.int64)
        super().__init__(self._message())

    def _message(self) -> str:
        text = self.cause
        count = len(self.elements)
        if self.kind and count:
            first = ", ".join(str(e.tolist()) for e in self.elements[:5])
            plural = {"vertex": "vertices"}.get(self.kind, self.kind + "s")
            text += f" ({count} {self.kind if count == 1 else plural}: {first}{', ...' if count > 5 else ''})"
        return f"{text}. {self.remedy}." if self.remedy else f"{text}."


class EmptyMeshError(MeshError):
    """There is nothing to unwrap."""

    remedy = "Select at least one face"


class NonFiniteError(MeshError):
    """A coordinate is NaN or infinite."""

    remedy = "Delete these vertices or give them finite positions"


class ZeroAreaFaceError(MeshError):
    """A face has no area."""

    remedy = "Use Mesh > Clean Up > Degenerate Dissolve, or Merge by Distance"


class DuplicateFaceError(MeshError):
    """Two faces have the same vertices."""

    remedy = "Delete one of each pair of faces"


class NonManifoldEdgeError(MeshError):
    """More than two faces meet at an edge that is no seam."""

    remedy = "Mark these edges as seams or separate the faces"


class OrientationError(MeshError):
    """Neighbouring faces disagree about which side is out."""

    remedy = "Use Mesh > Normals > Recalculate Outside"


class NotADiskError(MeshError):
    """A chart is closed, or has several boundaries or handles."""

    remedy = "Mark seams that cut it open into a disk"


class NotASphereError(MeshError):
    """A surface is open, has handles or several parts: it has no map to a sphere."""

    remedy = "Only one closed part without handles maps to a sphere"


class PrecisionError(MeshError):
    """A map leaves double precision."""

    remedy = "Cut the chart into less elongated pieces with seams"


class TransportError(MeshError):
    """The transport problem is ill-posed or did not converge."""

    remedy = "Cut the chart into smaller pieces with seams"


class DensityError(MeshError):
    """A target density is zero, negative or not a number."""

    remedy = "Give every face a positive, finite density"


class WeightError(MeshError):
    """Weights that mark no region."""

    remedy = "Paint weights between 0 and 1, not the same everywhere"


class ShareError(MeshError):
    """A factor or a share of the texture that no map can have."""

    remedy = "Choose a smaller factor, or paint a smaller region"


class PinError(MeshError):
    """Pinned UVs contradict each other or force a fold."""

    remedy = "Unpin some of these vertices or move the pins apart"


class FoldedUVError(MeshError):
    """UVs that should be improved are folded beyond repair."""

    remedy = "Unwrap these faces anew first"


class CountError(MeshError):
    """A remesh was asked for fewer vertices or faces than its topology and features take."""

    remedy = "Ask for more, or keep fewer features"


def positive_density(density: np.ndarray) -> np.ndarray:
    """The density (m,) of faces as floats.

    Raises
    ------
    DensityError : a value that is not positive and finite
    """
    density = np.asarray(density, float)
    wrong = np.flatnonzero(~(np.isfinite(density) & (density > 0)))
    if len(wrong):
        raise DensityError("A density is not positive and finite", kind="face", elements=wrong)
    return density
