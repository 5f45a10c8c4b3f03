"""Find and apply presets of operators: Blender's own files, for the sidebar and for the redo panel."""

from __future__ import annotations

import ast
import math
import os
from pathlib import Path

import bpy

from ..errors import UserError

FOLDER = Path(__file__).parents[1]


def register_folder() -> None:
    """Let Blender's preset menus list those that come with the add-on."""
    if hasattr(bpy.utils, "register_preset_path"):
        bpy.utils.register_preset_path(str(FOLDER))


def unregister_folder() -> None:
    if hasattr(bpy.utils, "unregister_preset_path"):
        bpy.utils.unregister_preset_path(str(FOLDER))


def files(operator: str) -> list[Path]:
    """Presets of an operator, such as "uv.omt_unwrap", ours first, then the user's, each by name."""
    folders = [FOLDER / "presets" / "operator" / operator]
    folders += [Path(p) for p in bpy.utils.preset_paths(f"operator/{operator}")]
    unique = dict.fromkeys(folder.resolve() for folder in folders)
    return [path for folder in unique if folder.is_dir() for path in sorted(folder.glob("*.py"))]


class PresetError(UserError):
    """A file that holds no settings, or none that the operator can have."""


def values(path: Path) -> dict:
    """Settings in a preset file, lines such as `op.margin = 4`; nothing in it is run.

    Raises
    ------
    PresetError : the file cannot be read, or holds something else than values
    """
    if not os.path.isfile(path):
        raise PresetError(f"{path.name} cannot be used: there is no such file. Choose another one.")
    found = {}
    try:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.Assign) and isinstance(target := node.targets[0], ast.Attribute):
                found[target.attr] = ast.literal_eval(node.value)
    except (OSError, SyntaxError, ValueError, TypeError, RecursionError, MemoryError) as error:
        raise PresetError(f"{path.name} cannot be used: {error}. Choose another one.") from error
    return found


def choose(path: Path, properties) -> None:
    """Set the properties of an operator that a preset names and the operator has; the others stay.

    Raises
    ------
    PresetError : see `values`, and where a value is none that the property can have; then all of them stay
    """
    known = properties.bl_rna.properties
    found = {name: value for name, value in values(path).items() if name in known and not known[name].is_readonly}
    before = {name: (getattr(properties, name), properties.is_property_set(name)) for name in found}
    try:
        for name, value in found.items():
            if isinstance(value, float) and not math.isfinite(value):
                raise ValueError(f"{name} is not a finite number")
            setattr(properties, name, value)
    except (ValueError, TypeError, OverflowError, AttributeError) as error:
        for name, (value, was_set) in before.items():
            if was_set:
                setattr(properties, name, value)
            else:
                properties.property_unset(name)
        raise PresetError(f"{path.name} cannot be used: {error}. Choose another one.") from error
