"""What is wrong with UVs is said to be as before where it was so before, measured in the same way, and only there."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scenes

# Shares of the area that islands cover of themselves, and of each other.
SHARES = (0.0, 0.2, 0.4)


@pytest.fixture
def written(package, monkeypatch, capfd):
    """What is said of UVs that come after others: both are three corners, whose first numbers are what is found."""
    layers, gates = package("commands.layers"), package("pipelines.gate")
    obj = scenes.bump(1, 1)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    (reading,) = [package("blender.mesh").read(obj)]

    def found(_triangles, uv, apart):
        folded, own, others = np.asarray(uv).reshape(-1, 2)[0, 0] > 1, *np.asarray(uv).reshape(-1, 2)[1]
        return SimpleNamespace(folded=np.array([folded, False]), overlap=float(own if apart else own + others))

    monkeypatch.setattr(gates, "check_layout", found)
    monkeypatch.setattr(layers, "_saved", lambda *_: [])
    monkeypatch.setattr(layers, "write_preview", lambda *_: None)

    def uvs(folded, own, others):
        uv = np.zeros((4, 2), np.float32)
        uv[reading.surface.triangles.ravel()[:2]] = (2.0 * folded, 0), (own, others)
        return uv

    def say(before, after, **more):
        options = SimpleNamespace(strict=False, uv_layer="", input=Path("in.blend"), output=Path("out.blend"))
        result = SimpleNamespace(uv=[uvs(*after)], corners=[np.arange(4)], warnings=[])
        pairs = [(obj, layers.replace(reading, uv=uvs(*before)))]
        layers.write_layers(options, pairs, result, **more)
        return [line for line in capfd.readouterr().err.splitlines() if "folded" in line or "under several" in line]

    return say


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("existed", [False, True])
def test_nothing_that_is_new_is_said_to_be_as_before(written, apart, existed):
    for before, after in product(product((False, True), SHARES, SHARES), repeat=2):
        covered, was = (own if apart else own + others for _, own, others in (after, before))
        lines = written(before, after, apart=apart, existed=existed)
        folds = [line for line in lines if "folded" in line]
        overlap = [line for line in lines if "under several" in line]
        assert len(folds) == after[0] and len(overlap) == (covered > 0)
        assert all(("as before" in line) == (existed and before[0]) for line in folds), (before, after, lines)
        assert all(("as before" in line) == (existed and covered <= was) for line in overlap), (before, after, lines)
