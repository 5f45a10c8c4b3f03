"""The sources of the package as trees, each read once for all suites that look into them."""

from __future__ import annotations

import ast
import functools
from pathlib import Path


@functools.cache
def tree_of(path: Path) -> ast.Module:
    """The tree of a source, which nobody changes."""
    return ast.parse(path.read_text(encoding="utf-8"))
