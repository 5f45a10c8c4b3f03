"""What scripts that repeat papers share: models, tables, and pictures side by side."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "papers"
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support")]


def models(names: Sequence[str]) -> list[str]:
    """Those of the models that are there; ends where none is."""
    import meshes

    os.environ.setdefault("OMT_UV_MODELS", str(ROOT.parent / "shared" / "models"))
    found = [name for name in names if meshes.model_path(name)]
    if not found:
        sys.exit(f"OMT_UV_MODELS names no folder with any of {', '.join(names)}")
    return found


def table(rows: Sequence[dict]) -> str:
    """Rows of equal keys as a table in Markdown."""
    keys = list(rows[0])
    lines = [" | ".join(keys), " | ".join("---" for _ in keys)]
    lines += [" | ".join(_cell(row[key]) for key in keys) for row in rows]
    return "\n".join(f"| {line} |" for line in lines)


def _cell(value) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def told(folder: Path, name: str, rows: Sequence[dict]) -> None:
    """Print a table, and write it."""
    text = table(rows)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.md").write_text(text + "\n")
    print(f"\n{name}\n{text}", flush=True)


def saved(path: Path, pictures: Sequence[np.ndarray], height: int, colours: int = 128) -> None:
    """Write pictures (h,w,3) in [0,1], top row first, side by side, so many pixels high, in so many colours, or 0."""
    images = [Image.fromarray(np.rint(255 * np.clip(p, 0, 1)).astype(np.uint8)) for p in pictures]
    images = [i.resize((round(i.width * height / i.height), height), Image.Resampling.LANCZOS) for i in images]
    gap = height // 40
    whole = Image.new("RGB", (sum(i.width for i in images) + gap * (len(images) - 1), height), "white")
    left = 0
    for image in images:
        whole.paste(image, (left, 0))
        left += image.width + gap
    path.parent.mkdir(parents=True, exist_ok=True)
    # The palette is that of most pixels: a few dots would lose their colours.
    (whole.quantize(colours) if colours else whole).save(path, optimize=True)
