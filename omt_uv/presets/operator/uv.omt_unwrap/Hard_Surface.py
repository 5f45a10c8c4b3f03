import bpy

op = bpy.context.active_operator

op.boundary = "FREE"
op.balance = 0.6
op.quality = "STANDARD"
op.seams = "AUTO"
op.fill_holes = False
op.max_shear = 1.15
op.cut_further = True
op.pack = True
op.turn_to_fit = False
op.margin = 8
op.texture_size = 2048
