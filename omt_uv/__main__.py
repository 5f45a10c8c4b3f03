"""`python -m omt_uv`."""

import os
import shutil
import sys

from .cli import main


def leave(status: int) -> None:
    """End the process with the status of the command.

    As a Python module, Blender 4.2 crashes while the interpreter shuts down after a glTF export, and the status
    would be that of the crash.
    """
    bpy = sys.modules.get("bpy")
    if bpy is not None and bpy.app.version < (4, 5, 0):
        shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


leave(main())
