"""The wheel that `pip install .` makes: every module in it, and an `omt-uv` that runs where nothing else of us is.

All other tests import the package from the source tree, where a module that the wheel lacks is found all the same:
once, packages were listed by hand, and the command that was installed could not import its own commands. So the wheel
is built from a copy (what an earlier build has left would be packed again) and installed into an environment of its
own, where what it depends on is found after it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import meshes
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ("pyproject.toml", "README.md", "LICENSE", "omt_uv")
# pip and the command must not find the source tree: neither by the folder nor by a variable.
ENVIRONMENT = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PIP_"))}
WHERE = "import omt_uv, omt_uv.cli; print(omt_uv.__file__)"


def run(*command, folder):
    done = subprocess.run(list(map(str, command)), cwd=folder, env=ENVIRONMENT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def in_tree():
    return {str(p.relative_to(ROOT)) for p in (ROOT / "omt_uv").glob("**/*.py")}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    pytest.importorskip("setuptools", minversion="70.1", reason="older ones need another package to make wheels")
    folder = tmp_path_factory.mktemp("wheel")
    for name in SOURCE:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(ROOT / name, folder / name)
    options = ("--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", folder / "made")
    run(sys.executable, "-m", "pip", "wheel", *options, folder, folder=folder)
    (made,) = (folder / "made").glob("*.whl")
    return made


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """The programs' folder of a fresh environment with the wheel, and what it depends on from here, but after it."""
    folder = tmp_path_factory.mktemp("installed")
    run(sys.executable, "-m", "venv", "--without-pip", folder, folder=folder)
    programs = folder / "bin"
    python = programs / "python"
    install = ("install", "--quiet", "--no-deps", "--no-index", wheel)
    run(sys.executable, "-m", "pip", "--python", python, *install, folder=folder)
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", folder=folder).strip())
    (site / "dependencies.pth").write_text(f"{Path(np.__file__).parents[1]}\n")
    return programs


def test_every_module_and_preset_is_in_the_wheel(wheel):
    with zipfile.ZipFile(wheel) as content:
        packed = {name for name in content.namelist() if ".dist-info/" not in name}
    assert packed == in_tree()


def test_the_package_is_the_installed_one(installed):
    found = Path(run(installed / "python", "-c", WHERE, folder=installed).strip())
    assert found.is_relative_to(installed.parent)
    assert not found.is_relative_to(ROOT)


def test_the_installed_command_unwraps(installed, tmp_path):
    V, F = meshes.bumpy(8, 8)
    lines = [f"v {x} {y} {z}" for x, y, z in V.tolist()] + [f"f {a} {b} {c}" for a, b, c in (F + 1).tolist()]
    (tmp_path / "in.obj").write_text("\n".join(lines) + "\n")
    run(installed / "omt-uv", "unwrap", "in.obj", "-o", "out.obj", folder=tmp_path)
    rows = [line.split() for line in (tmp_path / "out.obj").read_text().splitlines() if line]
    uv = np.array([row[1:3] for row in rows if row[0] == "vt"], float)
    corners = np.array([[corner.split("/")[1] for corner in row[1:]] for row in rows if row[0] == "f"], int) - 1
    assert len(corners) == len(F)
    assert uv.min() >= 0 and uv.max() <= 1
    a, b = (uv[corners[:, k]] - uv[corners[:, 0]] for k in (1, 2))
    area = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    assert (area > 0).all(), "no face is folded"
