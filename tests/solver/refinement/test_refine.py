"""Refinement: what the energy says, what no step may do, and what every result must satisfy."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import DensityError, FoldedUVError, PinError
from omt_uv.solver.maps import energy as E
from omt_uv.solver.maps.overlap import overlap_share
from omt_uv.solver.maps.tutte import tutte
from omt_uv.solver.maps.untangle import arc_length_boundary, count_folds, untangle
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import Progress, drain
from omt_uv.solver.refinement.continuation_rules import QUALITIES
from omt_uv.solver.refinement.refine import BOUNDARIES, RefinementOptions, refine

STANDARD = QUALITIES["standard"].area_error


def start(V, F, domain="disk"):
    """Tutte's map, boundary spread by length."""
    loop = boundary_loops(F)[0]
    outline = arc_length_boundary(V, loop, 1.0)
    if domain == "square":
        outline = outline / np.abs(outline).max(1)[:, None]
    return tutte(V, F, loop, outline)


def run(V, F, uv=None, target=None, pins=None, **options):
    domain = "square" if options.get("boundary") == "square" else "disk"
    uv = start(V, F, domain) if uv is None else uv
    return drain(refine(V, F, uv, RefinementOptions(**options), target=target, pins=pins))


def area_l1(V, F, uv, target=None):
    target = face_areas(V, F) if target is None else target
    signed = signed_areas(uv, F)
    return np.abs(signed / signed.sum() - target / target.sum()).sum()


def shear(V, F, uv):
    faces = E.elements(V, F, face_areas(V, F))
    a, b = (np.abs(d) for d in faces.derivatives(uv[:, 0] + 1j * uv[:, 1]))
    return faces.area @ ((a + b) / (a - b))


def complex_map(V, F):
    uv = start(V, F)
    return uv[:, 0] + 1j * uv[:, 1]


def elements_of(V, F, rng=None):
    target = face_areas(V, F)
    return E.elements(V, F, target if rng is None else target * rng.uniform(0.5, 2, len(F)))


# ---- the energy ---------------------------------------------------------------------------------------------


def test_energy_of_a_triangle_by_hand():
    V, F = meshes.single_triangle()
    w = 3 * V[:, 0] + 1j * V[:, 1]  # singular values 3 and 1, area ratio 3
    value = E.energy(elements_of(V, F), w, area_weight=2.0)
    assert value == pytest.approx((3 + 1 / 3) / 2 - 1 + 2 * ((3 + 1 / 3) / 2 - 1))


def test_energy_is_zero_at_an_isometry_and_infinite_at_a_fold():
    V, F = meshes.grid()
    w = (V[:, 0] + 1j * V[:, 1]) * np.exp(0.7j) + 3
    faces = elements_of(V, F)
    assert E.energy(faces, w, 10.0) == pytest.approx(0, abs=1e-14)
    assert np.abs(E.gradient(faces, w, 10.0)).max() < 1e-13
    assert E.energy(faces, w.conj(), 10.0) == np.inf


@pytest.mark.parametrize("balance", [0.0, 3.0, 300.0])
def test_gradient_is_the_derivative_of_the_energy(balance):
    rng = np.random.default_rng(0)
    V, F = meshes.random_disk()
    faces, w = elements_of(V, F, rng), complex_map(V, F)
    direction = rng.normal(size=len(w)) + 1j * rng.normal(size=len(w))
    h = 1e-7
    numeric = (E.energy(faces, w + h * direction, balance) - E.energy(faces, w - h * direction, balance)) / (2 * h)
    exact = (E.gradient(faces, w, balance).conj() * direction).real.sum()
    assert numeric == pytest.approx(exact, rel=1e-5)


def hessian_of_one_face(faces, w, balance):
    rows = np.ascontiguousarray(E.face_derivatives(faces, w, balance).rows.conj()).view(float)
    return (np.swapaxes(rows, 1, 2) @ rows)[0]


def numeric_hessian(faces, w, balance):
    h, columns = 1e-5, []
    for k in range(3):
        for axis in (1, 1j):
            step = np.zeros(3, complex)
            step[k] = h * axis
            difference = (E.gradient(faces, w + step, balance) - E.gradient(faces, w - step, balance)) / (2 * h)
            columns.append(difference.view(float))
    return np.array(columns)


@pytest.mark.parametrize("seed", range(6))
def test_hessian_is_the_nearest_semidefinite_one(seed):
    """Negative eigenvalues are set to zero in the space of Jacobians, all others are exact."""
    rng = np.random.default_rng(seed)
    V, F = meshes.single_triangle()
    faces = elements_of(V, F, rng)
    w = V[:, 0] + 1j * V[:, 1] + 0.3 * (rng.normal(size=3) + 1j * rng.normal(size=3))
    if signed_areas(np.column_stack([w.real, w.imag]), F)[0] < 0:
        w = w.conj()
    exact, projected = numeric_hessian(faces, w, 2.0), hessian_of_one_face(faces, w, 2.0)
    assert np.linalg.eigvalsh(projected).min() > -1e-10 * np.abs(projected).max()
    # Both as forms of the Jacobian (dw/dz, dw/dconj z), four real numbers that corners determine.
    jacobian = jacobian_of_corners(faces)
    inverse = np.linalg.pinv(jacobian)
    values, vectors = np.linalg.eigh(inverse.T @ exact @ inverse)
    clamped = jacobian.T @ (vectors * np.maximum(values, 0)) @ vectors.T @ jacobian
    assert np.allclose(clamped, projected, rtol=1e-4, atol=1e-5 * np.abs(projected).max())


def jacobian_of_corners(faces):
    """(4,6): derivatives of one face by its corners' coordinates."""
    columns = []
    for k in range(3):
        for axis in (1, 1j):
            step = np.zeros(3, complex)
            step[k] = axis
            a, b = faces.derivatives(step)
            columns.append([a[0].real, a[0].imag, b[0].real, b[0].imag])
    return np.array(columns).T


def test_pressure_only_softens_the_hessian():
    V, F = meshes.bumpy()
    faces, w = elements_of(V, F), complex_map(V, F)
    w = w / np.sqrt(faces.areas(w).sum())
    sizes = [np.square(np.abs(E.face_derivatives(faces, w, 50.0, p).rows)).sum() for p in (0.0, 0.3, 1.0)]
    assert sizes[0] < sizes[1] < sizes[2]


# ---- the result ---------------------------------------------------------------------------------------------

MESHES = {
    "bumpy": meshes.bumpy,
    "cone": meshes.cone,
    "hemisphere": meshes.hemisphere,
    "random": meshes.random_disk,
    "cap": meshes.cap,
}


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("name", MESHES)
def test_no_fold_and_small_error(name, boundary):
    V, F = MESHES[name]()
    result = run(V, F, boundary=boundary)
    assert (signed_areas(result.uv, F) > 0).all()
    assert result.status == "converged"
    assert area_l1(V, F, result.uv) == pytest.approx(result.area_error, abs=1e-9)
    assert result.area_error <= STANDARD
    assert not result.overlap
    assert overlap_share(result.uv[F]) == 0


@pytest.mark.parametrize("name", ["bumpy", "hemisphere"])
def test_every_quality_keeps_its_promise_and_a_better_one_has_less_energy(name):
    V, F = MESHES[name]()
    found = {quality: run(V, F, quality=quality) for quality in ("draft", "standard", "exact")}
    for quality, result in found.items():
        assert result.area_error <= QUALITIES[quality].area_error
    at_its_weight = QUALITIES["standard"].area_weights[-1]
    draft, standard, _ = (E.energy(elements_of(V, F), r.uv @ [1, 1j], at_its_weight) for r in found.values())
    assert draft > standard
    assert found["exact"].area_error < min(found["standard"].area_error, found["draft"].area_error)


def test_flat_charts_become_isometric():
    V, F = meshes.comb()
    V = np.column_stack([np.cos(0.3 * V[:, 0]), np.sin(0.3 * V[:, 0]), 0.3 * V[:, 1]])  # rolled on a cylinder
    result = run(V, F)
    assert result.area_error < 1e-9
    assert shear(V, F, result.uv) == pytest.approx(1, abs=1e-9)
    assert overlap_share(result.uv[F]) == 0


def test_disk_lies_on_the_circle_exactly():
    V, F = meshes.bumpy()
    uv = run(V, F, boundary="disk").uv
    radius = np.linalg.norm(uv[boundary_loops(F)[0]], axis=1)
    assert np.ptp(radius) < 1e-14
    assert np.pi * radius[0] ** 2 == pytest.approx(face_areas(V, F).sum())


def test_square_lies_on_the_square_exactly():
    V, F = meshes.bumpy()
    uv = run(V, F, boundary="square").uv
    half = np.sqrt(face_areas(V, F).sum()) / 2
    outline = np.abs(uv[boundary_loops(F)[0]]) / half
    assert np.allclose(outline.max(1), 1, atol=1e-14)
    corners = (np.abs(outline - 1) < 1e-14).all(1)
    assert corners.sum() == 4
    assert signed_areas(uv, F).sum() == pytest.approx((2 * half) ** 2)


def test_targets_are_met():
    V, F = meshes.bumpy()
    centre = V[F].mean(1)
    target = face_areas(V, F) * np.exp(2 * centre[:, 0])
    result = run(V, F, target=target)
    assert area_l1(V, F, result.uv, target) <= STANDARD
    assert area_l1(V, F, result.uv) > 0.1
    doubled = run(V, F, target=2 * target)
    assert np.allclose(doubled.uv, result.uv, atol=1e-6)


def test_free_result_has_the_area_and_the_pose_of_its_start():
    V, F = meshes.hemisphere()
    uv = start(V, F)
    result = run(V, F, uv)
    assert signed_areas(result.uv, F).sum() == pytest.approx(face_areas(V, F).sum())
    turned = np.array([[0.6, -0.8], [0.8, 0.6]])
    moved = run(V, F, 0.01 * uv @ turned.T + [5, 7])
    assert np.allclose((moved.uv - moved.uv.mean(0)), (result.uv - result.uv.mean(0)) @ turned.T, atol=1e-5)


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_scale_of_the_surface_is_the_scale_of_the_map(boundary):
    V, F = meshes.cap()
    small, large = run(V, F, boundary=boundary), run(1000 * V, F, boundary=boundary)
    assert np.allclose(large.uv - large.uv.mean(0), 1000 * (small.uv - small.uv.mean(0)), atol=1e-3)


@pytest.mark.parametrize("boundary", ["free", "disk"])
def test_numbering_does_not_matter(boundary):
    V, F = meshes.random_disk()
    uv = start(V, F)
    order = np.random.default_rng(0).permutation(len(V))
    place = np.argsort(order)
    shuffled = np.random.default_rng(1).permutation(len(F))
    a = run(V, F, uv, boundary=boundary)
    b = run(V[order], place[F][shuffled][:, [1, 2, 0]], uv[order], boundary=boundary)
    assert np.allclose(a.uv[order], b.uv, atol=1e-6)


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_balance_trades_area_for_shear_strictly(boundary):
    V, F = meshes.cap()
    results = [run(V, F, boundary=boundary, balance=t) for t in (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)]
    error = [r.area_error for r in results]
    sheared = [shear(V, F, r.uv) for r in results]
    assert (np.diff(error) > 0).all()
    assert (np.diff(sheared) < 0).all()
    assert all((signed_areas(r.uv, F) > 0).all() for r in results)


def test_mirrored_uvs_stay_mirrored():
    V, F = meshes.cap()
    uv = start(V, F)
    plain, mirrored = run(V, F, uv), run(V, F, uv * [-1, 1])
    assert (signed_areas(mirrored.uv, F) < 0).all()
    assert np.allclose(mirrored.uv, plain.uv * [-1, 1], atol=1e-6)


def test_refine_reports_progress_that_grows():
    V, F = meshes.bumpy()
    seen = []
    drain(refine(V, F, start(V, F)), seen.append)
    assert all(isinstance(p, Progress) for p in seen)
    fractions = [p.fraction for p in seen]
    assert fractions[0] == 0
    assert fractions[-1] == 1
    assert (np.diff(fractions) > 0).all()


# ---- folded starts ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_folded_starts_are_untangled(boundary):
    V, F = meshes.bumpy()
    uv = start(V, F, "square" if boundary == "square" else "disk")
    outline = boundary_loops(F)[0]
    inner = np.setdiff1d(np.arange(len(V)), outline)
    uv[inner] += 0.1 * np.random.default_rng(0).normal(size=(len(inner), 2))
    assert count_folds(uv, F) > 20
    result = run(V, F, uv, boundary=boundary)
    assert (signed_areas(result.uv, F) > 0).all()
    assert result.area_error <= STANDARD


def test_untangling_keeps_what_is_valid():
    V, F = meshes.cap()
    uv, loop = start(V, F), boundary_loops(F)[0]
    straight, warning = untangle(uv, V, F, loop, uv[loop])
    assert warning is None
    assert np.allclose(straight, uv, atol=1e-10)


def test_a_boundary_out_of_order_is_replaced_and_said():
    V, F = meshes.cap()
    uv, loop = start(V, F), boundary_loops(F)[0]
    uv[loop[:2]] = uv[loop[1::-1]]
    result = run(V, F, uv, boundary="disk")
    assert any("not in order" in w for w in result.warnings)
    assert (signed_areas(result.uv, F) > 0).all()


# ---- a boundary that may not cross itself -------------------------------------------------------------------


def overlapping_helix():
    """A strip that winds twice around a cone, so that its unrolled boundary runs over itself."""
    turns, k = 1.6, 120
    angle = np.linspace(0, 2 * np.pi * turns, k)
    rows = []
    for radius in (0.8, 1.0, 1.2):
        rows.append(np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.25 * angle * 0.2]))
    V = np.concatenate(rows)
    quad = np.arange(k - 1)
    F = np.concatenate(
        [
            np.concatenate(
                [
                    np.column_stack([r * k + quad, (r + 1) * k + quad, r * k + quad + 1]),
                    np.column_stack([r * k + quad + 1, (r + 1) * k + quad, (r + 1) * k + quad + 1]),
                ]
            )
            for r in range(2)
        ]
    )
    return V, F[:, [0, 1, 2]]


def test_a_strip_that_would_run_over_itself_is_kept_apart():
    V, F = overlapping_helix()
    result = run(V, F)
    assert not result.overlap
    assert overlap_share(result.uv[F]) == 0
    assert (signed_areas(result.uv, F) > 0).all()
    assert result.area_error < 0.01


@pytest.mark.parametrize("mesh", [meshes.comb, meshes.spiral_strip])
def test_winding_charts_do_not_overlap(mesh):
    V, F = mesh()
    V = V + 0.2 * np.column_stack([np.zeros((len(V), 2)), np.sin(3 * V[:, 0]) * np.cos(2 * V[:, 1])])
    result = run(V, F)
    assert not result.overlap
    assert overlap_share(result.uv[F]) == 0
    assert result.area_error < 0.01


# ---- pins ---------------------------------------------------------------------------------------------------


def test_pins_stay_where_they_are_to_the_last_bit():
    V, F = meshes.bumpy()
    first = run(V, F).uv
    pins = np.array([0, 16, 200, 288])
    result = run(V, F, first, pins=(pins, first[pins]))
    assert np.array_equal(result.uv[pins], first[pins])
    assert (signed_areas(result.uv, F) > 0).all()
    assert result.area_error <= STANDARD


def test_pins_are_dragged_to_places_that_stretch_the_map():
    V, F = meshes.bumpy()
    corners = np.array([0, 16, 272, 288])
    places = np.array([[0.1, 0.1], [0.9, 0.2], [0.2, 0.7], [0.8, 0.9]])
    result = run(V, F, pins=(corners, places))
    assert np.array_equal(result.uv[corners], places)
    assert (signed_areas(result.uv, F) > 0).all()
    assert overlap_share(result.uv[F]) == 0


def test_one_pin_fixes_the_place_and_none_changes_the_size():
    V, F = meshes.bumpy()
    uv = 0.1 * start(V, F) + 0.5
    result = run(V, F, uv, pins=(np.array([7]), uv[[7]]))
    assert np.array_equal(result.uv[7], uv[7])
    assert signed_areas(result.uv, F).sum() == pytest.approx(signed_areas(uv, F).sum())
    assert result.area_error <= STANDARD


def test_pins_that_contradict_are_named():
    V, F = meshes.bumpy()
    with pytest.raises(PinError, match="one place"):
        run(V, F, pins=(np.array([0, 5]), np.array([[0.0, 0], [0, 0]])))
    with pytest.raises(PinError, match="two places"):
        run(V, F, pins=(np.array([5, 5]), np.array([[0.0, 0], [1, 0]])))
    with pytest.raises(PinError, match="finite"):
        run(V, F, pins=(np.array([0, 5]), np.array([[0.0, 0], [np.nan, 0]])))


def test_pins_that_force_a_fold_are_named():
    V, F = meshes.grid()
    # All of one face, turned over, and a fourth to hold the orientation.
    face = F[40]
    places = V[face][:, [0, 1]][[1, 0, 2]]
    others = np.array([0, 8, 72, 80])
    with pytest.raises(PinError, match="fold") as error:
        run(V, F, pins=(np.append(face, others), np.concatenate([places, V[others][:, :2]])))
    assert len(error.value.elements)


# ---- bad input ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_a_bad_density_is_named(bad):
    V, F = meshes.grid()
    target = face_areas(V, F)
    target[5] = bad
    with pytest.raises(DensityError) as error:
        run(V, F, target=target)
    assert error.value.elements.tolist() == [5]


def test_uvs_without_area_are_named():
    V, F = meshes.grid()
    with pytest.raises(FoldedUVError, match="The UVs to refine have no area"):
        run(V, F, np.zeros((len(V), 2)))
    with pytest.raises(FoldedUVError, match="The UVs to refine have no area"):
        run(V, F, np.repeat(V[:, :1], 2, axis=1))
    broken = V[:, :2].copy()
    broken[3] = np.nan
    with pytest.raises(FoldedUVError) as error:
        run(V, F, broken)
    assert error.value.elements.tolist() == [3]


def test_uvs_folded_through_and_through_are_named():
    V, F = meshes.grid(20, 20)
    uv = np.random.default_rng(0).random((len(V), 2))
    with pytest.raises(FoldedUVError, match="beyond repair"):
        run(V, F, uv)


def test_options_outside_their_range_are_refused():
    V, F = meshes.grid()
    with pytest.raises(ValueError, match="balance"):
        run(V, F, balance=1.5)
    with pytest.raises(ValueError, match="boundary"):
        run(V, F, uv=V[:, :2], boundary="hexagon")
    with pytest.raises(ValueError, match="pins"):
        run(V, F, boundary="disk", pins=(np.array([0]), np.array([[0.0, 0]])))


# ---- published models ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["snail", "lilium", "alligator"])
def test_free_maps_of_models_are_exact(name):
    if meshes.model_path(name) is None:
        pytest.skip(f"no model {name}: set OMT_UV_MODELS")
    V, F = meshes.load_model(name)
    used, F = np.unique(F, return_inverse=True)
    V, F = V[used], F.reshape(-1, 3)
    result = run(V, F, quality="exact")
    assert area_l1(V, F, result.uv) <= 0.001
    assert (signed_areas(result.uv, F) > 0).all()
    assert not result.overlap


def test_lilium_has_little_shear():
    if meshes.model_path("lilium") is None:
        pytest.skip("no model lilium: set OMT_UV_MODELS")
    V, F = meshes.load_model("lilium")
    result = run(V, F)
    assert area_l1(V, F, result.uv) <= 0.003
    assert shear(V, F, result.uv) <= 1.15


def test_pin_errors_name_the_vertices_of_the_caller():
    """The refinement renumbers its mesh; whoever reads the error must not notice."""
    V, F = meshes.grid(8, 8)
    with pytest.raises(PinError) as caught:
        drain(refine(V, F, V[:, :2], pins=(np.array([5, 40, 70]), np.array([[0.0, 0], [0, 0], [1, 1]]))))
    assert sorted(caught.value.elements.tolist()) == [5, 40]
