"""Words of the tab in other languages: German and Japanese as a start.

Imports solver.lazy and its own modules.
Main names: tables_of; GERMAN and JAPANESE stand in modules of their own.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    registered="tables_of",
)
