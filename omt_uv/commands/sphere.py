"""Map closed meshes of a file to the sphere and lay them out as a globe: the command sphere."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from ..settings import (
    DEFAULT_PROJECTION,
    DEFAULT_SPHERE_METHOD,
    IMAGE_LAYOUTS,
    PROJECTIONS,
    SPHERE_METHODS,
    GlobeSettings,
)
from .common import CommandError, drain_shown, refusals, require_blender, write_report
from .layers import read_layers, write_layers
from .options import add_area_options, add_files, add_report, names, positive


def add(commands) -> None:
    command = commands.add_parser("sphere", help="map closed meshes to a sphere, without a seam, and lay it out")
    command.set_defaults(run=run)
    add_files(command)
    command.add_argument(
        "--projection", choices=names(PROJECTIONS), default=DEFAULT_PROJECTION.lower(), help="layout of the globe"
    )
    add_area_options(command)
    command.add_argument(
        "--method", choices=names(SPHERE_METHODS), default=DEFAULT_SPHERE_METHOD.lower(), help="how areas are moved"
    )
    command.add_argument("--fill-holes", action="store_true", help="take holes for filled, for the map alone")
    command.add_argument(
        "--weights", default="", metavar="GROUP", help="vertex group that gets more texture, or saliency, curvature"
    )
    command.add_argument(
        "--weight-factor",
        type=positive,
        default=2.0,
        metavar="F",
        help="how many times that of vertices without weight",
    )
    command.add_argument("--pole", default="", metavar="GROUP", help="vertex group of the north pole; default: Z is up")
    command.add_argument("--meridian", default="", metavar="GROUP", help="vertex group of the middle of the map")
    command.add_argument("--east", default="", metavar="GROUP", help="vertex group on the eastern side of the map")
    command.add_argument("--image", type=Path, metavar="IN.png", help="image to redraw for the layout")
    command.add_argument(
        "--image-layout",
        choices=names(IMAGE_LAYOUTS),
        default=IMAGE_LAYOUTS[0][0].lower(),
        help="a panorama, or sinusoidal: a flat picture, not pinched at the poles",
    )
    command.add_argument("--image-out", type=Path, metavar="OUT.png", help="where the redrawn image is written")
    command.add_argument("--uv-layer", default="", metavar="NAME", help="UV map to write or make; default: the active")
    add_report(command, "globe")


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ..blender.markers import globe_densities, group_markers
    from ..pipelines.globe import globe_jobs, project
    from ..solver.globe.rotation import MarkerError

    _check_image(options)
    settings = GlobeSettings(
        projection=options.projection,
        quality=options.quality,
        balance=options.balance,
        method=options.method,
        fill_holes=options.fill_holes,
    )
    objects, readings = read_layers(options)
    with refusals(objects, others=(MarkerError,)):
        markers = group_markers(objects, options.pole, options.meridian, options.east)
        pairs = list(zip(objects, readings, strict=True))
        densities = globe_densities(pairs, options.weights, options.weight_factor)
        jobs = globe_jobs(readings, densities, markers)
        globes = drain_shown(project(jobs, settings))
        image = _redrawn(options)
        written = write_layers(options, zip(objects, readings, strict=True), globes, apart=True)
        if image is not None:
            _write_image(options, *image)
    if options.report:
        reports = [[globe.report() for globe in mine] for mine in globes.globes]
        more = {"projection": options.projection, "method": options.method}
        write_report(options, more, objects, reports, written)


def _check_image(options: argparse.Namespace) -> None:
    """Refuse what cannot be written before the long work."""
    from ..files.images import check_target

    if (options.image is None) != (options.image_out is None):
        raise CommandError("--image and --image-out go together. Give both.")
    if options.image_out is None:
        return
    check_target(options.image_out)
    if not os.path.isfile(options.image):
        raise CommandError(f"{options.image}: there is no such file")


def _redrawn(options: argparse.Namespace):
    """Pixels of the redrawn image and the image they come from; None without one."""
    from ..files.images import load, pixels_of
    from ..pipelines.panorama_redraw import redraw

    if options.image is None:
        return None
    source = load(options.image)
    return drain_shown(redraw(pixels_of(source), options.image_layout, options.projection)), source


def _write_image(options: argparse.Namespace, pixels, source) -> None:
    from ..files.images import save

    save(options.image_out, pixels, source)
