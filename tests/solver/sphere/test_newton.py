"""Newton on the sphere: faces in tangent planes, slopes that are derivatives."""

from __future__ import annotations

import numpy as np
from sphere_shapes import blob

from omt_uv.solver.maps.energy import derivatives_of, elements
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import normalized
from omt_uv.solver.refinement.projected_newton import Assembly
from omt_uv.solver.sphere.newton import SphereProblem, derivatives, newton_direction, project_faces, retract, tangents


def test_the_slope_is_the_derivative():
    V, F = blob(1)
    target = face_areas(V, F)
    target *= 4 * np.pi / target.sum()
    faces = elements(V, F, target)
    problem = SphereProblem(faces, target, faces.ratio, Assembly(F, len(V)), 3.0)
    p = normalized(V)
    axes, face = tangents(p), project_faces(p, F)
    local = derivatives_of(faces, *derivatives(faces, face.corner), 3.0, 1.0)
    direction, slope = newton_direction(faces, problem.assembly, p, axes, face, local)
    before, after = (problem.energy(retract(p, axes, s * direction)) for s in (-1e-6, 1e-6))
    np.testing.assert_allclose((after - before) / 2e-6, slope, rtol=1e-5)
