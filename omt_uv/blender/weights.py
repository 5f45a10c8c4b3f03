"""Read the region that is magnified from vertex groups, attributes or scores of the shape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy

import bmesh
import numpy as np

from ..pipelines.layout import Refusal
from ..pipelines.reading import Reading
from ..settings import DEFAULT_HIGH, DEFAULT_LOW
from ..solver.analysis.vertex_scores import scaled_vertex_areas, soft_weights, vertex_score
from ..solver.errors import MeshError
from .vertex_groups import GroupError, group_weights

# Regions that need no vertex group, and the score they are made from.
COMPUTED = {"saliency": "saliency", "curvature": "gaussian"}


@dataclass(frozen=True)
class Weights:
    """Weights of an object's vertices, or of its polygons where `kind` is "face"."""

    values: np.ndarray
    kind: str = "vertex"


def region_weights(pairs: Sequence[tuple[bpy.types.Object, Reading]], name: str) -> list[np.ndarray]:
    """Weights (n,) of the region `name` for each object: a vertex group, 0 where an object has none; or one of
    COMPUTED, where no object has a group of this name.

    Raises
    ------
    GroupError : no object has this group, or no name is given
    Refusal : a mesh that has no such score
    """
    weights = [group_weights(obj, name) if name else None for obj, _ in pairs]
    if all(w is None for w in weights):
        if name in COMPUTED:
            return _scores(pairs, COMPUTED[name])
        names = ", ".join(obj.name for obj, _ in pairs)
        raise GroupError(
            f"{names}: There is no vertex group {name!r}. Paint one, or choose {' or '.join(COMPUTED)}."
            if name
            else f"{names}: No vertex group is named. Choose the one that marks the region."
        )
    sizes = [len(reading.surface.positions) for _, reading in pairs]
    return [np.zeros(n) if w is None else w for w, n in zip(weights, sizes, strict=True)]


def _scores(pairs: Sequence[tuple[bpy.types.Object, Reading]], kind: str) -> list[np.ndarray]:
    found = []
    for k, (_, reading) in enumerate(pairs):
        try:
            found.append(computed_weights(reading, kind))
        except MeshError as error:
            raise Refusal(k, error) from error
    return found


def attribute_weights(
    pairs: Sequence[tuple[bpy.types.Object, Reading]], name: str
) -> tuple[list[Weights], list[tuple[int, str]]]:
    """Weights of each object from its attribute `name`, floats on vertices or faces; 0 where an object has none.

    Values that reach beyond 1 are divided by the largest of all objects, which the warnings say: pairs of object
    index (-1 for all) and text.

    Raises
    ------
    GroupError : no object has this attribute, or one has it with another type or place
    """
    found = [float_attribute(obj, name) for obj, _ in pairs]
    if all(weights is None for weights in found):
        names = ", ".join(obj.name for obj, _ in pairs)
        raise GroupError(
            f"{names}: There is no attribute {name!r}. Choose one of floats on vertices or faces."
            if name
            else f"{names}: No attribute is named. Choose the one that marks the region."
        )
    most = max(float(weights.values.max(initial=0.0)) for weights in found if weights is not None)
    warnings = []
    if np.isfinite(most) and most > 1:
        found = [None if weights is None else replace(weights, values=weights.values / most) for weights in found]
        warnings = [(-1, f"The attribute {name!r} reaches {most:.4g}; its values were divided by that")]
    sizes = [len(reading.surface.positions) for _, reading in pairs]
    return [Weights(np.zeros(n)) if w is None else w for w, n in zip(found, sizes, strict=True)], warnings


def float_attribute(obj: bpy.types.Object, name: str) -> Weights | None:
    """Values of an attribute of floats on vertices or faces, in any mode; None if the mesh has none of this name.

    Raises GroupError for attributes of another type or place.
    """
    mesh = obj.data
    attribute = mesh.attributes.get(name) if name else None
    if attribute is None:
        return None
    if attribute.data_type != "FLOAT" or attribute.domain not in {"POINT", "FACE"}:
        raise GroupError(
            f"{obj.name}: The attribute {name!r} is {attribute.data_type} on {attribute.domain}. "
            "Choose one of floats on vertices or faces."
        )
    on_faces = attribute.domain == "FACE"
    kind = "face" if on_faces else "vertex"
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(mesh)
        elements = edit.faces if on_faces else edit.verts
        layer = elements.layers.float[name]
        return Weights(np.fromiter((element[layer] for element in elements), float, len(elements)), kind)
    values = np.zeros(len(attribute.data), np.float32)
    attribute.data.foreach_get("value", values)
    return Weights(values.astype(float), kind)


def named_weights(
    pairs: Sequence[tuple[bpy.types.Object, Reading]], name: str
) -> tuple[list[Weights], list[tuple[int, str]]]:
    """As `region_weights`, or as `attribute_weights` where no object has a group of this name; and warnings.

    Raises
    ------
    GroupError, Refusal : see there
    """
    grouped = any(name in obj.vertex_groups for obj, _ in pairs)
    has = [obj.name for obj, _ in pairs if name and obj.data.attributes.get(name) is not None]
    if has and not grouped:
        return attribute_weights(pairs, name)
    told = f"{', '.join(has)}: {name!r} is a vertex group and an attribute; the vertex group was used"
    return [Weights(w) for w in region_weights(pairs, name)], [(-1, told)] if has else []


def computed_weights(
    reading: Reading,
    kind: str,
    low: float = DEFAULT_LOW,
    high: float = DEFAULT_HIGH,
    invert: bool = False,
    selected: np.ndarray | None = None,
) -> np.ndarray:
    """Weights (n,) from a score of the whole mesh; see `vertex_scores.soft_weights`. Raises MeshError."""
    surface = reading.surface
    triangles = surface.corner_vertex[surface.triangles]
    values = vertex_score(kind, surface.positions, triangles, selected)
    return soft_weights(values, scaled_vertex_areas(surface.positions, triangles), low, high, invert)
