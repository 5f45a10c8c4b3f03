"""Match the mesh of a file with that of another, and carry over what is asked: the command match."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ... import __version__
from ...pipelines.shapes.choices import DEFAULT_PREFIX, DEFAULT_TRANSFERS, MATCH_DOMAINS, TRANSFERS
from ...solver.errors import reaching
from ..common import CommandError, UsageError, check_paths, drain_shown, refusals, require_blender, warn
from ..options import FORMATS, add_input, names, number, share
from ..selection import of_file, read_file

KEY = "OMT Match"


def add(commands) -> None:
    command = commands.add_parser("match", help="one surface onto another: UVs, weights, shape keys, or a wrap")
    command.set_defaults(run=run)
    add_input(command)
    command.add_argument("target", type=Path, metavar="DST", help="what IN is matched with")
    command.add_argument("-o", "--output", type=Path, metavar="OUT", required=True, help=FORMATS)
    command.add_argument(
        "--landmarks",
        default=DEFAULT_PREFIX,
        metavar="PREFIX|P.json",
        help=f"vertex groups and empties that begin so, default {DEFAULT_PREFIX}; or a file of pairs",
    )
    what = command.add_mutually_exclusive_group()
    what.add_argument(
        "--transfer",
        type=kinds_of,
        default=tuple(name.lower() for name in DEFAULT_TRANSFERS),
        metavar="LIST",
        help=f"what DST gets: {','.join(names(TRANSFERS))}",
    )
    what.add_argument("--wrap", action="store_true", help="write IN in the shape of DST instead")
    command.add_argument("--domain", choices=names(MATCH_DOMAINS), default="auto", help="where both are compared")
    command.add_argument("--balance", type=share, default=0.5, metavar="T", help="of the maps there, default 0.5")
    command.add_argument("--mirrored", action="store_true", help="match the mirror image of IN")
    command.add_argument("--features", type=_weight, default=0.05, metavar="W", help="how much bumps shall meet")
    command.add_argument("--report", type=Path, metavar="R.json", help="write figures of the match")


def kinds_of(text: str) -> tuple[str, ...]:
    """Words of a list with commas, each one that can be transferred."""
    known, words = names(TRANSFERS), tuple(word.strip() for word in text.split(",") if word.strip())
    wrong = [word for word in words if word not in known]
    if wrong or not words:
        raise argparse.ArgumentTypeError(f"{', '.join(wrong) or 'nothing'} is none of {', '.join(known)}")
    return words


def _weight(text: str) -> float:
    value = number(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is less than 0")
    return value


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ...blender.mesh import check_local
    from ...files.saving import save
    from ...files.verified import same_file

    check_paths(options)
    if options.wrap and options.output.suffix.lower() == ".stl":
        raise UsageError(f"{options.output}: the shapes of an .stl have no vertices in common. Write another format.")
    if same_file(options.input, options.target):
        raise UsageError(f"{options.input}: both files are one. Give two.")
    # What is written last is read last: opening a file closes the one before.
    first = _read(options, options.target if options.wrap else options.input)
    path = options.input if options.wrap else options.target
    second = _read(options, path)
    source, target = (second, first) if options.wrap else (first, second)
    result, attributes, told = _match(options, source, target)
    if options.wrap:
        check_local(second[0])
        _shaped(second[0], result, options.output)
    else:
        from ...blender.shapes.match_objects import check_room, write_onto

        kinds = set(options.transfer)
        _append_materials(options.input, source[1].materials)
        with refusals(name=second[0].name):
            check_room(second[0], source[1].attributes, kinds)
        carried, across = attributes
        write_onto(second[0], source[1], carried, kinds, _prefix(options))
        told += [reaching(across)] if across else []
    told = warn([], [(-1, text) for text in told], save(options.output, [second[0]], path))
    if options.report is not None:
        _report(options, result, told)


def _read(options: argparse.Namespace, path: Path):
    """The one object of a file, what it carries, its landmarks and its name; the object lives until the next file."""
    from ...blender.shapes.landmarks import read_landmarks
    from ...blender.shapes.match_objects import read_carrier, stretched_offsets

    pairs = read_file(of_file(options, path))
    if len(pairs) > 1:
        every = ", ".join(obj.name for obj, _ in pairs)
        raise CommandError(f"{path}: it has several meshes: {every}. Join them, or name one of IN by --object.")
    obj = pairs[0][0]
    with refusals(name=obj.name):
        carried = stretched_offsets(read_carrier(obj))
    prefix = _prefix(options)
    return obj, carried, read_landmarks(obj, prefix) if prefix else [], obj.name


def _prefix(options: argparse.Namespace) -> str:
    """How the names of landmarks begin, empty where they stand in a file."""
    return "" if options.landmarks.endswith(".json") else options.landmarks


def _match(options: argparse.Namespace, source, target):
    """The match, what the target gets (or None), and warnings."""
    from ...blender.shapes.match_objects import match_job
    from ...pipelines.shapes.landmark_pairs import pairs_of, read_pairs
    from ...pipelines.shapes.match import match_surfaces
    from ...pipelines.shapes.onto import transferred
    from ...pipelines.shapes.wrap import wrap_surfaces
    from ...solver.registration.results import RegistrationOptions

    if options.landmarks.endswith(".json"):
        pairs = read_pairs(Path(options.landmarks))
    else:
        pairs = pairs_of(source[2], target[2], (source[3], target[3]))
    settings = RegistrationOptions(
        domain=options.domain,
        balance=options.balance,
        mirrored=options.mirrored,
        features=options.features,
        strict=options.strict,
    )
    job = match_job(source[1], target[1], pairs, settings)
    with refusals(name=f"{source[3]}, {target[3]}"):
        result = drain_shown((wrap_surfaces if options.wrap else match_surfaces)(job))
        attributes = None if options.wrap else transferred(job, result, source[1].attributes)
    told = [f"{name}: {text}" for _, carried, _, name in (source, target) for text in carried.warnings]
    told += result.warnings
    return result, attributes, told


def _shaped(obj, result, output: Path) -> None:
    """The source in the shape of the target: a shape key where the format has them, its positions otherwise."""
    import numpy as np

    from ...blender.mesh import stretch

    positions = np.linalg.solve(stretch(obj), result.wrapped.T).T.astype(np.float32).ravel()
    if output.suffix.lower() in (".blend", ".glb", ".gltf", ".fbx"):
        if obj.data.shape_keys is None:
            obj.shape_key_add(name="Basis", from_mix=False)
        block = obj.shape_key_add(name=KEY, from_mix=False)
        block.data.foreach_set("co", positions)
        block.value = 1.0
    else:
        obj.data.vertices.foreach_set("co", positions)
    obj.data.update()


def _append_materials(path: Path, materials: tuple[str, ...]) -> None:
    """Bring materials of a .blend into the open file; of other formats their names are all there is."""
    import bpy

    if path.suffix.lower() != ".blend":
        return
    with bpy.data.libraries.load(str(path), link=False) as (there, data):
        missing = [name for name in dict.fromkeys(materials) if name and name not in bpy.data.materials]
        data.materials = [name for name in missing if name in there.materials]


def _report(options: argparse.Namespace, result, told: list[str]) -> None:
    from ...files.verified import write_text

    report = {
        "version": __version__,
        "input": str(options.input),
        "target": str(options.target),
        "output": str(options.output),
        **result.report(),
        "warnings": [*options.told, *told],
    }
    write_text(options.report, json.dumps(report, indent=1) + "\n")
