"""What is not said means the same wherever it is not said: in functions, in their steps, in options and in commands."""

from __future__ import annotations

import inspect
from dataclasses import fields

import pytest

from omt_uv import settings
from omt_uv.pipelines.volumes import choices
from omt_uv.solver.api import functions, steps
from omt_uv.solver.errors import percent, two_digits
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.refinement.refine import RefinementOptions
from omt_uv.solver.remeshing.initial.options import RemeshOptions


def defaults(of):
    return {field.name: field.default for field in fields(of)}


@pytest.mark.parametrize("name", ["unwrap", "refine", "magnify", "sphere_map", "remesh"])
def test_functions_and_their_steps_take_the_same(name):
    one, other = (dict(inspect.signature(getattr(of, name)).parameters) for of in (functions, steps))
    assert one.pop("progress").default is None
    # `unwrap` hands its cuts on among the options.
    other.pop("cuts", None)
    assert {n: (p.kind, p.default) for n, p in one.items()} == {n: (p.kind, p.default) for n, p in other.items()}


@pytest.mark.parametrize(
    "mine, theirs, common",
    [
        (settings.Settings, UnwrapOptions, {"boundary", "quality", "balance", "max_shear", "fill_holes", "aspect"}),
        (settings.RemeshSettings, RemeshOptions, {"count_of", "grading", "preserve_boundary", "strategy"}),
        (settings.RefineSettings, RefinementOptions, {"boundary", "quality", "balance"}),
    ],
)
def test_settings_start_from_what_solvers_start_from(mine, theirs, common):
    one, other = defaults(mine), defaults(theirs)
    assert common <= {name for name in one if name in other and one[name] == other[name]}


def test_magnifications_and_flows_are_alike_in_functions_and_settings():
    assert defaults(settings.MagnifySettings)["factor"] == 4
    assert inspect.signature(functions.magnify).parameters["factor"].default == 4
    flow = defaults(FlowOptions)
    assert (flow["radius"], flow["path"], flow["samples"]) == (
        choices.DEFAULT_RADIUS,
        choices.DEFAULT_PATH.lower(),
        choices.DEFAULT_SAMPLES,
    )


@pytest.mark.parametrize(
    "share, words",
    [(0.0, "less than 1 %"), (0.0099, "less than 1 %"), (0.01, "1 %"), (0.0149, "1 %"), (0.5, "50 %"), (1.0, "100 %")],
)
def test_shares_that_are_hardly_seen_are_not_nothing(share, words):
    assert percent(share) == words


@pytest.mark.parametrize(
    "share, words",
    [(0.0, "0 %"), (0.0004, "0.04 %"), (0.0123, "1.2 %"), (0.0999, "10 %"), (0.456, "46 %"), (0.997, "100 %")],
)
def test_shares_are_told_with_two_digits_or_whole(share, words):
    assert two_digits(share) == words
