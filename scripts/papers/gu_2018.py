"""B. Gu 2018, figures 8, 9 and 12: errors of remeshed heads over their numbers of faces, and the time of 70,000.

usage: gu_2018.py [--count 16] [--vertices 4000] [--levels 4] [--jobs 2]      writes build/papers/gu_2018
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from common import BUILD, ROOT
from heads import write_heads

FOLDER = BUILD / "gu_2018"
MODELS = ("max_planck.obj", "lion.off", "bunny.obj")
# Faces that B. Gu remeshed.
ALL = 70_000
ERRORS = {
    "hausdorff": "Hausdorff",
    "rms": "rms",
    "gaussian_error": "Gaussian curvature",
    "mean_error": "mean curvature",
}


def batch(source: Path, name: str, options) -> list[dict]:
    """Remesh a folder or a list of meshes in a batch, which goes on where it was; rows of its manifest."""
    from omt_uv.batch.manifest import rows_of

    out = FOLDER / name
    words = ["batch", "remesh", str(source), "-o", str(out), "--jobs", str(options.jobs), "--"]
    words += ["--vertices", str(options.vertices), "--levels", str(options.levels)]
    status = subprocess.run([sys.executable, "-m", "omt_uv", *words], cwd=ROOT).returncode
    if status not in (0, 7):
        sys.exit(status)
    return rows_of([out.with_name(f"{name}.manifest.sqlite")])


def models(options) -> None:
    """Remesh public models, as far as they are there, and draw the errors of each."""
    from omt_uv.display.canvas import save
    from omt_uv.display.plots import plot, slope

    folder = Path(os.environ.get("OMT_UV_MODELS", ROOT.parent / "shared" / "models"))
    paths = [path for path in (folder / name for name in MODELS) if path.is_file()]
    if not paths:
        print(f"{folder}: none of {', '.join(MODELS)} is there; heads alone")
        return
    (FOLDER / "models.txt").write_text("\n".join(map(str, paths)) + "\n")
    rows = batch(FOLDER / "models.txt", "models", options)
    levels = {row["name"]: levels_of([row]) for row in rows if row["report"]}
    for key, title in ERRORS.items():
        curves = {name: [(level["faces"], level[key]) for level in found] for name, found in levels.items()}
        save(FOLDER / f"models_{key}.png", plot(curves, title))
        print(f"{title:20}" + "   ".join(f"{name} {slope(curve):+.2f}" for name, curve in curves.items()))


def levels_of(rows: list[dict]) -> list[dict]:
    """Figures of every level of every head."""
    return [level for row in rows if row["report"] for level in json.loads(row["report"])["levels"]]


def medians(levels: list[dict]) -> dict[str, list[tuple[float, float]]]:
    """The median over heads of each error, by the number of faces."""
    faces = {level["level"]: level["faces"] for level in levels}
    return {
        name: [(faces[k], float(np.median([r[key] for r in levels if r["level"] == k]))) for k in sorted(faces)]
        for key, name in ERRORS.items()
    }


def tell(rows: list[dict], levels: list[dict], jobs: int) -> None:
    """Print errors, their exponents, and the time that all would take."""
    from omt_uv.display.plots import slope

    curves = medians(levels)
    print(f"\n{'':20}" + "".join(f"{faces:>10.0f}" for faces, _ in next(iter(curves.values()))) + "  exponent")
    for name, curve in curves.items():
        print(f"{name:20}" + "".join(f"{value:>10.5f}" for _, value in curve) + f"{slope(curve):>10.2f}")
    kept = sum(level["topology_kept"] for level in levels)
    least = min(level["angle_min"] for level in levels)
    print(f"topology kept in {kept} of {len(levels)}; least angle {least:.1f} degrees")
    done = [row for row in rows if row["state"] == "done"]
    seconds = np.array([row["processor"] for row in done])
    error = seconds.std() / max(len(seconds) - 1, 1) ** 0.5 / seconds.mean()
    days = ALL * seconds.mean() / 86400
    print(
        f"{len(done)} of {len(rows)} heads, {seconds.mean():.1f} s of a processor each (+-{100 * error:.0f} %): "
        f"{ALL} take {days:.1f} days of one core, {days / jobs:.1f} of {jobs}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=16)
    parser.add_argument("--vertices", type=int, default=4000)
    parser.add_argument("--levels", type=int, default=4)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    from omt_uv.display.canvas import save
    from omt_uv.display.plots import plot

    write_heads(FOLDER / "heads", options.count)
    rows = batch(FOLDER / "heads", "out", options)
    levels = levels_of(rows)
    save(FOLDER / "errors.png", plot(medians(levels), f"{options.count} heads, medians"))
    clouds = {name: [(level["faces"], level[key]) for level in levels] for key, name in ERRORS.items()}
    save(FOLDER / "cloud.png", plot(clouds, f"{options.count} heads", cloud=True))
    tell(rows, levels, options.jobs)
    models(options)
    print(f"plots: {FOLDER / 'errors.png'}, {FOLDER / 'cloud.png'}")


if __name__ == "__main__":
    main()
