"""Divide meshes into cells of equal area, or of equal painted density: the command partition."""

from __future__ import annotations

import argparse

from ...settings import CELL_WRITES, DEFAULT_CELL_WRITE, DEFAULT_RELAX, PartitionSettings
from ..common import check_paths, drain_shown, refusals, require_blender, warn, write_figures, write_preview
from ..options import add_files, add_report, names, vertices
from ..selection import read_file
from .formats import check_kept

EQUAL = "equal"
NEW_OBJECTS = ("mesh", "points")


def add(commands) -> None:
    command = commands.add_parser("partition", help="divide meshes into cells of exactly equal area")
    command.set_defaults(run=run)
    add_files(command)
    command.add_argument("--cells", type=vertices, metavar="N", required=True, help="how many cells each mesh gets")
    command.add_argument(
        "--capacity",
        default=EQUAL,
        metavar="equal|GROUP",
        help="cells of equal area, or of an equal integral of a vertex group's weights",
    )
    command.add_argument(
        "--relax", type=rounds, default=DEFAULT_RELAX, metavar="K", help="how often sites move to the means of cells"
    )
    command.add_argument(
        "--write", choices=names(CELL_WRITES), default=DEFAULT_CELL_WRITE.lower(), help="what the cells become"
    )
    command.add_argument("--seed", type=rounds, default=0, metavar="S", help="other sites to begin with")
    add_report(command, "mesh")


def rounds(text: str) -> int:
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 0")
    return value


def of_cells(options: argparse.Namespace) -> PartitionSettings:
    """The settings that the options of the command ask for."""
    return PartitionSettings(options.cells, options.relax, options.write, options.seed)


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ...blender.mesh import check_local, check_stretch
    from ...blender.shapes.cell_faces import check_cells
    from ...blender.vertex_groups import avoided
    from ...pipelines.shapes.partition import partition_surface

    check_kept(options.output, options.write)
    check_paths(options)
    pairs = read_file(options)
    objects = [obj for obj, _ in pairs]
    for obj in objects:
        check_local(obj)
        check_cells(obj, options.write)
        if options.write in NEW_OBJECTS:
            with refusals(name=obj.name):
                check_stretch(obj)
    weights = avoided(objects, "" if options.capacity == EQUAL else options.capacity)
    found = []
    for (obj, reading), mine in zip(pairs, weights, strict=True):
        with refusals(name=obj.name):
            found.append(drain_shown(partition_surface(reading.surface, reading.faces, mine, of_cells(options))))
    made = _write(options, pairs, found)
    told = [(k, text) for k, partition in enumerate(found) for text in partition.warnings]
    warnings = warn(objects, told, _save(options, made))
    _show(options, pairs, made, found)
    for obj, partition in zip(objects, found, strict=True):
        figures = partition.figures
        print(f"{obj.name}: {figures['cells']} cells, largest error of an area {figures['error']:.1e}")
    if options.report:
        _write_report(options, objects, found, warnings)


def _write(options: argparse.Namespace, pairs: list, found: list) -> list:
    """Write the cells into the objects, or make new ones; the objects to save."""
    from ...blender.shapes.cell_faces import write_cells
    from ...blender.shapes.cell_objects import new_cell_mesh, new_points, read_carried

    made = []
    for (obj, reading), partition in zip(pairs, found, strict=True):
        if options.write == "mesh":
            with refusals(name=obj.name):
                carried = read_carried(obj)
            made.append(new_cell_mesh(obj, reading.surface, reading.faces, partition, carried))
        elif options.write == "points":
            made.append(new_points(obj, partition))
        else:
            write_cells(obj, partition, options.write)
            made.append(obj)
    return made


def _show(options: argparse.Namespace, pairs: list, made: list, found: list) -> None:
    """Draw the meshes that were made, as whoever measures the file does; else the cells on what they are of."""
    from ...blender.mesh import read

    if options.write == "mesh":
        write_preview(options, [(obj, read(obj)) for obj in made])
    else:
        write_preview(options, pairs, [partition.cell for partition in found])


def _save(options: argparse.Namespace, made: list) -> list[str]:
    from ...files.saving import save

    return save(options.output, made, options.input)


def _write_report(options: argparse.Namespace, objects: list, found: list, warnings: list[str]) -> None:
    figures = {
        "capacity": options.capacity,
        "relax": options.relax,
        "write": options.write,
        "meshes": [{"object": obj.name, **p.figures} for obj, p in zip(objects, found, strict=True)],
    }
    write_figures(options, figures, warnings)
