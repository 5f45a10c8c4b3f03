"""Keep the screenshots of the last `make gui` for the documentation, in 256 colours.

usage: keep.py [--from build/gui/sid] [--to docs/pictures/ui]
"""

from __future__ import annotations

import argparse
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
KEPT = {
    "tour": ("tab", "unwrapped", "area", "shear", "histogram", "checker", "outdated", "redo"),
    "escape": ("progress",),
    "sections": ("magnify", "sphere", "remesh"),
    "shapes": ("partition", "distance", "match", "arrange", "flow"),
    "uv_editor": ("uv_unwrapped", "live", "uv_area", "uv_shear"),
}


def main() -> None:
    """Copy the pictures that the documentation shows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--from", dest="source", type=Path, default=ROOT / "build" / "gui" / "sid")
    parser.add_argument("--to", dest="target", type=Path, default=ROOT / "docs" / "pictures" / "ui")
    args = parser.parse_args()
    args.target.mkdir(parents=True, exist_ok=True)
    for story, names in KEPT.items():
        for name in names:
            if not (args.source / story / f"{name}.png").exists():
                print(f"{story}/{name}.png is missing: the picture of before stays")
                continue
            path = args.target / f"{name}.png"
            Image.open(args.source / story / f"{name}.png").convert("RGB").quantize(
                256, method=Image.Quantize.MAXCOVERAGE, kmeans=2
            ).save(path, optimize=True)
            print(f"{path} {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
