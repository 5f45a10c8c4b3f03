"""OMT UV, a Blender extension: area-preserving UV unwrapping by conformal maps and optimal mass transport."""


def register() -> None:
    from .omt_uv import registration

    registration.register()


def unregister() -> None:
    from .omt_uv import registration

    registration.unregister()
