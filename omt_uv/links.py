"""Where the documentation and the list of bugs are, in one place."""

from __future__ import annotations

WEBSITE = "https://omt-uv.github.io/omt-uv/"
BUGS = "https://github.com/omt-uv/omt-uv/issues"

# Pages of docs/operators, by operator.
PAGES = {
    "uv.omt_unwrap": "unwrap",
    "uv.omt_refine": "refine",
    "uv.omt_magnify": "magnify",
    "object.omt_weights": "weights",
    "uv.omt_sphere": "sphere",
    "uv.omt_seams": "seams",
    "object.omt_remesh": "remesh",
    "object.omt_compare": "remesh",
    "object.omt_match": "match",
    "object.omt_landmarks": "match",
    "object.omt_landmarks_suggest": "match",
    "object.omt_landmarks_clear": "match",
    "object.omt_strain": "match",
    "object.omt_similar": "similar",
    "uv.omt_stack": "arrange",
    "uv.omt_symmetrize": "arrange",
    "uv.omt_rectify": "arrange",
    "uv.omt_queue": "queue",
    "uv.omt_queue_stop": "queue",
    "mesh.omt_partition": "partition",
    "object.omt_flow": "flow",
    "uv.omt_flow": "flow",
    "object.omt_volume": "volume",
    "uv.omt_live": "live",
    "uv.omt_live_end": "live",
    "uv.omt_overlay": "distortion",
    "uv.omt_histogram": "distortion",
    "uv.omt_measure": "distortion",
    "object.omt_distance": "distortion",
    "uv.omt_regions": "distortion",
    "uv.omt_attributes": "distortion",
    "uv.omt_density_get": "texel_density",
    "uv.omt_density_set": "texel_density",
    "uv.omt_checker": "result",
    "uv.omt_checker_remove": "result",
    "uv.omt_worst": "result",
    "uv.omt_remedy": "result",
    "uv.omt_notices": "result",
}


def page(operator: str) -> str:
    """Address of the page about an operator; that of all of them where it has none of its own."""
    return f"{WEBSITE}operators/{PAGES[operator]}/" if operator in PAGES else f"{WEBSITE}operators/"


def manual() -> tuple[str, tuple[tuple[str, str], ...]]:
    """What Blender's Online Manual, by right click, opens for our operators and their settings."""
    places = tuple((f"bpy.ops.{operator}*", page(operator).removeprefix(WEBSITE)) for operator in sorted(PAGES))
    return WEBSITE, places
