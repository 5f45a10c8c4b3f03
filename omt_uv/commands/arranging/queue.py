"""Unwrap the meshes of a file one by one, each with a texture to itself: the command queue."""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field, replace

from ..common import CommandError, drain_shown, refusals
from ..layers import read_layers, write_layers
from ..options import add_preview, positive
from ..unwrap import add_settings, chosen

DEFAULT_LIMIT = 120.0


class TooSlowError(CommandError):
    """A mesh took longer than it may."""


class SomeFailedError(CommandError):
    """The file was written, but not all of its meshes have new UVs."""

    status = 7


@dataclass(frozen=True)
class _Done:
    """What is written: objects, Readings, corners, UVs, warnings by the place in the list, and what failed."""

    objects: list = field(default_factory=list)
    readings: list = field(default_factory=list)
    corners: list = field(default_factory=list)
    uv: list = field(default_factory=list)
    warnings: list = field(default_factory=list)
    failed: list = field(default_factory=list)


def add(commands) -> None:
    command = commands.add_parser("queue", help="unwrap the meshes of a file one by one, each in a texture of its own")
    command.set_defaults(run=run)
    add_settings(command)
    command.add_argument(
        "--limit", type=positive, default=DEFAULT_LIMIT, metavar="S", help="seconds after which a mesh is given up"
    )
    add_preview(command)


def run(options: argparse.Namespace) -> None:
    objects, readings = read_layers(options)
    from ...blender.vertex_groups import avoided, map_markers
    from ...pipelines.unwrap import lay_out

    settings, done = chosen(options), _Done()
    free = avoided(objects, options.keep_free)
    groups = {"centre": options.centre, "start": options.start_group, "corners": options.corners}
    marked = map_markers(objects, groups)
    for obj, reading, avoid, marks in zip(objects, readings, free, marked, strict=True):
        try:
            with refusals([obj]):
                job = _job(options, reading, avoid, marks)
                _take(done, obj, reading, drain_shown(_within(lay_out([job], settings), options)))
        except TooSlowError as error:
            done.failed.append(f"{obj.name}: {error}")
        except CommandError as error:
            done.failed.append(str(error))
    if not done.objects:
        raise CommandError("; ".join(done.failed))
    told = [text for _, text in done.warnings if "in the UVs" in text or "under several faces" in text]
    if told and options.strict:
        raise CommandError(f"{options.input}: {'; '.join(told)}. Nothing was written, as --strict asks.")
    # Of overlap the meshes were looked at one by one: they do not share a texture.
    write_layers(options, zip(done.objects, done.readings, strict=True), done, apart=True)
    if done.failed:
        raise SomeFailedError("; ".join(done.failed))


def _job(options: argparse.Namespace, reading, avoid, marks):
    from ...blender.subdivision import with_levels
    from ...pipelines.layout import UnwrapJob

    r = reading if options.subdivision == "auto" else with_levels(reading, options.subdivision)
    return UnwrapJob.of(r, r.subdivision, avoid, marks)


def _within(steps, options: argparse.Namespace):
    """The steps of a solver as long as they may take. Raises TooSlowError."""
    begin = time.monotonic()
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            return stop.value
        if time.monotonic() - begin > options.limit:
            raise TooSlowError(f"it took more than {options.limit:g} s")
        yield progress


def _take(done: _Done, obj, reading, layout) -> None:
    """Add a mesh to those that are done, with what a last look at its UVs finds."""
    import numpy as np

    from ...pipelines.gate import gate

    place = len(done.objects)
    uv = np.zeros((len(reading.surface.corner_vertex), 2)) if reading.uv is None else np.array(reading.uv)
    uv[layout.corners[0]] = layout.uv[0]
    done.objects.append(obj)
    done.readings.append(reading)
    done.corners.append(layout.corners[0])
    done.uv.append(layout.uv[0])
    texts = [text for _, text in layout.warnings]
    texts += gate([replace(reading, uv=uv)]).warnings()
    done.warnings.extend((place, text) for text in dict.fromkeys(texts))
