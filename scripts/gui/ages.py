"""Blenders that can be driven in a window: the one of this machine, and those of later Debians in roots of their own.

usage: ages.py [NAME ...]      makes the roots that are missing; needs root, debootstrap, and Debian's archive

A root is made once, in the folder OMT_UV_ROOTS (/var/tmp/omt_uv_roots by default): three minutes and 2 GB each. The
extension's zip is installed there from disk, as an artist would, and runs with its own wheels.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROOTS = Path(os.environ.get("OMT_UV_ROOTS", "/var/tmp/omt_uv_roots"))
ARCHIVE = os.environ.get("OMT_UV_DEBIAN", "http://deb.debian.org/debian")
# Blender opens libGL and libEGL by name, and its package asks for neither.
PACKAGES = "blender xdotool imagemagick libgl1 libegl1 libgl1-mesa-dri python3-scipy python3-cattr python3-requests"
# Lists of a mirror that is behind, or of a snapshot, have run out; they are signed all the same.
LISTS = 'Acquire::Check-Valid-Until "false";\n'
# The library that volumes need, which Debian has not, and where a root has it.
TETGEN = next(line for line in (ROOT / "requirements-dev.txt").read_text().splitlines() if line.startswith("tetgen"))
PYTHON_PACKAGES = Path("usr/lib/python3/dist-packages")
# What a root needs of the machine it is on.
SHARED = ("etc/resolv.conf",)
MOUNTED = ("proc", "sys", "dev")


@dataclass(frozen=True)
class Age:
    """A Blender: name, and Debian's suite for a root, empty for this machine's own."""

    name: str
    suite: str = ""

    @property
    def root(self) -> Path:
        return ROOTS / self.suite

    def is_there(self) -> bool:
        """Whether it can be driven as things are."""
        return not self.suite or (self.root / "usr/bin/blender").exists()


AGES = (Age("here"), Age("trixie", "trixie"), Age("sid", "sid"))


def why_not() -> str:
    """Why no root can be made here, empty if one can."""
    if os.geteuid() != 0:
        return "only root can make a root of its own"
    return "" if shutil.which("debootstrap") else "debootstrap is not installed"


def make(age: Age) -> None:
    """Make the root of an age, and nothing if it is there."""
    if age.is_there():
        return
    ROOTS.mkdir(parents=True, exist_ok=True)
    command = ["debootstrap", "--variant=minbase", "--include=ca-certificates", age.suite, str(age.root), ARCHIVE]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    for name in SHARED:
        shutil.copy2(f"/{name}", age.root / name)
    (age.root / "etc/apt/apt.conf.d/99lists").write_text(LISTS)
    enter(age, "apt-get update -qq", check=True)
    enter(age, f"DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends {PACKAGES}", check=True)


def give_tetgen(age: Age) -> None:
    """Put the library that volumes need into a root, as a wheel for its Python; nothing if it is there."""
    folder = age.root / PYTHON_PACKAGES
    if (folder / "tetgen").exists():
        return
    names = [path.name.removeprefix("python") for path in (age.root / "usr/bin").glob("python3.*")]
    version = next(name for name in names if name.replace(".", "").isdigit())
    wheels = ["--target", str(folder), "--python-version", version, "--only-binary=:all:", "--no-deps"]
    subprocess.run([sys.executable, "-m", "pip", "install", "-q", *wheels, TETGEN], check=True)


def enter(age: Age, script: str, check: bool = False) -> subprocess.CompletedProcess:
    """Run a line of the shell in a root, with what it needs mounted as long as it takes."""
    lines = [f"mountpoint -q {age.root}/{n} || mount --rbind /{n} {age.root}/{n}" for n in MOUNTED]
    # A name space of its own: the mounts go with it, whatever happens.
    command = ["unshare", "--mount", "--propagation", "private", "sh", "-c", "\n".join([*lines, _chroot(age, script)])]
    return subprocess.run(command, check=check, capture_output=True, text=True)


def _chroot(age: Age, script: str) -> str:
    return f"exec chroot {age.root} sh -c '{script}'"


def stay(age: Age, archive: Path) -> Path:
    """A folder of a new user in the root, with the zip in it; the folder as the root names it."""
    folder = Path(tempfile.mkdtemp(prefix="omt_uv_user_", dir=age.root / "tmp"))
    shutil.copy2(archive, folder / archive.name)
    return Path("/") / folder.relative_to(age.root)


def install(age: Age, archive: Path) -> Path:
    """A folder of a user in the root, with the extension installed from the zip; the folder as the root names it."""
    user = stay(age, archive)
    done = enter(
        age,
        f"HOME={user} BLENDER_USER_RESOURCES={user} blender --command extension install-file -r user_default -e "
        f"{user / archive.name}",
    )
    if "Installed" not in done.stdout + done.stderr:
        raise RuntimeError(f"{age.name}: the zip was not installed\n{done.stdout}{done.stderr}")
    (age.root / user.relative_to("/") / archive.name).unlink()
    return user


def main(names: list[str]) -> int:
    """Make the roots that are missing; 1 where that is not possible."""
    missing = [age for age in AGES if not age.is_there() and (not names or age.name in names)]
    if missing and (reason := why_not()):
        print(f"{', '.join(age.name for age in missing)}: {reason}")
        return 1
    for age in missing:
        print(f"Making a root for Blender of Debian {age.suite} in {age.root}", flush=True)
        make(age)
    for age in AGES:
        if age.suite and age.is_there() and (not names or age.name in names):
            give_tetgen(age)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
