"""Power diagrams and transport: exact sums, exact areas, and the least cost."""

import meshes
import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.spatial import Delaunay

from omt_uv.solver import errors
from omt_uv.solver.conformal.disk_map import conformal_disk
from omt_uv.solver.mesh.geometry import vertex_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.transport import semidiscrete
from omt_uv.solver.transport.convex_domain import ConvexPolygon, Disk, Rectangle, segment_integrals
from omt_uv.solver.transport.power_diagram import power_diagram
from omt_uv.solver.transport.regular_triangulation import by_flips, by_hull
from omt_uv.solver.transport.semidiscrete import transport

DOMAINS = {
    "disk": Disk(),
    "large disk": Disk(7.0),
    "square": Rectangle(),
    "rectangle": Rectangle(3.0, 0.5),
    "pentagon": ConvexPolygon(np.array([[0, 0], [2, 0], [3, 1], [1, 3], [-1, 1.0]])),
}


def inside(domain, count, seed=0):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-8, 8, (400 * count, 2)) * np.sqrt(domain.area) / 4
    return points[domain.contains(points)][:count]


def samples(domain, count):
    """Random points of the domain."""
    rng = np.random.default_rng(6)
    reach = np.abs(domain.boundary_point(np.linspace(0, domain.period, 400, endpoint=False))).max(axis=0)
    points = rng.uniform(-1, 1, (3 * count, 2)) * reach
    return points[domain.contains(points)][:count]


@pytest.mark.parametrize("name", DOMAINS)
@pytest.mark.parametrize("count", [3, 5, 40, 1000])
def test_cells_sum_to_the_domain(name, count):
    domain = DOMAINS[name]
    sites = inside(domain, count)
    rng = np.random.default_rng(count)
    for size in (0, 0.01, 1.0):
        cells = power_diagram(sites, size * domain.area / count * rng.normal(size=count), domain)
        assert cells.area.sum() == pytest.approx(domain.area, rel=1e-12)
        np.testing.assert_allclose(cells.moment.sum(axis=0), 0, atol=1e-12 * domain.area**1.5)
        assert cells.second.sum() == pytest.approx(domain.total_integrals()[3], rel=1e-12)
        assert cells.area.min() > -1e-12 * domain.area
        assert (cells.length >= 0).all()


@pytest.mark.parametrize("name", DOMAINS)
def test_cells_are_where_their_power_is_least(name):
    domain = DOMAINS[name]
    sites = inside(domain, 12)
    site_weights = 0.05 * domain.area * np.random.default_rng(3).random(12)
    cells = power_diagram(sites, site_weights, domain)
    x = samples(domain, 200_000)
    owner = (((x[:, None] - sites) ** 2).sum(axis=2) - site_weights).argmin(axis=1)
    share = np.bincount(owner, minlength=12) / len(x)
    np.testing.assert_allclose(cells.area / domain.area, share, atol=6e-3)
    held = share > 0.01
    number = np.bincount(owner, minlength=12)[held, None]
    mean = np.stack([np.bincount(owner, x[:, k], 12) for k in range(2)], axis=1)[held] / number
    np.testing.assert_allclose(cells.moment[held] / cells.area[held, None], mean, atol=0.02 * np.sqrt(domain.area))


def test_symmetric_sites_on_the_boundary():
    """A regular grid: cocircular everywhere, sites on every side and in the corners."""
    V, _ = meshes.grid(6, 6)
    cells = power_diagram(V[:, :2] - 0.5, np.zeros(len(V)), Rectangle())
    side = np.isin(np.arange(49) % 7, [0, 6]).astype(int) + np.isin(np.arange(49) // 7, [0, 6])
    np.testing.assert_allclose(cells.area, 1 / 36 / 2.0**side, rtol=1e-12)
    angle = np.arange(8) * np.pi / 4
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(power_diagram(ring, np.zeros(8), Disk()).area, np.pi / 8, rtol=1e-12)


def test_hidden_sites_have_no_area():
    sites = inside(Disk(), 30)
    site_weights = np.zeros(30)
    site_weights[4] = -5
    cells = power_diagram(sites, site_weights, Disk())
    assert cells.area[4] == 0 and cells.area.sum() == pytest.approx(np.pi, rel=1e-12)


def test_without_weights_it_is_the_delaunay_triangulation():
    sites = inside(Disk(), 200)
    got = {tuple(sorted(t)) for t in by_hull(sites, np.zeros(200)).triangles}
    assert got == {tuple(sorted(t)) for t in Delaunay(sites).simplices}


@pytest.mark.parametrize("name", DOMAINS)
def test_boundary_integrals_are_the_limit_of_short_chords(name):
    domain = DOMAINS[name]
    s = np.linspace(0, domain.period, 20_001)[:-1]
    p = domain.boundary_point(s)
    chords = np.concatenate([np.zeros((4, 1)), np.cumsum(segment_integrals(p[:-1], p[1:]), axis=1)], axis=1)
    np.testing.assert_allclose(domain.boundary_integrals(s), chords, atol=1e-5 * domain.period**4)
    inner = s[1:]
    back = domain.boundary_parameter(domain.boundary_point(inner))
    np.testing.assert_allclose(back, inner, atol=1e-9 * domain.period)


@pytest.mark.parametrize("name", DOMAINS)
def test_clip(name):
    domain = DOMAINS[name]
    origin = inside(domain, 50)
    angle = np.random.default_rng(1).uniform(0, 2 * np.pi, 50)
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    enter, leave = domain.clip(origin, direction)
    assert (enter < 0).all() and (leave > 0).all()
    for t in (enter, leave):
        point = origin + t[:, None] * direction
        np.testing.assert_allclose(domain.boundary_point(domain.boundary_parameter(point)), point, atol=1e-9)
    normal = np.column_stack([-direction[:, 1], direction[:, 0]])
    enter, leave = domain.clip(origin + 10 * domain.period * normal, direction)
    assert (enter > leave).all()


@pytest.mark.parametrize("name", DOMAINS)
def test_transport_meets_its_masses(name):
    domain = DOMAINS[name]
    sites = inside(domain, 400)
    mass = np.random.default_rng(2).uniform(0.1, 3, 400)
    result = drain(transport(sites, mass, domain))
    np.testing.assert_allclose(result.cells.area, mass / mass.sum() * domain.area, rtol=1e-6)
    assert result.cells.area.sum() == pytest.approx(domain.area, rel=1e-12)
    assert result.iterations <= 25


def test_newton_converges_quadratically():
    sites, residuals = inside(Disk(), 300), []
    for tolerance in (1e-2, 1e-4, 1e-8, 1e-12):
        residuals.append(drain(transport(sites, np.ones(300), Disk(), tolerance)).iterations)
    assert residuals[-1] - residuals[0] <= 4


@pytest.mark.parametrize("count", [3, 4, 7])
def test_no_permutation_is_cheaper(count):
    """Against the best assignment of sampled points to sites with equal masses, the continuous optimum."""
    domain = Disk()
    sites = inside(domain, count, seed=count)
    result = drain(transport(sites, np.ones(count), domain))
    x = samples(domain, 60 * count)[: 60 * count]
    cost = ((x[:, None] - np.repeat(sites, 60, axis=0)) ** 2).sum(axis=2)
    rows, columns = linear_sum_assignment(cost)
    sampled_cost = cost[rows, columns].mean() * domain.area
    assert result.cost == pytest.approx(sampled_cost, rel=0.1)
    # Whoever else gets the points pays more: shift every site's cell to another site.
    shifted = np.roll(sites, 1, axis=0)
    assert result.cells.cost(sites) < result.cells.cost(shifted)


def test_the_assignment_is_optimal_for_its_own_areas():
    """Kantorovich duality on a sample: with the dual weights, every point is with its cheapest site."""
    domain = Rectangle(2.0, 1.0)
    sites = inside(domain, 30)
    mass = np.random.default_rng(8).uniform(0.5, 2, 30)
    result = drain(transport(sites, mass, domain))
    dual = (result.site_weights * mass).sum() * domain.area / mass.sum()
    x = samples(domain, 200_000)
    least = (((x[:, None] - sites) ** 2).sum(axis=2) - result.site_weights).min(axis=1).mean() * domain.area
    assert dual + least == pytest.approx(result.cost, rel=1e-2)


def test_rotation_and_scale():
    sites, mass = inside(Disk(), 100), np.random.default_rng(0).uniform(1, 2, 100)
    plain = drain(transport(sites, mass, Disk()))
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s], [s, c]])
    turned = drain(transport(sites @ turn.T, 10 * mass, Disk()))
    np.testing.assert_allclose(turned.cells.centroid, plain.cells.centroid @ turn.T, atol=1e-7)
    large = drain(transport(3 * sites, mass, Disk(3.0)))
    np.testing.assert_allclose(large.cells.centroid, 3 * plain.cells.centroid, atol=1e-6)


def test_relabelling():
    sites, mass = inside(Disk(), 100), np.random.default_rng(0).uniform(1, 2, 100)
    order = np.random.default_rng(1).permutation(100)
    a, b = drain(transport(sites, mass, Disk())), drain(transport(sites[order], mass[order], Disk()))
    np.testing.assert_allclose(b.cells.centroid, a.cells.centroid[order], atol=1e-7)


@pytest.mark.parametrize("bad", ["twice", "outside", "nowhere", "no mass"])
def test_what_is_bad_is_named_by_the_labels_that_it_was_given(bad):
    """Solvers sort sites for their own ends; what they complain about is told in the order of the caller."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        sites, mass = inside(Disk(), 40, seed), np.ones(40)
        which = int(rng.integers(40))
        if bad == "twice":
            sites, mass = np.vstack([sites, sites[which]]), np.ones(41)
        elif bad == "outside":
            # Beyond another site, so that all that is its cell lies outside, too.
            far = np.linalg.norm(sites, axis=1).argmax()
            sites[which] = 30 * sites[far]
        elif bad == "nowhere":
            sites[which] = np.nan
        else:
            mass[which] = 0
        with pytest.raises(errors.TransportError) as caught:
            drain(transport(sites, mass, Disk()))
        assert len(caught.value.elements) == 1
        assert caught.value.elements[0] in ((which, 40) if bad == "twice" else (which,))


def test_bad_input_is_named():
    sites = inside(Disk(), 10)
    for mass in (np.r_[np.ones(9), 0], np.r_[np.ones(9), np.nan], np.r_[np.ones(9), -1]):
        with pytest.raises(errors.TransportError) as caught:
            drain(transport(sites, mass, Disk()))
        assert caught.value.elements.tolist() == [9]
    with pytest.raises(errors.TransportError, match="Sites are too close together to tell apart, as at the ends of l"):
        drain(transport(np.vstack([sites, sites[3]]), np.ones(11), Disk()))
    line = np.column_stack([np.linspace(-0.5, 0.5, 6), np.zeros(6)])
    with pytest.raises(errors.TransportError, match="The sites of the transport lie on one line or"):
        drain(transport(line, np.ones(6), Disk()))


@meshes.models_missing
@pytest.mark.parametrize("name", ["snail", "lilium", "face", "lion", "woody", "hemisphere"])
def test_models(name):
    V, F = meshes.load_model(name)
    sites, mass = drain(conformal_disk(V, F)).uv, vertex_areas(V, F)
    result = drain(transport(sites, mass, Disk()))
    np.testing.assert_allclose(result.cells.area, mass / mass.sum() * np.pi, rtol=1e-6)
    assert abs(result.cells.area.sum() - np.pi) < 1e-12
    assert result.iterations <= 25


def test_flips_repair_the_triangulation_a_hull_would_give():
    sites = inside(Disk(), 300)
    rng = np.random.default_rng(7)
    start = by_hull(sites, np.zeros(300))
    assert start.whole
    reached = 0
    for size in (1e-5, 1e-4, 5e-4, 3e-3):
        site_weights = size * rng.normal(size=300)
        repaired, hidden = by_flips(start, sites, site_weights)
        expected = by_hull(sites, site_weights)
        if repaired is None:
            # Flips alone cannot take a site out; the certificate must then be right.
            assert not hidden or len(np.unique(expected.triangles)) < 300
            continue
        reached += 1
        rows = [{tuple(sorted(t)) for t in r.triangles} for r in (repaired, expected)]
        assert rows[0] == rows[1]
        assert (repaired.twin[repaired.twin[repaired.twin >= 0]] >= 0).all()
    assert reached >= 2


def test_few_hulls_are_built():
    """One hull for the start; flips carry the triangulation through the Newton steps."""
    result = drain(transport(inside(Disk(), 2000), np.ones(2000), Disk()))
    assert result.hulls <= 2 and result.diagrams <= 20


def test_hulls_diagrams_and_flips_are_counted(monkeypatch):
    made = []
    hull, flip = semidiscrete.power_diagram, semidiscrete.by_flips

    def flipped(*given):
        found = flip(*given)
        made.extend([0] if found[0] is not None and not found[1] else [])
        return found

    monkeypatch.setattr(semidiscrete, "power_diagram", lambda *given: made.append(1) or hull(*given))
    monkeypatch.setattr(semidiscrete, "by_flips", flipped)
    result = drain(transport(inside(Disk(), 300), np.ones(300), Disk()))
    # A diagram is made of a hull, or of flips of the last one.
    assert result.diagrams == made.count(1) and result.hulls == made.count(1) - made.count(0) >= 1
    assert result.flips > 0


def straight(count):
    """Sites on the lines of a grid: many lie on straight sides of their hull."""
    x, y = np.meshgrid(np.linspace(-0.4, 0.4, count), np.linspace(-0.3, 0.3, count - 1))
    return np.column_stack([x.ravel(), y.ravel()])


def scattered(count):
    return np.random.default_rng(count).uniform(-0.4, 0.4, (count * (count - 1), 2))


@pytest.mark.parametrize("domain", [Rectangle(1.0, 0.9), Disk(0.7)], ids=["rectangle", "disk"])
@pytest.mark.parametrize("sites", [straight, scattered])
@pytest.mark.parametrize("count", [4, 6, 9])
def test_what_flips_leave_unproven_is_no_result(domain, sites, count, monkeypatch):
    """Where the hull of the sites has straight sides, flips may come to an end that is none."""
    made, solutions = [], []

    def flipped(*given):
        made.append(by_flips(*given))
        return made[-1]

    def solved(*given, solve_dual=semidiscrete.solve_dual):
        solutions.append((yield from solve_dual(*given)))
        return solutions[-1]

    monkeypatch.setattr(semidiscrete, "by_flips", flipped)
    monkeypatch.setattr(semidiscrete, "solve_dual", solved)
    points = sites(count)
    mass = np.random.default_rng(1).uniform(0.5, 2.0, len(points))
    found = drain(semidiscrete.transport(points, mass, domain))
    by_hand = [dual for dual, _ in made if dual is not None and not dual.whole]
    assert len(made) > 1 and bool(by_hand) == (sites is straight)
    assert not any(solutions[0].cells.dual is dual for dual in by_hand)
    anew = power_diagram(points, found.site_weights, domain)
    np.testing.assert_allclose(np.sort(found.cells.area), np.sort(anew.area), rtol=1e-9)


@pytest.mark.parametrize("name", ["disk", "rectangle"])
@pytest.mark.parametrize("more", [0.0, 3.0])
def test_from_the_weights_that_were_found_there_is_nowhere_to_go(name, more):
    """In the order of the caller's sites, whichever that is; what all weights have in common does not count."""
    domain = {"disk": Disk(), "rectangle": Rectangle(2.0, 0.5)}[name]
    sites, mass = inside(domain, 80), np.random.default_rng(0).uniform(1, 3, 80)
    found = drain(transport(sites, mass, domain))
    assert found.iterations > 0
    order = np.random.default_rng(1).permutation(80)
    again = drain(transport(sites[order], mass[order], domain, site_weights=found.site_weights[order] + more))
    assert again.iterations == 0
    np.testing.assert_allclose(again.cells.area, found.cells.area[order], rtol=1e-9)
    np.testing.assert_allclose(np.diff(again.site_weights), np.diff(found.site_weights[order]), atol=1e-12)
