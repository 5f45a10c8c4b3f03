"""Name remedies in the words of Blender's menus, for operators and commands.

The solver says what is wrong and what would help, but knows no menus. Here the class of an error is the key to where
a user of Blender finds that help; what is not here is said in the solver's own words.
"""

from __future__ import annotations

from .solver import errors

_JOIN = "Mark seams that join the boundaries, or fill the holes"

REMEDIES: dict[type[errors.MeshError], str] = {
    errors.EmptyMeshError: "Select at least one face",
    errors.NoSelectionError: "Select one or more vertices in Edit Mode",
    errors.ZeroAreaFaceError: "Use Mesh > Clean Up > Degenerate Dissolve, or Merge by Distance",
    errors.OrientationError: "Use Mesh > Normals > Recalculate Outside",
    errors.NotADiskError: "Mark seams that cut it open into a disk",
    errors.SeveralBoundariesError: _JOIN,
    errors.TouchingBoundariesError: f"Use Merge by Distance where they touch. {_JOIN}",
    errors.RepeatedVertexError: "Use Degenerate Dissolve",
    errors.OpenSurfaceError: "Fill the holes (Select > Non Manifold, then Fill), or unwrap it as a chart",
    errors.LooseVertexError: "Use Mesh > Clean Up > Delete Loose",
    errors.SeveralComponentsError: "Map them one by one (Separate by Loose Parts)",
    errors.PinchedVertexError: "Split the vertex (Mesh > Split > Faces by Edges)",
    errors.CrowdedError: "Use Merge by Distance and Degenerate Dissolve on it, or delete it",
    errors.CoarseningError: "Check it with Mesh > Clean Up",
    errors.WeightError: "Paint weights between 0 and 1, not the same everywhere",
    errors.NoRegionError: "Paint the region first",
    errors.UniformWeightsError: "Paint a part only",
    errors.EmptyRegionError: "Paint a region with area",
    errors.SoftRegionError: "Choose a factor nearer to 1, or paint the region with weight 1 and the rest with 0",
}

# What warnings advise in the middle of a sentence.
ADVICE: dict[str, str] = {
    errors.MERGE: "use Merge by Distance",
    errors.MERGING: "Merge by Distance",
    errors.CUT_FURTHER: "turn on Cut Further, or raise Max Shear",
    errors.MORE_SEAMS: "no seams were found that would pay; mark some yourself, or raise Max Shear",
    errors.DISSOLVE: "use Mesh > Clean Up > Degenerate Dissolve",
    errors.TURN_OUTSIDE: "Use Mesh > Normals > Recalculate Outside",
}

# What a button can do at once: identifier, label, description.
ACTIONS = (
    ("CUT_FURTHER", "Cut Further", "Unwrap again, and add seams to islands whose seams were marked by hand, too"),
    ("NORMALS", "Recalculate Normals", "Turn faces over until all of them look outside"),
    ("MERGE", "Merge by Distance", "Join vertices that lie on one another"),
    ("DISSOLVE", "Degenerate Dissolve", "Dissolve faces without area and edges without length"),
    (
        "APPLY_LEVEL",
        "Apply One Level",
        "Apply one level of the Subdivision Surface modifier, so that its UVs follow it",
    ),
)
_ACTION_FOR: dict[type[errors.MeshError], str] = {
    errors.OrientationError: "NORMALS",
    errors.ZeroAreaFaceError: "DISSOLVE",
    errors.RepeatedVertexError: "DISSOLVE",
    errors.TouchingBoundariesError: "MERGE",
    errors.CrowdedError: "MERGE",
}
_ACTION_ADVISED: dict[str, str] = {
    errors.MERGE: "MERGE",
    errors.MERGING: "MERGE",
    errors.CUT_FURTHER: "CUT_FURTHER",
    errors.DISSOLVE: "DISSOLVE",
    errors.APPLY_LEVEL: "APPLY_LEVEL",
    errors.TURN_OUTSIDE: "NORMALS",
}


def action_for(error: errors.MeshError) -> str:
    """The action that mends what an error complains about, or an empty text."""
    return next((action for kind, action in _ACTION_FOR.items() if isinstance(error, kind)), "")


def action_advised(warning: str) -> str:
    """The action that a warning of the solver, in its own words, advises, or an empty text."""
    return next((action for words, action in _ACTION_ADVISED.items() if words in warning), "")


def explain(error: errors.MeshError) -> str:
    """Say cause, place and remedy of an error, the remedy by the table unless it was given for this very case."""
    special = error.remedy != type(error).remedy
    return error.text(error.remedy if special else REMEDIES.get(type(error), error.remedy))


def advise(warning: str) -> str:
    """Say a warning of the solver with its advice in Blender's words."""
    for neutral, words in ADVICE.items():
        warning = warning.replace(neutral, words)
    return warning
