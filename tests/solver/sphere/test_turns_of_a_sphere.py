"""Which way a map to the sphere takes, with its steps written in advance, and what it tells of it."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import worked

from omt_uv.solver.errors import FoldedUVError, PrecisionError, TransportError
from omt_uv.solver.sphere import sphere_map as spheres

V, F = meshes.icosphere(0)


@pytest.fixture
def mapped(monkeypatch):
    """The map of an icosahedron whose steps are written: their names, what was told, and how far it went."""

    def run(
        *, conformal=None, transport=None, first=None, joined=False, given=True, error=0.005, method="newton", **options
    ):
        taken = []

        def sites(*_):
            taken.append("sites")
            return worked(conformal if conformal == "sites" else SimpleNamespace(sites="sites"))

        def conformal_sites(*_):
            taken.append("sites")
            return worked(PrecisionError("too thin") if conformal == "sites" else SimpleNamespace(sites=1 * V))

        def straightened(*_):
            taken.append("conformal")
            failed = conformal == "sphere"
            return worked(
                PrecisionError("too thin") if failed else SimpleNamespace(positions=2 * V, sites=1 * V, triangles=F)
            )

        def transported(*_):
            taken.append("transport")
            return worked(transport or 3 * V)

        def flow(*_):
            taken.append("flow")
            return worked(SimpleNamespace(moser=4 * V, positions=5 * V))

        def multilevel(*_):
            taken.append("multilevel")
            return worked((6 * V, None))

        failures = [first] if first is not None else []

        def refine(vertices, triangles, start, target, **given):
            of = "quads" if joined and given.get("polygons") is not None and given["polygons"][0] == 7 else "own"
            taken.append(f"refine {round(np.linalg.norm(start[0]))} {given['balance']:g} {of}")
            if failures:
                return worked(failures.pop())
            return worked(SimpleNamespace(positions=start, area_error=error, status="s", iterations=3, residual=0.5))

        monkeypatch.setattr(spheres, "conformal_sites", conformal_sites)
        monkeypatch.setattr(spheres, "straightened", straightened)
        monkeypatch.setattr(spheres, "_transport_start", transported)
        monkeypatch.setattr(spheres, "flow_map", flow)
        monkeypatch.setattr(spheres, "multilevel_start", multilevel)
        monkeypatch.setattr(spheres, "sphere_refine", refine)
        monkeypatch.setattr(spheres, "with_polygon_fans", lambda given: None)
        monkeypatch.setattr(spheres, "_as_given", lambda *_: given)
        quads = np.full(len(F), 7)
        monkeypatch.setattr(spheres, "with_mirrored_quads", lambda v, t, polygons: quads if joined else polygons)
        fractions, steps = [], spheres.sphere_map(V, F, method=method, **options)
        try:
            while True:
                fractions.append(next(steps).fraction)
        except StopIteration as stop:
            return stop.value, taken, fractions

    return run


def test_a_sphere_is_mapped_by_its_conformal_map_and_transport(mapped):
    found, taken, fractions = mapped()
    assert taken == ["sites", "conformal", "transport", "refine 3 0 own"] and found.warnings == ()
    assert np.array_equal(found.positions, 3 * V) and np.array_equal(found.conformal, 2 * V)
    assert np.array_equal(found.sites, V) and found.flow is None
    assert (found.status, found.iterations, found.residual) == ("s", 3, 0.5)
    assert fractions == sorted(fractions) and fractions[-1] <= 1


def test_a_flow_is_refined_or_comes_out_as_it_is(mapped):
    found, taken, _ = mapped(method="flow")
    assert taken == ["sites", "conformal", "flow", "refine 5 0 own"] and np.array_equal(found.flow.moser, 4 * V)
    found, taken, _ = mapped(method="moser")
    assert taken == ["sites", "conformal", "flow"] and np.array_equal(found.positions, 4 * V)
    assert np.array_equal(found.conformal, 2 * V) and (found.status, found.iterations) == ("moser", 0)


@pytest.mark.parametrize("method", ["newton", "flow", "moser"])
@pytest.mark.parametrize("where", ["sites", "sphere"])
def test_without_a_conformal_map_it_goes_from_coarse_to_fine(where, method, mapped):
    found, taken, _ = mapped(conformal=where, method=method)
    began = ["sites"] if where == "sites" else ["sites", "conformal"]
    # What comes nearest to a conformal map is that of the least shear.
    assert taken == [*began, "multilevel", "refine 6 0 own", "refine 6 1 own"]
    assert found.warnings == ("too thin; the map was built from coarse to fine instead",)
    assert np.array_equal(found.conformal, 6 * V)
    assert np.array_equal(found.sites, V if where == "sphere" else 6 * V)


@pytest.mark.parametrize(
    ("failing", "error"),
    [("transport", TransportError), ("first", FoldedUVError), ("first", TransportError)],
)
def test_without_a_transport_it_goes_from_coarse_to_fine(failing, error, mapped):
    found, taken, _ = mapped(**{failing: error("no way")})
    assert taken[-2:] == ["multilevel", "refine 6 0 own"] and np.array_equal(found.conformal, 2 * V)
    assert found.warnings == ("no way; the map was built from coarse to fine instead",)


def test_what_has_no_precision_while_it_is_refined_is_an_error(mapped):
    with pytest.raises(PrecisionError, match="Cut the chart into less elongated pieces with"):
        mapped(first=PrecisionError("no"))


@pytest.mark.parametrize(
    ("joined", "given", "again"), [(True, True, False), (True, False, True), (False, False, False)]
)
def test_quads_that_were_joined_are_parted_again_where_that_is_better(joined, given, again, mapped):
    _, taken, _ = mapped(joined=joined, given=given)
    quads = "quads" if joined else "own"
    assert taken[3:] == [f"refine 3 0 {quads}"] + ["refine 3 0 own"] * again


@pytest.mark.parametrize(
    ("error", "quality", "balance", "told"),
    [
        (0.0081, "standard", 0.0, 1),
        (0.0079, "standard", 0.0, 0),
        (0.0081, "draft", 0.0, 0),
        (0.0081, "standard", 0.5, 0),
    ],
)
def test_areas_that_are_off_are_told_where_they_should_not_be(error, quality, balance, told, mapped):
    found, taken, _ = mapped(error=error, quality=quality, balance=balance)
    assert len(found.warnings) == told and taken[-1] == f"refine 3 {balance:g} own"


@pytest.mark.parametrize("unknown", ["", "Newton", "ricci"])
def test_methods_are_known(unknown):
    with pytest.raises(ValueError, match="newton, flow, moser"):
        next(spheres.sphere_map(V, F, method=unknown))


@pytest.mark.parametrize(
    ("method", "folded", "again"), [("newton", False, False), ("newton", True, True), ("moser", True, False)]
)
def test_caps_that_are_fanned_are_mapped_as_they_are_where_that_folds_them(method, folded, again, monkeypatch):
    asked = []
    flat = V.copy()
    if folded:
        flat[F[0, 0]] = -V[F[0, 0]]

    def mapping(given, used, options):
        asked.append(given)
        assert (used, options) == (method, {"balance": 0.25, "quality": "draft"})
        n = len(V) + (given == "fans")
        rows = np.concatenate([flat, np.ones((1, 3))])[:n]
        found = {"positions": rows, "conformal": rows, "sites": rows, "status": "", "iterations": 0, "residual": 0.0}
        return worked(spheres.SphereMap(**found, warnings=(), flow=None))

    monkeypatch.setattr(spheres, "with_polygon_fans", lambda given: "fans")
    monkeypatch.setattr(spheres, "_mapped", mapping)
    steps = spheres.sphere_map(V, F, method=method, balance=0.25, quality="draft")
    try:
        while True:
            next(steps)
    except StopIteration as stop:
        found = stop.value
    assert len(asked) == 1 + again and asked[0] == "fans"
    assert len(found.positions) == len(found.sites) == len(found.conformal) == len(V)


@pytest.mark.parametrize(("error", "kept"), [(0.5, True), (1e-4, False)])
def test_triangles_are_as_given_where_they_are_not_much_farther_off(error, kept):
    surface = SimpleNamespace(triangles=F)
    target = np.ones(len(F)) + 0.01 * (np.arange(len(F)) % 2)
    assert spheres._as_given(V, surface, target, error) == kept
    folded = V.copy()
    folded[F[0, 0]] = -V[F[0, 0]]
    assert not spheres._as_given(folded, surface, target, 100.0)


def test_targets_are_areas_times_density():
    area = [np.linalg.norm(np.cross(V[b] - V[a], V[c] - V[a])) / 2 for a, b, c in F]
    surface = SimpleNamespace(vertices=V, triangles=F)
    assert spheres._target(surface, None) == pytest.approx(area)
    density = np.arange(1.0, len(F) + 1)
    assert spheres._target(surface, density) == pytest.approx(area * density)
