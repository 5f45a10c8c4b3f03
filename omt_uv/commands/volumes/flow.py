"""Move handles of a file's meshes and let the rest follow without a change of volume: the command flow."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...pipelines.volumes.choices import DEFAULT_PATH, DEFAULT_RADIUS, DEFAULT_SAMPLES, FLOW_PATHS
from ..common import CommandError, UsageError, check_paths, drain_shown, refusals, require_blender, warn, write_figures
from ..options import add_files, names, positive
from ..selection import read_file

# The ball around everything is so much larger, or nothing on it could move.
ROOM = 1.1
# What `--inside` calls that ball.
BALL = "ball"


def add(commands) -> None:
    command = commands.add_parser("flow", help="move parts of bodies; the rest flows along, and volumes stay")
    command.set_defaults(run=run_flow)
    add_files(command)
    command.add_argument("--handles", type=Path, metavar="H.json", required=True, help="what moves, and where to")
    reach = command.add_mutually_exclusive_group()
    reach.add_argument(
        "--radius", type=positive, default=DEFAULT_RADIUS, metavar="R", help="reach, as a share of the diagonal"
    )
    reach.add_argument(
        "--lambda", dest="sharpness", type=positive, metavar="L", help="the same as 1 / R^2, as Hu, Zou and Hua give it"
    )
    command.add_argument("--path", choices=names(FLOW_PATHS), default=DEFAULT_PATH.lower(), help="the way of handles")
    command.add_argument("--samples", type=_count, default=DEFAULT_SAMPLES, metavar="K", help="chords of a curved path")
    command.add_argument("--keep", default="", metavar="GROUP", help="vertex group that stays")
    command.add_argument(
        "--inside", default="", metavar="ball|NAME", help="walls: the ball around all, or a closed mesh"
    )
    command.add_argument("--shape-key", action="store_true", help="write a shape key, into .blend, .glb, .gltf or .fbx")
    command.add_argument("--frames", type=_count, default=1, metavar="K", help="so many shape keys along the way")
    command.add_argument("--report", type=Path, metavar="R.json", help="write volumes, intersections and steps")


def _count(text: str) -> int:
    value = int(text)
    if not 1 <= value <= 1000:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 1 to 1000")
    return value


def run_flow(options: argparse.Namespace) -> None:
    """Carry out the command flow."""
    require_blender()
    from ...blender.volumes.bodies import write_frames, write_positions
    from ...files.saving import save
    from ...pipelines.volumes.handle_file import read_handle_file

    keyed = options.shape_key or options.frames > 1
    if keyed and options.output.suffix.lower() not in (".blend", ".glb", ".gltf", ".fbx"):
        raise UsageError(f"{options.output}: this format has no shape keys. Write .blend, .glb, .gltf or .fbx.")
    check_paths(options)
    file = read_handle_file(options.handles)
    everything = [obj for obj, _ in read_file(options)]
    # A body may be called as the ball around all is.
    objects = [obj for obj in everything if options.inside == BALL or obj.name != options.inside]
    if not objects:
        raise CommandError(f"{options.input}: only the wall {options.inside} is there, and nothing that could flow.")
    with refusals(name=objects[0].name if len(objects) == 1 else str(options.input)):
        found = _flow(options, file, objects)
    for k, obj in enumerate(objects):
        if keyed:
            write_frames(obj, [frame[k] for frame in found.frames], keyed=options.frames > 1)
        else:
            write_positions(obj, found.frames[-1][k])
    told = warn(objects, [(-1, text) for text in found.warnings], save(options.output, everything, options.input))
    if options.report is not None:
        write_figures(options, {"objects": [obj.name for obj in objects], **found.report()}, told)


def _flow(options: argparse.Namespace, file, objects: list):
    """The FlowResult of objects with the handles of a file."""
    from ...blender.volumes.bodies import check_keep, members, read_body
    from ...pipelines.volumes.flow import FlowJob, flow_bodies
    from ...pipelines.volumes.handle_file import handles_of
    from ...solver.flows.options import FlowOptions

    keep = options.keep or (file.keep[0] if file.keep else "")
    bodies: list = []
    for obj in objects:
        with refusals(name=obj.name):
            bodies.append(read_body(obj, keep))
    check_keep(objects, keep)
    handles = handles_of(file, bodies, lambda k, group: _rows(members(objects[k], group)))
    radius = options.radius if options.sharpness is None else options.sharpness**-0.5
    flowing = FlowOptions(radius=radius, path=options.path, samples=options.samples)
    return drain_shown(flow_bodies(FlowJob(tuple(bodies), handles, flowing, _domain(options, bodies), options.frames)))


def _rows(inside):
    return None if inside is None else inside.nonzero()[0]


def _domain(options: argparse.Namespace, bodies):
    """The walls that `--inside` names."""
    if not options.inside:
        return None
    if options.inside != BALL:
        from ...blender.volumes.flow_handles import wall_of

        return wall_of("mesh", options.inside)
    import numpy as np

    from ...solver.flows.domain import ball_domain

    points = np.concatenate([body.positions for body in bodies])
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    return ball_domain(middle, float(np.linalg.norm(points - middle, axis=1).max()) * ROOM)
