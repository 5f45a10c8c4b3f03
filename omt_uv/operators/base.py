"""Choose objects, tell errors and run long solvers, for all operators on meshes.

numpy and scipy load when an operator runs, so that Blender does not wait for them at startup.
"""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager

import bpy

from ..display import overlay
from ..errors import UserError, one_line
from ..session import following, last_run, run
from ..session.language import counted
from ..settings import DEFAULT_MAX_SHEAR, DEFAULT_TEXTURE_SIZE

# What Blender makes of infinity is above, and nothing that is meant.
LARGEST = 3e38
# Up to so many objects each have a line of their own where the same is said of them, but for numbers.
MOST_NAMED = 3
NUMBER = re.compile(r"\d[\d.,e+-]*")
# Where operators on meshes work, unless they say otherwise.
MODES = ("OBJECT", "EDIT_MESH")


class Complaint(UserError):
    """What the user is told instead of a result, and the object and MeshError it is about, if any."""

    def __init__(self, message: str, obj=None, error=None):
        super().__init__(message)
        self.obj, self.error = obj, error


def mesh_objects(context: bpy.types.Context, shared: bool = False) -> list[bpy.types.Object]:
    """Mesh objects to work on, the active one first, one for each mesh data-block, or with `shared` all of them.

    Raises
    ------
    Complaint : there is none
    """
    from ..blender.mesh import one_for_each_mesh

    if context.mode == "EDIT_MESH":
        objects = list(context.objects_in_mode_unique_data)
    else:
        objects = [obj for obj in context.selected_objects if obj.type == "MESH"]
    objects.sort(key=lambda obj: obj != context.view_layer.objects.active)
    unique = objects if shared else one_for_each_mesh(objects)
    if not unique:
        raise Complaint("No mesh is selected. Select one or more mesh objects.")
    return unique


def select_alone(context: bpy.types.Context, objects: Sequence[bpy.types.Object]) -> None:
    """Select these objects and no others, the first one active; those outside of the view layer are left out."""
    for obj in context.selected_objects:
        obj.select_set(False)
    there = [obj for obj in objects if obj.name in context.view_layer.objects]
    for obj in there:
        obj.select_set(True)
    if there:
        context.view_layer.objects.active = there[0]


def read_objects(context: bpy.types.Context, layer: str = "") -> list:
    """Pairs of object and Reading of a UV layer (the active one by default), of objects with a face to work on.

    Raises
    ------
    Complaint : no object has any
    """
    from ..blender.mesh import read

    pairs = []
    for obj in mesh_objects(context):
        with complaints(obj):
            pairs.append((obj, read(obj, layer)))
    full = [(obj, reading) for obj, reading in pairs if reading.faces.any()]
    if full:
        return full
    names = ", ".join(obj.name for obj, _ in pairs)
    if context.mode == "EDIT_MESH":
        raise Complaint(f"{names}: No face is selected. Select the faces to work on.")
    raise Complaint(f"{names}: The mesh has no faces. Select a mesh with faces.")


def read_writable(context: bpy.types.Context, layer: str = "") -> tuple[list[bpy.types.Object], list]:
    """Objects and their Readings, as `read_objects`, where UVs can be written to the layer.

    Raises
    ------
    Complaint : no object has a face to work on, or one cannot be written
    """
    from ..blender.mesh import check_target

    pairs = read_objects(context, layer)
    objects = [obj for obj, _ in pairs]
    with complaints():
        for obj in objects:
            check_target(obj, layer)
    return objects, [reading for _, reading in pairs]


def check_all_local(pairs: list) -> list:
    """The pairs of object and Reading, if what is written to their meshes is saved.

    Raises
    ------
    Complaint : a mesh is linked, or an override
    """
    from ..blender.mesh import check_local

    with complaints():
        for obj, _ in pairs:
            check_local(obj)
    return pairs


def write_layers(objects: list[bpy.types.Object], layer: str, result) -> None:
    """Write `result.uv` to `result.corners` of the layer of every object (the active one if empty)."""
    from ..blender.mesh import target_layer, write_uv

    for obj, corners, uv in zip(objects, result.corners, result.uv, strict=True):
        write_uv(obj, target_layer(obj, layer), corners, uv)


@contextmanager
def complaints(about=None, objects: Sequence = (), others: tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """Turn what a block raises for the user to mend into a Complaint.

    about : the object that a MeshError of the block is about, if it is about one
    objects : those that the index of a Refusal counts
    others : errors that tell the user what to do, too, although they are no UserErrors
    """
    from ..pipelines.layout import Refusal
    from ..remedies import explain
    from ..solver.errors import MeshError

    try:
        yield
    except Complaint:
        raise
    except Refusal as refusal:
        obj = objects[refusal.index]
        raise Complaint(f"{obj.name}: {explain(refusal.error)}", obj, refusal.error) from refusal
    except MeshError as error:
        if about is None:
            raise Complaint(explain(error)) from error
        raise Complaint(f"{about.name}: {explain(error)}", about, error) from error
    except UserError as error:
        raise Complaint(str(error)) from error
    except others as error:
        raise Complaint(str(error)) from error


def blaming(pairs: list) -> AbstractContextManager[None]:
    """Complain of the first object, of pairs of object and Reading that a block measures as one, without a measure."""
    from ..pipelines import distortion

    return distortion.blaming(pairs, complaints)


def tell(operator: bpy.types.Operator, context: bpy.types.Context, complaint: Complaint) -> set[str]:
    """Select what is wrong, report it, and cancel."""
    names, action = [obj.name for obj in last_run.chosen_objects(context)], ""
    if complaint.error is not None:
        from ..blender.mesh import select_culprits
        from ..remedies import action_for

        select_culprits(context, complaint.obj, complaint.error)
        names, action = [complaint.obj.name] if complaint.obj else names, action_for(complaint.error)
    last_run.state.error = text = one_line(str(complaint))
    notice = last_run.Notice(text, action)
    last_run.keep(last_run.Summary(operator.bl_label, (), (notice,), tuple(names), refused=True))
    operator.report({"ERROR"}, text)
    return {"CANCELLED"}


def warn(operator: bpy.types.Operator, objects: list, warnings: list[tuple[int, str]]) -> None:
    """Report warnings, pairs of an index into objects (-1: of none) and a text, each once, and one for many objects of
    which the same is said, but for numbers."""
    from ..remedies import action_advised, advise

    alike: dict[str, list[tuple[int, str, int]]] = {}
    for (index, raw), count in Counter(warnings).items():
        kind = NUMBER.sub("#", raw) if index >= 0 else raw
        alike.setdefault(kind, []).append((index, raw, count))
    for told in alike.values():
        others = len({index for index, *_ in told}) - 1
        for index, raw, count in told if others < MOST_NAMED else told[:1]:
            name = f"{objects[index].name}: " if index >= 0 else ""
            several = f" ({counted(count, '{} island', '{} islands')})" if count > 1 else ""
            text = advise(raw) + several
            if others >= MOST_NAMED:
                # The numbers are those of the first.
                name, text = "", f"{objects[index].name} and {others} other objects: {text}"
            last_run.state.notices.append(last_run.Notice(text, action_advised(raw)))
            operator.report({"WARNING"}, one_line(name + text))


def _is_finite(value) -> bool:
    """Whether a property, a number or several, is finite; Blender makes the largest float of infinity."""
    return all(abs(x) < LARGEST for x in (value if hasattr(value, "__len__") else (value,)))


def check_numbers(operator: bpy.types.Operator) -> None:
    """Raise Complaint where a property is no finite number: Blender's own limits let NaN pass."""
    for prop in operator.rna_type.properties:
        if prop.type == "FLOAT" and not _is_finite(getattr(operator, prop.identifier)):
            raise Complaint(f"{prop.name} is not a finite number. Give another value.")


# Events that move the view, which goes on while a solver runs.
NAVIGATION = {
    *(
        "MIDDLEMOUSE",
        "WHEELUPMOUSE",
        "WHEELDOWNMOUSE",
        "WHEELINMOUSE",
        "WHEELOUTMOUSE",
        "MOUSEMOVE",
        "INBETWEEN_MOUSEMOVE",
    ),
    *("TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE", "MOUSESMARTZOOM", "NDOF_MOTION", "WINDOW_DEACTIVATE"),
    *(f"NUMPAD_{k}" for k in range(10)),
    *("NUMPAD_PERIOD", "NUMPAD_PLUS", "NUMPAD_MINUS"),
}


# Keys that end a run with what it has so far, where that is a result.
KEEP = ("RET", "NUMPAD_ENTER")
# Seconds between two looks of the user at the progress.
SHOW_EVERY = 0.1


class SolverOperator:
    """A long solver behind an operator: subclasses give `steps`, a generator, and `finish`, which writes.

    `steps(context)` yields Progress and returns a result without changing anything in the file, so it can be
    thrown away at any moment. `finish(context, result)` writes it. Both raise Complaint.

    Scripts and the redo panel run `execute`, which does all at once. A click runs `invoke`: the same generator,
    stepped from a timer, so that Blender stays usable and Esc cancels; one undo step either way.
    """

    bl_label: str
    # Whether it changes the active UVs, so that their figures are worth a look.
    makes_uvs = False
    modes: tuple[str, ...] = MODES
    # Rows of a name and a value on the result that `finish` wants to be shown first, instead of others of that name.
    said: tuple[tuple[str, str], ...] = ()
    _timer: bpy.types.Timer | None = None
    _shown = 0.0

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return ready(cls, context, cls.modes)

    def steps(self, context: bpy.types.Context):
        raise NotImplementedError

    def finish(self, context: bpy.types.Context, result) -> None:
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..solver.progress import drain

        following.keep(context)
        manager, begin = context.window_manager, time.monotonic()
        manager.progress_begin(0, 100)
        try:
            check_numbers(self)
            result = drain(self.steps(context), lambda p: manager.progress_update(int(100 * p.fraction)))
            self._finish(context, result, time.monotonic() - begin)
        except Complaint as complaint:
            return tell(self, context, complaint)
        finally:
            manager.progress_end()
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if bpy.app.background or context.window is None:
            return self.execute(context)
        return self.begin(context)

    def begin(self, context: bpy.types.Context) -> set[str]:
        """Run the first slice, which is all for small meshes, and go on from a timer."""
        if run.current is not None:
            return tell(self, context, Complaint(f"{run.current.label} is still running. Wait, or cancel it by Esc."))
        following.keep(context)
        try:
            check_numbers(self)
            objects = mesh_objects(context)
        except Complaint as complaint:
            return tell(self, context, complaint)
        run.current = run.Run(self.bl_label, context, objects, self.steps(context))
        self._timer = None
        state = self._advance(context)
        if "RUNNING_MODAL" in state and not bpy.app.background:
            self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
            context.window_manager.modal_handler_add(self)
        return state

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC" and event.value == "PRESS":
            seconds = run.current.seconds if run.current else 0.0
            self.cancel(context)
            self.report({"INFO"}, f"Cancelled after {seconds:.1f} s; nothing was changed")  # type: ignore[attr-defined]
            return {"CANCELLED"}
        if event.type in KEEP and event.value == "PRESS" and run.current and run.current.end_early():
            show_progress(context, run.current.text())
            return {"RUNNING_MODAL"}
        if event.type == "TIMER":
            return self._advance(context)
        return {"PASS_THROUGH"} if event.type in NAVIGATION else {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Throw the solver away; Blender calls this when it loads another file."""
        if run.current is not None:
            run.current.close()
            run.current = None
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        show_progress(context, None)

    def _finish(self, context: bpy.types.Context, result, seconds: float) -> None:
        """Write the result, and keep what the panel says about it."""
        last_run.state.notices.clear()
        self.finish(context, result)
        found = last_run.Figures()
        if self.makes_uvs:
            pairs = read_objects(context)
            readings = [reading for _, reading in pairs]
            found = figures_of(context, readings, self)
            overlap = self._gate(readings)
            found = last_run.Figures(found.rows + overlap.rows, found.beyond | overlap.beyond)
            overlay.refresh(context, pairs)
        told = {name for name, _ in self.said}
        rows = (*self.said, *(row for row in found.rows if row[0] not in told), ("Time", last_run.seconds(seconds)))
        names = tuple(obj.name for obj in last_run.chosen_objects(context))
        notices = tuple(last_run.state.notices)
        last_run.keep(last_run.Summary(self.bl_label, rows, notices, names, found.beyond - told))
        last_run.state.error = ""

    def stacks(self) -> bool:
        """Whether islands may lie on one another, so that only overlap inside of them is told."""
        return False

    def _gate(self, readings: list) -> last_run.Figures:
        """Tell of folds and overlap in the UVs that were written; a row for the panel."""
        from ..pipelines.gate import gate

        found = gate(readings, apart=self.stacks())
        warn(self, [], [(-1, text) for text in found.warnings()])
        return last_run.overlap_row(found.overlap)

    def _advance(self, context: bpy.types.Context) -> set[str]:
        current, ended = run.current, True
        if current is None:
            return {"CANCELLED"}
        try:
            ended = current.advance()
            if not ended:
                # Drawing takes its time as well, the more so without a graphics card.
                if time.monotonic() - self._shown > SHOW_EVERY:
                    show_progress(context, current.text())
                    self._shown = time.monotonic()
                return {"RUNNING_MODAL"}
            self._finish(context, current.result, current.seconds)
        except Complaint as complaint:
            return tell(self, context, complaint)
        except run.Disturbed as reason:
            return tell(self, context, Complaint(f"{current.label} was cancelled: {reason}. Run it again."))
        finally:
            if ended:
                self.cancel(context)
        return {"FINISHED"}


def figures_of(context: bpy.types.Context, readings: list, operator=None, measured=None) -> last_run.Figures:
    """Figures of the active UVs of readings, for the texture and within the bound that an operator has.

    measured : their Distortion, where it is known
    """
    scale = context.scene.unit_settings.scale_length
    bound = getattr(operator, "max_shear", 0.0)
    size = getattr(operator, "texture_size", DEFAULT_TEXTURE_SIZE)
    return last_run.figures(readings, size, scale, bound if bound > 1 else DEFAULT_MAX_SHEAR, measured)


class QuickOperator:
    """An operator without a long solver behind it: subclasses give `act`, which does all at once.

    `act(context)` may raise Complaint, UserError and MeshError; what they say is reported.
    """

    modes: tuple[str, ...] = MODES

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return ready(cls, context, cls.modes)

    def act(self, context: bpy.types.Context) -> None:
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        following.keep(context)
        try:
            check_numbers(self)
            with complaints():
                self.act(context)
        except Complaint as complaint:
            return tell(self, context, complaint)
        return {"FINISHED"}


def ready(cls, context: bpy.types.Context, modes: tuple[str, ...] = MODES) -> bool:
    """Whether an operator on meshes can run; the tooltip of the greyed button says why not."""
    if run.current is not None:
        cls.poll_message_set(f"{run.current.label} is still running. Esc cancels it")
        return False
    if context.mode in modes:
        return True
    cls.poll_message_set("Works in Object Mode and in Edit Mode of a mesh")
    return False


def show_progress(context: bpy.types.Context, text: str | None) -> None:
    """Say in the status bar and in our panels how far a run is; None: there is none."""
    if context.workspace is None:
        return
    context.workspace.status_text_set(text)
    last_run.redraw(context)
