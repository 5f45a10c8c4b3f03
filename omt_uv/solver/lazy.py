"""Import the main names of a package only when they are used (PEP 562)."""

from __future__ import annotations

import importlib
from collections.abc import Callable


def lazy(package: str, **modules: str) -> tuple[Callable[[str], object], list[str]]:
    """`__getattr__` and `__all__` of a package whose names stand in modules of its own.

    Blender's start would wait for scipy if a package imported its modules. `modules` maps a module to its names,
    with blanks between them; a name that a module bears, too, is left out: once imported, the module would hide it.
    """
    home = {name: module for module, names in modules.items() for name in names.split()}

    def find(name: str) -> object:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(f"{package}.{home[name]}"), name)

    return find, sorted(home)
