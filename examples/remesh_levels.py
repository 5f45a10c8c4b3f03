"""Make a series of meshes of one surface, each with half the vertices of the one before."""

from __future__ import annotations

import numpy as np
from surfaces import pear

from omt_uv import solver as omt


def main() -> None:
    vertices, faces = pear()
    for count in (400, 200, 100):
        mesh = omt.remesh(vertices, faces, count)
        sides = mesh.vertices[mesh.triangles] - mesh.vertices[np.roll(mesh.triangles, -1, axis=1)]
        length = np.linalg.norm(sides, axis=2)
        print(f"{len(mesh.vertices)} vertices: edges vary by {100 * length.std() / length.mean():.1f} %, {mesh.status}")

        # Anything that lives on the old vertices follows by where the new ones lie.
        height = (mesh.barycentric * vertices[faces[mesh.faces], 2]).sum(axis=1)
        print(f"  the height of the old surface goes from {height.min():.2f} to {height.max():.2f}")


if __name__ == "__main__":
    main()
