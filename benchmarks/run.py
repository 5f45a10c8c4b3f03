"""Run parts of the benchmarks and write their tables as TSV files.

All times are seconds of processor time, medians where a part takes --runs, but for profile and latency (wall clock).
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.part import Option, Part
from benchmarks.parts import (
    alike,
    bodies,
    cage,
    cascade,
    clicks,
    cuts,
    hard,
    invariance,
    latency,
    level,
    magnify,
    match,
    memory,
    pace,
    packing,
    partition,
    polygons,
    profile,
    remesh,
    saliency,
    speed,
    sphere,
    transport,
    unwrap,
)

MODULES = (
    transport,
    unwrap,
    profile,
    memory,
    speed,
    magnify,
    cascade,
    saliency,
    latency,
    sphere,
    remesh,
    cuts,
    clicks,
    level,
    hard,
    invariance,
    match,
    partition,
    polygons,
    cage,
    alike,
    bodies,
    packing,
    pace,
)
PARTS: dict[str, Part] = {part.name: part for module in MODULES for part in module.PARTS}
OPTIONS: dict[str, Option] = {option.name: option for part in PARTS.values() for option in part.options}


def make_parser() -> argparse.ArgumentParser:
    """The parser, with the options of all parts; what was not given is None."""
    width = max(map(len, PARTS))
    listed = "\n".join(f"{name:{width}}  {part.description}" for name, part in PARTS.items())
    parser = argparse.ArgumentParser(
        description=f"{__doc__}\nParts:\n{listed}", formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help="default all but those that say otherwise")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "benchmarks", help="folder for the TSV files")
    for option in OPTIONS.values():
        takers = ", ".join(part.name for part in PARTS.values() if option in part.options)
        parser.add_argument(f"--{option.name}", help=f"{option.help} ({takers})", **option.keywords)
    return parser


def parse(words=None) -> tuple[argparse.Namespace, list[Part]]:
    """The options, each with its default where it was not given, and the parts to run."""
    parser = make_parser()
    args = parser.parse_args(words)
    if unknown := sorted(set(args.parts) - set(PARTS)):
        parser.error(f"unknown part {', '.join(unknown)}: there are {', '.join(PARTS)}")
    parts = [PARTS[name] for name in args.parts] or [part for part in PARTS.values() if part.by_default]
    for name, option in OPTIONS.items():
        if getattr(args, name) is None:
            setattr(args, name, option.default)
        elif not any(option in part.options for part in parts):
            parser.error(f"--{name}: {', '.join(part.name for part in parts)} cannot take it")
    return args, parts


def describe_machine() -> str:
    """Versions and cores, without which no figure means anything."""
    import bpy

    import numpy as np
    import scipy

    return (
        f"Blender {bpy.app.version_string}, Python {platform.python_version()}, numpy {np.__version__}, "
        f"scipy {scipy.__version__}, {os.cpu_count()} cores, {platform.system()}; medians of processor seconds"
    )


def main() -> None:
    """Run the parts that were named, one after the other."""
    args, parts = parse()
    print(describe_machine())
    for part in parts:
        part.table(args).write(args.out / f"{part.name}.tsv")


if __name__ == "__main__":
    main()
