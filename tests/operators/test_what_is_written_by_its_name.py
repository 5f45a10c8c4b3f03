"""What an operator writes by a name is the same whether there is something of that name or not, wherever it stands; it
is the active one then, and others stay as they were and where they were."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
from sphere_shapes import blob

# Operator, arguments, the property that names what is written, and what that is.
RUNS = {
    "weights": ("object.omt_weights", {"kind": "GAUSSIAN", "show": False}, "weight_group", "groups"),
    "unwrap": ("uv.omt_unwrap", {"kind": "CONFORMAL", "max_shear": 0.0}, "uv_layer", "layers"),
    "sphere": ("uv.omt_sphere", {"method": "MOSER"}, "uv_layer", "layers"),
}
NAMES = ("one", "two", "three")


def add(seed, x):
    """An object with groups and UV layers of all names, the first of each active."""
    V, F = blob(1, seed=seed)
    obj = scenes.add(V * [1.0, 1.3, 0.8], F.tolist(), f"Body {seed}")
    obj.location.x = x
    for k, name in enumerate(NAMES):
        obj.vertex_groups.new(name=name).add(range(5 * k, 5 * k + 9), 0.2 + 0.1 * k, "REPLACE")
        if name not in obj.data.uv_layers:
            obj.data.uv_layers.new(name=name)
        scenes.set_uv(obj, np.random.default_rng(k).random((3 * len(F), 2)), name)
    obj.vertex_groups.active_index, obj.data.uv_layers.active_index = 0, 0
    return obj


def told(obj, kind):
    """Everything of a kind by its name, in its order, and the name of the active one."""
    if kind == "layers":
        layers = obj.data.uv_layers
        return {layer.name: scenes.uv_of(obj, layer.name) for layer in layers}, layers.active.name
    groups, mesh = obj.vertex_groups, obj.data
    found = {
        group.name: np.array([sum(g.weight for g in v.groups if g.group == group.index) for v in mesh.vertices])
        for group in groups
    }
    return found, groups[groups.active_index].name


def written(run, name, mode):
    """What two objects hold after an operator has written by a name, and before."""
    operator, arguments, key, kind = RUNS[run]
    scenes.open_empty()
    objects = [add(1, 0.0), add(2, 4.0)]
    if mode == "lacking":
        # Another one that has nothing of the kind.
        objects[1].vertex_groups.clear()
        while objects[1].data.uv_layers:
            objects[1].data.uv_layers.remove(objects[1].data.uv_layers[0])
    before = [told(obj, kind)[0] if mode != "lacking" or obj is objects[0] else {} for obj in objects]
    scenes.select(objects)
    if mode == "edited":
        scenes.edit(*objects)
    module, verb = operator.split(".")
    assert getattr(getattr(bpy.ops, module), verb)("EXEC_DEFAULT", **arguments, **{key: name}) == {"FINISHED"}
    scenes.leave_edit()
    return [told(obj, kind) for obj in objects], before


@pytest.mark.parametrize("mode", ["plain", "edited", "lacking"])
@pytest.mark.parametrize("run", RUNS)
def test_what_is_written_by_a_name_is_the_same_wherever_it_stands(package, run, mode):
    new, _ = written(run, "new", mode)
    for name in NAMES:
        found, before = written(run, name, mode)
        for (values, active), (fresh, shown), was in zip(found, new, before, strict=True):
            assert active == name and shown == "new"
            assert list(values) == [*was, *([] if name in was else [name])]
            np.testing.assert_array_equal(values[name], fresh["new"])
            for other in was:
                if other != name:
                    np.testing.assert_array_equal(values[other], was[other])
