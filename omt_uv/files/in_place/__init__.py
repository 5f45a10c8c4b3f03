"""UVs put into the bytes of a file that exists, with everything else in it left as it is.

Imports errors.
Main names: obj.put, ply.put, glb.put, read_plain, Imported, InPlaceError.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(__name__, imported="Imported InPlaceError", plain_obj="read_plain")
