"""The command flow: positions, shape keys, report, and what is refused."""

from __future__ import annotations

import json
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes
from bodies import icosphere


@pytest.fixture
def ball(tmp_path):
    V, F = icosphere(2)
    obj = scenes.add(V, F, "Ball")
    obj.vertex_groups.new(name="tip").add([int(V[:, 2].argmax())], 1.0, "REPLACE")
    obj.vertex_groups.new(name="feet").add(np.flatnonzero(V[:, 2] < -0.8).tolist(), 1.0, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    (tmp_path / "h.json").write_text(json.dumps({"handles": [{"group": "tip", "move": [0, 0, 0.4]}]}))
    return tmp_path


def test_a_blend_gets_a_shape_key_and_a_report(run, ball):
    words = ["flow", ball / "in.blend", "-o", ball / "out.blend", "--handles", ball / "h.json", "--keep", "feet"]
    status, _, err = run(*words, "--shape-key", "--report", ball / "r.json", "--path", "radius", "--lambda", "25")
    assert status == 0, err
    report = json.loads((ball / "r.json").read_text())
    assert report["volume_change"] < 1e-6 and report["new_intersections"] == 0 and report["missed"] < 1e-6
    bpy.ops.wm.open_mainfile(filepath=str(ball / "out.blend"))
    keys = bpy.data.objects["Ball"].data.shape_keys.key_blocks
    assert list(keys.keys()) == ["Basis", "Flow"]
    assert max(p.co.z for p in keys["Flow"].data) == pytest.approx(1.4, abs=1e-5)


def test_other_files_get_the_positions(run, package, ball):
    (ball / "h.json").write_text('[{"group": "tip", "move": [0.2, 0, 0]}]')
    words = ["flow", ball / "in.blend", "-o", ball / "out.obj", "--handles", ball / "h.json"]
    status, _, err = run(*words, "--inside", "ball")
    assert status == 0, err
    (obj,) = package("files.meshes").load(ball / "out.obj")
    assert 0.19 < max(obj.data.vertices, key=lambda v: v.co.z).co.x < 0.5


@pytest.mark.parametrize("suffix", [".blend", ".obj", ".ply", ".stl", ".glb", ".fbx"])
def test_a_wall_goes_along_into_the_file_and_stays_as_it_is(run, package, ball, suffix):
    V, F = icosphere(1)
    scenes.add(V * 2.0, F, "Wall")
    bpy.ops.wm.save_as_mainfile(filepath=str(ball / "in.blend"))
    out = ball / f"out{suffix}"
    status, _, err = run("flow", ball / "in.blend", "-o", out, "--handles", ball / "h.json", "--inside", "Wall")
    assert status == 0, err
    scenes.open_empty()
    found = package("files.meshes").load(out)
    places = np.array([obj.matrix_world @ v.co for obj in found for v in obj.data.vertices])
    # Corners of the wall, and the tip, which is not where it was.
    radius = np.linalg.norm(places, axis=1)
    assert len({tuple(at) for at in places[radius > 1.9].round(3)}) == len(V)
    np.testing.assert_allclose(radius[radius > 1.9], 2, atol=1e-5)
    assert radius[radius < 1.9].max() == pytest.approx(1.4, abs=1e-4)


def test_what_makes_no_sense_is_refused(run, ball):
    words = ["flow", ball / "in.blend", "-o", ball / "out.obj", "--handles", ball / "h.json"]
    for more, code, text in [
        (["--frames", "3"], 2, "no shape keys"),
        (["--keep", "none"], 1, "no vertex group 'none'"),
        (["--inside", "Nothing"], 1, "no object 'Nothing'"),
        (["--inside", "Ball"], 1, "nothing that could flow"),
    ]:
        status, _, err = run(*words, *more)
        assert status == code and text in err, err
        assert not (ball / "out.obj").exists()
    (ball / "h.json").write_text("[]")
    status, _, err = run(*words)
    assert status == 1 and "no list of handles" in err


def test_the_ball_that_keeps_a_flow_in_is_around_all_bodies_wherever_they_are(package, monkeypatch):
    V, _ = icosphere(2)
    flow, made = package("commands.volumes.flow"), []
    monkeypatch.setattr(package("solver.flows.domain"), "ball_domain", lambda *given: made.append(given))
    bodies = [SimpleNamespace(positions=V * [1, 1, 2] + [40.0, -70, 5]), SimpleNamespace(positions=V + [43.0, -70, 5])]
    flow._domain(SimpleNamespace(inside="ball"), bodies)
    ((middle, radius),) = made
    np.testing.assert_allclose(middle, [41.5, -70, 5])
    distance = np.linalg.norm(np.concatenate([body.positions for body in bodies]) - middle, axis=1)
    assert radius == pytest.approx(1.1 * distance.max())


@pytest.mark.parametrize("option", ["", "feet", "tip"])
@pytest.mark.parametrize("in_file", [(), ("feet",), ("tip",)], ids=str)
def test_what_stays_is_that_of_the_option_before_that_of_the_file(package, monkeypatch, option, in_file):
    command, bodies = package("commands.volumes.flow"), package("blender.volumes.bodies")
    V, F = icosphere(1)
    obj = scenes.add(V, F, "Ball")
    for name in ("feet", "tip"):
        obj.vertex_groups.new(name=name)
    kept = []
    monkeypatch.setattr(bodies, "read_body", lambda obj, keep="": kept.append(keep))
    monkeypatch.setattr(package("pipelines.volumes.handle_file"), "handles_of", lambda *_: kept[0])
    monkeypatch.setattr(package("pipelines.volumes.flow"), "FlowJob", lambda _, handles, *more: handles)
    monkeypatch.setattr(package("pipelines.volumes.flow"), "flow_bodies", lambda handles: handles)
    monkeypatch.setattr(command, "drain_shown", lambda found: found)
    options = SimpleNamespace(keep=option, sharpness=None, radius=0.3, path="straight", samples=2, inside="", frames=1)
    expected = option or (in_file[0] if in_file else "")
    assert command._flow(options, SimpleNamespace(keep=in_file), [obj]) == expected and kept == [expected]
