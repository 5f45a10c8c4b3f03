"""Drive a real Blender window without a screen, as an artist would.

Needs Debian's packages blender, xvfb and xdotool. Debian's Blender has no numpy: that comes from the project's own
environment, if its Python is the same.

usage: run.py [STORY ...] [--out FOLDER]       stories are the files of this folder's `stories`, all by default
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
PROGRAMS = ("blender", "Xvfb", "xdotool")
SIZE = (1600, 900)
TIME_LIMIT = 500


def missing() -> str:
    """Why no window can be driven here, empty if it can."""
    absent = [name for name in PROGRAMS if shutil.which(name) is None]
    if absent:
        return f"{', '.join(absent)} not installed (Debian: apt-get install blender xvfb xdotool libgl1-mesa-dri)"
    answer = subprocess.run(
        ["blender", "-b", "--factory-startup", "--python-expr", "import sys; print('PY', *sys.version_info[:2])"],
        capture_output=True,
        text=True,
    )
    python = next((line.split()[1:] for line in answer.stdout.splitlines() if line.startswith("PY ")), [])
    if python != [str(x) for x in sys.version_info[:2]]:
        return (
            f"Blender's Python is {'.'.join(python)}, and numpy is here for {sys.version_info[0]}.{sys.version_info[1]}"
        )
    return ""


def stories() -> list[Path]:
    """Files of all stories."""
    return sorted((HERE / "stories").glob("*.py"))


def play(story: Path, out: Path) -> dict:
    """Play one story in a window of its own; what it found, also in OUT/facts.json."""
    import numpy

    out.mkdir(parents=True, exist_ok=True)
    (out / "facts.json").unlink(missing_ok=True)
    with tempfile.TemporaryDirectory(prefix="omt_uv_gui_") as folder, open(out / "blender.log", "w") as log:
        (Path(folder) / "addons").mkdir()
        (Path(folder) / "addons" / "omt_uv").symlink_to(ROOT)
        server, display = _display(log)
        variables = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | {
            "DISPLAY": display,
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "BLENDER_USER_SCRIPTS": folder,
            "OMT_UV_SITE": str(Path(numpy.__file__).resolve().parents[1]),
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        command = ["blender", "--factory-startup", "--window-geometry", "0", "0", *map(str, SIZE)]
        command += ["--python", str(HERE / "drive.py"), "--", str(story), str(out)]
        try:
            subprocess.run(command, env=variables, stdout=log, stderr=log, timeout=TIME_LIMIT)
        except subprocess.TimeoutExpired:
            return {"error": f"the story took longer than {TIME_LIMIT} s"}
        finally:
            server.terminate()
            server.wait()
    found = out / "facts.json"
    if found.exists():
        return json.loads(found.read_text())
    logs = [out / name for name in ("blender.log", "stacks.log")]
    return {"error": "\n".join(log.read_text()[-4000:] for log in logs if log.exists())}


def _display(log):
    """A screen that nobody sees, and its name; the server chooses a free number."""
    read, write = os.pipe()
    screen = f"{SIZE[0]}x{SIZE[1]}x24"
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", screen, "+extension", "GLX"]
    server = subprocess.Popen(command, pass_fds=[write], stdout=log, stderr=log)
    os.close(write)
    with os.fdopen(read) as pipe:
        number = pipe.readline().strip()
    time.sleep(0.2)
    return server, f":{number}"


def main() -> int:
    """Play stories; 1 if one of them failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stories", nargs="*", metavar="STORY", help=" ".join(s.stem for s in stories()))
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "gui")
    args = parser.parse_args()
    if reason := missing():
        print(f"skipped: {reason}")
        return 0
    failed = False
    for story in stories():
        if not args.stories or story.stem in args.stories:
            facts = play(story, args.out.resolve() / story.stem)
            failed |= "error" in facts
            print(json.dumps({story.stem: facts}, indent=1))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
