"""Objects that are matched or divided: what they carry, their landmarks, and what is written.

Imports settings, errors, solver, pipelines, pipelines.shapes and blender.
Main names: read_carrier, read_landmarks, write_wrap, write_onto, write_colours, write_strain, write_cells.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    landmarks="put_landmark read_landmarks remove_landmarks",
    match_objects="Carried match_job read_carrier write_colours write_onto write_wrap",
    strain="write_strain",
    cell_faces="write_cells",
    cell_objects="new_cell_mesh new_points read_carried",
)
