"""Unwrap many objects one after the other: what is done stays, whatever happens to the others: uv.omt_queue."""

from __future__ import annotations

import time

import bpy
from bpy.props import FloatProperty

from ...session import following, last_run, queue, run
from ...session.language import counted, words
from ..base import Complaint, check_all_local, check_numbers, complaints, mesh_objects, ready, tell, warn

UNWRAP = "uv.omt_unwrap"


class UV_OT_omt_queue(bpy.types.Operator):
    """Unwrap the selected objects one by one, each with a texture to itself, with the settings of Unwrap.
    Stop or Esc keeps what is done. What takes too long or fails is named, and selected at the end"""

    bl_idname = "uv.omt_queue"
    bl_label = "Unwrap in a Queue"
    bl_options = {"REGISTER", "UNDO"}

    limit: FloatProperty(
        name="Time Limit",
        description="Seconds after which an object is given up, and the next one taken. 0: none",
        default=120.0,
        min=0.0,
        soft_max=3600.0,
        subtype="TIME_ABSOLUTE",
    )

    _timer: bpy.types.Timer | None = None
    _jobs: queue.Queue | None = None

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return ready(cls, context, ("OBJECT",))

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if bpy.app.background or context.window is None:
            return self.execute(context)
        state = self.begin(context)
        if "RUNNING_MODAL" in state:
            self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
            context.window_manager.modal_handler_add(self)
        return state

    def execute(self, context: bpy.types.Context) -> set[str]:
        """For scripts and the redo panel: all at once."""
        state = self.begin(context)
        try:
            while "RUNNING_MODAL" in state:
                state = self._advance(context)
        finally:
            # Nothing would go on with it after an error.
            if self._jobs is not None:
                self._jobs.close()
        return state

    def begin(self, context: bpy.types.Context) -> set[str]:
        following.keep(context)
        try:
            if queue.state is not None and queue.state.is_running:
                raise Complaint(f"{self.bl_label} is still running. Wait, or stop it.")
            check_numbers(self)
            objects = mesh_objects(context)
            check_all_local([(obj, None) for obj in objects])
            _check_groups(context, objects)
        except Complaint as complaint:
            return tell(self, context, complaint)
        queue.forget()
        queue.state = self._jobs = queue.Queue([queue.Job(obj.name) for obj in objects])
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC" and event.value == "PRESS":
            queue.stop()
        return self._advance(context) if event.type == "TIMER" else {"PASS_THROUGH"}

    def cancel(self, context: bpy.types.Context) -> None:
        queue.stop()
        self._end(context)

    def _advance(self, context: bpy.types.Context) -> set[str]:
        """Work on the job that is on for a moment, or begin the next one."""
        from ...solver.progress import take_step

        jobs = self._jobs
        job = jobs.current if jobs is not None else None
        if jobs is None or job is None or not jobs.is_running:
            return self._end(context)
        obj = bpy.data.objects.get(job.name)
        if obj is None or obj.name not in context.view_layer.objects:
            job.end("FAILED", "it is gone")
            return {"RUNNING_MODAL"}
        try:
            steps = job.steps or job.begin(self._steps(context, obj), run.Watch(context, [obj], any_mode=True))
            job.check()
            end, more = time.monotonic() + run.SLICE, True
            while more:
                job.progress = take_step(steps).fraction
                if self.limit and job.seconds > self.limit:
                    job.end("FAILED", f"it took more than {self.limit:.0f} s")
                    return {"RUNNING_MODAL"}
                more = time.monotonic() < end
        except StopIteration as stop:
            self._keep(job, obj, stop.value)
        except run.Disturbed as reason:
            job.end("FAILED", str(reason))
        except Complaint as complaint:
            # The job says whose it is.
            job.end("FAILED", str(complaint).removeprefix(f"{job.name}: "))
        last_run.redraw(context)
        return {"RUNNING_MODAL"}

    @staticmethod
    def _keep(job: queue.Job, obj: bpy.types.Object, layout) -> None:
        """Write what was found for a job, if its object is still what it was found for."""
        try:
            job.check(thoroughly=True)
        except run.Disturbed as reason:
            job.end("FAILED", str(reason))
            return
        job.warnings = _write(obj, layout)
        job.end("DONE")

    def _steps(self, context: bpy.types.Context, obj: bpy.types.Object):
        """The steps of unwrapping one object, with the settings of the operator."""
        from ...blender.mesh import check_target, read
        from ...blender.vertex_groups import avoided, map_markers
        from ...pipelines.layout import UnwrapJob
        from ...pipelines.unwrap import lay_out
        from ..unwrap import UV_OT_omt_unwrap, groups_of_markers, kept_free

        chosen = context.window_manager.operator_properties_last(UNWRAP)
        with complaints(obj):
            check_target(obj, chosen.uv_layer)
            reading = read(obj)
            (avoid,) = avoided([obj], _own(obj, kept_free(chosen)))
            (marks,) = map_markers([obj], {role: _own(obj, name) for role, name in groups_of_markers(chosen).items()})
        subdivision = reading.subdivision if chosen.use_subdivision else None
        job = UnwrapJob.of(reading, subdivision, avoid, marks)
        with complaints(objects=[obj]):
            return (yield from lay_out([job], UV_OT_omt_unwrap.settings(chosen)))

    def _end(self, context: bpy.types.Context) -> set[str]:
        jobs = self._jobs
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        if jobs is None or jobs.is_over:
            return {"CANCELLED"}
        jobs.close()
        failed = [job for job in jobs.jobs if job.state == "FAILED"]
        done = [job for job in jobs.jobs if job.state == "DONE"]
        for obj in context.view_layer.objects:
            if failed:
                obj.select_set(obj.name in {job.name for job in failed})
        notices = tuple(last_run.Notice(f"{job.name}: {job.reason}") for job in failed)
        last_run.state.notices.clear()
        warn(self, jobs.jobs, [(k, text) for k, job in enumerate(jobs.jobs) for text in job.warnings])
        rows = (("Done", words("{} of {}", len(done), len(jobs.jobs))), ("Failed, selected", f"{len(failed)}"))
        names = tuple(obj.name for obj in last_run.chosen_objects(context))
        told = tuple(last_run.state.notices)
        last_run.keep(last_run.Summary(self.bl_label, rows, notices + told, names))
        for notice in notices:
            self.report({"WARNING"}, notice.text)
        last_run.redraw(context)
        one, many = "Unwrapped {} of {} object", "Unwrapped {} of {} objects"
        self.report({"INFO"}, counted(len(jobs.jobs), one, many, len(done), len(jobs.jobs)))
        return {"FINISHED"} if done else {"CANCELLED"}


def _own(obj: bpy.types.Object, name: str) -> str:
    """The name of a vertex group, empty where the object has none of this name."""
    return name if name in obj.vertex_groups else ""


def _check_groups(context: bpy.types.Context, objects: list) -> None:
    """Complain of a vertex group in the settings of Unwrap that none of the objects has."""
    from ...blender.vertex_groups import avoided
    from ..unwrap import groups_of_markers, kept_free

    chosen = context.window_manager.operator_properties_last(UNWRAP)
    with complaints():
        for name in (kept_free(chosen), *groups_of_markers(chosen).values()):
            avoided(objects, name)


def _write(obj: bpy.types.Object, layout) -> list[str]:
    """Write the UVs of an object, and its seams where that is asked for; warnings, also those of a last look."""
    from ...blender.mesh import read
    from ...pipelines.gate import gate
    from ..unwrap import write_result

    chosen = bpy.context.window_manager.operator_properties_last(UNWRAP)
    told = [text for _, text in write_result(chosen, [obj], layout)]
    return [*told, *gate([read(obj)], apart=not chosen.pack).warnings()]


class UV_OT_omt_queue_stop(bpy.types.Operator):
    """Stop the queue; what is done is kept"""

    bl_idname = "uv.omt_queue_stop"
    bl_label = "Stop the Queue"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return queue.state is not None and not queue.state.is_over

    def execute(self, _context: bpy.types.Context) -> set[str]:
        queue.stop()
        return {"FINISHED"}
