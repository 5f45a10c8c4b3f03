"""Every sentence that the solver may say, on both sides of where it says it: nothing is told, and then those words.

`said.sentences` finds the sentences in the sources; one without a scene here, or in `test_every_warning_of_new_meshes`,
or without a reason in `NO_WARNINGS`, fails. A scene yields what is told and what is to be told, in words of its own,
with the numbers of what lies there.
"""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from hard_meshes import voxel_surface
from said import Scenes, sentences
from scripted_steps import worked

from omt_uv.solver import errors
from omt_uv.solver.analysis import density, region_density
from omt_uv.solver.canonical import named_maps
from omt_uv.solver.canonical.markers import ChartMarkers
from omt_uv.solver.cutting import cuts
from omt_uv.solver.cutting.disk_charts import disk_charts
from omt_uv.solver.editing import refine_island, uv_islands
from omt_uv.solver.flows import flow_map, passing
from omt_uv.solver.maps import untangle
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.closed_surface import closed_surface
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization import chart_map, convex_maps, initial_map, shear_bound, unwrap
from omt_uv.solver.parameterization.options import MapOptions, ShearBound
from omt_uv.solver.progress import EarlyEnd, RunLog, drain
from omt_uv.solver.refinement import continuation, initial_maps
from omt_uv.solver.refinement.refine import RefinementOptions, refine
from omt_uv.solver.transport.convex_domain import Disk
from omt_uv.solver.transport.inverse_map import centroid_map

SENTENCES = sentences("solver")
SCENES = Scenes()
says = SCENES.says
# What is said, but not as a warning: parts of errors, remedies, and names of ways.
NO_WARNINGS = {
    ("solver/analysis/joint_density.py", "The regions cannot have"): "an error",
    ("solver/analysis/joint_density.py", "or take the factors"): "a remedy",
    ("solver/canonical/markers.py", "Markers of corners"): "an error",
    ("solver/counts.py", "A mesh of about {} vertices"): "an error",
    ("solver/counts.py", "A picture of {} pixels"): "an error",
    ("solver/counts.py", "Ask for a smaller one"): "a remedy",
    ("solver/counts.py", "Ask for fewer"): "a remedy",
    ("solver/counts.py", "Ask for fewer, or for longer"): "a remedy",
    ("solver/errors.py", " ({} {}: {})"): "elements of an error",
    ("solver/errors.py", "apply one level"): "said by `test_every_warning` of the pipelines",
    ("solver/errors.py", "{} across a seam"): "said by `test_every_warning` of the pipelines",
    ("solver/flows/domain.py", "A wall of {} samples"): "an error",
    ("solver/flows/paths.py", "A path of {} places"): "an error",
    ("solver/maps/distortion.py", "The area of the faces"): "an error",
    ("solver/maps/overlap.py", "A measure by {} samples"): "an error",
    ("solver/mesh/charts.py", "surface of genus"): "an error",
    ("solver/mesh/closed_surface.py", "Fill the holes, or take"): "a remedy",
    ("solver/mesh/closed_surface.py", "Only bodies without handles"): "a remedy",
    ("solver/mesh/closed_surface.py", "Only closed surfaces without handles"): "a remedy",
    ("solver/parameterization/chart_map.py", "Cut this part further"): "a remedy",
    ("solver/partition/division.py", "A division into {} cells"): "an error",
    ("solver/signatures/marked.py", "A signature of {} points"): "an error",
    ("solver/signatures/marked.py", "Mark one vertex"): "a remedy",
    ("solver/signatures/marked.py", "Nothing is farther"): "an error",
    ("solver/signatures/marked.py", "The surface as far"): "an error",
    ("solver/signatures/signature.py", "A signature of {} points"): "an error",
    ("solver/sphere/conformal.py", "as it is"): "a way of a map",
    ("solver/sphere/moser_flow.py", "points left"): "an error",
    ("solver/subdivision/catmull_clark.py", "A subdivided mesh of about {} quads"): "an error",
    ("solver/subdivision/catmull_clark.py", "Ask for fewer levels"): "a remedy",
    ("solver/transport/damped_newton.py", "did not converge in {} steps"): "an error",
    ("solver/transport/damped_newton.py", "is stuck at a residual of {}"): "an error",
}
# Those of `test_every_warning_of_new_meshes`.
ELSEWHERE = ("solver/remeshing/", "solver/sphere/sphere_map.py", "solver/volumes/", "solver/registration/")
DISSOLVE, MERGING = "dissolve faces without area", "merging vertices that coincide"


def test_every_sentence_has_a_scene_or_a_reason_why_not():
    assert [s for s in SCENES.without(SENTENCES, NO_WARNINGS) if not s.module.startswith(ELSEWHERE)] == []


@pytest.mark.parametrize("key", SCENES.of, ids=" ".join)
def test_a_sentence_is_told_from_its_bound_on_and_only_there(key, monkeypatch):
    SCENES.check(key, SENTENCES, monkeypatch)


def disk(columns=3, **parts):
    """A grid as a disk that is to be mapped."""
    V, F = meshes.grid(columns, columns)
    chart = strict_charts(triangle_surface(V, F))[0]
    return chart_map._disk_mesh(chart.vertices, chart, MapOptions(**parts), None, RunLog(), ChartMarkers())


# ---- densities ---------------------------------------------------------------------------------------------------


@says("solver/analysis/density.py", "Areas are {} % of the texture off")
def areas_off(patch):
    text = "the density varies more than these faces can show. Soften the region, or choose a smaller factor"
    yield density.area_error_warnings(0.04, 0.02), []
    yield density.area_error_warnings(0.0401, 0.02), [f"Areas are 4 % of the texture off: {text}"]
    yield density.area_error_warnings(0.123, 0.05), [f"Areas are 12 % of the texture off: {text}"]


@says("solver/analysis/region_density.py", "The border of the region is very soft")
def soft_border(patch):
    """Told where densities vary by more than four times what a hard border would take for the same share."""
    area, factor = np.ones(1000), 2.0

    def found(weight):
        """The density, and what a hard border would take, of a region in part of less weight."""
        region = np.where(np.arange(1000) < 50, 1.0, np.where(np.arange(1000) < 500, weight, 0.0))
        share = region.mean()
        hard = factor * share / (1 - factor * share) * (1 - share) / share
        return region_density.exact_density(region, area, factor), hard

    low, high = 0.0, 0.44
    for _ in range(40):
        middle = (low + high) / 2
        one, hard = found(middle)
        low, high = (middle, high) if one.contrast < 4 * hard else (low, middle)
    for weight, soft in ((0.0, False), (0.999 * low, False), (1.001 * high, True), (0.44, True)):
        one, _ = found(weight)
        text = f"The border of the region is very soft for this factor: densities vary by {one.contrast:.3g}"
        yield one.warnings, [text] if soft else []


# ---- maps by name ------------------------------------------------------------------------------------------------


@says("solver/canonical/named_maps.py", "The conformal map with a free boundary turns")
def turned_over(patch):
    V, F = meshes.grid(3, 3)
    problem = named_maps.NamedProblem(V, F, np.ones(len(F)))
    for moved, text in ((None, ""), (0, "a face"), (5, "5 faces")):
        uv = V[:, :2].copy()
        if moved is not None:
            uv[moved] += 0.9
        count = int((~(doubled_areas(uv, F) > 0)).sum())
        text = {0: "", 1: "a face"}.get(count, f"{count} faces")
        patch.setattr(named_maps, "boundary_first", lambda *_, uv=uv: SimpleNamespace(uv=uv))
        told = f"The conformal map with a free boundary turns {text} over; choose a disk"
        yield drain(named_maps.conformal_map(problem)).warnings, [told] if count else []


def doubled_areas(uv, F):
    a, b = uv[F[:, 1]] - uv[F[:, 0]], uv[F[:, 2]] - uv[F[:, 0]]
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


@says("solver/canonical/named_maps.py", "A conformal map fills a rectangle of aspect")
def stretched(patch):
    V, F = meshes.grid(3, 3)
    found = SimpleNamespace(uv=V[:, :2], aspect=1.25, straightened=0)
    patch.setattr(named_maps, "conformal_rectangle", lambda *_: worked(found))
    text = "A conformal map fills a rectangle of aspect 1.25; it was stretched"
    for aspect, told in ((0.0, []), (1.25 / 1.0009, []), (1.25 / 1.0011, [text]), (1.25 * 1.0011, [text])):
        problem = named_maps.NamedProblem(V, F, np.ones(len(F)), "rectangle", np.array([0, 3, 15, 12]), aspect)
        yield drain(named_maps.conformal_map(problem)).warnings, told


# ---- cuts --------------------------------------------------------------------------------------------------------


def cut_of(V, F, **options):
    return drain(disk_charts(triangle_surface(V, F), **options)).warnings


def turned(F, *rows):
    F = F.copy()
    F[list(rows)] = F[list(rows)][:, ::-1]
    return F


@says("solver/cutting/cuts.py", "{} to the other side than the faces around")
def looking_back(patch):
    V, F = meshes.grid(4, 4)
    W, G = meshes.icosphere(1)
    how = "mapped with them, so that the texture is mirrored there. Turn faces over until all look outside"
    for rows, who in (((), ""), ((3,), "A face looks"), ((3, 20), "2 faces look")):
        told = [f"{who} to the other side than the faces around; {how}"] if rows else []
        yield cut_of(V, turned(F, *rows)), told
        yield cut_of(W, turned(G, *rows)), told


@says("solver/cutting/cuts.py", "Where a surface has one side only")
def one_sided(patch):
    text = "Where a surface has one side only, {} to the other side of the map; the texture is mirrored there"
    for count, who in ((0, ""), (1, "a face looks"), (2, "2 faces look")):
        yield list(cuts._warnings(False, 0, count, 0, 0)), [text.format(who)] if count else []
    # Half an icosahedron, every two of its vertices joined: however it is opened, some faces look to the other side.
    F = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [0, 5, 1], [1, 2, 4], [2, 3, 5], [3, 4, 1], [4, 5, 2],
                  [5, 1, 3]])  # fmt: skip
    V = np.random.default_rng(0).normal(size=(6, 3))
    (told,) = cut_of(V, F)
    (count,) = (k for k in (3, 4) if f" {k} faces" in told)
    yield [told], [text.format(f"{count} faces look")]
    yield cut_of(V, F[:5]), []


@says("solver/cutting/cuts.py", "A part with many handles")
def crowded(patch):
    text = "A part with many handles was taken apart, along the hard edges of its holes or into clusters"
    for rows, columns in ((3, 4), (1, 13)):
        solid = np.ones((2 * rows + 1, 2 * columns + 1, 1), bool)
        solid[1::2, 1::2] = False
        V, quads = voxel_surface(solid)
        found = drain(disk_charts(meshes.polygon_surface(V, quads.tolist()), sieve=32)).warnings
        yield [t for t in found if "handles" in t], [text] if rows * columns > 12 else []


@says("solver/cutting/cuts.py", "{} boundary vertices lie on one another")
def touching(patch):
    V, F = meshes.grid(4, 4)
    for shift, count in ((2.0, 0), (0.0, 10), (0.5, 6), (1.0, 2)):
        # Two patches side by side: what lies on one another of both, and stays two parts.
        both = np.concatenate([V, V + [1 if shift < 2 else 2, shift % 2, 0]]), np.concatenate([F, F + len(V)])
        text = f"{count} boundary vertices lie on one another; {MERGING} joins the parts there"
        yield cut_of(*both), [text] if count else []
    # A slit in a disk was meant to be open.
    slit = np.concatenate([V, V[[2]]]), np.where((F == 2) & (V[F].mean(axis=1)[:, :1] > 0.5), len(V), F)
    yield cut_of(*slit), []
    W, G = meshes.icosphere(1)
    yield cut_of(W, G[3:]), []


@says("solver/cutting/disk_charts.py", "{} no area and got a little")
def without_area(patch):
    V, F = meshes.grid(4, 4)
    for count, who in ((0, ""), (1, "A face has"), (2, "2 faces have")):
        W, G = V.copy(), F
        for k in range(count):
            # A vertex of its own on a side of the boundary: with the ends of the edge it has no area.
            edge = open_sides(F)[3 * k]
            G, W = np.vstack([G, [[edge[1], edge[0], len(W)]]]), np.vstack([W, W[list(edge)].mean(axis=0)])
        yield cut_of(W, G), [f"{who} no area and got a little for the map; {DISSOLVE}"] if count else []


def open_sides(F):
    """Boundary edges of triangles, as they run."""
    sides = np.concatenate([F[:, [k, (k + 1) % 3]] for k in range(3)]).tolist()
    return [tuple(e) for e in sides if e[::-1] not in sides]


@says("solver/cutting/hole_filling.py", "{} filled for the map")
def sieves(patch):
    V, F = meshes.icosphere(2)
    for holes in (4, 5, 6):
        # Faces that have no vertex in common are taken out.
        out, used = [], set()
        for k, row in enumerate(F.tolist()):
            if len(out) < holes and not used & set(F[np.isin(F, row).any(axis=1)].ravel().tolist()):
                out.append(k)
                used |= set(row)
        found = cut_of(V, np.delete(F, out, axis=0), sieve=3)
        texts = [text for text in found if "filled" in text]
        # One of them is the outline.
        filled = holes - 1 if holes - 1 > 3 else 0
        yield texts, [f"{filled} holes are filled for the map: cuts to them would leave it no shape"] if filled else []


# ---- islands -----------------------------------------------------------------------------------------------------


@says("solver/editing/refine_island.py", "The UVs were folded, or met themselves")
def straightened(patch):
    V, F = meshes.grid(4, 4)
    text = "The UVs were folded, or met themselves; the refinement started from a straightened map"
    for away in (0.0, 0.2, 0.3):
        uv = V[:, :2].copy()
        uv[12, 0] += away
        yield drain(refine_island.refine_island(V, F, uv)).warnings, [text] if away > 0.25 else []


@says("solver/editing/refine_island.py", "The outline of an island meets itself")
def meeting(patch):
    V, F = meshes.grid(4, 1)
    patch.setattr(refine_island, "_parted", lambda w, *_: w)
    text = "The outline of an island meets itself; it is not kept apart"
    for meets, told in ((False, []), (True, [text])):
        patch.setattr(refine_island, "meets_itself", lambda *_, meets=meets: meets)
        yield drain(refine_island.refine_island(V, F, V[:, :2])).warnings, told
    # Nor is it where pins hold all of it, which may ask for that.
    held = np.arange(len(V)), V[:, :2]
    yield drain(refine_island.refine_island(V, F, V[:, :2], pins=held)).warnings, []


@says("solver/editing/uv_islands.py", "{} faces have no area")
def nowhere(patch):
    V, F = meshes.grid(2, 2)
    for count in (0, 1, 3):
        W, G = (
            np.vstack([V, np.full((3 * count, 3), 5.0)]),
            np.vstack([F, len(V) + np.arange(3 * count).reshape(-1, 3)]),
        )
        uv = np.concatenate([V[F.ravel(), :2], np.full((3 * count, 2), 0.5)])
        text = f"{count} faces have no area, neither in space nor in the UVs, and stay; {DISSOLVE}"
        found = uv_islands.uv_islands(triangle_surface(W, G.astype(int)), uv)
        assert len(found.islands) == 1
        yield found.warnings, [text] if count else []


# ---- flows -------------------------------------------------------------------------------------------------------


@says("solver/flows/flow_map.py", "Vertices of a handle that the flow took elsewhere")
def handle_missed(patch):
    text = (
        "Vertices of a handle that the flow took elsewhere, by up to {} % of the diagonal, were set to their ends; a "
        "handle that keeps its shape, and a smaller radius, are followed more closely"
    )
    yield flow_map._warnings(1e-3, np.zeros(2), 0), []
    yield flow_map._warnings(1.01e-3, np.zeros(2), 0), [text.format("0.1")]
    yield flow_map._warnings(0.234, np.zeros(0), 0), [text.format("23")]


@says("solver/flows/flow_map.py", "An enclosed volume changes")
def volume_changed(patch):
    text = "An enclosed volume changes by {} %; a finer mesh near the handles helps"
    yield flow_map._warnings(0.0, np.array([1e-3, -1e-3]), 0), []
    yield flow_map._warnings(0.0, np.array([0.0, -1.2e-3]), 0), [text.format("0.12")]
    yield flow_map._warnings(0.0, np.array([0.057, -1e-3]), 0), [text.format("5.7")]


@says("solver/flows/flow_map.py", "{} through one another that did not before")
def newly_crossing(patch):
    how = "through one another that did not before; a finer mesh, a greater radius or a shorter way helps"
    yield flow_map._warnings(0.0, np.zeros(0), 0), []
    yield flow_map._warnings(0.0, np.zeros(0), 1), [f"A pair of faces passes {how}"]
    yield flow_map._warnings(0.0, np.zeros(0), 7), [f"7 pairs of faces pass {how}"]


@says("solver/flows/passing.py", "{} and {} are {} % of the diagonal apart")
def passing_by(patch):
    names, none, some = ["one", "two", "three"], np.zeros((0, 2), int), np.zeros((1, 2), int)
    text = (
        "{} and three are 12 % of the diagonal apart on their way and go different ways; what is around them moves up "
        "to {} times as fast as they do"
    )
    for strength, handles, surge, pairs, told in (
        (9.0, (0, 2), 3.0, none, []), (0.0, (0, 2), 3.1, none, [text.format("one", "3.1")]),
        (3.0, (0, 2), 1.0, some, []), (3.1, (1, 2), 1.04, some, [text.format("two", "1")]),
        (3.1, (1, 2), 1.0, none, []), (9.0, (-1, -1), 9.0, some, []),
    ):  # fmt: skip
        yield passing.Passing(strength, handles, 0.123).warning(names, surge, pairs), told


# ---- first maps --------------------------------------------------------------------------------------------------


@says("solver/maps/untangle.py", "The start could not be untangled")
def not_untangled(patch):
    V, F = meshes.grid(3, 3)
    loop = np.array([e[0] for e in sides_in_order(F)])
    text = "The start could not be untangled; the refinement starts from a mean value map of the surface"
    for energies, told in (((100.0, 1.0), []), ((100.1, 100.0), [text]), ((100.1, 100.1), [])):
        left = iter(energies)
        patch.setattr(untangle, "map_energy", lambda *_, left=left: next(left))
        said = untangle.untangle(V[:, :2], V, F, loop, V[loop, :2])[1]
        yield [] if said is None else [said], told


def sides_in_order(F):
    after = dict(open_sides(F))
    at, found = min(after), []
    while len(found) < len(after):
        found.append((at, after[at]))
        at = after[at]
    return found


@says("solver/transport/inverse_map.py", "The transport tangles the boundary")
def tangled(patch):
    t = 2 * np.pi * np.arange(12) / 12
    circle, told = 0.9 * np.column_stack([np.cos(t), np.sin(t)]), []
    centroid_map(circle, Disk(), np.arange(12), None, told)
    yield list(told), []
    centroid_map(circle, Disk(), np.arange(12)[::-1], None, told)
    yield told, ["The transport tangles the boundary; it was spread evenly instead"]


@says("solver/parameterization/initial_map.py", "{}; started from a mean value map")
def from_mean_values(patch):
    task = disk(3, boundary="disk")
    for fails in (False, True):
        if fails:
            patch.setattr("omt_uv.solver.conformal.disk_map.conformal_disk", refused(errors.PrecisionError("Too thin")))
        log = RunLog()
        drain(initial_map.initial_map(task, log))
        yield log.warnings, ["Too thin; started from a mean value map instead"] if fails else []


@says("solver/parameterization/initial_map.py", "{}; refined the embedding without transport")
def without_transport(patch):
    task, cause = disk(3, boundary="disk"), errors.TransportError("No cells")
    first = "No cells; started from a mean value map instead"
    for fails, told in ((False, []), (True, [first, "No cells; refined the embedding without transport"])):
        if fails:
            patch.setattr(initial_map, "_transport", lambda *_: worked((None, cause.cause)))
        log = RunLog()
        drain(initial_map.initial_map(task, log))
        yield log.warnings, told


@says("solver/parameterization/initial_map.py", "The conformal map puts neighbours")
def too_close(patch):
    task = disk(3, boundary="disk")
    for nearest in (1.01e-7, 0.98e-7, 3e-9):
        patch.setattr(initial_map, "halfedge_lengths", lambda *_, nearest=nearest: np.array([1.0, nearest]))
        log = RunLog()
        drain(initial_map.initial_map(task, log))
        text = f"The conformal map puts neighbours {nearest:.0e} apart, too close for the transport"
        yield log.warnings, [f"{text}; started from a mean value map instead"] if nearest < 1e-7 else []


@says("solver/canonical/named_maps.py", "The conformal map puts neighbours")
def too_close_for_cells(patch):
    one = disk(3, boundary="disk")
    task = named_maps.NamedProblem(one.vertices, one.triangles, one.target, "disk")
    for nearest in (1.01e-7, 0.98e-7, 3e-9):
        patch.setattr(named_maps, "halfedge_lengths", lambda *_, nearest=nearest: np.array([1.0, nearest]))
        text = f"The conformal map puts neighbours {nearest:.0e} apart, too close for the transport"
        told = [f"{text}; started from a mean value map instead"] if nearest < 1e-7 else []
        yield list(drain(named_maps.polar_map(task)).warnings), told


def refused(error):
    """A solver that begins, and ends in an error."""

    def steps(*_, **__):
        yield from ()
        raise error

    return steps


@says("solver/refinement/initial_maps.py", "The boundary of the start is not in order")
def not_in_order(patch):
    V, F = meshes.grid(4, 4)
    loop = np.array([e[0] for e in sides_in_order(F)])
    text = "The boundary of the start is not in order; it was spread over the domain by its length"
    mixed = V[:, :2] - 0.5
    mixed[loop[:8]] = mixed[loop[:8][::-1]]
    for uv, told in ((V[:, :2] - 0.5, []), (mixed, [text])):
        yield [t for t in initial_maps.disk_initial_map(V, F, uv, loop).warnings if "order" in t], told
        yield [t for t in initial_maps.square_initial_map(V, F, uv, loop).warnings if "order" in t], told


@says("solver/refinement/initial_maps.py", "The corners of the start squeeze")
def squeezed(patch):
    V, F = meshes.bumpy(6, 6)
    loop = np.array([e[0] for e in sides_in_order(F)])
    text = "The corners of the start squeeze or fold faces; they were spread by the length of the boundary"
    usable = initial_maps.USABLE
    for energy, told in ((usable, []), (1.01 * usable, [text])):
        energies = iter([energy])
        patch.setattr(initial_maps, "map_energy", lambda *_, e=energies: next(e, 1.0))
        yield [t for t in initial_maps.square_initial_map(V, F, V[:, :2], loop).warnings if "corners" in t], told


@says("solver/refinement/initial_maps.py", "{} boundary vertices leave the circle")
def off_the_circle(patch):
    for (V, F), count in ((meshes.cap(6, 12), 0), (meshes.quad_patch(), 1), (fan_with_ears(2), 2)):
        loop = np.array([e[0] for e in sides_in_order(F)])
        found = initial_maps.notched_disk(
            initial_maps.disk_initial_map(V, F, V[:, :2] - V[:, :2].mean(axis=0), loop), F, loop
        )
        text = f"{count} boundary vertices leave the circle, where it has no room for their faces"
        yield [] if found is None else found.warnings, [text] if count else []


def fan_with_ears(count):
    """A fan of six triangles about a middle, with ears on some of its sides, which one inner edge cuts off each."""
    a = np.pi * np.arange(6) / 3
    V = np.concatenate([[[0.0, 0, 0]], np.column_stack([np.cos(a), np.sin(a), 0 * a])])
    F = np.column_stack([np.zeros(6, int), 1 + np.arange(6), 1 + (1 + np.arange(6)) % 6])
    ears = 2 * np.arange(count)
    b = a[ears] + np.pi / 6
    tips = 1.3 * np.column_stack([np.cos(b), np.sin(b), 0 * b])
    return np.vstack([V, tips]), np.vstack([F, np.column_stack([F[ears, 2], F[ears, 1], 7 + np.arange(count)])])


@says("solver/refinement/initial_maps.py", "{} boundary vertices leave the square")
def off_the_square(patch):
    V, F = meshes.grid(4, 4)
    loop = np.array([e[0] for e in sides_in_order(F)])
    for ears in (0, 1, 2):
        W, G = V, F
        for k in range(ears):
            # The middle edge of a side gets a face of its own: all of its corners are on that side.
            edge = next(
                e
                for e in sides_in_order(F)
                if abs(V[list(e)].mean(axis=0)[k] - (0.375)) < 1e-9 and V[e[0], 1 - k] < 1e-9
            )
            tip = V[list(edge)].mean(axis=0) - 0.02 * np.eye(3)[1 - k]
            G, W = np.vstack([G, [[edge[1], edge[0], len(W)]]]), np.vstack([W, tip])
        loop = np.array([e[0] for e in sides_in_order(G)])
        text = f"{ears} boundary vertices leave the square, where a face would lie along a side"
        yield initial_maps.square_initial_map(W, G, W[:, :2], loop).warnings, [text] if ears else []


@says("solver/refinement/continuation.py", "The boundary of the start crosses itself")
def crossing_start(patch):
    V, F = meshes.grid(6, 1)
    text = "The boundary of the start crosses itself; it is not kept apart"
    for crosses, told in ((False, []), (True, [text])):
        patch.setattr(continuation.MapProblem, "boundary_crosses", lambda self, w, crosses=crosses: crosses)
        yield drain(refine(V, F, V[:, :2], RefinementOptions(balance=0.5))).warnings, told


# ---- broken meshes -----------------------------------------------------------------------------------------------


@says("solver/mesh/closed_surface.py", "{} no area and got a little")
def flat_of_a_sphere(patch):
    V, F = meshes.icosphere(1)
    polygons = np.arange(len(F))
    for rows, who in (((), ""), ((0,), "A face has"), ((0, 1), "2 faces have")):
        W = np.concatenate([V, V[F[list(rows)]].mean(axis=1).reshape(-1, 3)])
        G, own = [F], [polygons]
        for k, row in enumerate(rows):
            # A vertex on the first edge of a face: of what it is split into, one has no area.
            i, j, _ = F[row]
            W[len(V) + k] = (V[i] + V[j]) / 2
        split = [
            [[i, j, len(V) + k], [j, h, len(V) + k], [h, i, len(V) + k]] for k, (i, j, h) in enumerate(F[list(rows)])
        ]
        keep = np.setdiff1d(np.arange(len(F)), rows)
        G = np.vstack([F[keep], *split]) if rows else F
        own = np.concatenate([keep, len(F) + np.arange(3 * len(rows))])
        told = [f"{who} no area and got a little for the map; {DISSOLVE}"] if rows else []
        yield closed_surface(W, G).warnings, told
        yield closed_surface(W, G, own).warnings, told
        # Of a polygon as a whole there is enough.
        yield closed_surface(W, G, np.concatenate([keep, np.repeat(len(F) + np.arange(len(rows)), 3)])).warnings, []


@says("solver/mesh/repair.py", "{} sharing several edges in a row")
def sharing_edges(patch):
    V = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0], [1, -1, 0.0]])
    how = "sharing several edges in a row with another, mapped apart; dissolve the vertex that only the two share"
    both = [[0, 1, 2, 3], [2, 1, 0, 4]]
    for polygons, told in (([[0, 1, 3], [1, 2, 3]], []), (both, [f"2 faces {how}"])):
        yield drain(disk_charts(meshes.polygon_surface(V, polygons))).warnings, told


@says("solver/mesh/repair.py", "More than two faces meet")
def three_at_an_edge(patch):
    V, F = meshes.grid(3, 3)
    inner = [tuple(e) for e in np.concatenate([F[:, [k, (k + 1) % 3]] for k in range(3)]).tolist()]
    inner = [e for e in inner if e[::-1] in inner and e[0] < e[1]]
    for count, where in ((0, ""), (1, "an edge"), (2, "2 edges")):
        chosen, W, G = [inner[0], next(e for e in inner if not set(e) & set(inner[0]))][:count], V, F
        for a, b in chosen:
            G, W = np.vstack([G, [[a, b, len(W)]]]), np.vstack([W, V[a] + [0, 0, 1]])
        text = f"More than two faces meet at {where}; cut open there for the map"
        yield [t for t in cut_of(W, G) if "More than" in t], [text] if count else []


@says("solver/mesh/repair.py", "{} with the same vertices as another")
def doubles(patch):
    V, F = meshes.grid(3, 3)
    how = "with the same vertices as another, mapped apart; delete what is double, or merge vertices that coincide"
    for rows, who in (((), ""), ((4,), "1 face"), ((4, 9), "2 faces")):
        yield cut_of(V, np.vstack([F, F[list(rows)]])), [f"{who} {how}"] if rows else []


@says("solver/mesh/repair.py", "{} with a vertex used twice")
def twice(patch):
    V, F = meshes.grid(3, 3)
    for rows, who in (((), ""), ((0,), "1 face"), ((0, 5), "2 faces")):
        G = np.vstack([F, F[list(rows)][:, [0, 1, 1]]])
        told = [f"{who} with a vertex used twice, mapped apart; {DISSOLVE}"] if rows else []
        yield [t for t in cut_of(V, G) if "used twice" in t], told


# ---- charts ------------------------------------------------------------------------------------------------------


def map_of(V, F, **options):
    return drain(chart_map.map_chart(strict_charts(triangle_surface(V, F))[0], options=MapOptions(**options))).warnings


@says("solver/parameterization/chart_map.py", "A chart with only three boundary vertices")
def only_three(patch):
    T, Q = meshes.single_triangle(), meshes.quad_patch()
    for boundary in ("square", "rectangle"):
        text = f"A chart with only three boundary vertices does not fill a {boundary}; its boundary is free"
        yield [t for t in map_of(*T, boundary=boundary) if "three" in t], [text]
        yield [t for t in map_of(*Q, boundary=boundary) if "three" in t], []
    yield [t for t in map_of(*T, boundary="disk") if "three" in t], []


@says("solver/parameterization/chart_map.py", "parts that single edges cut off")
def more_than_a_circle(patch):
    text = "The disk has no room for this chart (parts that single edges cut off take more than all of a circle)"
    V, F = fan_with_ears(3)
    for arcs, told in (([0.5, 0.5], []), ([0.6, 0.41], [f"{text}; its boundary is free instead"])):
        patch.setattr(chart_map, "arcs_of_parts", lambda *_, arcs=arcs: (np.array(arcs), None))
        yield [t for t in map_of(V, F, boundary="disk") if "single" in t], told
        yield [t for t in map_of(V, F, boundary="disk", balance=0.5) if "single" in t], []
        yield [t for t in map_of(V, F, boundary="free") if "single" in t], []


@says("solver/parameterization/chart_map.py", "faces stay squeezed to nothing")
@says("solver/errors.py", "The {} has no room")
def squeezed_to_nothing(patch):
    task = disk(3, boundary="disk")
    for share in (1.1e-7, 0.9e-7):
        area = task.target * 1.0
        area[4] = share * task.target[4]
        patch.setattr(chart_map, "signed_areas", lambda *_, area=area: area)
        log = RunLog()
        options = chart_map.RefinementOptions(boundary="disk")
        start = chart_map.mean_value_sites(task.vertices, task.triangles, task.loop, None, Disk())
        drain(chart_map._refined(task, start, options, False, None, log))
        text = "The disk has no room for this chart (faces stay squeezed to nothing); its boundary is free instead"
        yield log.warnings, [text] if share < 1e-7 else []


@says("solver/parameterization/chart_map.py", "Markers of a centre")
def markers_not_kept(patch):
    text, uv = "Markers of a centre, and of three places, are kept by conformal and polar maps alone", np.eye(4, 2)
    task = disk(3)
    for markers, told in (
        (ChartMarkers(), []), (ChartMarkers(start=0), []), (ChartMarkers(corners=(0, 1, 2, 3)), []),
        (ChartMarkers(centre=0), [text]), (ChartMarkers(corners=(0, 1, 2)), [text]),
    ):  # fmt: skip
        log = RunLog()
        chart_map._turned(uv, task, markers, None, log)
        yield log.warnings, told


@says("solver/parameterization/chart_map.py", "A conformal map fills a rectangle of its own aspect")
def no_square(patch):
    V, F = meshes.bumpy(4, 4)
    text = "A conformal map fills a rectangle of its own aspect, and no square"
    for boundary, kind, told in (
        ("square", "conformal", [text]),
        ("rectangle", "conformal", []),
        ("square", "polar", []),
    ):
        yield [t for t in map_of(V, F, boundary=boundary, kind=kind) if "own aspect" in t], told


@says("solver/parameterization/chart_map.py", "{}; refined without a coarser mesh")
def no_coarser(patch):
    V, F = meshes.bumpy(6, 6)
    patch.setattr(chart_map, "coarse_initial_map", refused(errors.CoarseningError("Nothing collapses")))
    for above, told in ((len(V), []), (len(V) - 1, ["Nothing collapses; refined without a coarser mesh"])):
        patch.setattr(chart_map, "COARSE_ABOVE", above)
        patch.setattr(chart_map, "roomy_initial_map", lambda *_: None)
        yield map_of(V, F), told


@says("solver/parameterization/chart_map.py", "faces are folded or without area")
def folded_all_the_same(patch):
    V, F = meshes.bumpy(4, 4)
    true = chart_map.measured_chart
    for count in (0, 3):
        folding = lambda *a, count=count: chart_map.replace(true(*a), folds=count)  # noqa: E731
        patch.setattr(chart_map, "measured_chart", folding)
        told = [f"{count} faces are folded or without area in the map"] if count else []
        yield map_of(V, F), told
        yield map_of(V, F, boundary="disk", kind="conformal"), told


@says("solver/parameterization/convex_maps.py", "in the map if cut along another diagonal")
def dented(patch):
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0.0]])
    surface = meshes.polygon_surface(V, [[0, 1, 2, 3], [1, 4, 5, 2]])
    (chart,) = strict_charts(surface)
    at = {int(v): k for k, v in enumerate(chart.vertex_ids)}
    plain = drain(chart_map.map_chart(chart))
    for corners, who in (((), ""), ((0,), "1 face folds"), ((0, 5), "2 faces fold")):
        uv = V[chart.vertex_ids, :2].copy()
        for corner, to in zip(corners, ([0.7, 0.6], [1.3, 0.4]), strict=False):
            uv[at[corner]] = to
        told = [f"{who} in the map if cut along another diagonal"] if corners else []
        before = chart_map.replace(
            plain, uv=uv, warnings=("kept", "9 faces fold in the map if cut along another diagonal")
        )
        yield convex_maps.with_dents_told(surface, chart, before).warnings, ["kept", *told]


@says("solver/parameterization/options.py", "{} {} in the mean, above")
@says("solver/parameterization/options.py", "its seams were marked by hand")
@says("solver/parameterization/options.py", ", {} of the surface,")
@says("solver/errors.py", "cut further for less shear")
@says("solver/errors.py", "less than {} %")
def sheared(patch):
    bound, hand, area = ShearBound(1.35), np.array([True, True, False]), np.array([1.0, 2.0, 1.0])
    how = "seams were marked by hand. cut further for less shear, or allow for more"
    third = "An island, 25 % of the surface, shears 2 in the mean, above 1.35: why"
    for mean, told in (
        ([1.354, 1.0, 1.354], []),
        ([1.356, 1.0, 1.0], [f"An island, 25 % of the surface, shears 1.36 in the mean, above 1.35: its {how}"]),
        ([1.4, 1.5, 1.0], [f"2 islands, 75 % of the surface, shear 1.5 in the mean, above 1.35: their {how}"]),
        ([1.0, 1.5, 2.0], [f"An island, 50 % of the surface, shears 1.5 in the mean, above 1.35: its {how}", third]),
    ):
        yield list(bound.missed(np.array(mean), area, hand, "why")), told
    whole = "An island shears 2 in the mean, above 1.35: why"
    yield list(bound.missed(np.array([2.0]), area[:1], ~hand[:1], "why")), [whole]
    for share, words in ((0.0099, "less than 1 %"), (0.01, "1 %"), (0.99, "99 %")):
        text = f"An island, {words} of the surface, shears 2 in the mean, above 1.35: its {how}"
        yield list(bound.missed(np.array([2.0, 1.0]), np.array([share, 1 - share]), hand[:2], "why")), [text]


@says("solver/errors.py", "kept before its seams were done")
@says("solver/errors.py", "no seams were found that would pay")
def not_searched(patch):
    last = SimpleNamespace(
        charts=[0], searched=[0], mean=np.array([2.0]), bound=1.5, area=np.ones(1), memory={}, cuts=0, maps=[]
    )
    search = SimpleNamespace(shear=ShearBound(1.5), memory={}, lenience_of=lambda charts: np.ones(len(charts)))
    begin = "An island shears 2 in the mean, above 1.5: "
    found = "no seams were found that would pay; allow for more shear, or mark some yourself"
    ended = SimpleNamespace(is_asked=True)
    yield shear_bound._result(last, search, (), EarlyEnd(), True).warnings, [begin + found]
    yield (
        shear_bound._result(last, search, (), ended, True).warnings,
        [f"{begin}kept before its seams were done; unwrap again"],
    )
    last.mean[0] = 1.5
    yield shear_bound._result(last, search, (), ended, True).warnings, []


@says("solver/errors.py", "merge vertices that coincide")
def merge(patch):
    yield from doubles(patch)


@says("solver/errors.py", "merging vertices that coincide")
def merging(patch):
    yield from touching(patch)


@says("solver/errors.py", "dissolve faces without area")
def dissolve(patch):
    yield from without_area(patch)


@says("solver/parameterization/unwrap.py", "{} no map in double precision")
def no_map_at_first(patch):
    good, bad = SimpleNamespace(failure=None), SimpleNamespace(failure=errors.PrecisionError("no"))
    for first, told in (
        ([good, good], []),
        ([good, bad], ["An island along its seams has no map in double precision; cut further"]),
        ([bad, bad, good], ["2 islands along their seams have no map in double precision; cut further"]),
    ):
        yield unwrap.cut_for_a_map(first, [good, good]), told
    with pytest.raises(errors.PrecisionError):
        unwrap.cut_for_a_map([good, bad], [good, bad])
