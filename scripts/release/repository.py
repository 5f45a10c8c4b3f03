"""Make a static repository of extensions in ./dist/repository: Blender subscribes to its index.json.

usage: repository.py [--here] [--to FOLDER] [ZIP ...]

--here: only the platform this runs on; default: all. Zips that are given are taken as they are, and nothing is built.

Put the folder on any web server. Its page, index.html, lets a user drag the extension into Blender, which asks to add
the repository and keeps the extension up to date from then on. The index is made by Blender's own program, as
`blender --command extension server-generate` does.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

from build_extension import blender_ext, build, this_platform
from fetch_wheels import ROOT, manifest

PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>OMT UV for Blender</title>
<style>body {{ font: 16px/1.5 sans-serif; max-width: 40em; margin: 3em auto; padding: 0 1em }}
a.drag {{ display: inline-block; padding: .6em 1.2em; border-radius: .4em; background: #265787; color: white;
text-decoration: none }}</style>
<h1>OMT UV {version}</h1>
<p>{tagline}. For Blender {blender} and later.</p>
<p>Drag one of these into Blender's window:</p>
{links}
<p>Or: Edit &gt; Preferences &gt; Get Extensions &gt; Repositories &gt; + &gt; Add Remote Repository, with
the address of <a href="index.json">index.json</a>.</p>
</html>
"""
NAMES = {
    "linux-x64": "Linux",
    "windows-x64": "Windows",
    "macos-arm64": "macOS, Apple silicon",
    "macos-x64": "macOS, Intel",
}


def make(zips: list[Path], target: Path) -> None:
    """Lay out the zips, and the index and the page beside them, in a new folder."""
    target.mkdir(parents=True)
    for path in zips:
        shutil.copy2(path, target / path.name)
    command = [sys.executable, str(blender_ext()), "server-generate", "--repo-dir", str(target)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    info = manifest()
    # What Blender reads of a link that is dropped: where the repository is, and what it needs.
    more = f"repository=./index.json&blender_version_min={info['blender_version_min']}"
    links = [
        f'<p><a class="drag" href="./{path.name}?{more}&platforms={name}">{NAMES[name]}</a></p>'
        for path in zips
        for name in platforms_of(path)
    ]
    page = PAGE.format(
        version=info["version"],
        tagline=info["tagline"],
        blender=info["blender_version_min"],
        links="\n".join(links),
    )
    (target / "index.html").write_text(page)
    print(f"{target}: {', '.join(sorted(path.name for path in target.iterdir()))}")


def platforms_of(archive: Path) -> list[str]:
    """The platforms that a zip is for."""
    with zipfile.ZipFile(archive) as opened:
        return tomllib.loads(opened.read("blender_manifest.toml").decode())["platforms"]


def main() -> None:
    """Make the repository of zips that are there, or that are built first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--here", action="store_true")
    parser.add_argument("--to", type=Path, default=None, metavar="FOLDER", help="dist/repository by default, made anew")
    parser.add_argument("zips", nargs="*", type=Path, metavar="ZIP")
    args = parser.parse_args()
    if args.to is None:
        args.to = ROOT / "dist" / "repository"
        shutil.rmtree(args.to, ignore_errors=True)
    make(args.zips or build([this_platform()] if args.here else manifest()["platforms"]), args.to)


if __name__ == "__main__":
    main()
