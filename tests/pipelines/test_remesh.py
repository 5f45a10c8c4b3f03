"""Series of remeshes: counts, densities and errors as the settings have them."""

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from bodies import hourglass

from omt_uv.pipelines import remesh as remeshing
from omt_uv.pipelines.remesh import RemeshJob, density_of, oriented, remesh_series
from omt_uv.settings import DENSITIES, RemeshSettings
from omt_uv.solver.errors import CountError, DensityError, MeshError
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain

NONE = np.zeros((0, 2), np.int64)


def job(V, F, values=None, **more):
    return RemeshJob(triangle_surface(V, F), NONE, NONE, values, **more)


def series(V, F, **settings):
    return drain(remesh_series(job(V, F, warnings=("mended",)), RemeshSettings(**settings)))


@pytest.fixture(scope="module")
def levels():
    return series(*meshes.icosphere(3), count=80, levels=3)


def test_every_level_has_its_count_and_is_closed(levels):
    assert [len(level.positions) for level in levels.levels] == [80, 40, 20]
    for level in levels.levels:
        assert len(level.triangles) == 2 * len(level.positions) - 4
        assert len(level.correspondence.vertex_triangle) == len(level.positions)
        assert level.correspondence.vertex_weights.sum(axis=1) == pytest.approx(np.ones(len(level.positions)))
    assert levels.warnings[0] == "mended"


def test_a_level_is_what_it_is_alone(levels):
    alone = series(*meshes.icosphere(3), count=40)
    assert np.array_equal(alone.levels[0].positions, levels.levels[1].positions)
    assert np.array_equal(alone.levels[0].triangles, levels.levels[1].triangles)


def test_faces_and_edge_lengths_are_counted():
    V, F = meshes.icosphere(3)
    assert len(series(V, F, count_of="faces", count=60).levels[0].triangles) == 60
    found = series(V, F, count_of="edge", count=0.6).levels[0]
    edge = np.linalg.norm(found.positions[found.triangles] - found.positions[np.roll(found.triangles, 1, 1)], axis=2)
    assert edge.mean() == pytest.approx(0.6, rel=0.05)


@pytest.mark.parametrize("count_of", ["vertices", "faces"])
@pytest.mark.parametrize("count", [41, 60, 97])
@pytest.mark.parametrize(("levels", "ratio"), [(1, 0.5), (2, 0.5), (4, 0.37)])
def test_the_first_level_has_the_count_that_is_asked_and_later_ones_even_faces(count_of, count, levels, ratio):
    V, F = meshes.icosphere(1)
    settings = RemeshSettings(count_of=count_of, count=count, levels=levels, ratio=ratio)
    kind, found = remeshing._counts(triangle_surface(V, F), F, settings)
    assert (kind, found[0]) == (count_of, count) and len(found) == levels
    for k in range(1, levels):
        asked = round(count * ratio**k)
        assert found[k] == asked + (asked % 2 if count_of == "faces" else 0)


@pytest.mark.parametrize(
    "settings",
    [{"count": 0}, {"count": np.nan}, {"count_of": "edge", "count": -1}, {"levels": 2, "ratio": 1.0}, {"count": 3}],
)
def test_counts_that_are_none_are_refused(settings):
    with pytest.raises(CountError):
        series(*meshes.icosphere(1), **settings)


@pytest.mark.parametrize("count_of", ["vertices", "faces", "edge"])
def test_counts_that_no_float_has_are_refused_as_others(count_of):
    huge = 10**400
    given = {"count_of": count_of, "count": 1e-300 if count_of == "edge" else huge}
    with pytest.raises(CountError, match=r"memory.*fewer, or for longer edges"):
        series(*meshes.icosphere(1), **given)
    with pytest.raises(CountError, match="is none"):
        series(*meshes.icosphere(1), count_of=count_of, count=-huge)


@pytest.mark.parametrize("levels", [8, 10**9, 10**400])
def test_levels_without_a_vertex_are_refused_before_the_first_is_made(levels):
    with pytest.raises(CountError, match=r"^The last of \S+ levels would have no vertices"):
        series(*meshes.icosphere(2), count=40, levels=levels, ratio=0.5)
    surface = triangle_surface(*meshes.icosphere(1))
    seven = RemeshSettings(count_of="vertices", count=40, levels=7, ratio=0.5)
    assert remeshing._counts(surface, surface.triangles, seven)[1] == [40, 20, 10, 5, 2, 1, 1]


@pytest.mark.parametrize("ratio", [-1.0, 0.0, 1.0, 2.0, np.nan])
def test_what_one_level_does_not_use_refuses_nothing(ratio):
    V, F = meshes.icosphere(2)
    found, plain = series(V, F, count=40, ratio=ratio), series(V, F, count=40)
    assert np.array_equal(found.levels[0].positions, plain.levels[0].positions)
    with pytest.raises(CountError, match="ratio between 0 and 1"):
        series(V, F, count=40, levels=2, ratio=ratio)


def test_errors_say_the_level():
    with pytest.raises(CountError, match=r"^LOD1: "):
        series(*meshes.icosphere(2), count=20, levels=2, ratio=0.1)


@pytest.mark.parametrize("name", [name.lower() for name, *_ in DENSITIES])
def test_densities_do_not_depend_on_the_unit_of_length(name):
    V, F = meshes.bumpy(8, 8)
    values = None if name not in ("weights", "attribute") else np.linspace(0.1, 1, len(F))
    settings = RemeshSettings(density=name)
    one, other = (density_of(job(s * V, F, values), F, settings) for s in (1.0, 1024.0))
    if name == "uniform":
        assert one is None and other is None
        return
    assert one.shape == (len(F),) and (one > 0).all()
    assert other / other.sum() == pytest.approx(one / one.sum(), rel=1e-6)


def test_weights_span_the_factor_and_attributes_are_taken_as_they_are():
    V, F = meshes.grid(4, 4)
    values = np.linspace(0, 1, len(F))
    painted = density_of(job(V, F, values), F, RemeshSettings(density="weights", factor=8.0))
    assert painted[-1] / painted[0] == pytest.approx(8)
    density = density_of(job(V, F, values + 1), F, RemeshSettings(density="attribute"))
    assert np.array_equal(density, values + 1)
    with pytest.raises(DensityError, match="There is nothing to read the density from"):
        density_of(job(V, F), F, RemeshSettings(density="attribute"))
    with pytest.raises(MeshError, match="A density is not positive and finite"):
        density_of(job(V, F, values - 1), F, RemeshSettings(density="attribute"))


def test_triangles_that_look_away_are_turned_over_and_others_stay():
    V, F = meshes.icosphere(1)
    surface = triangle_surface(V, F)
    found = oriented(surface)
    assert found.surface is surface and not found.kept.any() and not found.warnings
    wrong = F.copy()
    wrong[[3, 50]] = wrong[[3, 50]][:, ::-1]
    found = oriented(triangle_surface(V, wrong))
    assert len(found.warnings) == 1 and "2 faces look to another side" in found.warnings[0]
    assert not found.kept.any() and not len(found.joints)
    assert same_windings(found.surface.corner_vertex[found.surface.triangles], F)


def same_windings(F, G) -> bool:
    return {tuple(np.roll(t, -t.argmin())) for t in F} == {tuple(np.roll(t, -t.argmin())) for t in G}


def test_what_looks_outwards_stays_outside_where_it_is_joined_the_wrong_way_round():
    V, F = hourglass(10, 16)
    above = V[F][:, :, 2].mean(axis=1) > 0
    volume = np.einsum("md,md->m", V[F[:, 0]], np.cross(V[F[:, 1]], V[F[:, 2]]))
    assert volume[above].sum() < 0 < volume[~above].sum()
    given = F.copy()
    given[above] = given[above][:, ::-1]
    # Two faces of the other bulb are wound wrongly, besides.
    wrong = np.flatnonzero(~above)[[40, 90]]
    given[wrong] = given[wrong][:, ::-1]
    found = oriented(triangle_surface(V, given))
    assert len(found.warnings) == 2 and "2 faces look to another side" in found.warnings[0]
    assert "joined the wrong way round" in found.warnings[1]
    after = found.surface.corner_vertex[found.surface.triangles]
    kept = found.kept
    # Along the line between two rings the parts interlock.
    assert kept.sum() == above.sum() and len(found.joints) == 32
    after[kept] = after[kept][:, ::-1]
    right = F.copy()
    right[above] = right[above][:, ::-1]
    assert same_windings(after, right)
    made = RemeshJob(found.surface, found.joints, NONE, kept=kept)
    level = drain(remesh_series(made, RemeshSettings(count=300))).levels[0]
    new = np.where(level.back[:, None], level.triangles[:, ::-1], level.triangles)
    P = level.positions[new]
    side = np.where(P[:, :, 2].mean(axis=1) > 0, 0.5, -0.5)[:, None] * [0, 0, 1]
    volume = np.einsum("md,md->m", P[:, 0] - side, np.cross(P[:, 1] - side, P[:, 2] - side))
    assert (volume > 0).mean() > 0.9


@pytest.mark.parametrize("first", [False, True])
@pytest.mark.parametrize("second", [False, True])
@pytest.mark.parametrize("inside", [False, True])
def test_parts_keep_their_sides_where_both_of_a_joint_look_outwards_as_given(monkeypatch, first, second, inside):
    """Two triangles joined the wrong way round, and two joined the right way, which nothing is to be said of."""
    given = np.array([[0, 1, 2], [1, 2, 3], [4, 5, 6], [6, 5, 7]])
    gluing = SimpleNamespace(first=np.array([1, 7]), second=np.array([3, 9]))
    turned = np.array([False, True, False, False])
    hidden = np.stack([np.zeros(4), np.ones(4)])

    def looks_out(sides, _area, part):
        # Of the parts as they are given, and seen from behind.
        by_triangle = [first, second, True, True] if sides[0, 0] == 0 else [inside] * 4
        found = np.zeros(part.max() + 1, bool)
        found[part] = by_triangle
        return found

    monkeypatch.setattr(remeshing, "hidden_sides", lambda *_: hidden)
    monkeypatch.setattr(remeshing, "looks_out", looks_out)
    kept = remeshing._sides_back(np.random.default_rng(0).normal(size=(8, 3)), given, gluing, turned)
    odd = first and second
    assert kept.tolist() == [odd and inside, odd, False, False]


@pytest.mark.parametrize("count_of, counts", [("vertices", [80, 40]), ("faces", [156, 78])])
def test_features_are_those_that_so_many_vertices_can_show(monkeypatch, count_of, counts):
    """Of faces there are twice as many."""
    asked, features = [], remeshing._features

    def recorded(job, triangles, density, vertex_count):
        asked.append(vertex_count)
        return features(job, triangles, density, vertex_count)

    monkeypatch.setattr(remeshing, "_features", recorded)
    series(*meshes.icosphere(2), count_of=count_of, count=counts[0], levels=2)
    assert asked == (counts if count_of == "vertices" else [n // 2 for n in counts])
