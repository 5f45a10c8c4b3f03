"""Damaged files of every format through the whole program, each in its own process: a result or one line, no traceback.

OMT_UV_MUTANTS=2000 damages more files than `make test` does.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import bpy

import mesh_bytes
import pytest
import scenes

ROOT = Path(__file__).resolve().parents[2]
MUTANTS = int(os.environ.get("OMT_UV_MUTANTS", "2"))
# Done, refused, Blender crashed, too late, too little memory: never a defect of our own.
FORESEEN = {0, 1, 3, 4, 5}
OFF = b"OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"
STL = b"solid\n" + b"".join(
    b"facet normal 0 0 0\nouter loop\n%bendloop\nendfacet\n" % b"".join(b"vertex %d %d %d\n" % p for p in face)
    for face in (((0, 0, 0), (1, 0, 0), (0, 1, 0)), ((0, 0, 0), (0, 1, 0), (0, 0, 1)))
)


@pytest.fixture
def sources(tmp_path):
    """Good files of every format."""
    scenes.cube()
    made = {
        ".blend": lambda path: bpy.ops.wm.save_as_mainfile(filepath=path),
        ".fbx": lambda path: bpy.ops.export_scene.fbx(filepath=path),
    }
    found = {".ply": mesh_bytes.ply_bytes("binary_little_endian"), ".glb": mesh_bytes.glb_bytes(), ".off": OFF,
             ".obj": mesh_bytes.obj_bytes(), ".gltf": mesh_bytes.gltf_parts(embedded=True)[0],
             ".stl": STL + b"endsolid\n"}  # fmt: skip
    for suffix, export in made.items():
        export(str(tmp_path / f"good{suffix}"))
        found[suffix] = (tmp_path / f"good{suffix}").read_bytes()
    return found


def test_a_damaged_file_is_a_result_or_one_line(sources, tmp_path):
    pytest.importorskip("scipy", reason="runs outside Blender, where the wheels of the extension are not")
    names = list(sources)
    statuses = []
    for k in range(MUTANTS):
        suffix = names[k % len(names)]
        raw = list(mesh_bytes.mutants(sources[suffix], k // len(names) + 1))[-1]
        folder = tmp_path / str(k)
        folder.mkdir()
        (folder / f"in{suffix}").write_bytes(raw)
        target = suffix if k % 2 and suffix != ".off" else ".obj"
        words = [
            "unwrap",
            folder / f"in{suffix}",
            "-o",
            folder / f"out{target}",
            "--quality",
            "draft",
            "--timeout",
            "90",
        ]
        command = [sys.executable, "-m", "omt_uv", *map(str, words)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, errors="replace")
        statuses.append(done.returncode)
        lines = done.stderr.splitlines()
        assert done.returncode in FORESEEN, (suffix, k, done.stderr)
        assert "Traceback" not in done.stderr and done.stdout == "", (suffix, k, done.stderr)
        kind = "warning" if done.returncode == 0 else "error"
        assert all(line.startswith("omt_uv: ") for line in lines), (suffix, k, lines)
        assert done.returncode == 0 or lines[-1].startswith(f"omt_uv: {kind}: "), (suffix, k, lines)
        assert (folder / f"in{suffix}").read_bytes() == raw
        here = {path.name for path in folder.iterdir()}
        assert here - {"out.mtl"} == {f"in{suffix}"} | ({f"out{target}"} if done.returncode == 0 else set()), (k, here)
    # So that the test sees what it is there for.
    assert MUTANTS < 50 or {0, 1} <= set(statuses)
