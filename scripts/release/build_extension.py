"""Build and validate one extension zip per platform in ./dist, with the wheels of that platform and the pages inside.

usage: build_extension.py [--here] [PLATFORM...]     --here: only the platform this runs on; default: all
"""

from __future__ import annotations

import importlib.util
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

from fetch_wheels import ROOT, fetch, manifest

CONTENT = ("__init__.py", "LICENSE", "README.md", "CHANGELOG.md", "omt_uv")

# Where omt_uv/links.py looks for the pages.
HELP = "help"


def this_platform() -> str:
    """The platform this runs on, as the manifest names it."""
    system = {"Linux": "linux", "Windows": "windows", "Darwin": "macos"}[platform.system()]
    return f"{system}-{'arm64' if platform.machine().lower() in {'arm64', 'aarch64'} else 'x64'}"


def blender_ext() -> Path:
    """Blender's own builder, a plain Python program in the bpy wheel."""
    spec = importlib.util.find_spec("bpy")
    if spec is None or not spec.submodule_search_locations:
        raise SystemExit("bpy is not installed")
    folder = Path(spec.submodule_search_locations[0])
    return next(folder.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))


def build(platforms: list[str]) -> list[Path]:
    """Paths of the validated zips."""
    stage, target = ROOT / "build" / "extension", ROOT / "dist"
    shutil.rmtree(stage, ignore_errors=True)
    (stage / "wheels").mkdir(parents=True)
    target.mkdir(exist_ok=True)
    wheels = fetch(platforms)
    for wheel in wheels:
        (stage / "wheels" / wheel.name).hardlink_to(wheel)
    for name in CONTENT:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, stage / name, ignore=shutil.ignore_patterns("__pycache__"))
        elif source.exists():
            shutil.copy2(source, stage / name)
    site = Path(__file__).with_name("site.py")
    subprocess.run([sys.executable, str(site), "--out", str(stage / HELP)], check=True, stdout=subprocess.DEVNULL)
    (stage / "blender_manifest.toml").write_text(_manifest_text(platforms, {w.name for w in wheels}))
    run = [sys.executable, str(blender_ext())]
    subprocess.run(
        [*run, "build", "--split-platforms", "--source-dir", str(stage), "--output-dir", str(target)],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    info = manifest()
    zips = [target / f"{info['id']}-{info['version']}-{p.replace('-', '_')}.zip" for p in platforms]
    for path in zips:
        subprocess.run([*run, "validate", str(path)], check=True, stdout=subprocess.DEVNULL)
    return zips


def _manifest_text(platforms: list[str], wheels: set[str]) -> str:
    """The manifest with only these platforms and wheels, and with the website of omt_uv/links.py if that has one."""
    text = (ROOT / "blender_manifest.toml").read_text()
    website = re.search(r'^WEBSITE = "(.+)"$', (ROOT / "omt_uv" / "links.py").read_text(), re.MULTILINE)
    if website:
        text = re.sub(r"^(type = .*)$", rf'\1\nwebsite = "{website[1]}"', text, flags=re.MULTILINE)
    listed = ", ".join(f'"{p}"' for p in platforms)
    text = re.sub(r"^platforms = .*$", f"platforms = [{listed}]", text, flags=re.MULTILINE)
    unwanted = re.compile(r'^\s*"\./wheels/(.+\.whl)",\n', re.MULTILINE)
    return unwanted.sub(lambda line: line.group() if line.group(1) in wheels else "", text)


if __name__ == "__main__":
    arguments = sys.argv[1:]
    platforms = [this_platform()] if arguments == ["--here"] else arguments or manifest()["platforms"]
    for path in build(platforms):
        print(f"{path.relative_to(ROOT)}  {path.stat().st_size / 1e6:.0f} MB")
