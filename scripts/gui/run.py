"""Drive a real Blender window without a screen, as an artist would.

Needs Debian's packages blender, xvfb and xdotool. Debian's Blender has no numpy: that comes from the project's own
environment, if its Python is the same. Later ages of Blender are driven in roots of their own (see ages.py).

usage: run.py [STORY ...] [--age NAME] [--out FOLDER]      stories are the files of this folder's `stories`
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent))
from ages import AGES, Age, enter, install, stay

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
PROGRAMS = ("blender", "Xvfb", "xdotool")
SIZE = (1600, 900)
TIME_LIMIT = 900


def missing(age: Age = AGES[0]) -> str:
    """Why no window of an age can be driven here, empty if it can."""
    absent = [name for name in PROGRAMS[1 if age.suite else 0 :] if shutil.which(name) is None]
    if absent:
        return f"{', '.join(absent)} not installed (Debian: apt-get install blender xvfb xdotool libgl1-mesa-dri)"
    if age.suite:
        return "" if age.is_there() else f"no root at {age.root}; scripts/gui/ages.py makes one"
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


def play(story: Path, out: Path, age: Age = AGES[0], theme: str = "") -> dict:
    """Play one story in a window of its own; what it found, also in OUT/facts.json."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "facts.json").unlink(missing_ok=True)
    with open(out / "blender.log", "w") as log:
        server, display = _display(log)
        try:
            (_in_root if age.suite else _here)(story, out, age, {"DISPLAY": display, "OMT_UV_THEME": theme}, log)
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


def _command(drive: Path, story: Path, out: Path) -> list[str]:
    window = ["--window-geometry", "0", "0", *map(str, SIZE)]
    return ["blender", *window, "--python", str(drive), "--", str(story), str(out)]


def _here(story: Path, out: Path, _age: Age, variables: dict, log) -> None:
    """With this machine's Blender, and the sources as an add-on of it."""
    import numpy

    with tempfile.TemporaryDirectory(prefix="omt_uv_gui_") as folder:
        (Path(folder) / "addons").mkdir()
        (Path(folder) / "addons" / "omt_uv").symlink_to(ROOT)
        variables = (
            {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
            | {
                "LIBGL_ALWAYS_SOFTWARE": "1",
                "BLENDER_USER_SCRIPTS": folder,
                "OMT_UV_SITE": str(Path(numpy.__file__).resolve().parents[1]),
                "PYTHONDONTWRITEBYTECODE": "1",
            }
            | variables
        )
        command = _command(HERE / "drive.py", story, out)
        command.insert(1, "--factory-startup")
        subprocess.run(command, env=variables, stdout=log, stderr=log, timeout=TIME_LIMIT)


@functools.cache
def _user(age: Age) -> Path:
    """A user of a root with the extension, installed once for all stories."""
    return install(age, _archive())


# Stories of two windows at once build and install one zip.
ONE_AT_A_TIME = threading.Lock()


@functools.cache
def _archive() -> Path:
    """The extension's zip for this machine, built once for all stories."""
    sys.path.append(str(ROOT / "scripts" / "release"))
    from build_extension import build, this_platform

    (archive,) = build([this_platform()])
    return archive


def is_fresh(story: Path) -> bool:
    """Whether a story begins without the extension, to install it by itself."""
    return "\nFRESH = True\n" in story.read_text()


def _in_root(story: Path, out: Path, age: Age, variables: dict, log) -> None:
    """With the Blender of a root, and the extension as it was installed from the zip, or its zip alone."""
    with ONE_AT_A_TIME:
        user = stay(age, _archive()) if is_fresh(story) else _user(age)
    inside = age.root / user.relative_to("/")
    for path in (*HERE.glob("*.py"), story):
        shutil.copy2(path, inside / path.name)
    target = user / f"out_{story.stem}"
    shutil.rmtree(inside / target.name, ignore_errors=True)
    command = _command(user / "drive.py", user / story.name, target)
    words = {"HOME": str(user), "LIBGL_ALWAYS_SOFTWARE": "1", "BLENDER_USER_RESOURCES": str(user)} | variables
    words["OMT_UV_ZIP"] = str(user)
    words["OMT_UV_ADDON"] = "bl_ext.user_default.omt_uv"
    shell = " ".join([*(f"{k}={v}" for k, v in words.items()), "timeout", str(TIME_LIMIT), *command])
    done = enter(age, shell)
    log.write(done.stdout + done.stderr)
    for path in (inside / target.name).glob("*"):
        shutil.copy2(path, out / path.name)


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
    parser.add_argument("--age", choices=[age.name for age in AGES], default="here")
    parser.add_argument("--light", action="store_true", help="in Blender's light theme")
    args = parser.parse_args()
    age = next(age for age in AGES if age.name == args.age)
    if reason := missing(age):
        print(f"skipped: {reason}")
        return 0
    failed = False
    for story in stories():
        if not args.stories or story.stem in args.stories:
            facts = play(story, args.out.resolve() / age.name / story.stem, age, "light" if args.light else "")
            failed |= "error" in facts
            print(json.dumps({story.stem: facts}, indent=1))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
