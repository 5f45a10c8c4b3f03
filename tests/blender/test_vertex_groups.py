"""Vertex groups: what is written is read, in both modes; vertices of weight 0 are in none."""

from __future__ import annotations

import numpy as np
import pytest
import scenes


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_what_is_written_is_read(package, mode):
    groups, obj = package("blender.vertex_groups"), scenes.bump()
    weights = np.random.default_rng(0).random(len(obj.data.vertices)).astype(np.float32)
    weights[::3] = 0
    if mode == "EDIT":
        scenes.edit(obj)
    # Twice: the second time the group is there, with other weights in it. Whichever was written is the active one.
    for name, values in (("heat", weights[::-1].copy()), ("cold", 0 * weights), ("heat", weights)):
        groups.write_group(obj, name, values)
        assert obj.vertex_groups.active.name == name
    assert (groups.group_weights(obj, "heat") == weights).all()
    assert groups.group_weights(obj, "none") is None
    if mode == "EDIT":
        scenes.leave_edit()
    assert [len(v.groups) for v in obj.data.vertices] == (weights > 0).astype(int).tolist()
    assert (groups.group_weights(obj, "heat", obj.data) == weights).all()


def test_objects_without_the_group_avoid_nothing(package):
    groups = package("blender.vertex_groups")
    first, second = scenes.bump(name="A"), scenes.bump(name="B")
    groups.write_group(first, "face", np.ones(len(first.data.vertices)))
    one, none = groups.avoided([first, second], "face")
    assert (one == 1).all() and none is None
    assert groups.avoided([first, second], "") == [None, None]
    with pytest.raises(groups.GroupError, match="A, B: There is no vertex group 'nose'"):
        groups.avoided([first, second], "nose")


def test_groups_that_cannot_be_written_are_named(package):
    groups, obj = package("blender.vertex_groups"), scenes.bump()
    groups.check_group_target(obj, "new")
    obj.vertex_groups.new(name="kept").lock_weight = True
    for name, words in (("", "no name"), ("kept", "locked")):
        with pytest.raises(groups.GroupError, match=words):
            groups.check_group_target(obj, name)


def test_the_selection_is_read_in_both_modes(package):
    groups, obj = package("blender.vertex_groups"), scenes.bump(4, 4)
    scenes.edit(obj, faces=[0])
    chosen = groups.selected_vertices(obj)
    assert np.flatnonzero(chosen).tolist() == sorted(obj.data.polygons[0].vertices)
    scenes.leave_edit()
    assert (groups.selected_vertices(obj) == chosen).all()


@pytest.mark.parametrize("roles", [("centre",), ("start", "corners"), ("centre", "start", "corners")], ids=str)
def test_markers_are_vertices_of_more_than_half_of_the_weight(package, roles):
    """Of every object its own, and of every group that is named."""
    groups, objects = package("blender.vertex_groups"), [scenes.bump(3, 3, name="A"), scenes.bump(4, 2, name="B")]
    expected = []
    for k, obj in enumerate(objects):
        mine = {}
        for role in ("centre", "start", "corners"):
            weights = np.random.default_rng([k, len(role)]).random(len(obj.data.vertices)).astype(np.float32)
            weights[:3] = 0.5, 0.0, 0.49
            groups.write_group(obj, f"of {role}", weights)
            mine[role] = np.flatnonzero(weights > 0.5) if role in roles else np.zeros(0, int)
        expected.append(mine)
    named = {role: f"of {role}" if role in roles else "" for role in ("centre", "start", "corners")}
    for found, mine in zip(groups.map_markers(objects, named), expected, strict=True):
        for role, vertices in mine.items():
            np.testing.assert_array_equal(getattr(found, role), vertices, err_msg=role)
