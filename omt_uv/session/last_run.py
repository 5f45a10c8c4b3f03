"""Remember what the last run did, for the panel and for reports of bugs, and notice when it holds no more."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass, field

import bpy

from ..settings import AREA_BOUND, DEFAULT_MAX_SHEAR, OVERLAP_BOUND

# Seconds after a change before it is looked at, so that nobody waits who is at work.
PATIENCE = 0.4


@dataclass(frozen=True)
class Notice:
    """A warning or an error in words; action: what a button can do about it, of `remedies.ACTIONS`, or empty."""

    text: str
    action: str = ""


@dataclass(frozen=True)
class Summary:
    """What the panel shows.

    title : the operator; rows : pairs of a name and a value; notices : warnings, or why it was refused
    objects : names of those it is about; beyond : names of rows that are out of their bounds
    refused : whether nothing was done
    """

    title: str
    rows: tuple[tuple[str, str], ...] = ()
    notices: tuple[Notice, ...] = ()
    objects: tuple[str, ...] = ()
    beyond: frozenset[str] = frozenset()
    refused: bool = False

    @property
    def warnings(self) -> tuple[str, ...]:
        return tuple(notice.text for notice in self.notices)

    @property
    def is_good(self) -> bool:
        """Whether there is nothing to say against it."""
        return not (self.refused or self.notices or self.beyond)


@dataclass
class State:
    """outdated : why the figures hold no more, empty while they do; marks : of the objects, when they were taken."""

    summary: Summary | None = None
    error: str = ""
    notices: list[Notice] = field(default_factory=list)
    shown: int = 0
    outdated: str = ""
    marks: dict[str, bytes] = field(default_factory=dict)


state = State()


def keep(summary: Summary) -> None:
    """Let the panel show it, and watch the objects that it is about."""
    from ..blender.fingerprint import uv_mark

    state.summary, state.shown, state.outdated = summary, 0, ""
    state.marks = {obj.name: uv_mark(obj) for obj in map(bpy.data.objects.get, summary.objects) if obj is not None}
    for kind, function in _handlers():
        if function not in kind:
            kind.append(function)


def forget() -> None:
    """Let the panel show nothing; also when the add-on goes."""
    state.summary, state.shown, state.outdated = None, 0, ""
    state.marks.clear()
    for kind, function in _handlers():
        if function in kind:
            kind.remove(function)
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)


def look_again() -> str:
    """Whether the figures still hold: an empty text, or why they do not."""
    from ..blender.fingerprint import uv_mark

    if state.summary is None or not state.marks:
        # A live session brings its figures up to date itself.
        state.outdated = ""
        return ""
    objects = {name: bpy.data.objects.get(name) for name in state.marks}
    if any(obj is None or obj.type != "MESH" for obj in objects.values()):
        state.outdated = "an object is gone"
    elif any(uv_mark(obj) != state.marks[name] for name, obj in objects.items()):
        state.outdated = "the mesh has changed"
    else:
        chosen = {obj.name for obj in chosen_objects(bpy.context)}
        state.outdated = "others are selected" if chosen and chosen != set(objects) else ""
    return state.outdated


def chosen_objects(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Mesh objects that an operator would work on."""
    if context.mode == "EDIT_MESH":
        return list(context.objects_in_mode)
    return [obj for obj in context.selected_objects if obj.type == "MESH"]


def _handlers() -> list:
    """Blender's lists of handlers, and what each shall call."""
    handlers = bpy.app.handlers
    changes = (handlers.depsgraph_update_post, handlers.undo_post, handlers.redo_post)
    return [*((kind, _suspect) for kind in changes), (handlers.load_pre, _before_load)]


def _suspect(*_) -> None:
    """Something has changed: look at it, once it is quiet."""
    if bpy.app.background:
        return
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    bpy.app.timers.register(_look, first_interval=PATIENCE)


def _look() -> None:
    before = state.outdated
    if look_again() != before:
        redraw(bpy.context)


def _before_load(*_) -> None:
    """The file that it is about goes."""
    forget()


def lines(text: str, width: int) -> list[str]:
    """A text in lines of so many characters."""
    return textwrap.wrap(text, max(12, width))


def redraw(context: bpy.types.Context) -> None:
    """Draw the sidebars of all windows anew."""
    for area in (a for window in context.window_manager.windows for a in window.screen.areas):
        if area.type in {"VIEW_3D", "IMAGE_EDITOR"}:
            for region in area.regions:
                if region.type == "UI":
                    region.tag_redraw()


@dataclass(frozen=True)
class Figures:
    """Rows about UVs, and the names of those that are out of their bounds."""

    rows: tuple[tuple[str, str], ...] = ()
    beyond: frozenset[str] = frozenset()


def figures(
    readings, texture_size: float, metres: float, max_shear: float = DEFAULT_MAX_SHEAR, measured=None
) -> Figures:
    """Rows about the active UVs of readings, whose Distortion may be known; none where there is nothing to measure."""
    from ..pipelines.distortion import ON_SUBDIVISION, measure_readings, on_subdivision
    from ..pipelines.subdivision import evaluated
    from ..pipelines.texel_density import Texels, texel_density
    from ..solver.errors import MeshError

    try:
        place = (("Measured", ON_SUBDIVISION),) if on_subdivision(readings) else ()
        readings = [evaluated(reading) for reading in readings]
        found = measured or measure_readings(readings, overlap=False)
        pixels = texel_density(readings, Texels(texture_size, metres))
    except MeshError:
        return Figures()
    found_rows = rows_of(found, max_shear)
    return Figures((*place, *found_rows.rows, ("Texel density", density_text(pixels))), found_rows.beyond)


def rows_of(found, max_shear: float = DEFAULT_MAX_SHEAR) -> Figures:
    """Rows about a Distortion."""
    beyond = {
        "Area error": found.area_l1 > AREA_BOUND,
        "Shear": found.angle_mean > max_shear,
        "Folded faces": found.folds > 0,
    }
    rows = (
        ("Area error", f"{100 * found.area_l1:.2f} %"),
        ("Shear", f"{found.angle_mean:.3f}"),
        ("Folded faces", f"{found.folds}"),
        ("Islands", f"{found.charts}"),
    )
    return Figures(rows, frozenset(name for name, is_beyond in beyond.items() if is_beyond))


def overlap_row(overlap: float) -> Figures:
    """The row about the share of the UV area that is under several faces."""
    from ..solver.errors import two_digits

    beyond = frozenset({"Overlap"}) if overlap > OVERLAP_BOUND else frozenset()
    return Figures((("Overlap", two_digits(overlap)),), beyond)


def density_text(per_metre: float) -> str:
    """Pixels per metre of the surface, as games have it: per centimetre where that is a number of some size."""
    return f"{per_metre / 100:.4g} px/cm" if per_metre >= 100 else f"{per_metre:.4g} px/m"


def seconds(value: float) -> str:
    return f"{value:.2f} s" if value < 10 else f"{value:.0f} s"
