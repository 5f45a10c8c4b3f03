"""Maps are made once, and again only for another density; small components become batches."""

from __future__ import annotations

import meshes
import numpy as np

from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing.initial.component_maps import ComponentImages, RemeshSource


def test_strategies_name_images():
    conformal, preserving = np.zeros((3, 2)), np.ones((3, 2))
    images = ComponentImages(conformal, preserving, ())
    assert images.pair("app-cfp") == (preserving, conformal) or images.pair("app-cfp")[0] is preserving
    assert images.pair("cfp-cfp")[0] is images.pair("cfp-cfp")[1] is conformal


def test_maps_are_kept_for_the_last_density():
    maps = RemeshSource(*meshes.bumpy(8, 8)).maps[0]
    one = np.ones(len(maps.component.triangles))
    first = drain(maps.of_chart(0, one))
    assert drain(maps.of_chart(0, one.copy())) is first
    other = drain(maps.of_chart(0, np.where(np.arange(len(one)) % 2, 1.0, 2.0)))
    assert other is not first and other.conformal is first.conformal


def test_giving_up_is_told_from_then_on():
    maps = RemeshSource(*meshes.icosphere(1)).maps[0]
    assert maps.by_sphere and maps.warnings == ()
    maps.give_up("No room")
    assert not maps.by_sphere and "No room" in maps.warnings[0]


def test_one_batch_of_closed_components_and_one_of_others():
    shapes = [meshes.icosphere(1), meshes.grid(2, 2), meshes.icosphere(1), meshes.grid(2, 2), meshes.torus()]
    first = np.cumsum([0] + [len(V) for V, _ in shapes])
    V = np.concatenate([V + 3 * k for k, (V, _) in enumerate(shapes)])
    F = np.concatenate([F + k for (_, F), k in zip(shapes, first[:-1], strict=True)])
    source = RemeshSource(V, F)
    alone, closed, lined = source.maps_with_batches(np.array([True, True, True, True, False]))
    assert alone is source.maps[4] and len(closed.component.members) == len(lined.component.members) == 2
    assert closed.component.euler == 4 and lined.component.euler == 2
    assert source.maps_with_batches(np.array([True, True, True, True, False]))[1] is closed
    assert len(source.maps_with_batches(np.eye(5, dtype=bool)[0])) == 5
