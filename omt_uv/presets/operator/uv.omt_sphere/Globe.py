import bpy

op = bpy.context.active_operator

op.projection = "LAMBERT"
op.balance = 0.0
op.quality = "STANDARD"
op.orientation = "AXES"
op.inside = False
