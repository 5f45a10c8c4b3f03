"""Match the selected object with the active one: object.omt_match."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ...pipelines.shapes.choices import (
    DEFAULT_PREFIX,
    DEFAULT_TRANSFERS,
    MATCH_DOMAINS,
    MATCH_MODES,
    TRANSFERS,
)
from ...session import run
from ...session.language import counted
from ..base import Complaint, SolverOperator, complaints, warn

KEY = "OMT Match"
# Modes that write the shape of the target.
SHAPING = ("WRAP", "MORPH")


def source_and_target(context: bpy.types.Context) -> tuple[bpy.types.Object, bpy.types.Object]:
    """The selected and the active object, both meshes.

    Raises
    ------
    Complaint : there is another number of them, or they share a mesh
    """
    target = context.view_layer.objects.active
    meshes = [obj for obj in context.selected_objects if obj.type == "MESH"]
    if target is None or target not in meshes or len(meshes) != 2:
        raise Complaint(
            "Select two mesh objects: first the one to match, then, as the active one, what to match it with."
        )
    source = next(obj for obj in meshes if obj != target)
    if source.data == target.data:
        raise Complaint(f"{source.name} and {target.name} share their mesh. Make one of them a single user.")
    return source, target


class OBJECT_OT_omt_match(SolverOperator, bpy.types.Operator):
    """Find what corresponds on the selected and the active object, and carry over UVs, weights, shapes"""

    bl_idname = "object.omt_match"
    bl_label = "Match"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    mode: EnumProperty(name="Result", description="What the match is for", items=MATCH_MODES)
    transfer: EnumProperty(
        name="Transfer",
        description="What the active object gets",
        items=TRANSFERS,
        options={"ENUM_FLAG"},
        default=set(DEFAULT_TRANSFERS),
    )
    landmark_prefix: StringProperty(
        name="Landmarks",
        description="Vertex groups and empties that begin so, with equal names on both objects, shall meet",
        default=DEFAULT_PREFIX,
    )
    domain: EnumProperty(name="Domain", description="Where both surfaces are compared", items=MATCH_DOMAINS)
    balance: FloatProperty(
        name="Area - Angle",
        description="What the maps to the domain keep: areas at 0, angles at 1",
        default=0.5,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    mirrored: BoolProperty(name="Mirrored", description="Match the mirror image of the selected object", default=False)
    use_polish: BoolProperty(
        name="Polish",
        description="Let the match settle on the surfaces, for the least distortion",
        default=True,
    )
    features: FloatProperty(
        name="Features",
        description="How much dents and bumps shall meet, next to how little is distorted",
        default=0.05,
        min=0.0,
        soft_max=1.0,
    )
    shape_key: StringProperty(name="Shape Key", description="Shape key to write", default=KEY)
    factor: FloatProperty(
        name="Factor", description="How far the selected object becomes the active one", default=0.5, min=0.0, max=1.0
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.mode != "OBJECT":
            cls.poll_message_set("Matches objects, so it works in Object Mode only")  # type: ignore[attr-defined]
            return False
        return super().poll(context)

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def kinds(self) -> set[str]:
        """What to transfer, in the words of the pipeline."""
        return {kind.lower() for kind in self.transfer} if self.mode == "TRANSFER" else set()

    def steps(self, context: bpy.types.Context):
        from ...blender.mesh import check_local
        from ...blender.shapes.landmarks import read_landmarks
        from ...blender.shapes.match_objects import check_room, match_job, read_carrier, stretched_offsets
        from ...pipelines.shapes.landmark_pairs import pairs_of
        from ...solver.registration.results import RegistrationOptions

        source, target = source_and_target(context)
        if self.mode in SHAPING and not self.shape_key:
            raise Complaint("The shape key has no name. Name the one to write.")
        with complaints(source):
            first = stretched_offsets(read_carrier(source))
        with complaints(target):
            second = read_carrier(target)
        with complaints():
            if self.mode == "TRANSFER":
                check_room(target, first.attributes, self.kinds())
            for obj in (source,) if self.mode in SHAPING else (source, target)[self.mode == "TRANSFER" :]:
                check_local(obj)
            points = (read_landmarks(source, self.landmark_prefix), read_landmarks(target, self.landmark_prefix))
            pairs = (
                pairs_of(*points, (source.name, target.name)) if self.landmark_prefix else pairs_of([], [], ("", ""))
            )
            options = RegistrationOptions(
                domain=self.domain.lower(),
                balance=self.balance,
                mirrored=self.mirrored,
                polish=self.use_polish,
                features=self.features,
            )
            job = match_job(first, second, pairs, options)
            result, attributes = yield from run.aside(_matched(job, first, self.mode))
        return source, target, first, job, result, attributes, second.warnings

    def finish(self, context: bpy.types.Context, result) -> None:
        from ...blender.shapes.match_objects import write_colours, write_onto, write_wrap
        from ...solver.errors import reaching

        source, target, first, job, match, attributes, warnings = result
        told = [(0, text) for text in first.warnings] + [(1, text) for text in warnings]
        told += [(-1, text) for text in match.warnings]
        if self.mode == "TRANSFER":
            carried, across = attributes
            names = write_onto(target, first, carried, self.kinds(), self.landmark_prefix)
            if across:
                told.append((1, reaching(across)))
            text = f"Transferred {', '.join(names) or 'nothing'}"
        elif self.mode == "CHECKER":
            write_colours(source, target, job, match)
            text = "Colours show what corresponds: Viewport Shading, Color, Attribute"
        else:
            write_wrap(source, target, match, self.shape_key, 1.0 if self.mode == "WRAP" else self.factor)
            text = f"Shape key {self.shape_key!r} of {source.name}"
        self.said = _figures(match)
        warn(self, [source, target], told)
        self.report({"INFO"}, f"{text}; {counted(len(match.found.met), '{} landmark', '{} landmarks')}")


def _figures(match) -> tuple[tuple[str, str], ...]:
    """Rows for the panel."""
    count, met = len(match.found.met), int(match.found.met.sum())
    rows = (
        ("Landmarks met", f"{met} of {count}" if count else "none set"),
        ("Flipped", f"{100 * match.found.flipped:.2g} %"),
        ("Area ratio, mean", f"{match.figures.mean_area:.2f}"),
        ("Distance, rms", f"{100 * match.fit:.2g} %"),
    )
    return rows if match.intersections is None else (*rows, ("Faces that meet", str(match.intersections)))


def _matched(job, carried, mode: str):
    """The match, and, to transfer, the attributes of the target and how many faces reach across a seam."""
    from ...pipelines.shapes.match import match_surfaces
    from ...pipelines.shapes.onto import transferred
    from ...pipelines.shapes.wrap import wrap_surfaces

    result = yield from (wrap_surfaces if mode in SHAPING else match_surfaces)(job)
    return result, transferred(job, result, carried.attributes) if mode == "TRANSFER" else None


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator that count as others stand, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "mode")
    if properties.mode == "TRANSFER":
        layout.column(align=True).prop(properties, "transfer")
    if properties.mode in SHAPING:
        layout.prop(properties, "shape_key")
    if properties.mode == "MORPH":
        layout.prop(properties, "factor", slider=True)
    layout.prop(properties, "landmark_prefix")
    layout.prop(properties, "domain")
    layout.prop(properties, "mirrored")
    layout.prop(properties, "balance", slider=True)
    layout.prop(properties, "use_polish")
    if properties.use_polish:
        layout.prop(properties, "features")
