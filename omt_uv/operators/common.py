"""What all operators on meshes share: which objects, how errors are told, how a long solver is run.

numpy and scipy load when an operator runs, so that Blender does not wait for them at startup.
"""

from __future__ import annotations

from collections import Counter

import bpy


class Complaint(Exception):
    """What the user is told instead of a result, and the object and MeshError it is about, if any."""

    def __init__(self, message: str, obj=None, error=None):
        super().__init__(message)
        self.obj, self.error = obj, error


def mesh_objects(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Mesh objects to work on, the active one first, one for each mesh data-block.

    Raises
    ------
    Complaint : there is none
    """
    if context.mode == "EDIT_MESH":
        objects = list(context.objects_in_mode_unique_data)
    else:
        objects = [obj for obj in context.selected_objects if obj.type == "MESH"]
    objects.sort(key=lambda obj: obj != context.view_layer.objects.active)
    unique = list({obj.data: obj for obj in reversed(objects)}.values())[::-1]
    if not unique:
        raise Complaint("No mesh is selected. Select one or more mesh objects.")
    return unique


def read_objects(context: bpy.types.Context, layer: str = "") -> list:
    """Pairs of object and Reading of a UV layer (the active one by default), of objects with a face to work on.

    Raises
    ------
    Complaint : no object has any
    """
    from .. import blender_mesh
    from ..solver.errors import MeshError

    pairs = []
    for obj in mesh_objects(context):
        try:
            pairs.append((obj, blender_mesh.read(obj, layer)))
        except MeshError as error:
            raise Complaint(f"{obj.name}: {error}", obj, error) from error
    full = [(obj, reading) for obj, reading in pairs if reading.faces.any()]
    if full:
        return full
    names = ", ".join(obj.name for obj, _ in pairs)
    if context.mode == "EDIT_MESH":
        raise Complaint(f"{names}: No face is selected. Select the faces to work on.")
    raise Complaint(f"{names}: The mesh has no faces. Select a mesh with faces.")


def tell(operator: bpy.types.Operator, context: bpy.types.Context, complaint: Complaint) -> set[str]:
    """Select what is wrong, report it, and cancel."""
    if complaint.error is not None:
        from ..blender_mesh import select_culprits

        select_culprits(context, complaint.obj, complaint.error)
    operator.report({"ERROR"}, str(complaint))
    return {"CANCELLED"}


def warn(operator: bpy.types.Operator, objects: list, warnings: list[tuple[int, str]]) -> None:
    """Report warnings, pairs of an index into objects (-1: of none) and a text, each once."""
    for (index, text), count in Counter(warnings).items():
        name = f"{objects[index].name}: " if index >= 0 else ""
        operator.report({"WARNING"}, f"{name}{text}" + (f" ({count} islands)" if count > 1 else ""))


class SolverOperator:
    """A long solver behind an operator: subclasses give `steps`, a generator, and `finish`, which writes.

    `steps(context)` yields Progress and returns a result without changing anything in the file, so it can be
    thrown away at any moment. `finish(context, result)` writes it. Both raise Complaint.
    """

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.mode in {"OBJECT", "EDIT_MESH"}:
            return True
        cls.poll_message_set("Works in Object Mode and in Edit Mode of a mesh")  # type: ignore[attr-defined]
        return False

    def steps(self, context: bpy.types.Context):
        raise NotImplementedError

    def finish(self, context: bpy.types.Context, result) -> None:
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..solver.progress import drain

        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            result = drain(self.steps(context), lambda p: manager.progress_update(int(100 * p.fraction)))
            self.finish(context, result)
        except Complaint as complaint:
            return tell(self, context, complaint)
        finally:
            manager.progress_end()
        return {"FINISHED"}
