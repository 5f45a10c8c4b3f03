"""Figures are of the surface, in any units: neither finer faces somewhere nor their order nor a motion changes them."""

from __future__ import annotations

from dataclasses import fields

import meshes
import numpy as np
import pytest
from sphere_shapes import random_rotation

from omt_uv.display.histogram import histogram, thumbnail
from omt_uv.pipelines.distortion import measure_readings
from omt_uv.pipelines.measuring.per_face import face_values
from omt_uv.pipelines.measuring.region_figures import figures_by_region
from omt_uv.pipelines.reading import Reading
from omt_uv.pipelines.texel_density import Texels, texel_density
from omt_uv.solver.comparison.triangle_shapes import compare_shapes
from omt_uv.solver.maps.distortion import RATIO_FLOOR
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.strain.beltrami import beltrami
from omt_uv.solver.strain.regions import region_strain


def bent():
    """A bent patch of triangles of many sizes, and UVs (n,2) that share the texture unevenly."""
    V, F = meshes.grid(6, 5)
    x, y = V[:, 0], V[:, 1]
    V = np.column_stack([x**1.7, 1.3 * y, 0.4 * np.sin(3 * x) * y])
    return V, F, np.column_stack([0.1 + 0.5 * x + 0.1 * y * y, 0.2 + 0.4 * y**1.4]), np.arange(len(F)) % 3 == 0


def finer(V, F, uv, region):
    """Every triangle of the left half in three about its middle."""
    cut = V[F].mean(axis=1)[:, 0] < np.median(V[F].mean(axis=1)[:, 0])
    new = len(V) + np.arange(cut.sum())
    a, b, c = F[cut].T
    parts = np.concatenate([np.column_stack([p, q, new]) for p, q in ((a, b), (b, c), (c, a))])
    every = (np.concatenate([x, x[F[cut]].mean(axis=1)]) for x in (V, uv))
    W, new_uv = every
    return W, np.concatenate([F[~cut], parts]), new_uv, np.concatenate([region[~cut], np.tile(region[cut], 3)])


def otherwise(V, F, uv, region):
    """Faces and vertices in another order, turned and moved."""
    rng = np.random.default_rng(2)
    name, order = rng.permutation(len(V)), rng.permutation(len(F))
    W, new_uv = np.empty_like(V), np.empty_like(uv)
    W[name], new_uv[name] = V @ random_rotation(3).T + [1, 2, 3], uv
    return W, np.roll(name[F[order]], 1, axis=1), new_uv, region[order]


def larger(V, F, uv, region):
    """Ten times as large in space."""
    return 10 * V, F, uv, region


def doubled(V, F, uv, region):
    """Two of them beside one another, in space and in UV."""
    n = len(V)
    return (np.concatenate([V, V + [9, 0, 0]]), np.concatenate([F, F + n]), np.concatenate([uv, uv + [2, 0]]),
            np.tile(region, 2))  # fmt: skip


def reading(V, F, uv):
    return Reading(triangle_surface(V, F), np.ones(len(F), bool), uv[F.ravel()].astype(np.float32), None)


def of_run(V, F, uv, region):
    found = measure_readings([reading(V, F, uv)])
    # What grows from one face on is of this face.
    return {k: v for k, v in vars(found).items() if isinstance(v, float) and not k.startswith("seed")}


def of_regions(V, F, uv, region):
    rows = figures_by_region([reading(V, F, uv)], [("some", [region])], 512)
    return {f"{row.name} {f.name}": getattr(row, f.name) for row in rows for f in fields(row)
            if f.name not in ("name", "faces")}  # fmt: skip


def of_texels(V, F, uv, region):
    return {"density": texel_density([reading(V, F, uv)], Texels(512, 0.5))}


def of_pictures(V, F, uv, region):
    plot, small = histogram([reading(V, F, uv)]), thumbnail([reading(V, F, uv)])
    return {"plot": float(plot.mean()), "bars": float(small[..., 3].mean())}


def of_strain(V, F, uv, region):
    image = np.column_stack([uv, 0.2 * uv[:, 0]])
    rows = region_strain(beltrami(V, F, image), {"some": region})
    return {f"{row.name} {k}": v for row in rows for k, v in vars(row).items() if isinstance(v, float)}


def of_shapes(V, F, uv, region):
    return vars(compare_shapes(V, F))


FIGURES = (of_run, of_regions, of_texels, of_pictures, of_strain, of_shapes)
# What is in units of length, and how it grows with these.
UNITS = {"area": 2, "perimeter": 1, "density": -1, "texel_density": -1}
# What two have twice.
SUMS = {"area", "perimeter", "uv_area"}


@pytest.mark.parametrize("figures", FIGURES)
@pytest.mark.parametrize("change", [finer, otherwise, larger, doubled])
def test_figures_stay_whatever_the_faces(change, figures):
    if (change, figures) == (finer, of_shapes):
        pytest.skip("these are of the faces")
    before, after = figures(*bent()), figures(*change(*bent()))
    assert before.keys() == after.keys() and before
    for key, value in before.items():
        name = key.split()[-1]
        if change is doubled and name in ("uv_diameter", "angle_p1"):
            continue
        factor = 10.0 ** UNITS.get(name, 0) if change is larger else 2.0 if change is doubled and name in SUMS else 1.0
        assert after[key] == pytest.approx(value * factor, rel=2e-5), key


@pytest.mark.parametrize("kind", ["without area", "folded"])
def test_faces_that_have_no_area_in_the_map_have_the_least_value_there_is(kind):
    V, F, uv, _ = bent()
    corner_uv = uv[F].copy()
    plain = face_values(Reading(triangle_surface(V, F), np.ones(len(F), bool), corner_uv.reshape(-1, 2), None))
    if kind == "folded":
        # Its last vertex goes to the other side of the opposite edge, and with it that corner of all around.
        moved = uv.copy()
        moved[F[4, 2]] = corner_uv[4, :2].sum(axis=0) - corner_uv[4, 2]
        corner_uv = moved[F]
    else:
        corner_uv[4, 2] = corner_uv[4, 0]
    found = face_values(Reading(triangle_surface(V, F), np.ones(len(F), bool), corner_uv.reshape(-1, 2), None))
    assert found.area[4] == pytest.approx(np.log2(RATIO_FLOOR)) and found.area[4] < plain.area.min() - 1
    assert np.isfinite(found.shear).all() and np.isfinite(found.stretch).all()
