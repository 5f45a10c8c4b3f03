"""Commands that draw: test pictures, layouts in colours, and the power diagrams of the transport.

Imports commands, pipelines, blender, display, files and, when they run, the solver.
Main names: test_texture.drawn, diagram.obj_text.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    diagram="obj_text",
    test_texture="drawn",
)
