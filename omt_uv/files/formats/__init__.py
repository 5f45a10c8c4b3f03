"""What files say by themselves, without Blender: what headers declare, and the Object File Format.

Imports solver.lazy alone.
Main names: check_header, read_off.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(__name__, headers="check_header", off="read_off")
