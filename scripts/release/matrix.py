"""Run the Blender tests on every supported Blender version, from the built zip and with its own wheels.

usage: matrix.py [VERSION...]     versions as below, all by default

Each version has an environment .venv-VERSION with bpy, the numpy that this Blender ships, TetGen, which users install
by themselves, and pytest: scipy and xatlas can only come out of the zip.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from build_extension import build, this_platform
from fetch_wheels import ROOT

# Blender: Python, bpy, numpy
VERSIONS = {
    "4.2": ("3.11", "4.2.23", "1.24.3"),
    "4.5": ("3.11", "4.5.15", "1.26.4"),
    "5.0": ("3.11", "5.0.1", "1.26.4"),
    "5.2": ("3.13", "5.2.3", "2.3.4"),
}
FOLDERS = ("blender", "commands", "display", "extension", "operators", "panels", "session")
BLENDER_TESTS = [f"tests/{name}" for name in FOLDERS]
PYTEST = "pytest==9.2.0"
TETGEN = next(line for line in (ROOT / "requirements-dev.txt").read_text().splitlines() if line.startswith("tetgen"))


def environment(version: str) -> Path | None:
    """Python of .venv-VERSION, made as needed; None where its Python is not installed."""
    python_version, bpy, numpy = VERSIONS[version]
    python = ROOT / f".venv-{version}" / "bin" / "python"
    if not python.exists():
        found = subprocess.run(
            [ROOT / "scripts" / "release" / "find_python.sh", python_version], capture_output=True, text=True
        )
        if found.returncode:
            return None
        subprocess.run([found.stdout.strip(), "-m", "venv", str(python.parent.parent)], check=True)
    packages = [f"bpy=={bpy}", f"numpy=={numpy}", PYTEST, TETGEN]
    subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *packages], check=True)
    return python


def run(python: Path, archive: Path) -> tuple[int, float]:
    """Exit status and seconds of the Blender tests in an empty user folder."""
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="omt_uv_matrix_") as folder:
        variables = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        variables |= {"BLENDER_USER_RESOURCES": folder, "OMT_UV_ZIP": str(archive)}
        done = subprocess.run([python, "-m", "pytest", "-q", *BLENDER_TESTS], cwd=ROOT, env=variables)
    return done.returncode, time.perf_counter() - begin


def main(versions: list[str]) -> int:
    """Test the versions one after the other; 1 if one of them failed."""
    (archive,) = build([this_platform()])
    rows, failed = [], False
    for version in versions:
        print(
            f"== Blender {VERSIONS[version][1]}, Python {VERSIONS[version][0]}, numpy {VERSIONS[version][2]}",
            flush=True,
        )
        python = environment(version)
        if python is None:
            rows.append(f"{version}  skipped: Python {VERSIONS[version][0]} was not found")
            continue
        status, seconds = run(python, archive)
        failed |= status != 0
        rows.append(f"{version}  {'passed' if status == 0 else f'FAILED (status {status})'}  {seconds:.0f} s")
    print("\n".join(["", *rows]))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or list(VERSIONS)))
