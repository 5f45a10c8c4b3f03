"""Give the .mtl of an OBJ file that was exported its name, which never is that of another file."""

from __future__ import annotations

from pathlib import Path

from .verified import check_length


def place_materials(made: Path, target: Path, companions: dict[Path, Path]) -> list[str]:
    """Name the materials of an OBJ file `made` after its target, and add them to its companions; returns warnings.

    A file of this name with other contents is somebody else's, and stays.
    """
    materials = made.with_suffix(".mtl")
    text = made.read_bytes()
    if not materials.is_file():
        return []
    place, told = target.with_suffix(".mtl"), []
    for k in range(1, 1000):
        if not place.exists() or place.read_bytes() == materials.read_bytes():
            break
        place = target.with_name(f"{target.stem}_{k}.mtl")
    if place.name != target.with_suffix(".mtl").name:
        told = [f"{target.with_suffix('.mtl').name} holds other materials and was left alone; {place.name} has these"]
    check_length(place)
    text = text.replace(b"mtllib " + materials.name.encode(), b"mtllib " + place.name.encode(), 1)
    made.write_bytes(text)
    companions[materials] = place
    return told
