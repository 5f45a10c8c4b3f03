"""Refuse files that do not keep what a command writes."""

from __future__ import annotations

from pathlib import Path

from ..common import CommandError

# What is kept by which files; new meshes and their UVs by all.
KEPT_BY = {
    "face_sets": (".blend",),
    "attribute": (".blend",),
    "seams": (".blend",),
    "materials": (".blend", ".obj", ".glb", ".gltf", ".fbx"),
    "points": (".blend", ".obj"),
}


def check_kept(path: Path, what: str) -> None:
    """Raise CommandError if a file of this name does not keep what KEPT_BY names."""
    kept = KEPT_BY.get(what)
    if kept is not None and path.suffix.lower() not in kept:
        raise CommandError(f"{path}: {what.replace('_', ' ')} are kept by {' '.join(kept)} alone. Write one of these.")
