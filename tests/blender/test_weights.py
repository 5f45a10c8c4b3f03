"""The region: a group before an attribute, a score where neither is, and every size as the mesh has it."""

from __future__ import annotations

import numpy as np
import pytest
import scenes
from region_scenes import painted, weights_of, with_attribute


def pairs_of(package, *objects):
    return [(obj, package("blender.mesh").read(obj)) for obj in objects]


def test_objects_without_the_group_have_no_part_in_the_region(package):
    first, second = painted("A"), scenes.bump(name="B")
    one, none = package("blender.weights").region_weights(pairs_of(package, first, second), "region")
    assert (one == weights_of(first)).all()
    assert none.shape == (len(second.data.vertices),) and not none.any()


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_attributes_above_one_are_divided_by_the_largest(package, mode):
    obj = with_attribute(lambda obj: 5.0 * weights_of(obj))
    if mode == "EDIT":
        scenes.edit(obj)
    (found,), warnings = package("blender.weights").attribute_weights(pairs_of(package, obj), "heat")
    assert found.values.max() == pytest.approx(1) and found.kind == "vertex"
    assert len(warnings) == 1 and "divided" in warnings[0][1]


@pytest.mark.parametrize("most", [0.3, 1.0, 1.25, 2.0, 7.0])
def test_weights_are_divided_where_they_exceed_one_and_only_there(package, most):
    obj = with_attribute(lambda obj: most * weights_of(obj))
    (found,), warnings = package("blender.weights").attribute_weights(pairs_of(package, obj), "heat")
    np.testing.assert_allclose(found.values, min(most, 1.0) * weights_of(obj), atol=1e-6)
    assert len(warnings) == (most > 1) and all(index == -1 and f"{most:.4g}" in text for index, text in warnings)


def test_computed_weights_are_those_of_the_name_unless_a_group_has_it(package):
    weights, obj = package("blender.weights"), painted()
    pairs = pairs_of(package, obj)
    (computed,) = weights.region_weights(pairs, "curvature")
    assert (computed == weights.computed_weights(pairs[0][1], "gaussian")).all()
    assert 0 == computed.min() < computed.max() == 1
    obj.vertex_groups["region"].name = "curvature"
    assert (weights.region_weights(pairs, "curvature")[0] == weights_of(obj, "curvature")).all()


def test_the_object_without_a_score_is_named_by_its_index(package):
    flat = scenes.bump(height=0.0, name="Flat")
    with pytest.raises(package("pipelines.layout").Refusal) as caught:
        package("blender.weights").region_weights(pairs_of(package, scenes.bump(), flat), "curvature")
    assert caught.value.index == 1


def test_inverted_weights_add_up_to_one(package):
    reading = pairs_of(package, scenes.bump())[0][1]
    weigh = package("blender.weights").computed_weights
    assert np.allclose(weigh(reading, "mean") + weigh(reading, "mean", invert=True), 1)


def test_the_largest_value_is_that_of_all_objects_wherever_it_is(package):
    """And an object without the attribute has no part in it."""
    tall, low = (with_attribute(lambda obj, most=most: most * weights_of(obj)) for most in (8.0, 2.0))
    bare = scenes.bump(name="Bare")
    for order in ([tall, low, bare], [bare, low, tall]):
        found, warnings = package("blender.weights").attribute_weights(pairs_of(package, *order), "heat")
        assert len(warnings) == 1 and "reaches 8;" in warnings[0][1]
        for obj, weights in zip(order, found, strict=True):
            share = {tall: 1.0, low: 0.25}.get(obj)
            expected = np.zeros(len(obj.data.vertices)) if share is None else share * weights_of(obj)
            np.testing.assert_allclose(weights.values, expected, atol=1e-6)
