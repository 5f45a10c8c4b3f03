import bpy

op = bpy.context.active_operator

op.boundary = "FREE"
op.balance = 0.0
op.quality = "STANDARD"
op.seams = "CHARTS"
op.fill_holes = False
op.max_shear = 0.0
op.pack = True
op.turn_to_fit = True
op.margin = 4
op.texture_size = 1024
op.uv_layer = "Lightmap"
