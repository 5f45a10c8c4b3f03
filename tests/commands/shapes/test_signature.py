"""Files of signatures hold numbers alone: what would be run when it is read is refused, and not run."""

from __future__ import annotations

import numpy as np
import pytest


class Trap:
    """What pickle runs."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (str(self.path), "w"))


@pytest.mark.parametrize("module", ["commands.shapes.signature", "pipelines.shapes.signature_index"])
def test_nothing_is_run(package, tmp_path, module):
    trap = np.empty(1, object)
    trap[0] = Trap(tmp_path / "run")
    np.savez(tmp_path / "a.npz", packed=trap, floor=trap, names=trap, classes=trap, kinds=trap, starts=trap)
    found = package(module)
    readers = [getattr(found, name) for name in ("read_signature", "read_index") if hasattr(found, name)]
    assert readers
    for reader in readers:
        with pytest.raises(package("errors").UserError, match=r"a\.npz"):
            reader(tmp_path / "a.npz")
    assert not (tmp_path / "run").exists()


def test_a_signature_comes_back_as_it_was(package, tmp_path):
    index = package("pipelines.shapes.signature_index")
    rows = np.random.default_rng(0).normal(size=(7, 4)).astype(np.float32)
    # Places on the unit sphere, and curvatures.
    rows[:, :3] /= np.linalg.norm(rows[:, :3], axis=1)[:, None]
    again = index.packed(index.unpacked(rows, 0.25))
    np.testing.assert_allclose(again, rows, atol=1e-6)
    np.savez(tmp_path / "a.npz", packed=rows, floor=0.25)
    found = package("commands.shapes.signature").read_signature(tmp_path / "a.npz")
    assert found.floor == 0.25
    np.testing.assert_allclose(index.packed(found), rows, atol=1e-6)
    np.savez(tmp_path / "b.npz", floor=0.25)
    for name in ("b.npz", "none.npz"):
        with pytest.raises(package("errors").UserError, match=name):
            package("commands.shapes.signature").read_signature(tmp_path / name)
