"""The command volume: files of tetrahedra, reports, and what is refused."""

from __future__ import annotations

import json

import bpy

import numpy as np
import pytest
import scenes
from bodies import limbed


@pytest.fixture
def body(tmp_path):
    scenes.add(*limbed(2), "Body")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    return tmp_path


def test_every_format_holds_the_map(run, body):
    words = ["volume", body / "in.blend", "--tets", "1200"]
    status, _, err = run(*words, "-o", body / "out.npz", "--report", body / "r.json")
    assert status == 0, err
    data = np.load(body / "out.npz")
    assert data["positions"].shape == data["points"].shape and len(data["dilation"]) == len(data["tets"])
    # Shares of the body, times what they grow by, are those of the ball, which lies about 0.
    corner = data["points"][data["tets"]] - data["points"][data["tets"]][:, :1]
    here = np.linalg.det(corner[:, 1:])
    assert (here / here.sum() * 2.0 ** data["dilation"]).sum() == pytest.approx(1, rel=1e-9)
    assert np.linalg.norm(data["positions"], axis=1).max() == pytest.approx(1, abs=1e-6)
    np.testing.assert_allclose(np.ptp(data["points"], axis=0), np.ptp(limbed(2)[0], axis=0), rtol=1e-5)
    (figures,) = json.loads((body / "r.json").read_text())["volumes"]
    assert figures["inverted"] == 0 and figures["vertex_share_error"] < 0.02 and figures["object"] == "Body"
    assert run(*words, "-o", body / "out.vtu", "--domain", "cube")[0] == 0
    assert "UnstructuredGrid" in (body / "out.vtu").read_text()[:200]
    assert run(*words, "-o", body / "out.blend")[0] == 0
    bpy.ops.wm.open_mainfile(filepath=str(body / "out.blend"))
    assert "OMT Ball" in bpy.data.objects["Body Tetrahedra"].data.attributes


def test_what_makes_no_sense_is_refused(run, body):
    words = ["volume", body / "in.blend"]
    assert run(*words, "-o", body / "out.obj")[0] == 2
    status, _, err = run(*words, "-o", body / "out.npz", "--domain", "Nothing")
    assert status == 1 and "no mesh 'Nothing'" in err
