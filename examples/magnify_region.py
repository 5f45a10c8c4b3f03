"""Give a painted region of existing UVs four times its share of the texture."""

from __future__ import annotations

import numpy as np
from surfaces import hill

from omt_uv import solver as omt


def main() -> None:
    vertices, faces = hill()
    uv = omt.unwrap(vertices, faces, boundary="square").uv

    # 1 on the top of the hill, 0 at its foot, and a smooth step between them.
    weights = np.clip(3 * vertices[:, 2] - 1, 0, 1)
    result = omt.magnify(vertices, faces, uv, weights, factor=4)
    print(
        f"share of the region: {result.share_before:.4f}, asked {result.share_asked:.4f}, now {result.share_after:.4f}"
    )
    print(f"{result.figures.folds} folds, overlap {result.figures.overlap:.6f}")


if __name__ == "__main__":
    main()
