"""`python -m omt_uv`."""

import contextlib
import os
import sys

from .cli import main


def leave(status: int) -> None:
    """End the process with the status of the command.

    As a Python module, Blender 4.2 crashes while the interpreter shuts down after a glTF export, and the status
    would be that of the crash.
    """
    bpy = sys.modules.get("bpy")
    if bpy is not None and bpy.app.version < (4, 5, 0):
        # Only ever an empty folder: where Blender made none for this session, this is the folder of everybody's files.
        with contextlib.suppress(OSError):
            os.rmdir(bpy.app.tempdir)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


leave(main())
