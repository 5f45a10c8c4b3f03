"""The scripts that make meshes to try batches on: sizes, what is broken, and heads that are disks."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from omt_uv.solver.comparison.triangle_shapes import topology_of
from omt_uv.solver.mesh.geometry import face_areas

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"


def script(path):
    spec = importlib.util.spec_from_file_location(Path(path).stem, SCRIPTS / path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_sizes_fall_by_a_power_law_and_three_of_a_hundred_are_broken(tmp_path):
    module = script("farm/make_meshes.py")
    faces = module.write_meshes(tmp_path, count=100, most=300)
    assert len(list(tmp_path.glob("*.obj"))) == 100 and (faces == 0).sum() == 3
    assert len(list(tmp_path.glob("*_*.obj"))) == 3 and faces.max() == 300
    # Half of a law n^-1 from 60 on is below 120.
    assert 0.35 < (faces[faces > 0] < 120).mean() < 0.65
    again = script("farm/make_meshes.py").write_meshes(tmp_path / "again", count=100, most=300)
    assert np.array_equal(faces, again)
    assert all((tmp_path / "again" / p.name).read_bytes() == p.read_bytes() for p in tmp_path.glob("*.obj"))


@pytest.mark.parametrize("kind", ["tube", "dome", "torus"])
def test_shapes_are_oriented_manifolds(kind):
    class Chosen:
        """Random numbers that choose this kind."""

        def __init__(self):
            self._rng = np.random.default_rng(0)

        def choice(self, _kinds):
            return kind

        def __getattr__(self, name):
            return getattr(self._rng, name)

    V, F = script("farm/make_meshes.py").shape(Chosen(), 500)
    found = topology_of(F)
    assert (found.loops, found.euler, found.crowded, found.disagreeing) == (
        (0, 0, 0, 0) if kind == "torus" else (2, 0, 0, 0)
    )
    assert abs(len(F) - 500) < 60 and face_areas(V, F).min() > 0


def test_heads_are_disks_with_a_neck_that_vary():
    heads = script("papers/heads.py")
    (V, F), (W, _) = heads.head(0), heads.head(1)
    found = topology_of(F)
    assert (found.components, found.loops, found.euler, found.disagreeing) == (1, 1, 1, 0)
    assert face_areas(V, F).min() > 0 and 0.02 < np.abs(V - W).max() < 1
    assert np.array_equal(V, heads.head(0)[0])
    # The outside looks outwards, Y is up, and the nose in front.
    volume = np.einsum("ij,ij->i", V[F[:, 0]], np.cross(V[F[:, 1]], V[F[:, 2]])).sum()
    assert volume > 0 and abs(V[V[:, 2].argmax(), 0]) < 0.1 and V[0, 1] > 1
