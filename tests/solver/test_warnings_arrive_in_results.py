"""What any part of the solver warns of, or writes into the log of a run, stands in the result of the whole.

As `tests/commands/test_every_warning_arrives.py`: everything that comes with warnings has one more, and every function
that is given a log writes one into it. `warnings_arrive.tsv` has which of these stand in the result of every run, also
of runs whose charts are taken for large ones, which come by way of coarser meshes. Those of trials that come to nothing
are no loss, and are not in it. OMT_UV_ACCEPT=1 writes the table anew.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import meshes
import numpy as np
import pytest
import recorded_calls
from bodies import limbed
from marked_warnings import Marking, mark_of, marks_in
from recorded_calls import Call
from solver_runs import curved, near_middle
from told_otherwise import body, patch, ramp
from wider_runs import bent

from omt_uv import solver as omt
from omt_uv.solver import flows
from omt_uv.solver.editing.magnify_regions import magnify_regions
from omt_uv.solver.editing.refine_island import refine_island
from omt_uv.solver.parameterization import chart_map, initial_map
from omt_uv.solver.parameterization.unwrap import UnwrapOptions, unwrap
from omt_uv.solver.progress import RunLog, drain
from omt_uv.solver.registration import RegistrationOptions, vertex_landmarks
from omt_uv.solver.registration.charts.chart_maps import register_charts
from omt_uv.solver.registration.register import register
from omt_uv.solver.remeshing.initial.component_maps import RemeshSource
from omt_uv.solver.remeshing.initial.options import RemeshOptions
from omt_uv.solver.remeshing.remesh_surface import remesh
from omt_uv.solver.volumes.body_map import into_body, volume_map

TABLE = Path(__file__).with_name("warnings_arrive.tsv")
ACCEPT = bool(os.environ.get("OMT_UV_ACCEPT"))
# Sizes from which on charts come by way of coarser meshes, in runs of small ones.
SIZES = {"COARSE_ABOVE": 120, "DRAFT_ABOVE": 50, "DRAFT_COARSE_ABOVE": 120, "DIRECT_WITH_ROOM": 120, "DIRECT_FAR": 120,
         "FEWEST_FAR": 60}  # fmt: skip
# Calls of each function in a run that are marked.
MOST = 3


class Logging(Marking):
    """Marks logs of runs, too, of every function that is given one, and the first calls of each by their number."""

    def __init__(self) -> None:
        super().__init__()
        self.begun: Counter[str] = Counter()

    def begin(self, name: str, function: Callable, args: tuple, kwargs: dict) -> Call | None:
        self.begun[name] += 1
        return super().begin(f"{name}#{self.begun[name]}", function, args, kwargs) if self.begun[name] <= MOST else None

    def end(self, call: Call | None, args: tuple, kwargs: dict, result, is_method: bool) -> None:
        super().end(call, args, kwargs, result, is_method)
        for given in (*args, *kwargs.values()) if call is not None else ():
            if isinstance(given, RunLog) and mark_of(call.name) not in given.warnings:
                given.warnings.append(mark_of(call.name))


def _patch(**options):
    return lambda: omt.unwrap(*patch(), **options)


def _large(is_far=False, **options):
    """A patch that is taken for a large one; is_far: areas are asked for that are far from its own."""

    def run():
        with pytest.MonkeyPatch.context() as change:
            for module in (initial_map, chart_map):
                for name in SIZES.keys() & vars(module).keys():
                    change.setattr(module, name, SIZES[name])
            V, F = meshes.bumpy(17, 17)
            asked = 1 + 30 * near_middle(V, F)[F].mean(axis=1) ** 4
            return omt.unwrap(bent(V), F, density=asked if is_far else None, **options)

    return run


def _far():
    """Areas far from the surface's come by conformal map and transport."""
    V, F = patch()
    return omt.unwrap(V, F, boundary="disk", density=(1 + 20 * near_middle(V, F) ** 4)[: len(F)])


def _pinned():
    V, F = patch()
    pins = np.isin(F, [3, len(V) - 2])
    return omt.unwrap(V, F, pins=(pins.ravel(), V[F][:, :, :2]))


def _cut():
    V, F = limbed(2)
    return drain(unwrap(omt.polygon_surface(bent(V), F), options=UnwrapOptions(max_shear=1.3)))


def _magnified():
    V, F = patch()
    return omt.magnify(V, F, V[F][:, :, :2], near_middle(V, F), 2.0)


def _magnified_regions():
    V, F = curved()
    regions = np.stack([near_middle(V, F), np.clip(V[:, 0] - 0.9, 0, 1)])[:, F].mean(axis=2)
    return drain(magnify_regions(V[:, :2], F, regions, [2.0, 0.7], exact=False))


def _island():
    V, F = curved()
    return drain(refine_island(V, F, V[:, :2], balance=0.2))


def _sphere():
    V, F = body()
    return omt.sphere_map(V, F, balance=0.3, density=ramp(V, F, 1, 3))


def _remeshed(mesh: Callable, **options):
    return lambda: drain(remesh(RemeshSource(*mesh()), 90, RemeshOptions(**options)))


def _matched():
    V, F = body()
    chosen = vertex_landmarks((np.array([3, 40, 90]), F), (np.array([3, 40, 90]), F))
    return drain(register((V, F), (V * [1.2, 0.9, 1.0], F), chosen))


def _matched_by_charts():
    V, F = curved(5)
    ends = np.array([0, 5, 35, 30])
    none, marks = np.zeros((0, 2), int), vertex_landmarks((ends, F), (ends, F))
    return drain(register_charts((V, F, none), (V * [1.1, 1, 1.4], F, none), marks, RegistrationOptions("charts")))


def _flowed():
    V, F = body()
    rows = np.flatnonzero(V[:, 0] > 0.9)
    return drain(flows.flow(V, (flows.FlowHandle(V[rows], V[rows] + [0.2, 0.1, 0.05], rows),), flows.FlowOptions(), F))


def _into_a_body():
    V, F = meshes.icosphere(1)
    first, other = (drain(volume_map(bent(V * s), F, count=200)) for s in ([1, 1, 1.2], [1, 1.2, 0.8]))
    return drain(into_body(first, other))


RUNS: dict[str, Callable] = {
    "a patch": _patch(),
    "a patch, exact": _patch(quality="exact", balance=0.4),
    "into a disk": _patch(boundary="disk"),
    "into a square": _patch(boundary="square"),
    "conformal": _patch(kind="conformal", boundary="disk"),
    "polar": _patch(kind="polar", boundary="square"),
    "far": _far,
    "large": _large(),
    "large, draft": _large(quality="draft"),
    "large, disk": _large(boundary="disk"),
    "large, draft, square": _large(quality="draft", boundary="square"),
    "large, far": _large(is_far=True),
    "large, far, disk": _large(is_far=True, boundary="disk"),
    "cut": _cut,
    "mirrored": lambda: omt.unwrap(*meshes.two_bumps(8)),
    "pinned": _pinned,
    "magnified": _magnified,
    "regions magnified": _magnified_regions,
    "an island refined": _island,
    "a sphere": _sphere,
    "a new patch": _remeshed(curved),
    "a new body": _remeshed(body),
    "a new body by measure": _remeshed(body, strategy="app-app", rounds=0),
    "matched": _matched,
    "matched by charts": _matched_by_charts,
    "flowed": _flowed,
    "into a body": _into_a_body,
}


def rows() -> set[str]:
    """Names of runs and of the functions whose marks are in their results."""
    found = set()
    record = Logging()
    everything = [*recorded_calls.modules(), omt]
    with recorded_calls.watching(record, everything, private=True, callers=(sys.modules[__name__],)):
        for name, run in RUNS.items():
            record.begun.clear()
            result = run()
            told = [result, *getattr(result, "charts", ()), *getattr(result, "maps", ())]
            lines = [text for part in told for text in getattr(part, "warnings", ())]
            found |= {f"{name}\t{function}" for function, _ in marks_in(lines)}
    return found


def test_warnings_of_all_parts_arrive_as_the_table_says():
    found = rows()
    if ACCEPT:
        TABLE.write_text("".join(f"{row}\n" for row in sorted(found)))
    told = set(TABLE.read_text().splitlines())
    assert len(told) > 100 and {row.partition("\t")[0] for row in told} == set(RUNS)
    lost = sorted(told - found)
    assert not lost, "\n".join([*lost, "OMT_UV_ACCEPT=1 accepts this"])
