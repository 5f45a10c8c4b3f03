"""As `test_every_warning`: sentences of new meshes, of maps to the sphere, of bodies, and of matches."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from said import Scenes, sentences
from scripted_steps import worked
from sphere_shapes import blob

from omt_uv.solver import errors
from omt_uv.solver.progress import drain
from omt_uv.solver.registration import register as registers
from omt_uv.solver.registration import results
from omt_uv.solver.registration.landmarks import vertex_landmarks
from omt_uv.solver.remeshing import remesh_component, remesh_surface
from omt_uv.solver.remeshing.components.components import split_components
from omt_uv.solver.remeshing.initial import component_maps, disk_images, initial_mesh
from omt_uv.solver.remeshing.initial.options import RemeshOptions
from omt_uv.solver.remeshing.initial.sample_plan import plan_samples
from omt_uv.solver.sphere import sphere_map as spheres
from omt_uv.solver.volumes import body_map

FOLDERS = ("solver/remeshing", "solver/sphere/sphere_map.py", "solver/volumes", "solver/registration")
SENTENCES = sentences(*FOLDERS)
SCENES = Scenes()
says = SCENES.says
NO_WARNINGS = {
    ("solver/remeshing/components/components.py", " for the map"): "taken out of what others say",
    ("solver/remeshing/components/components.py", ", mapped apart"): "taken out of what others say",
    ("solver/remeshing/components/components.py", ", remeshed apart"): "said of what others say",
    ("solver/remeshing/remesh_surface.py", "{} {} are too few"): "an error",
    ("solver/volumes/envelope.py", "A body of about {} tetrahedra"): "an error",
    ("solver/volumes/meshing.py", "A body of about {} tetrahedra"): "an error",
    ("solver/volumes/sampling.py", "An index of about {} places"): "an error",
    ("solver/volumes/sampling.py", "A lattice of {} points"): "an error",
    ("solver/volumes/shells.py", "A family of {} shells"): "an error",
    ("solver/volumes/shells.py", "A sphere of about {} faces"): "an error",
}
NO_LINES = np.zeros((0, 2), int)


def test_every_sentence_has_a_scene_or_a_reason_why_not():
    assert SCENES.without(SENTENCES, NO_WARNINGS) == []


@pytest.mark.parametrize("key", SCENES.of, ids=" ".join)
def test_a_sentence_is_told_from_its_bound_on_and_only_there(key, monkeypatch):
    SCENES.check(key, SENTENCES, monkeypatch)


def refused(error):
    """A solver that begins, and ends in an error."""

    def steps(*_, **__):
        yield from ()
        raise error

    return steps


def remeshed(V, F, count, rounds=0, **options):
    source = component_maps.RemeshSource(V, F)
    return drain(remesh_surface.remesh(source, count, RemeshOptions(rounds=rounds, fit=False, **options)))


# ---- new meshes --------------------------------------------------------------------------------------------------


@says("solver/remeshing/components/components.py", "{} turned over")
def turned_over(patch):
    V, F = meshes.grid(4, 4)
    for rows, who in (
        ((), ""), ((3,), "A triangle looked to the wrong side and was"), ((3, 20), "2 triangles looked there and were"),
    ):  # fmt: skip
        G = F.copy()
        G[list(rows)] = G[list(rows)][:, ::-1]
        yield split_components(V, G, NO_LINES).warnings, [f"{who} turned over"] if rows else []


@says("solver/remeshing/components/components.py", "{} boundary vertices lie on one another")
def touching(patch):
    V, F = meshes.grid(4, 4)
    for shift, count in ((2.0, 0), (0.0, 5), (0.5, 3)):
        W = np.concatenate([V, V + [1 if shift < 2 else 2, shift % 2, 0]])
        found = split_components(W, np.concatenate([F, F + len(V)]), NO_LINES)
        text = "boundary vertices lie on one another and stay apart; merging vertices that coincide joins them"
        # Both vertices of every pair.
        yield found.warnings, [f"{2 * count} {text}"] if count else []


@says("solver/remeshing/components/components.py", "{} left out")
def left_out(patch):
    V, F = meshes.grid(4, 4)
    one, two = "A part without area was", "2 parts without area were"
    for count, size, who in ((0, 0.0, ""), (1, 1.3e-6, one), (2, 1.3e-6, two), (1, 1.5e-6, "")):
        # A triangle of half that square each, beside a square: 1e-12 of its area, or less.
        small = size * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        W = np.concatenate([V, *(small + [2 + k, 0, 0] for k in range(count))])
        G = np.concatenate([F, len(V) + np.arange(3 * count).reshape(-1, 3)])
        yield split_components(W, G, NO_LINES).warnings, [f"{who} left out"] if who else []


def test_what_a_repair_says_is_said_of_a_new_mesh():
    V, F = meshes.grid(3, 3)
    (told,) = split_components(V, np.vstack([F, F[:2]]), NO_LINES).warnings
    how = "delete what is double, or merge vertices that coincide"
    assert told == f"2 faces with the same vertices as another, remeshed apart; {how}"
    W, G = np.vstack([V, V[5] + [0, 0, 1]]), np.vstack([F, [[5, 6, len(V)]]])
    assert [t for t in split_components(W, G, NO_LINES).warnings if "More" in t] == [
        "More than two faces meet at an edge; cut open there"
    ]


@says("solver/remeshing/initial/component_maps.py", "{}; a part was remeshed without")
def without_a_sphere(patch):
    maps = component_maps.RemeshSource(*meshes.icosphere(1)).maps[0]
    one = np.ones(len(maps.component.triangles))
    drain(maps.of_sphere(one))
    yield maps.warnings, []
    patch.setattr(component_maps, "sphere_image", refused(errors.TransportError("No cells")))
    assert drain(maps.of_sphere(2 * one)) is None and not maps.by_sphere
    yield maps.warnings, ["No cells; a part was remeshed without a map to the sphere"]


@says("solver/remeshing/initial/disk_images.py", "A conformal map puts neighbours")
@says("solver/remeshing/initial/disk_images.py", "{}; samples were carried to a mean value map")
def mean_values(patch):
    V, F = meshes.bumpy(4, 4)
    how = "samples were carried to a mean value map instead"
    for nearest in (1.01e-7, 0.99e-7):
        patch.setattr(disk_images, "halfedge_lengths", lambda *_, nearest=nearest: np.array([1.0, nearest]))
        told = [] if nearest > 1e-7 else [f"A conformal map puts neighbours too close together; {how}"]
        yield drain(disk_images.conformal_image(V, F)).warnings, told
    patch.setattr(disk_images, "conformal_disk", refused(errors.PrecisionError("Lost digits")))
    told = drain(disk_images.conformal_image(V, F)).warnings
    assert told == (f"Lost digits; {how}",)


@says("solver/remeshing/initial/disk_images.py", "{}; samples were spread without transport")
def without_transport(patch):
    V, F = meshes.bumpy(4, 4)
    uv = drain(disk_images.conformal_image(V, F)).uv
    yield drain(disk_images.preserving_image(V, F, uv, np.ones(len(F)))).warnings, []
    patch.setattr(disk_images, "transport", refused(errors.TransportError("No cells")))
    told = ["No cells; samples were spread without transport"]
    yield drain(disk_images.preserving_image(V, F, uv, np.ones(len(F)))).warnings, told


@says("solver/remeshing/initial/initial_mesh.py", "A part has no maps to the disk")
def without_maps(patch):
    V, F = meshes.bumpy(8, 8)
    text = "A part has no maps to the disk in double precision and was remeshed without"
    for fails, told in ((False, []), (True, [text])):
        if fails:
            patch.setattr(initial_mesh, "triangulate_chart", lambda *_: None)
        yield remeshed(V, F, 40, rounds=1, strategy="cfp-cfp").warnings, told


@says("solver/remeshing/remesh_component.py", "A part is thinner than the new triangles")
def too_thin(patch):
    """Boxes, and needles of which a few vertices do not reach both ends."""
    V, F = meshes.cube()
    text = "A part is thinner than the new triangles and does not keep its shape. Ask for more, or remesh it by itself"
    for thin, count, told in ((0.3, 20, []), (0.003, 16, [text]), (0.02, 60, [])):
        yield remeshed(V * [1, thin, thin], F, count, rounds=4).warnings, told


def test_what_is_far_is_told_by_the_edges_that_are_asked_for_there():
    component = split_components(*meshes.grid(4, 4), NO_LINES).components[0]
    corner, count = component.vertices[:1], len(component.triangles)
    far = np.linalg.norm(component.vertices - corner, axis=1).max()
    for edge, told in ((far / 1.49, False), (far / 1.51, True)):
        assert bool(remesh_component._too_thin(component, corner, np.full(count, edge))) == told


@says("solver/remeshing/initial/sample_plan.py", "{} vertices for a part are too few")
def too_few_for_corners(patch):
    text = "vertices for a part are too few to keep the corners of its boundaries and features"
    maps = component_maps.RemeshSource(*meshes.grid(8, 8)).maps[0]
    one, at = np.ones(len(maps.component.triangles)), np.ones(len(maps.component.vertices))
    for count, kept, told in ((4, True, []), (3, True, [f"3 {text}"]), (3, False, [])):
        found = plan_samples(maps, count, one, at, RemeshOptions(preserve_boundary=kept), 1.0)
        yield found.warnings, told


@says("solver/remeshing/remesh_surface.py", "{} {} are more than")
def no_detail(patch):
    V, F = meshes.quad_patch()
    patch.setattr(remesh_surface, "MAX_REFINEMENT", 4)
    for count_of, count in (("vertices", 16), ("vertices", 17), ("faces", 8), ("faces", 9)):
        more = count > 4 * (len(V) if count_of == "vertices" else len(F))
        told = [f"{count} {count_of} are more than 4 times the input's; they add no detail"] if more else []
        yield remeshed(V, F, count, count_of=count_of).warnings, told


@says("solver/remeshing/remesh_surface.py", "Closed surfaces have an even number")
def even_number(patch):
    V, F = meshes.icosphere(1)
    for count, made in ((40, 40), (41, 40)):
        found = remeshed(V, F, count, count_of="faces")
        assert len(found.triangles) == made
        text = f"Closed surfaces have an even number of triangles: {made} instead of {count}"
        yield [t for t in found.warnings if "even" in t], [text] if made != count else []


# ---- spheres, bodies, matches ------------------------------------------------------------------------------------


@says("solver/remeshing/remesh_surface.py", "{} ({} times)")
def several_times(patch):
    for texts, told in (
        (["a", "b"], ["a", "b"]),
        (["b", "a", "b"], ["b (2 times)", "a"]),
        (["a"] * 3, ["a (3 times)"]),
    ):
        yield remesh_surface.summed_up(texts), told


@says("solver/sphere/sphere_map.py", "On the sphere, the area of a face is off")
def off_on_the_sphere(patch):
    V, F = blob(1)
    true, goal = spheres._refined, spheres.QUALITIES["standard"].area_error

    def refined(error):
        def steps(*given):
            found = yield from true(*given)
            return replace(found, area_error=error)

        return steps

    for error in (goal, 1.001 * goal):
        patch.setattr(spheres, "_refined", refined(error))
        found = drain(spheres.sphere_map(V, F))
        off = np.abs(sphere_areas(found.positions, F) / areas(V, F) - 1)
        share = areas(V, F)
        mean, deviation = 100 * share @ off, 100 * np.sqrt(share @ off**2)
        text = (
            f"On the sphere, the area of a face is off by {mean:.1f} % on average, standard deviation {deviation:.1f} "
            "%; a finer mesh on long limbs helps"
        )
        yield found.warnings, [text] if error > goal else []
        yield drain(spheres.sphere_map(V, F, balance=0.2)).warnings, []


def areas(V, F):
    """Shares of the faces in the area."""
    a = np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1)
    return a / a.sum()


def sphere_areas(P, F):
    """Shares of the sphere: of Girard, by the solid angle of every face."""
    a, b, c = (P[F[:, k]] for k in range(3))
    top = np.einsum("mk,mk->m", a, np.cross(b, c))
    below = 1 + sum(np.einsum("mk,mk->m", x, y) for x, y in ((a, b), (b, c), (c, a)))
    return 2 * np.arctan2(top, below) / (4 * np.pi)


@says("solver/sphere/sphere_map.py", "{}; the map was built from coarse to fine")
def from_coarse_to_fine(patch):
    V, F = blob(1)
    yield drain(spheres.sphere_map(V, F, balance=0.2)).warnings, []
    told = ["Too thin; the map was built from coarse to fine instead"]
    for name, error in (("straightened", errors.PrecisionError), ("_transport_start", errors.TransportError)):
        with pytest.MonkeyPatch.context() as other:
            other.setattr(spheres, name, refused(error("Too thin")))
            yield drain(spheres.sphere_map(V, F, balance=0.2)).warnings, told


@says("solver/volumes/body_map.py", " inverted in the map")
def inverted(patch):
    how = "inverted in the map; the method newton has none"
    for count, who in ((0, ""), (1, "A tetrahedron is"), (2, "2 tetrahedra are")):
        yield body_map._told(count, 0.0), [f"{who} {how}"] if count else []


@says("solver/volumes/body_map.py", "Volumes are {} % off")
def volumes_off(patch):
    text = "Volumes are {} % off in sum: remesh the surface evenly, with smaller faces"
    yield body_map._told(0, 0.02), []
    yield body_map._told(0, 0.0201), [text.format(2)]
    yield body_map._told(0, 0.128), [text.format(13)]


@says("solver/volumes/body_map.py", "{} of {} tetrahedra")
def inverted_between(patch):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]])
    tets = np.array([[0, 1, 2, 3], [0, 2, 1, 4]])
    turned = {0: points, 1: points * [1, 1, -1], 2: points * [1, -1, 1]}
    turned[1] = points.copy()
    turned[1][4] = [0.2, 0.2, 2.0]
    first = body_map.VolumeMap(
        points=points, tets=tets, positions=points, domain="ball", shares=0.0, around_vertices=0.0, inverted=0, steps=0,
        warnings=(),
    )  # fmt: skip
    patch.setattr(body_map, "tet_problem", lambda *_: None)
    for count, verb in ((0, ""), (1, "is"), (2, "are")):
        through = turned[count]
        patch.setattr(body_map, "TetLocation", lambda *_, p=through: SimpleNamespace(values=lambda *_: p))
        fails = refused(errors.TetrahedraError("No"))
        patch.setattr(body_map, "untangled", fails if count else lambda *_: worked(points))
        patch.setattr(body_map, "exact_volumes", lambda *_: worked(SimpleNamespace(points=points, positions=points)))
        text = f"{count} of 2 tetrahedra {verb} inverted where they lie between those of the other body"
        yield drain(body_map.into_body(first, first)).warnings, [text] if count else []


@says("solver/registration/register.py", "{} into closed holes")
def into_holes(patch):
    V, F = blob(2)
    chosen = np.array([0, 40, 90])
    marks = vertex_landmarks((chosen, F), (chosen, F))
    true = registers._on
    closed = np.flatnonzero((F == 7).any(axis=1))
    name = np.cumsum(np.bincount(np.delete(F, closed, axis=0).ravel(), minlength=len(V)) > 0) - 1
    W, G = np.delete(V, 7, axis=0), name[np.delete(F, closed, axis=0)]
    holed = vertex_landmarks((chosen, F), (name[chosen], G))
    for count, who in ((0, ""), (1, "A vertex of the source falls"), (2, "2 vertices of the source fall")):

        def on(surface, faces, weights, count=count):
            found = true(surface, faces, weights)
            beside = np.arange(len(found.beside)) < (count if surface.holes else 0)
            return results.OnSurface(found.faces, found.barycentric, beside)

        patch.setattr(registers, "_on", on)
        told = [f"{who} into closed holes"] if count else []
        yield drain(registers.register((V, F), (W, G), holed)).warnings, told
        back = vertex_landmarks((name[chosen], G), (chosen, F))
        yield drain(registers.register((W, G), (V, F), back)).warnings, [t.replace("source", "target") for t in told]
    yield drain(registers.register((V, F), (V, F), marks)).warnings, []


@says("solver/registration/results.py", "Landmarks {} cannot be met")
def not_met(patch):
    V, F = blob(1)
    at = np.array([0, 5, 9])
    marks = vertex_landmarks((at, F), (at, F), ("eye", "nose", "chin"))
    nothing = results.OnSurface(np.zeros(0, int), np.zeros((0, 3)), np.zeros(0, bool))
    for met, names in (([True] * 3, ""), ([True, False, True], "'nose'"), ([False, True, False], "'eye', 'chin'")):
        found = results.Registration(
            nothing, nothing, "sphere", V, V, 0.0, V, np.zeros(3), np.array(met), (1, 1), 0.0, ("a",)
        )
        told = [f"Landmarks {names} cannot be met without a fold"] if names else []
        yield results.with_missed(found, marks, False).warnings, ["a", *told]
