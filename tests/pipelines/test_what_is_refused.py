"""What pipelines refuse that no command or operator comes upon, beside what goes."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.pipelines.arranging.actions import rectify_islands
from omt_uv.pipelines.globe import GlobeJob, project
from omt_uv.pipelines.layout import Refusal, UnwrapJob
from omt_uv.pipelines.magnify import Region, islands_of
from omt_uv.pipelines.reading import Reading
from omt_uv.pipelines.regions.several import MISSED, JointShares, NamedRegion, magnify_several, region_factors
from omt_uv.pipelines.remesh import RemeshJob, remesh_series
from omt_uv.pipelines.shapes.landmark_pairs import PairsError, pairs_of, read_pairs
from omt_uv.pipelines.shapes.match import largest_part
from omt_uv.pipelines.shapes.partition import MOST_MATERIALS, partition_surface
from omt_uv.pipelines.shapes.strain import strain_of
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.settings import GlobeSettings, MagnifySettings, PartitionSettings, RemeshSettings, Settings
from omt_uv.solver import errors
from omt_uv.solver.analysis.density import Target
from omt_uv.solver.errors import MeshError
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain

V, F = meshes.grid(3, 3)
SURFACE = triangle_surface(V, F)
UV = V[F.ravel(), :2]
BAD_FACTORS = {
    "eyes": "no region and factor",
    "eyes=": "no region and factor",
    "eyes=three": "no region and factor",
    "=3": "names no region",
    " = 3": "names no region",
}


@pytest.mark.parametrize("text", BAD_FACTORS)
def test_what_is_no_region_and_factor_is_refused_by_what_is_wrong(text):
    assert region_factors(["a=b=2", " c = 3e0 "]) == [("a=b", 2.0), ("c", 3.0)]
    with pytest.raises(ValueError, match=BAD_FACTORS[text]):
        region_factors(["nose=2", text])
    with pytest.raises(ValueError, match="named twice"):
        region_factors(["nose=2", "nose =3"])


def test_regions_without_uvs_or_with_weights_that_are_none_are_refused_by_the_number_of_their_surface():
    bare = Region(SURFACE, None, np.ones(len(V)), None)
    with pytest.raises(Refusal) as caught:
        islands_of(2, bare)
    assert caught.value.index == 2 and "no UVs" in str(caught.value.error)
    good, bad = (Region(SURFACE, None, np.full(len(V), w), None) for w in (0.5, np.nan))
    with pytest.raises(Refusal) as caught:
        drain(magnify_several([NamedRegion("one", 2.0, (good, bad))], MagnifySettings()))
    assert caught.value.index == 1


def test_a_surface_without_faces_or_with_points_that_are_nowhere_has_no_largest_part():
    assert len(largest_part(SURFACE, "source").used) == len(V)
    with pytest.raises(errors.EmptyMeshError, match="target has no faces"):
        largest_part(triangle_surface(V, F[:0]), "target")
    W = V.copy()
    W[5] = np.inf
    with pytest.raises(errors.MeshError, match="of the source are not finite"):
        largest_part(triangle_surface(W, F), "source")


def test_more_cells_than_material_slots_are_refused_where_they_become_slots():
    for cells, refused in ((MOST_MATERIALS + 1, errors.CountError), (MOST_MATERIALS, errors.EmptyMeshError)):
        with pytest.raises(errors.MeshError) as caught:
            drain(
                partition_surface(
                    triangle_surface(V, F[:0]), None, None, PartitionSettings(cells=cells, write="materials")
                )
            )
        assert caught.type is refused


@pytest.mark.parametrize("uv, shape", [(None, None), (UV, V)])
def test_strain_is_that_of_one_thing(uv, shape):
    with pytest.raises(ValueError, match="of UVs or of a shape"):
        strain_of(SURFACE, uv, shape)
    assert np.abs(strain_of(SURFACE, UV).mu).max() < 1e-9 or V[:, 2].any()


NO_PAIRS = ["", "[", "{}", "[1]", '[["a", 0]]', "[[0]]", "[[0, 1, 2]]", "[[[0, 1], 2]]", "[[0, -1]]", "[[true, 0]]",
            '[[0, "123"]]', '["12"]', "[[0, [NaN, 0, 0]]]", "[[0, [1e999, 0, 0]]]", f"[[0, [{10**400}, 0, 0]]]",
            f"[[{2**31}, 0]]"]  # fmt: skip


@pytest.mark.parametrize("text", NO_PAIRS)
def test_files_of_pairs_that_are_none_are_refused_by_their_name(tmp_path, text):
    """No number of a vertex below 0 is one, which would be taken for the origin."""
    path = tmp_path / "pairs.json"
    with pytest.raises(PairsError, match=path.name):
        read_pairs(path)
    path.write_text(text)
    with pytest.raises(PairsError, match=path.name):
        read_pairs(path)
    path.write_text("[[0, [1, 2, 3]], [4, 5]]")
    found = read_pairs(path)
    assert [(p.vertex, p.position) for p in found.source + found.target] == [
        (0, None),
        (4, None),
        (-1, (1, 2, 3)),
        (5, None),
    ]


def test_pairs_want_each_name_once_on_either_side():
    assert pairs_of([], [], ("A", "B")).source == ()


def test_islands_that_are_no_grids_are_refused_by_their_faces():
    with pytest.raises(Refusal, match="no quads") as caught:
        rectify_islands([Reading(SURFACE, np.ones(len(F), bool), UV, None)])
    np.testing.assert_array_equal(caught.value.error.elements, np.arange(len(F)))


@pytest.mark.parametrize("off", [1.0, -1.0])
def test_regions_that_missed_their_share_are_told_and_no_others(off):
    target, missed = np.array([0.2, 0.3, 0.5]), np.array([0.9, 1.1, 0.0])
    shares = JointShares(("a", "b", "c"), target / 2, target, target * (1 + off * MISSED * missed))
    (told,) = shares.warnings()
    assert told.startswith("b has ") and told.endswith(" of the texture instead of 30 %")


def quad_bump():
    """Quads, which are not numbered as their triangles are, of one disk."""
    points, quads = meshes.quad_grid(5, 4)
    points = np.column_stack([points[:, 0], points[:, 1], 0.3 * np.sin(4 * points[:, 0]) * points[:, 1]])
    return points, [list(q) for q in quads]


def remeshed(surface, density):
    none = np.zeros((0, 2), np.int64)
    settings = RemeshSettings(count=30, density="attribute", source="it")
    return drain(remesh_series(RemeshJob(surface, none, none, density), settings))


def unwrapped(surface, density):
    return drain(lay_out([UnwrapJob(surface, target=Target(density))], Settings(quality="draft")))


def projected(surface, density):
    return drain(project([GlobeJob(surface, density=density)], GlobeSettings(quality="draft")))


@pytest.mark.parametrize("pipeline", [remeshed, unwrapped, projected])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, 1e-9])
@pytest.mark.parametrize("bad", [[3], [1, 5], [4]])
def test_a_density_that_is_none_is_that_of_polygons_by_their_numbers(pipeline, value, bad):
    """However they are cut into triangles; what varies too much is so of the least ones."""
    if pipeline is projected:
        points, triangles = meshes.cube()
        quads = np.column_stack([triangles[:6], triangles[6:, 2]])
        surface = meshes.polygon_surface(points, [list(q) for q in quads])
    else:
        surface = meshes.polygon_surface(*quad_bump())
    density = np.ones(len(surface.triangles))
    density[np.isin(surface.triangle_face, bad)] = value
    if value > 0 and pipeline is not remeshed:
        pytest.skip("what varies much is said of the result")
    with pytest.raises((MeshError, Refusal)) as caught:
        pipeline(surface, density)
    error = getattr(caught.value, "error", caught.value)
    assert (error.kind, error.elements.tolist()) == ("face", bad)
