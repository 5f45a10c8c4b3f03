"""Name what is wrong with an input, where it is, and what to do about it.

The class of an error is its key: front ends may know better words for its remedy than the solver, which knows no menus
(see `remedies.py` beside this package). A remedy given where an error is raised is about that very case, and stands.
"""

from __future__ import annotations

import numpy as np

# Elements that a message names at most.
FEW = 5
# The least share that a message names as a number.
LEAST_TOLD = 0.01


def first_of(elements: np.ndarray) -> str:
    """The first few of elements (k,) or (k,2), for a message."""
    return ", ".join(map(str, elements[:FEW].tolist())) + (", ..." if len(elements) > FEW else "")


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
        super().__init__(self.text(self.remedy))

    def text(self, remedy: str) -> str:
        """Cause, number and first few elements, and a remedy, as sentences."""
        text = self.cause
        count = len(self.elements)
        if self.kind and count:
            plural = {"vertex": "vertices"}.get(self.kind, self.kind + "s")
            text += f" ({count} {self.kind if count == 1 else plural}: {first_of(self.elements)})"
        return f"{text}. {remedy}." if remedy else f"{text}."


class EmptyMeshError(MeshError):
    """There is nothing to unwrap."""

    remedy = "Give at least one face"


class NoSelectionError(EmptyMeshError):
    """Distances need vertices to start from."""

    remedy = "Choose one or more vertices"


class NonFiniteError(MeshError):
    """A coordinate is NaN or infinite."""

    remedy = "Delete these vertices or give them finite positions"


class ZeroAreaFaceError(MeshError):
    """A face has no area."""

    remedy = "Dissolve these faces, or merge vertices that coincide"


class DuplicateFaceError(MeshError):
    """Two faces have the same vertices."""

    remedy = "Delete one of each pair of faces"


class NonManifoldEdgeError(MeshError):
    """More than two faces meet at an edge that is no seam."""

    remedy = "Mark these edges as seams or separate the faces"


class OrientationError(MeshError):
    """Neighbouring faces disagree about which side is out."""

    remedy = "Turn faces over until all look outside"


class NotADiskError(MeshError):
    """A chart is closed, or has several boundaries or handles."""

    remedy = "Add seams that cut it open into a disk"


class SeveralBoundariesError(NotADiskError):
    """A chart has more boundary loops than one."""

    remedy = "Add seams that join the boundaries, or fill the holes"


class TouchingBoundariesError(SeveralBoundariesError):
    """A chart has several boundary loops, and vertices of them coincide."""

    remedy = f"Merge vertices that coincide. {SeveralBoundariesError.remedy}"


class NotASphereError(MeshError):
    """A surface is open, has handles or several parts: it has no map to a sphere."""

    remedy = "Only one closed part without handles maps to a sphere"


class RepeatedVertexError(NotASphereError):
    """A face of a surface for the sphere uses a vertex twice."""

    remedy = "Dissolve the face"


class OpenSurfaceError(NotASphereError):
    """A surface for the sphere has boundary edges."""

    remedy = "Fill the holes, or unwrap it as a chart"


class LooseVertexError(NotASphereError):
    """A vertex of a surface for the sphere belongs to no face."""

    remedy = "Delete the vertex"


class SeveralComponentsError(NotASphereError):
    """A surface for the sphere is not connected."""

    remedy = "Map them one by one"


class PinchedVertexError(NotASphereError):
    """Several fans of faces meet in one vertex of a surface for the sphere."""

    remedy = "Split the vertex"


class BoundaryError(MeshError):
    """A map that has no such boundary."""

    remedy = "Choose a disk, a square or a rectangle"


class PrecisionError(MeshError):
    """A map leaves double precision."""

    remedy = "Cut the chart into less elongated pieces with seams"


class CrowdedError(PrecisionError):
    """Vertices of a remesh do not fit into a chart in double precision."""

    remedy = "Merge vertices that coincide and dissolve faces without area, or delete it"


class CoarseningError(MeshError):
    """A closed mesh has no edge that collapses without harm."""

    remedy = "Look for vertices that coincide and faces without area"


class TransportError(MeshError):
    """The transport problem is ill-posed or did not converge."""

    remedy = "Cut the chart into smaller pieces with seams"


class DensityError(MeshError):
    """A target density is zero, negative or not a number."""

    remedy = "Give every face a positive, finite density"


class WeightError(MeshError):
    """Weights that mark no region."""

    remedy = "Give weights between 0 and 1, not the same everywhere"


class NoRegionError(WeightError):
    """All weights are zero."""

    remedy = "Mark the region first"


class UniformWeightsError(WeightError):
    """All weights are the same."""

    remedy = "Mark a part only"


class ShareError(MeshError):
    """A factor or a share of the texture that no map can have."""

    remedy = "Choose a smaller factor, or paint a smaller region"


class EmptyRegionError(ShareError):
    """A region has no area."""

    remedy = "Mark a region with area"


class SoftRegionError(ShareError):
    """Weights in between 0 and 1 do not let a region have its share."""

    remedy = "Choose a factor nearer to 1, or mark the region with weight 1 and the rest with 0"


class PinError(MeshError):
    """Pinned UVs contradict each other or force a fold."""

    remedy = "Unpin some of these vertices or move the pins apart"


class FoldedUVError(MeshError):
    """UVs that should be improved are folded beyond repair."""

    remedy = "Unwrap these faces anew first"


class GridError(MeshError):
    """An island that should become a rectangle is no grid of quads."""

    remedy = "Choose islands of quads in rows and columns, such as strips and bands"


class CountError(MeshError):
    """A remesh was asked for fewer vertices or faces than its topology and features take."""

    remedy = "Ask for more, or keep fewer features"


class HandleError(MeshError):
    """Handles of a flow contradict each other, or there is none that moves."""

    remedy = "Move them apart, let them go the same way, or choose a smaller radius"


class LibraryError(MeshError):
    """A library that a solver needs is not installed."""

    remedy = "Install it"


class SelfIntersectionError(MeshError):
    """A surface passes through itself, so that it has no inside."""

    remedy = "Move these faces apart, or remesh the surface"


class TetrahedraError(MeshError):
    """No tetrahedra fill a surface, or none of them has a map without inversions."""

    remedy = "Remesh the surface evenly first"


class TopologyMismatchError(MeshError):
    """Two surfaces that are to be matched have different topology, or one that no common domain has."""

    remedy = "Close holes and remove handles until both are alike"


class LandmarkError(MeshError):
    """Landmarks of two surfaces contradict each other, or cannot be met."""

    remedy = "Give every landmark one place on either surface"


class HandednessError(LandmarkError):
    """Landmarks of one surface are a mirror image of those of the other."""

    remedy = "Exchange left and right on one side, or match mirrored"


def percent(share: float) -> str:
    """A share in words: what is hardly seen shall not read as nothing, or as all."""
    return f"{100 * share:.0f} %" if share >= LEAST_TOLD else f"less than {100 * LEAST_TOLD:.0f} %"


def two_digits(share: float) -> str:
    """A share in two digits, or as a whole number of hundredths.

    >>> two_digits(0.00256), two_digits(0.9973)
    ('0.26 %', '100 %')
    """
    return f"{100 * share:.2g} %" if share < 0.1 else f"{100 * share:.0f} %"


def without_room(boundary: str, why: str) -> str:
    """What is said of a chart whose boundary is free, since the one asked for has no room for it.

    >>> without_room("disk", "2 faces stay folded")
    'The disk has no room for this chart (2 faces stay folded); its boundary is free instead'
    """
    return f"The {boundary} has no room for this chart ({why}); its boundary is free instead"


def plural(count: int, one: str, many: str) -> str:
    """What is said of one, or of several, whose number takes the place of the braces.

    Examples
    --------
    >>> plural(1, "a face is", "{} faces are"), plural(0, "a face is", "{} faces are")
    ('a face is', '0 faces are')
    """
    return one if count == 1 else many.format(count)


def reaching(faces: int) -> str:
    """What is said of faces of a new mesh that reach across a seam."""
    return f"{plural(faces, 'A face reaches', '{} faces reach')} across a seam; UVs are continued there"


# What warnings advise, in the solver's words: front ends replace these by where their users find it.
MERGE = "merge vertices that coincide"
MERGING = "merging vertices that coincide"
DISSOLVE = "dissolve faces without area"
TURN_OUTSIDE = OrientationError.remedy
CUT_FURTHER = "cut further for less shear, or allow for more"
ENDED_EARLY = "kept before its seams were done; unwrap again"
APPLY_LEVEL = "apply one level of the modifier before"
MORE_SEAMS = "no seams were found that would pay; allow for more shear, or mark some yourself"


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


class MarginError(MeshError):
    """The margins leave no room for the islands."""

    remedy = "Lower the margin or raise the texture size"
