"""Find and apply presets of operators: Blender's own files, for the sidebar and for the redo panel."""

from __future__ import annotations

import ast
from pathlib import Path

import bpy

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


def values(path: Path) -> dict:
    """Settings in a preset file, lines such as `op.margin = 4`; nothing in it is run.

    Raises
    ------
    OSError, SyntaxError, ValueError : the file cannot be read, or holds something else than values
    """
    found = {}
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and isinstance(target := node.targets[0], ast.Attribute):
            found[target.attr] = ast.literal_eval(node.value)
    return found


def choose(path: Path, properties) -> None:
    """Set the properties of an operator that a preset names and the operator has; the others stay."""
    for name, value in values(path).items():
        if name in properties.bl_rna.properties:
            setattr(properties, name, value)
