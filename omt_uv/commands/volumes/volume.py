"""Map the inside of a closed mesh to a ball, a cube or another body, into a file of tetrahedra: the command volume."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...pipelines.volumes.choices import DEFAULT_TETS, VOLUME_LIBRARIES, VOLUME_METHODS
from ..common import CommandError, UsageError, check_paths, drain_shown, refusals, require_blender, warn, write_figures
from ..options import add_input, faces, names
from ..selection import read_file

WRITABLE = (".vtu", ".npz", ".blend")


def add(commands) -> None:
    command = commands.add_parser(
        "volume", help="map the inside of a closed mesh, every part with its share of the volume"
    )
    command.set_defaults(run=run_volume)
    add_input(command)
    command.add_argument("-o", "--output", type=Path, metavar="OUT", required=True, help=" ".join(WRITABLE))
    command.add_argument(
        "--domain", default="ball", metavar="ball|cube|MESH", help="or the name of another object of IN"
    )
    command.add_argument("--method", choices=names(VOLUME_METHODS), default="newton", help="how volumes come right")
    command.add_argument("--tets", type=faces, default=DEFAULT_TETS, metavar="N", help="tetrahedra, about")
    command.add_argument(
        "--library", choices=names(VOLUME_LIBRARIES), default="tetgen", help="tetwild takes broken surfaces, too"
    )
    command.add_argument("--report", type=Path, metavar="R.json", help="write figures and a histogram of dilations")


def run_volume(options: argparse.Namespace) -> None:
    """Carry out the command volume."""
    require_blender()
    from ...blender.volumes.tet_objects import read_volume_body
    from ...files.verified import check_writable
    from ...pipelines.volumes.volume import VolumeSettings, mapped_volume

    suffix = options.output.suffix.lower()
    if suffix not in WRITABLE:
        raise UsageError(f"{options.output}: unknown format {suffix!r}. Use one of {' '.join(WRITABLE)}.")
    check_paths(options, [])
    check_writable(options.output)
    objects = [obj for obj, _ in read_file(options)]
    known = options.domain in ("ball", "cube")
    goal = None if known else next((obj for obj in objects if obj.name == options.domain), None)
    if not known and goal is None:
        raise CommandError(
            f"{options.input}: there is no mesh {options.domain!r} to map to. Give ball, cube or its name."
        )
    mine = [obj for obj in objects if obj is not goal]
    if not mine:
        raise CommandError(f"{options.input}: only {options.domain} is there, and nothing that could be mapped to it.")
    if len(mine) > 1 and suffix != ".blend":
        raise CommandError(
            f"{options.input}: has {len(mine)} meshes to map. Choose one by --object, or write a .blend."
        )
    settings = VolumeSettings(options.domain if known else "body", options.method, options.tets, options.library)
    found = []
    for obj in mine:
        with refusals(name=obj.name):
            other = None if goal is None else read_volume_body(goal)
            found.append(drain_shown(mapped_volume(read_volume_body(obj), settings, other)))
    told = warn(mine, [(k, text) for k, f in enumerate(found) for text in f.map.warnings], _save(options, mine, found))
    if options.report is not None:
        volumes = [{"object": obj.name, **f.report()} for obj, f in zip(mine, found, strict=True)]
        write_figures(options, {"method": options.method, "volumes": volumes}, told)


def _save(options: argparse.Namespace, objects: list, found: list) -> list[str]:
    """Write the tetrahedra; warnings of the writer."""
    import io

    import numpy as np

    from ...blender.volumes.tet_objects import tet_object
    from ...files.saving import save
    from ...files.verified import check_bytes, staged, write_text
    from ...pipelines.volumes.vtu import vtu_text
    from ...solver.volumes.slices import dilation

    suffix = options.output.suffix.lower()
    if suffix == ".blend":
        made = [tet_object(obj, f) for obj, f in zip(objects, found, strict=True)]
        return save(options.output, made, options.input)
    (one,) = found
    logs = dilation(one.map.points, one.map.positions, one.map.tets)
    if suffix == ".vtu":
        vectors = {"OMT Ball": one.map.positions}
        write_text(options.output, vtu_text(one.map.points, one.map.tets, vectors, {"OMT Dilation": logs}))
        return []
    data = io.BytesIO()
    np.savez_compressed(
        data, points=one.map.points, tets=one.map.tets, positions=one.map.positions, ball=one.ball, dilation=logs
    )
    with staged(options.output) as made_file:
        made_file.write_bytes(data.getvalue())
        check_bytes(made_file, data.getvalue())
    return []
