"""Every public function, called once more as the solver calls it: what it leaves alone, what laws hold, what it finds.

The runs of `solver_runs` call nearly all public functions of the solver on generic input. `laws.tsv` names, for each,
the laws that hold there: how the result goes with the size, place, turn and numbering of what was given. `found.tsv`
has how exact, and three figures of what each finds in its first calls of every run: where these change, what the
function does has changed, and that is on purpose or a bug. OMT_UV_ACCEPT=1 writes both anew, without what the last bits
of the input decide; OMT_UV_ACCEPT=fewer leaves out what does not hold here, to be called once with every
OPENBLAS_CORETYPE (Haswell, Nehalem, Zen, SkylakeX): other processors round otherwise.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import os
from pathlib import Path

import laws_of_meshes
import numpy as np
import pytest
import recorded_calls
import solver_runs
from recorded_calls import Call, leaves, recorded, same
from scipy.spatial.transform import Rotation

from omt_uv import solver
from omt_uv.solver import progress
from omt_uv.solver.progress import drain

LAWS = Path(__file__).with_name("laws.tsv")
# Laws of meshes that are told otherwise, of private functions, too.
OTHERWISE = Path(__file__).with_name("laws_of_meshes.tsv")
FOUND = Path(__file__).with_name("found.tsv")
FEWER = os.environ.get("OMT_UV_ACCEPT") == "fewer"
ACCEPT = bool(os.environ.get("OMT_UV_ACCEPT")) and not FEWER
TURN = Rotation.from_euler("xyz", [90, 0, 90], degrees=True).as_matrix().round()
TURNED = Rotation.from_rotvec([0.4, -0.7, 0.2]).as_matrix()
# Calls of each function in a run whose figures are kept.
MOST = 8
# What stands behind names in runs of symmetric meshes, where last bits may decide more.
SYMMETRIC = " of symmetric meshes"


@functools.cache
def record():
    """The calls of all runs."""
    return run_all()


BACK: set[str] = set()


def _ahead(steps):
    """The same steps; the names of those that go back are kept."""
    reached = 0.0
    while True:
        try:
            told = next(steps)
        except StopIteration as stop:
            return stop.value
        if told.fraction < reached - 1e-9:
            BACK.add(steps.__name__)
        reached = max(reached, told.fraction)
        yield told


@functools.wraps(progress.drain)
def _drain_ahead(steps, callback=None):
    return drain(_ahead(steps), callback)


def test_what_is_told_of_the_way_never_goes_back():
    """But where a solver is called by itself that is part of another one, which waits for its rounds."""
    record()
    assert {"multilevel_start"} >= BACK


def run_all():
    """The record of all runs, and figures of what functions give in them."""
    recorded_calls.forget([solver_runs])
    told = recorded_calls.Told(MOST)
    with pytest.MonkeyPatch.context() as patch, contextlib.ExitStack() as stack:
        for module in [*recorded_calls.modules(), solver_runs]:
            if vars(module).get("drain") is progress.drain and module is not progress:
                patch.setattr(module, "drain", _drain_ahead)
        patch.setattr(progress, "drain", _drain_ahead)
        kept = stack.enter_context(recorded(3))
        kept.all = recorded_calls.Record(2)
        stack.enter_context(recorded_calls.watching(kept.all, recorded_calls.modules(), private=True))
        stack.enter_context(recorded_calls.watching(told, [*recorded_calls.modules(), solver]))
        for name, run in solver_runs.RUNS.items():
            kept.next_run()
            kept.all.next_run()
            told.next_run(SYMMETRIC * (name in ("with_symmetry", "bodies_cut_open")))
            run()
    kept.told = told.figures
    return kept


def test_nearly_all_functions_are_called():
    names = {name for module in recorded_calls.modules() for name in recorded_calls.names_of(module)}
    assert len(record().calls) > 0.7 * len(names) and set(record().calls) <= names


# Three are given a search, which keeps what it has found; one says that it overwrites.
SEARCHES = {
    "cutting.cuts.cut_gluing",
    "cutting.disk_charts.disk_charts",
    "parameterization.shear_search.ShearSearch.again",
    "remeshing.edits.delaunay_flips.make_delaunay_embedded",
}


def test_what_a_function_is_given_it_leaves_as_it_is_or_says_so():
    silent = {k for k, f in record().changed.items() if "in place" not in f"{k} {inspect.getdoc(f)}".replace("_", " ")}
    assert silent <= SEARCHES


def test_the_same_call_finds_the_same():
    other = []
    for name, calls in sorted(record().calls.items()):
        if is_quick(calls[0]) and not same(outcome(calls[0]), outcome(calls[0])):
            other.append(name)
    assert other == []


# ---- laws -------------------------------------------------------------------------------------------------------


def is_quick(call: Call) -> bool:
    return sum(leaf.nbytes for leaf in leaves((call.args, call.kwargs))) < 60_000 and call.name not in SLOW


# What takes longest; its laws are those of what it calls, and of tests of its own.
SLOW = {
    "analysis.occlusion.hidden_sides",
    "analysis.seam_costs.seam_costs",
    "analysis.symmetry_plane.symmetry_plane",
    "api.functions.distortion",
    "api.functions.magnify",
    "api.functions.refine",
    "api.functions.remesh",
    "api.functions.sphere_map",
    "api.functions.unwrap",
    "api.steps.magnify",
    "api.steps.refine",
    "api.steps.remesh",
    "api.steps.sphere_map",
    "api.steps.unwrap",
    "comparison.comparison_figures.compare",
    "comparison.greatest.by_position",
    "contact.barrier.brought",
    "editing.magnify.magnify_map",
    "editing.magnify.magnify_region",
    "editing.refine_island.refine_island",
    "flows.flow_map.flow",
    "flows.shape.FlowShape.sound",
    "globe.pole_vertices.move_vertices_onto",
    "maps.overlap.overlap_share",
    "mesh.closest_point.ClosestPoint.near_by_position",
    "mesh.closest_point.spread_points",
    "mesh.point_location.locate",
    "packing.pack_square.pack",
    "parameterization.shear_bound.bound_shear",
    "parameterization.shear_search.ShearSearch.costs",
    "partition.division.divide",
    "refinement.refine.refine",
    "registration.coarse_meshes.straightened",
    "remeshing.initial.component_maps.ComponentMaps.of_sphere",
    "remeshing.initial.initial_mesh.make_initial_mesh",
    "remeshing.initial.sphere_samples.sample_sphere",
    "remeshing.remesh_component.remesh_component",
    "remeshing.remesh_surface.remesh",
    "signatures.marked.marked_signature",
    "signatures.reference.exact_transport",
    "signatures.signature.signature",
    "sphere.coarsen.collapse_to_tetrahedron",
    "sphere.conformal.conformal_sphere",
    "sphere.dominitz_tannenbaum.flow_map",
    "sphere.moser_flow.advect_points",
    "sphere.multilevel.multilevel_start",
    "sphere.refine.sphere_refine",
    "sphere.sphere_map.sphere_map",
    "transfer.correspondence.correspond",
    "transport.semidiscrete_sphere.sphere_transport",
}


def outcome(call: Call, change=None):
    """Arrays that a call returns, or leaves in what it was given; None if it refuses."""
    args, kwargs = recorded_calls.copied((call.args, call.kwargs))
    if change is not None:
        args = tuple(change(a) for a in args)
        kwargs = {k: change(a) for k, a in kwargs.items()}
    try:
        result = call.function(*args, **kwargs)
        if inspect.isgenerator(result):
            result = drain(result)
    except Exception:  # noqa: BLE001, whatever it is, there is no law
        return None
    told = [result, args] if result is None else [result]
    return [np.array(leaf) for leaf in leaves(told)]


def is_space(value) -> bool:
    return isinstance(value, np.ndarray) and value.dtype == float and value.ndim == 2 and value.shape[1] == 3


def close(a, b, scale=None) -> bool:
    if a.shape != b.shape:
        return False
    if a.dtype.kind not in "fc":
        return np.array_equal(a, b)
    size = max(np.abs(b[np.isfinite(b)]).max(initial=0) if scale is None else scale, 1e-300)
    return bool(np.allclose(a, b, rtol=1e-6, atol=1e-8 * size, equal_nan=True))


def law_of_size(before, after):
    """Powers of two that each array has been multiplied by; None where there is none."""
    if after is None or len(after) != len(before):
        return None
    powers = []
    for a, b in zip(before, after, strict=True):
        if a.shape != b.shape:
            return None
        if a.dtype.kind not in "fc" or not np.abs(a[np.isfinite(a)]).max(initial=0):
            if not close(b, a):
                return None
            continue
        fits = [k for k in (0, 1, 2, -1, -2, 3, -3, 4, -4) if close(b, a * 2.0**k)]
        if not fits:
            return None
        powers.append(fits[0])
    return " ".join(map(str, powers)) if len(set(powers)) > 1 else str(powers[0]) if powers else "0"


def law_of_motion(before, after, moved):
    """ "still" or "with it" if arrays stay, or those of three columns go along."""
    if after is None or len(after) != len(before):
        return None
    words = set()
    for a, b in zip(before, after, strict=True):
        if close(b, a):
            words.add("still")
        elif is_space(a) and a.shape == b.shape and close(b, moved(a)):
            words.add("with it")
        else:
            return None
    return "with it" if "with it" in words else "still"


def law_of_order(call, before):
    """ "faces": whether the order of triangles (m,3) decides about nothing but that of rows (m,...)."""
    parameters = list(inspect.signature(call.function).parameters)
    given = dict(zip(parameters, call.args, strict=False)) | call.kwargs
    triangles = next((given[k] for k in ("triangles", "F", "faces") if isinstance(given.get(k), np.ndarray)), None)
    if triangles is None or triangles.ndim != 2 or triangles.dtype.kind != "i":
        return None
    m = len(triangles)
    order = np.random.default_rng(m).permutation(m)
    after = outcome(call, lambda a: a[order] if isinstance(a, np.ndarray) and a.ndim and len(a) == m else a)
    if after is None or len(after) != len(before):
        return None
    rows = False
    for a, b in zip(before, after, strict=True):
        if close(b, a):
            continue
        if a.ndim and len(a) == m and a.shape == b.shape and close(b, a[order]):
            rows = True
            continue
        return None
    return "rows" if rows else "none"


def laws(call: Call):
    """Lines of the laws that hold for a call."""
    before = outcome(call)
    if not before:
        return
    given = [*enumerate(call.args), *call.kwargs.items()]
    names = list(inspect.signature(call.function).parameters)
    for key, value in given:
        name = names[key] if isinstance(key, int) and key < len(names) else str(key)
        if isinstance(value, np.ndarray) and value.dtype.kind == "f" and value.size:
            after = outcome(call, lambda a, value=value: 2 * a if _is_that(a, value) else a)
            power = law_of_size(before, after)
            if power is not None:
                yield "\t".join([call.name, f"twice {name}", power])
            bent = outcome(call, lambda a, value=value: a * _waves(a) if _is_that(a, value) else a)
            if bent is not None and law_of_size(before, bent) != "0":
                yield "\t".join([call.name, f"other {name}", "counts"])
    if any(is_space(value) for _, value in given):
        after = outcome(call, lambda a: 2 * a if is_space(a) else a)
        power = law_of_size(before, after)
        if power is not None:
            yield "\t".join([call.name, "all larger", power])
        for way, move in (("turned", lambda a: a @ TURNED.T), ("moved", lambda a: a + [0.5, -1.25, 2.0])):
            word = law_of_motion(before, outcome(call, lambda a, move=move: move(a) if is_space(a) else a), move)
            if word:
                yield "\t".join([call.name, way, word])
    word = law_of_order(call, before)
    if word:
        yield "\t".join([call.name, "faces in another order", word])


def _is_that(a, value) -> bool:
    return isinstance(a, np.ndarray) and a.shape == value.shape and a.dtype == value.dtype and np.array_equal(a, value)


def _waves(a):
    return 1 + 0.05 * np.sin(1.0 + np.arange(a.size)).reshape(a.shape)


def all_laws(kept):
    found = []
    for _, calls in sorted(kept.calls.items()):
        if is_quick(calls[0]):
            found += laws(calls[0])
    return found


def test_laws_that_hold_are_those_of_the_table():
    lines = all_laws(record())
    assert len(lines) > 1000
    if ACCEPT:
        LAWS.write_text("\n".join(lines) + "\n")
    told = LAWS.read_text().splitlines()
    missing = set(told) - set(lines)
    if FEWER:
        LAWS.write_text("".join(f"{line}\n" for line in told if line not in missing))
        return
    assert not missing, "\n".join(sorted(missing))


def all_laws_of_meshes(kept):
    """Lines of functions, laws, and the words that hold for all calls that are kept."""
    found = []
    for name, calls in sorted(kept.all.calls.items()):
        if all(is_quick(call) and laws_of_meshes.is_quick(call) for call in calls):
            each = [set(laws_of_meshes.all_that_hold(call).items()) for call in calls]
            found += ["\t".join([name, *law]) for law in sorted(set.intersection(*each))]
    return found


def test_laws_of_meshes_told_otherwise_are_those_of_the_table():
    """Tiny and huge, mirrored, turned over, numbered otherwise, with a loose vertex, and two of it side by side."""
    calls = record().all.calls
    if ACCEPT:
        OTHERWISE.write_text("".join(f"{line}\n" for line in all_laws_of_meshes(record())))
    told = [line.split("\t") for line in OTHERWISE.read_text().splitlines()]
    assert len(told) > 1000
    missing = [
        "\t".join(line)
        for line in told
        if any(laws_of_meshes.held(call, line[1]) != line[2] for call in calls.get(line[0], [])) or line[0] not in calls
    ]
    if FEWER:
        OTHERWISE.write_text("".join("\t".join(line) + "\n" for line in told if "\t".join(line) not in missing))
        return
    assert not missing, "\n".join(missing)


# ---- what is found ----------------------------------------------------------------------------------------------


def _shaken(mesh, seed, *args):
    V, F = mesh(*args)
    return V + 1e-10 * np.random.default_rng(seed).normal(size=V.shape), F


def shaken(seed):
    """The record of the same runs on meshes that differ in the tenth digit."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("patch", "body"):
            patch.setattr(solver_runs, name, functools.partial(_shaken, getattr(solver_runs, name), seed))
        kept = run_all()
    recorded_calls.forget([solver_runs])
    return kept


def test_what_is_found_is_that_of_the_table():
    rows = record().told
    if ACCEPT:
        lines = recorded_calls.lines_of(rows, [shaken(seed).told for seed in (1, 2, 3)])
        FOUND.write_text("".join(f"{line}\n" for line in lines))
    recorded_calls.hold(FOUND, rows)
