"""Give a region a chosen number of times its share of the texture: the command magnify."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from ..settings import (
    BOUNDARIES,
    DEFAULT_FACTOR,
    DEFAULT_MARGIN,
    DEFAULT_QUALITY,
    DEFAULT_SOURCE,
    DEFAULT_TEXTURE_SIZE,
    OWN_BOUNDARY,
    QUALITIES,
    SOURCES,
    MagnifySettings,
)
from .common import CommandError, drain_shown, refusals, require_blender, write_report
from .layers import read_layers, write_layers
from .options import FORMATS, add_files, add_report, margin, names, positive, texture_size


def add(commands) -> None:
    command = commands.add_parser("magnify", help="give a region a chosen number of times its share of the texture")
    command.set_defaults(run=run, balance=0.0)
    add_files(command, accepts=f"{FORMATS} .off")
    command.add_argument(
        "--weights",
        required=True,
        metavar="NAME",
        help="vertex group of the region, or an attribute of floats on vertices or faces; or saliency, or curvature",
    )
    command.add_argument(
        "--factor", type=positive, default=DEFAULT_FACTOR, metavar="M", help="times its share (default %(default)s)"
    )
    command.add_argument(
        "--exact",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="M times the share of the whole; otherwise M holds between weight 1 and weight 0",
    )
    command.add_argument(
        "--source", choices=names(SOURCES), default=DEFAULT_SOURCE.lower(), help="unwrap the mesh, or use its UVs"
    )
    command.add_argument(
        "--boundary",
        choices=names((OWN_BOUNDARY, *BOUNDARIES)),
        default=OWN_BOUNDARY[0].lower(),
        help="outline of every island; own: free for the mesh, as it is for UVs",
    )
    command.add_argument("--cascade", type=times, default=1, metavar="K", help="magnify K times in a row")
    command.add_argument("--quality", choices=names(QUALITIES), default=DEFAULT_QUALITY.lower(), help="see unwrap")
    command.add_argument(
        "--margin", type=margin, default=DEFAULT_MARGIN, metavar="PX", help="least distance of islands"
    )
    command.add_argument("--texture-size", type=texture_size, default=DEFAULT_TEXTURE_SIZE, metavar="PX")
    command.add_argument("--uv-layer", default="", metavar="NAME", help="UV map to use; default: the active one")
    command.add_argument("--image", type=Path, metavar="FILE", help="picture of the old UVs that shall follow them")
    command.add_argument(
        "--image-output",
        type=Path,
        metavar="FILE",
        help="picture of the new UVs, .png .exr .tif .jpg",
    )
    add_report(command, "island")


def times(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number of times")
    return value


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ..blender.weights import named_weights
    from ..pipelines.magnify import Region, magnify, warped_picture

    picture = _picture(options)
    settings = MagnifySettings(
        boundary=options.boundary,
        quality=options.quality,
        margin=options.margin,
        texture_size=options.texture_size,
        factor=options.factor,
        exact=options.exact,
        source=options.source,
        cascade=options.cascade,
    )
    objects, readings = read_layers(options)
    with refusals(objects):
        weights, told = named_weights(list(zip(objects, readings, strict=True)), options.weights)
        regions = [
            Region(r.surface, r.faces, w.values, r.all_pins, w.kind, r.up)
            for r, w in zip(readings, weights, strict=True)
        ]
        result = drain_shown(magnify(regions, settings))
        result = replace(result, warnings=[*told, *result.warnings])
        written = write_layers(options, zip(objects, readings, strict=True), result, existed=options.source == "uv")
    if picture is not None:
        _write_picture(options, warped_picture(picture[0], regions, result, options.margin, picture[1]))
    print(result.shares.text())
    if options.report:
        more = {"weights": options.weights, "factor": options.factor, "exact": options.exact, "source": options.source}
        shares = {"share": result.shares.report()}
        write_report(options, {**more, "cascade": options.cascade, **shares}, objects, result.reports, written)


def _picture(options: argparse.Namespace):
    """Pixels (h,w,4) of the picture that shall follow, and whether its alpha is straight; or None."""
    if options.image is None and options.image_output is None:
        return None
    if options.image is None or options.image_output is None:
        raise CommandError("A picture needs both --image and --image-output.")
    if options.source != "uv":
        raise CommandError("A picture can only follow UVs that exist. Use --source uv.")
    from ..files import images

    try:
        images.check_target(options.image_output)
        image = images.load(options.image)
        return images.pixels_of(image), images.has_straight_alpha(image)
    except images.ImageError as error:
        raise CommandError(str(error)) from error


def _write_picture(options: argparse.Namespace, picture) -> None:
    from ..files import images

    try:
        # Reading the mesh has closed the file that the image was in.
        images.save(options.image_output, picture, images.load(options.image))
    except images.ImageError as error:
        raise CommandError(str(error)) from error
