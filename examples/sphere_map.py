"""Map a closed surface to the sphere so that every face has its share of it."""

from __future__ import annotations

import numpy as np
from surfaces import pear

from omt_uv import solver as omt


def main() -> None:
    vertices, faces = pear()
    found = omt.sphere_map(vertices, faces)
    a, b, c = found.positions[faces].transpose(1, 0, 2)
    # Solid angle of a triangle (van Oosterom, Strackee 1983).
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    angle = 2 * np.arctan2(volume, 1 + (a * b).sum(1) + (b * c).sum(1) + (c * a).sum(1))
    p, q, r = vertices[faces].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(q - p, r - p), axis=1)
    error = np.abs(angle / angle.sum() - area / area.sum()).sum()
    print(f"{found.status}: the whole sphere is {angle.sum() / np.pi:.3f} pi, the area error {error:.4f}")


if __name__ == "__main__":
    main()
