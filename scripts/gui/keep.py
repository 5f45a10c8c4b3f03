"""Keep the screenshots of the last `make gui` for the documentation, in 256 colours.

usage: keep.py [--from build/gui/sid] [--to docs/pictures/ui]
"""

from __future__ import annotations

import argparse
from pathlib import Path

from PIL import Image, ImageChops

ROOT = Path(__file__).resolve().parents[2]
# Width of the column of tabs, and a difference that is seen.
TABS = 34
VISIBLE = 24
# Pictures whose names say too little outside of their story.
NAMED = {
    "file": "from_disk",
    "search_area_preserving": "search",
    "object_mode": "live_object_mode",
    "one_pin": "live_pin",
}
KEPT = {
    "tour": ("tab", "unwrapped", "area", "shear", "histogram", "checker", "outdated", "redo"),
    "escape": ("progress", "keep"),
    "sections": ("magnify", "sphere", "remesh"),
    "shapes": ("distance",),
    "install": ("drop", "first_minute"),
    "disk": ("file",),
    "menus": ("search_area_preserving", "preferences"),
    "live": ("object_mode",),
    "pins": ("one_pin",),
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
            save(Image.open(args.source / story / f"{name}.png"), args.target / f"{NAMED.get(name, name)}.png")
    for dark in sorted((args.source / "panels").glob("*_dark.png")):
        name = dark.stem.removesuffix("_dark")
        save(side_by_side(dark, dark.with_name(f"{name}_light.png")), args.target / f"section_{name}.png")


def side_by_side(dark: Path, light: Path) -> Image.Image:
    """A section in both themes, without the empty part below it."""
    both = [Image.open(path).convert("RGB") for path in (dark, light)]
    width, height = both[0].size
    # The last row of pixels is of the empty part; nothing is written at the very left.
    empty = Image.new("RGB", both[0].size, both[0].getpixel((width // 2, height - 3)))
    box = ImageChops.difference(both[0].crop((0, 0, width - TABS, height)), empty.crop((0, 0, width - TABS, height)))
    bottom = min((box.convert("L").point(lambda x: 255 * (x > VISIBLE)).getbbox() or (0, 0, 0, height))[3] + 4, height)
    picture = Image.new("RGB", (2 * width, bottom))
    for k, part in enumerate(both):
        picture.paste(part.crop((0, 0, width, bottom)), (k * width, 0))
    return picture


def save(picture: Image.Image, path: Path) -> None:
    """With few colours, which is what an interface has."""
    few = picture.convert("RGB").quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=2)
    few.save(path, optimize=True)
    print(f"{path} {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
