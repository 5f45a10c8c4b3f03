"""Objects that are matched: what they carry, their landmarks, and what a match writes.

Imports blender, pipelines, pipelines.shapes, solver and errors.
Main names: read_carrier, read_landmarks, write_wrap, write_onto, write_colours, write_strain.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    landmarks="put_landmark read_landmarks remove_landmarks",
    match_objects="Carried match_job read_carrier write_colours write_onto write_wrap",
    strain="write_strain",
)
