"""Draw layouts as images, and power diagrams as meshes: uv.omt_layout_image, object.omt_diagram."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty

from ...session import run
from ...session.language import counted
from ...settings import DOMAINS
from ..base import Complaint, QuickOperator, SolverOperator, blaming, complaints, read_objects, warn

KINDS = (
    ("AREA", "Area", "Every face in the colour of its area: blue has too little of the texture, red too much"),
    ("SHEAR", "Shear", "Every face in the colour of its shear"),
    ("NORMALS", "Normals", "Lit by the normals of the surface, so that one sees what lies where"),
)
NAME = "OMT UV Layout"


class UV_OT_omt_layout_image(QuickOperator, bpy.types.Operator):
    """Draw the UVs of the selected objects as an image: in the colours of area or shear, or lit by the surface"""

    bl_idname = "uv.omt_layout_image"
    bl_label = "UV Layout to Image"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(name="Layout", description="What the image shows", items=KINDS, default="NORMALS")
    size: IntProperty(
        name="Size", description="Width of the image in pixels", default=1024, min=16, max=8192, subtype="PIXEL"
    )

    def act(self, context: bpy.types.Context) -> None:
        from ...blender.mesh import place_of
        from ...display.canvas import show
        from ...display.preview import Placed
        from ...display.textures.layouts import layout_picture

        pairs = read_objects(context)
        bare = [obj.name for obj, reading in pairs if reading.uv is None]
        if bare:
            raise Complaint(f"{', '.join(bare)}: There are no UVs to draw. Unwrap the mesh first.")
        placed = [Placed(reading, *place_of(obj)) for obj, reading in pairs]
        with blaming(pairs):
            picture = layout_picture(placed, self.kind.lower(), self.size)
        image = show(NAME, picture)
        self.report({"INFO"}, f"The image {image.name!r} shows the layout")


class OBJECT_OT_omt_diagram(SolverOperator, bpy.types.Operator):
    """Make a mesh of the power diagram by which the areas of the active object are transported, a cell a vertex"""

    bl_idname = "object.omt_diagram"
    bl_label = "Power Diagram"
    bl_options = {"REGISTER", "UNDO"}

    domain: EnumProperty(name="Domain", description="What the cells fill", items=DOMAINS, default="DISK")

    def steps(self, context: bpy.types.Context):
        from ...pipelines.measuring.diagrams import diagram

        # The active one, if it is among them.
        obj, reading = read_objects(context)[0]
        with complaints(obj):
            found = yield from run.aside(diagram(reading.surface, reading.faces, self.domain.lower()))
        return obj, found

    def finish(self, context: bpy.types.Context, result) -> None:
        from ...blender.mesh import link_beside, new_mesh

        obj, found = result
        points, polygons = found.mesh()
        mesh = new_mesh(f"{obj.name}_cells", points.tolist(), [p.tolist() for p in polygons])
        new = bpy.data.objects.new(mesh.name, mesh)
        link_beside(new, obj)
        warn(self, [obj], [(0, text) for text in found.warnings])
        self.said = (("Cells", str(len(polygons))), ("Area error", f"{100 * found.residual:.2g} %"))
        self.report({"INFO"}, f"{new.name}: {counted(len(polygons), 'Made {} cell', 'Made {} cells')}")
