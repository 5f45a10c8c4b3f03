"""Names of packages are found when they are used, and only those."""

from __future__ import annotations

import pytest

from omt_uv.solver.lazy import lazy


def test_names_are_those_of_their_modules():
    find, names = lazy("omt_uv.solver.mesh", topology="pair_keys twins", geometry="face_areas")
    from omt_uv.solver.mesh.topology import twins

    assert names == ["face_areas", "pair_keys", "twins"] and find("twins") is twins


def test_other_names_are_an_attribute_error():
    find, _ = lazy("omt_uv.solver.mesh", topology="twins")
    with pytest.raises(AttributeError, match="face_areas"):
        find("face_areas")
