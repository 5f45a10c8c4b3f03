import bpy

op = bpy.context.active_operator

op.boundary = "FREE"
op.balance = 0.2
op.quality = "STANDARD"
op.seams = "AUTO"
op.fill_holes = True
op.max_shear = 1.35
op.pack = True
op.turn_to_fit = False
op.margin = 8
op.texture_size = 4096
