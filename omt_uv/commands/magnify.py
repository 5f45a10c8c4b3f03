"""Give a region a chosen number of times its share of the texture: the command magnify."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from ..settings import (
    BOUNDARIES,
    DEFAULT_FACTOR,
    DEFAULT_MAGNIFIED_SHEAR,
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
from .options import (
    FORMATS,
    add_files,
    add_report,
    add_subdivision,
    chosen_subdivision,
    margin,
    names,
    positive,
    shear,
    texture_size,
)


def add(commands) -> None:
    command = commands.add_parser("magnify", help="give a region a chosen number of times its share of the texture")
    command.set_defaults(run=run, balance=0.0)
    add_files(command, accepts=f"{FORMATS} .off")
    command.add_argument(
        "--weights",
        default="",
        metavar="NAME",
        help="vertex group of the region, or an attribute of floats on vertices or faces; or saliency, or curvature",
    )
    command.add_argument(
        "--region",
        action="append",
        default=[],
        metavar="NAME=FACTOR",
        help="in place of --weights and --factor: a region and its factor; repeated, all shares are exact together",
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
    command.add_argument(
        "--max-shear",
        type=shear,
        default=DEFAULT_MAGNIFIED_SHEAR,
        metavar="S",
        help="where the mesh is unwrapped, add seams until islands shear less than S > 1 in the mean; 0: none",
    )
    command.add_argument("--cascade", type=times, default=1, metavar="K", help="magnify K times in a row")
    command.add_argument("--quality", choices=names(QUALITIES), default=DEFAULT_QUALITY.lower(), help="see unwrap")
    command.add_argument(
        "--margin", type=margin, default=DEFAULT_MARGIN, metavar="PX", help="least distance of islands"
    )
    command.add_argument("--texture-size", type=texture_size, default=DEFAULT_TEXTURE_SIZE, metavar="PX")
    add_subdivision(command)
    command.add_argument("--uv-layer", default="", metavar="NAME", help="UV map to use; default: the active one")
    _add_pictures(command)
    add_report(command, "island")


def _add_pictures(command: argparse.ArgumentParser) -> None:
    """Options of pictures that follow the UVs."""
    command.add_argument("--image", type=Path, metavar="FILE", help="picture of the old UVs that shall follow them")
    command.add_argument(
        "--image-output",
        type=Path,
        metavar="FILE",
        help="picture of the new UVs, .png .exr .tif .jpg",
    )
    command.add_argument(
        "--detail",
        action="append",
        default=[],
        metavar="FILE:U0,V0,U1,V1",
        help="picture of higher resolution of a box of the old UVs, laid over --image where it is magnified; repeated",
    )
    command.add_argument(
        "--image-size", type=texture_size, default=0, metavar="PX", help="width of --image-output; default: of --image"
    )


def times(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number of times")
    return value


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ..pipelines.magnify import magnify
    from ..pipelines.regions.several import magnify_several

    named, picture = _named(options), _picture(options)
    settings = MagnifySettings(
        boundary=options.boundary,
        quality=options.quality,
        margin=options.margin,
        texture_size=options.texture_size,
        factor=options.factor,
        exact=options.exact,
        source=options.source,
        cascade=options.cascade,
        max_shear=options.max_shear,
    )
    objects, readings = read_layers(options, existing=options.source == "uv")
    with refusals(objects):
        readings = chosen_subdivision(options, readings)
        several, told = _regions(named, list(zip(objects, readings, strict=True)))
        regions = several[0].parts
        steps = magnify_several(several, settings) if options.region else magnify(regions, settings)
        result = drain_shown(steps)
        result = replace(result, warnings=[*told, *result.warnings])
        written = write_layers(options, zip(objects, readings, strict=True), result, existed=options.source == "uv")
    if picture is not None:
        _write_picture(options, _warped(options, picture, regions, result))
    print(result.shares.text())
    if options.report:
        more = {"weights": options.weights, "factor": options.factor, "exact": options.exact, "source": options.source}
        more |= {"regions": dict(named)} if options.region else {}
        shares = {"share": result.shares.report()}
        write_report(options, {**more, "cascade": options.cascade, **shares}, objects, result.reports, written)


def _named(options: argparse.Namespace) -> list[tuple[str, float]]:
    """Names of regions and their factors."""
    from ..pipelines.regions.several import region_factors

    if bool(options.weights) == bool(options.region):
        raise CommandError("Give either --weights NAME and --factor, or --region NAME=FACTOR once or more often.")
    try:
        return region_factors(options.region) or [(options.weights, options.factor)]
    except ValueError as error:
        raise CommandError(f"--region: {error}.") from error


def _regions(named: list[tuple[str, float]], pairs: list) -> tuple[list, list[tuple[int, str]]]:
    """The regions with what of them is on each object, and warnings."""
    from ..blender.weights import named_weights
    from ..pipelines.magnify import Region
    from ..pipelines.regions.several import NamedRegion

    found, told = [], []
    for name, factor in named:
        weights, texts = named_weights(pairs, name)
        told += texts
        parts = [
            Region(r.surface, r.faces, w.values, r.all_pins, w.kind, r.axes, r.subdivision, r.was_split)
            for (_, r), w in zip(pairs, weights, strict=True)
        ]
        found.append(NamedRegion(name, factor, tuple(parts)))
    return found, told


def _picture(options: argparse.Namespace):
    """Pixels (h,w,4) of the picture that shall follow, whether its alpha is straight, and insets; or None."""
    if options.image is None and options.image_output is None:
        if options.detail or options.image_size:
            raise CommandError("--detail and --image-size go with --image and --image-output. Give all of them.")
        return None
    if options.image is None or options.image_output is None:
        raise CommandError("A picture needs both --image and --image-output.")
    if options.source != "uv":
        raise CommandError("A picture can only follow UVs that exist. Use --source uv.")
    from ..files import images
    from ..solver.counts import check_pixels

    try:
        images.check_target(options.image_output)
        image = images.load(options.image)
        pixels, insets = images.pixels_of(image), _insets(options)
        with refusals():
            check_pixels(*_size(options, pixels))
        return pixels, images.has_straight_alpha(image), insets
    except images.ImageError as error:
        raise CommandError(str(error)) from error


def _insets(options: argparse.Namespace) -> list:
    """Pictures that are laid over boxes of the old UVs."""
    from ..files import images
    from ..pipelines.regions.detail import parsed_inset
    from ..solver.editing.inset_images import InsetImage

    found = []
    for text in options.detail:
        try:
            name, low, high = parsed_inset(text)
        except ValueError as error:
            raise CommandError(f"--detail: {error}.") from error
        found.append(InsetImage(images.pixels_of(images.load(Path(name))), low, high))
    return found


def _warped(options: argparse.Namespace, picture, regions, result):
    """The picture of the new UVs."""
    from ..pipelines.magnify import warped_picture
    from ..pipelines.regions.detail import detailed_picture

    pixels, straight, insets = picture
    if not insets and not options.image_size:
        return warped_picture(pixels, regions, result, options.margin, straight)
    return detailed_picture(pixels, regions, result, insets, _size(options, pixels), options.margin)


def _size(options: argparse.Namespace, pixels) -> tuple[int, int]:
    """Rows and columns of the picture of the new UVs."""
    height, width = pixels.shape[:2]
    wide = options.image_size or width
    return max(1, round(height * wide / width)), wide


def _write_picture(options: argparse.Namespace, picture) -> None:
    from ..files import images

    try:
        # Reading the mesh has closed the file that the image was in.
        images.save(options.image_output, picture, images.load(options.image))
    except images.ImageError as error:
        raise CommandError(str(error)) from error
