"""OMT UV, a Blender extension: area-preserving UV unwrapping by conformal maps and optimal mass transport."""

# Read by Blender before 4.2 alone; the manifest is what counts.
bl_info = {
    "name": "OMT UV",
    "description": "Area-preserving UV unwrapping by optimal mass transport",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Sidebar > OMT, in the 3D View and the UV Editor",
    "category": "UV",
}


def register() -> None:
    from .omt_uv import registration

    registration.register()


def unregister() -> None:
    from .omt_uv import registration

    registration.unregister()
