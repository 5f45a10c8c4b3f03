"""Where the documentation and the list of bugs are, in one place.

Nothing is published yet, so both addresses are empty: pages are those that come with the extension, and nothing points
to a list of bugs. A release that has a website or a list writes it here, and here alone; the build writes it into the
manifest.
"""

from __future__ import annotations

from pathlib import Path

# With a slash at its end, as the folder that `make site` makes is published.
WEBSITE = ""
BUGS = ""
ROOT = Path(__file__).resolve().parents[1]
# Pages in the extension's zip, and those of a checkout, with what their addresses end in.
PLACES = ((ROOT / "help", "/index.html"), (ROOT / "docs", ".md"))

# Pages of docs/operators, by operator.
PAGES = {
    "uv.omt_unwrap": "unwrap",
    "uv.omt_refine": "refine",
    "uv.omt_magnify": "magnify",
    "uv.omt_region_add": "magnify",
    "uv.omt_region_remove": "magnify",
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
    "uv.omt_layout_image": "result",
    "object.omt_diagram": "result",
    "uv.omt_checker_remove": "result",
    "uv.omt_worst": "result",
    "uv.omt_remedy": "result",
    "uv.omt_notices": "result",
}


def root() -> tuple[str, str]:
    """Beginning and end of the addresses of all pages; both empty where there are none."""
    if WEBSITE:
        return WEBSITE, "/"
    found = next(((folder, end) for folder, end in PLACES if folder.is_dir()), None)
    return (f"{found[0].as_uri()}/", found[1]) if found else ("", "")


def page(operator: str = "") -> str:
    """Address of the page about an operator; that of all of them where it has none of its own; empty without pages."""
    start, end = root()
    if not start:
        return ""
    if operator not in PAGES:
        return f"{start}operators{'/README.md' if end == '.md' else end}"
    return f"{start}operators/{PAGES[operator]}{end}"


def manual() -> tuple[str, tuple[tuple[str, str], ...]]:
    """What Blender's Online Manual, by right click, opens for our operators; nothing without pages."""
    start, _ = root()
    names = sorted(PAGES) if start else ()
    return start, tuple((f"bpy.ops.{operator}*", page(operator).removeprefix(start)) for operator in names)
