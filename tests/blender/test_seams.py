"""Seams: marked once, whatever the order of their vertices, and none is taken away."""

from __future__ import annotations

import numpy as np
import pytest
import scenes


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_seams_are_added_and_counted_once(package, mode):
    mark_seams, obj = package("blender.seams").mark_seams, scenes.bump(4, 4)
    ends = np.array([edge.vertices[:] for edge in obj.data.edges])
    obj.data.edges[2].use_seam = True
    if mode == "EDIT":
        scenes.edit(obj)
    assert mark_seams(obj, np.zeros((0, 2), int)) == 0
    assert mark_seams(obj, ends[[5, 9]][:, ::-1]) == 2
    assert mark_seams(obj, ends[[2, 5, 9]]) == 0
    if mode == "EDIT":
        scenes.leave_edit()
    assert [edge.index for edge in obj.data.edges if edge.use_seam] == [2, 5, 9]
