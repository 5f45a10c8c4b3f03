"""Every example runs as it stands, in a process of its own, and says what it promises."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted(p for p in (ROOT / "examples").glob("*.py") if p.name != "surfaces.py")
SAYS = {
    "magnify_region": "now",
    "measure_uvs": "refined: area error 0.00",
    "remesh_levels": "100 vertices",
    "sphere_map": "whole sphere is 4.000 pi",
    "unwrap_mesh": "UVs (1600, 4, 2)",
}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_example_runs(path):
    done = subprocess.run(
        [sys.executable, str(path)], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 0, done.stderr
    assert SAYS[path.stem] in done.stdout


def test_a_folder_is_unwrapped_and_reported(tmp_path):
    (tmp_path / "in").mkdir()
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3\nf 1 3 4\n"
    for name in ("one", "two"):
        (tmp_path / "in" / f"{name}.obj").write_text(text)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    subprocess.run(
        ["bash", str(ROOT / "examples" / "batch_folder.sh"), str(tmp_path / "in"), str(tmp_path / "out")],
        check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PATH": path},
    )
    made = sorted(p.name for p in (tmp_path / "out").iterdir() if p.suffix != ".mtl")
    assert made == ["one.json", "one.obj", "two.json", "two.obj"]
