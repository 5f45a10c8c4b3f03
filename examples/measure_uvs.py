"""Measure UVs that came from elsewhere, refine them, and measure again."""

from __future__ import annotations

from surfaces import hill

from omt_uv import solver as omt


def main() -> None:
    vertices, faces = hill()
    # Seen from above: the sides of the hill get too little.
    uv = vertices[faces][:, :, :2]
    refined = omt.refine(vertices, faces, uv)
    for name, figures in (("from above", omt.distortion(vertices, faces, uv)), ("refined", refined.figures)):
        print(
            f"{name}: area error {figures.area_l1:.4f}, 99 % within {figures.area_p99:.2f} octaves, "
            f"shear {figures.angle_mean:.3f}, {figures.folds} folds, overlap {figures.overlap:.6f}"
        )


if __name__ == "__main__":
    main()
