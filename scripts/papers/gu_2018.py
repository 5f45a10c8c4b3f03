"""B. Gu 2018, figures 8, 9 and 12: errors of remeshed heads over their numbers of faces, and the time of 70,000.

usage: gu_2018.py [--count 16] [--vertices 4000] [--levels 4] [--jobs 2]      writes build/papers/gu_2018
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from heads import write_heads

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build" / "papers" / "gu_2018"
# Faces that B. Gu remeshed.
ALL = 70_000
ERRORS = {
    "hausdorff": "Hausdorff",
    "rms": "rms",
    "gaussian_error": "Gaussian curvature",
    "mean_error": "mean curvature",
}


def batch(options) -> Path:
    """Remesh the heads in a batch, which goes on where it was; the path of its manifest."""
    heads, out = FOLDER / "heads", FOLDER / "out"
    write_heads(heads, options.count)
    words = ["batch", "remesh", str(heads), "-o", str(out), "--jobs", str(options.jobs), "--"]
    words += ["--vertices", str(options.vertices), "--levels", str(options.levels)]
    status = subprocess.run([sys.executable, "-m", "omt_uv", *words], cwd=ROOT).returncode
    if status not in (0, 7):
        sys.exit(status)
    return out.with_name("out.manifest.sqlite")


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
    from omt_uv.batch.manifest import rows_of
    from omt_uv.display.canvas import save
    from omt_uv.display.plots import plot

    rows = rows_of([batch(options)])
    levels = levels_of(rows)
    save(FOLDER / "errors.png", plot(medians(levels), f"{options.count} heads, medians"))
    clouds = {name: [(level["faces"], level[key]) for level in levels] for key, name in ERRORS.items()}
    save(FOLDER / "cloud.png", plot(clouds, f"{options.count} heads", cloud=True))
    tell(rows, levels, options.jobs)
    print(f"plots: {FOLDER / 'errors.png'}, {FOLDER / 'cloud.png'}")


if __name__ == "__main__":
    main()
