"""Fetch the wheels that blender_manifest.toml lists into ./wheels, unmodified from the package index.

usage: fetch_wheels.py [PLATFORM...]     platforms as in the manifest, all by default
"""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def manifest() -> dict:
    """The manifest as a dict."""
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text())


def platform_of(wheel: str) -> str:
    """Platform, as the manifest names it, of a wheel's file name."""
    tag = wheel.removesuffix(".whl").rsplit("-", 1)[1]
    if tag.startswith("macosx"):
        return "macos-arm64" if tag.endswith("arm64") else "macos-x64"
    return "windows-x64" if tag.startswith("win") else "linux-x64"


def wheels_for(platforms: list[str]) -> list[str]:
    """File names of the wheels of platforms."""
    names = [Path(wheel).name for wheel in manifest()["wheels"]]
    return [name for name in names if platform_of(name) in platforms]


def fetch(platforms: list[str]) -> list[Path]:
    """Paths of the wheels, downloaded where they are missing."""
    folder = ROOT / "wheels"
    folder.mkdir(exist_ok=True)
    paths = [folder / name for name in wheels_for(platforms)]
    for path in paths:
        if path.exists():
            continue
        project, version, python, _, tags = path.name.removesuffix(".whl").split("-")
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
        command += ["--only-binary=:all:", "--implementation", "cp", "--python-version", f"{python[2]}.{python[3:]}"]
        for tag in tags.split("."):
            command += ["--platform", tag]
        subprocess.run([*command, "--dest", str(folder), f"{project}=={version}"], check=True)
        if not path.exists():
            raise SystemExit(f"The package index has another wheel than {path.name}")
    return paths


if __name__ == "__main__":
    for path in fetch(sys.argv[1:] or manifest()["platforms"]):
        print(path.relative_to(ROOT))
