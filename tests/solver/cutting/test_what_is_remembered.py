"""What a search remembers saves time and decides nothing; of several finds the one that costs least is taken."""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np
import pytest
from short_cuts import component_of

from omt_uv.solver.cutting import cut_graph, developable_nets


class Forgetful(set):
    """A set in which nothing is ever found."""

    def __contains__(self, _):
        return False


def body(name, seed, count=5):
    """A body, and so many places that its cut goes to."""
    mesh = {
        "ball": lambda: meshes.icosphere(2),
        "ring": lambda: meshes.torus(12, 8),
        "patch": lambda: meshes.bumpy(8, 7),
        "band": lambda: meshes.annulus(),
    }
    component = component_of(*mesh[name]())
    return component, np.random.default_rng(seed).choice(component.vertex_count, count, replace=False)


@pytest.mark.parametrize("name", ["ball", "ring", "patch", "band"])
def test_a_cut_is_as_short_as_if_nothing_had_been_remembered(name):
    shorter = 0
    for seed in range(12):
        component, tips = body(name, seed, 12)
        # A detour to begin with, so that there is much to shorten, and more than once.
        rough = replace(component, cost=np.random.default_rng(seed).uniform(1, 9, len(component.cost)))
        cut = cut_graph.greedy_arcs(rough, tips)
        tried: set[bytes] = set()
        found = cut_graph.shorten(component, cut, tips, tried=tried)
        np.testing.assert_array_equal(found, cut_graph.shorten(component, cut, tips, tried=Forgetful()))
        shorter += component.cost[found].sum() < component.cost[cut].sum()
        # What is remembered holds of the cut that is there in the end.
        for stretch in cut_graph.stretches(component, found, tips):
            if stretch.tobytes() in tried:
                rest = found.copy()
                rest[stretch] = False
                length = component.cost[stretch].sum()
                path = cut_graph._shortest_bridge(component, rest, tips, length)
                assert path is None or component.cost[path].sum() >= length * (1 - 1e-9)
    assert shorter > 9


@pytest.mark.parametrize("name", ["ball", "patch"])
@pytest.mark.parametrize("sound", [range(24), (3, 11, 17), (20,), ()], ids=str)
def test_of_the_nets_that_lie_apart_the_cheapest_is_taken(monkeypatch, name, sound):
    """Its cost, and not how many edges it has, or which came first."""
    for seed in range(4):
        component, tips = body(name, seed)
        cost = component.cost * np.random.default_rng(seed).uniform(1, 4, len(component.cost))
        component = replace(component, cost=cost)
        first = cut_graph.greedy_arcs(component, tips)
        net = developable_nets.Net(component, first, tips, component.cost, np.ones(len(tips)))
        rng, made = np.random.default_rng(seed), []

        def drawn(given, roots, rng=rng, made=made, component=component):
            made.append(cut_graph.greedy_arcs(replace(component, cost=rng.uniform(1, 9, len(given.cost))), roots))
            return made[-1]

        def covers_itself(_, cut, made=made):
            return not any(cut is made[k] for k in sound) if made else True

        monkeypatch.setattr(developable_nets, "greedy_arcs", drawn)
        monkeypatch.setattr(developable_nets, "_covers_itself", covers_itself)
        found = net.spread_out().cut
        costs = [component.cost[made[k]].sum() for k in sound]
        np.testing.assert_array_equal(found, made[sound[int(np.argmin(costs))]] if len(sound) else first)
