"""Write the signature of a file's shape: the command signature, which a library runs on every file."""

from __future__ import annotations

import argparse
import io
from pathlib import Path

from ..common import CommandError, check_paths, require_blender
from ..options import add_input
from .distance import add_points, signature_of_file

NAME = "signature"
SUFFIX = ".npz"


def add(commands) -> None:
    command = commands.add_parser(NAME, help="what a shape is compared by, as an array of points on the sphere")
    command.set_defaults(run=run)
    add_input(command)
    command.add_argument("-o", "--output", type=Path, metavar="S.npz", required=True, help=".npz")
    add_points(command)


def run(options: argparse.Namespace) -> None:
    """Write points with their curvature (k,4) as `packed`, and the `floor`."""
    require_blender()
    import numpy as np

    from ...files.verified import check_writable, write_bytes
    from ...pipelines.shapes.signature_index import packed

    if options.output.suffix.lower() != SUFFIX:
        raise CommandError(f"{options.output}: a signature is an .npz. Name one.")
    check_paths(options, [])
    check_writable(options.output)
    found = signature_of_file(options, options.input)
    data = io.BytesIO()
    np.savez(data, packed=packed(found), floor=found.floor)
    write_bytes(options.output, data.getvalue())


def read_signature(path: Path):
    """A signature that was written. Raises CommandError."""
    import numpy as np

    from ...pipelines.shapes.signature_index import UNREADABLE, unpacked

    try:
        with np.load(path, allow_pickle=False) as data:
            return unpacked(data["packed"], float(data["floor"]))
    except UNREADABLE as error:
        raise CommandError(f"{path}: is no signature ({error})") from error
