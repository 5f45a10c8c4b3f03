"""Unwrap a surface, watch it go, and read what the map is worth."""

from __future__ import annotations

from surfaces import hill

from omt_uv import solver as omt


def main() -> None:
    vertices, faces = hill()
    result = omt.unwrap(vertices, faces, progress=show)
    figures = result.figures
    print(f"area error {figures.area_l1:.4f}, shear {figures.angle_mean:.3f}, {figures.folds} folds")
    print(f"UVs {result.uv.shape}, one for every corner of every face")

    # Less shear, at the price of areas; and a map that fills a disk.
    for options in ({"balance": 0.5}, {"boundary": "disk"}, {"quality": "exact"}):
        figures = omt.unwrap(vertices, faces, **options).figures
        print(f"{options}: area error {figures.area_l1:.4f}, shear {figures.angle_mean:.3f}")


def show(progress: omt.Progress) -> None:
    """Print where each stage begins and ends."""
    if progress.fraction in (0.0, 1.0):
        print(f"{progress.stage}: {100 * progress.fraction:.0f} %")


if __name__ == "__main__":
    main()
