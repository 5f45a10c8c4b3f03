"""Geometry processing in numpy and scipy alone; nothing in here knows Blender.

Conventions, stated once: triangles are counter-clockwise seen from outside, areas of
counter-clockwise triangles are positive, Laplacians are positive semidefinite, angles are
radians, arrays are float64 and int64.
"""
