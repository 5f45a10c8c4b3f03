"""Put a checker on objects in place of their materials, which are kept with them, and take it off again."""

from __future__ import annotations

import bpy

import numpy as np

NAME = "OMT UV Checker"
# Property of an object or mesh with the materials that its slots had, by number; "" stands for a slot that was made.
_KEPT = "omt_uv_materials"
_NO_SLOT = "none"


def put(obj: bpy.types.Object, kind: str, size: int, picture: np.ndarray | None = None) -> None:
    """Show a checker on every face; kind as `Image.generated_type`, or the name of a picture (h,w,3) in [0,1], top row
    first; size in pixels."""
    material = _material(kind, size, picture)
    if not obj.material_slots:
        obj.data.materials.append(material)
        obj.data[_KEPT] = {_NO_SLOT: True}
        return
    for k, slot in enumerate(obj.material_slots):
        if slot.material == material:
            continue
        owner = obj if slot.link == "OBJECT" else obj.data
        kept = dict(owner.get(_KEPT, {}))
        # An empty slot has nothing to keep; its number alone says that it was there.
        kept[str(k)] = slot.material if slot.material is not None else False
        owner[_KEPT] = kept
        slot.material = material


def take_off(obj: bpy.types.Object) -> bool:
    """Give an object its materials back; whether it had a checker."""
    found = False
    for owner in (obj.data, obj):
        if _KEPT not in owner:
            continue
        found = True
        kept = owner[_KEPT].to_dict()
        if kept.pop(_NO_SLOT, False):
            obj.data.materials.clear()
        for k, material in kept.items():
            if int(k) < len(obj.material_slots) and has_checker(obj.material_slots[int(k)].material):
                obj.material_slots[int(k)].material = material or None
        del owner[_KEPT]
    return found


def tidy() -> None:
    """Remove checkers that nothing shows any more."""
    for collection in (bpy.data.materials, bpy.data.images):
        for block in [b for b in collection if b.name.startswith(NAME) and b.users == 0]:
            collection.remove(block)


def has_checker(material: bpy.types.Material | None) -> bool:
    return material is not None and material.name.startswith(NAME)


def wears_one(obj: bpy.types.Object) -> bool:
    """Whether materials of an object are kept aside."""
    return _KEPT in obj or _KEPT in obj.data


def _image(name: str, kind: str, size: int, picture: np.ndarray | None) -> bpy.types.Image:
    if picture is None:
        image = bpy.data.images.new(name, size, size)
        image.source, image.generated_type = "GENERATED", kind
        return image
    height, width = picture.shape[:2]
    image = bpy.data.images.new(name, width, height)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = picture[::-1]
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


def _material(kind: str, size: int, picture: np.ndarray | None) -> bpy.types.Material:
    name = f"{NAME} {kind.split('_')[0].lower()} {size}"
    found = bpy.data.materials.get(name)
    if found is not None:
        return found
    image = bpy.data.images.get(name) or _image(name, kind, size, picture)
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.location = image, (-300, 300)
    surface = next((n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
    if surface is not None:
        tree.links.new(node.outputs["Color"], surface.inputs["Base Color"])
        surface.inputs["Roughness"].default_value = 1.0
    # The 3D View's solid shading shows the active one.
    tree.nodes.active = node
    return material
