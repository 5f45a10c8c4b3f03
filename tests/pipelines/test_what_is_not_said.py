"""What is not said means the same wherever it is not said: parameters and fields of one name start from one value."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import pkgutil
from collections import defaultdict

import pytest

import omt_uv
from omt_uv import pipelines, solver

# Names that mean one thing here and another there.
DIFFERENT = {"apart", "around", "aspect", "axes", "before", "corners", "count", "crossing", "domain", "features",
             "fixed", "flat", "keep", "kind", "least", "level", "max_rounds", "mirror", "most", "near", "options",
             "order", "patient", "quads", "radius", "relaxed", "rounds", "samples", "seams", "share", "sharp", "size",
             "start", "sweeps", "tolerance", "vertices"}  # fmt: skip
# What starts from another value than the others do, and may.
OTHERWISE = {
    "balance": {"solver.registration.results.RegistrationOptions"},
    "boundary": {
        "solver.editing.magnify.magnify_map",
        "solver.editing.magnify.magnify_region",
        "solver.editing.magnify_regions.magnify_regions",
    },
    "mirrored": {"solver.arranging.stacks.stacks", "solver.seams.path_graph.path_graph"},
    "pressure": {"solver.refinement.continuation.StageLimits"},
    "sieve": {"solver.cutting.cuts.cut"},
    "was_split": {"solver.mesh.repair.flat_triangles"},
}


def defaults():
    """By name: the places of functions, methods and dataclasses that have a value for it, and the value."""
    found = defaultdict(dict)

    def add(place, of):
        if dataclasses.is_dataclass(of):
            for field in dataclasses.fields(of):
                if field.default is not dataclasses.MISSING:
                    found[field.name][place] = field.default
        elif inspect.isfunction(of):
            for name, given in inspect.signature(of).parameters.items():
                if given.default is not given.empty:
                    found[name][place] = given.default

    for package in (solver, pipelines):
        for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            module = importlib.import_module(info.name)
            short = info.name.removeprefix(f"{omt_uv.__name__}.")
            for name, of in vars(module).items():
                if getattr(of, "__module__", "") != info.name:
                    continue
                add(f"{short}.{name}", of)
                if inspect.isclass(of):
                    made = ["__init__"] if dataclasses.is_dataclass(of) else []
                    for method in set(vars(of)) - set(made):
                        add(f"{short}.{name}.{method}", vars(of)[method])
    return found


DEFAULTS = {name: places for name, places in defaults().items() if len(places) > 1}


@pytest.mark.parametrize("name", sorted(set(DEFAULTS) - DIFFERENT))
def test_what_has_one_name_starts_from_one_value(name):
    places = {place: value for place, value in DEFAULTS[name].items() if place not in OTHERWISE.get(name, ())}
    assert len({repr(value) for value in places.values()}) <= 1, places


@pytest.mark.parametrize("name", sorted(OTHERWISE))
def test_what_starts_otherwise_does(name):
    """Lists of what is left out are no longer than they have to be."""
    places, others = DEFAULTS[name], OTHERWISE[name]
    usual = {repr(value) for place, value in places.items() if place not in others}
    assert others <= set(places) and all(repr(places[place]) not in usual for place in others)


@pytest.mark.parametrize("name", sorted(DIFFERENT))
def test_names_that_mean_several_things_have_several_values(name):
    assert len({repr(value) for value in DEFAULTS[name].values()}) > 1
