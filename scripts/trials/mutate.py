"""Put small bugs into modules, one at a time, in a copy of the project, and count those that tests of these see.

usage: mutate.py LOG [--seed 0] [--count 40] [--only FOLDER] [--seconds 60]

LOG gets a line of each: seen or SURVIVED, where, what, the line. Modules of LOG are left out of the next call. First
the tests of the module run, then, for what survives, all that import it or call what it is, and those of every
dataclass, operator and command. A bug that takes too long is seen if what is right does not. Needs git.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# A bug: bytes from, to, what stands there then, and a word about it.
Bug = tuple[int, int, str, str]
SWAPPED = {ast.Lt: ("<", "<="), ast.Gt: (">", ">="), ast.LtE: ("<=", "<"), ast.GtE: (">=", ">"), ast.Eq: ("==", "!="),
           ast.NotEq: ("!=", "=="), ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"),
           ast.Div: ("/", "*"), ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"), ast.And: ("and", "or"),
           ast.Or: ("or", "and")}  # fmt: skip
CALLED = {"minimum": "maximum", "maximum": "minimum", "min": "max", "max": "min", "argmin": "argmax",
          "argmax": "argmin", "any": "all", "all": "any", "floor": "ceil", "ceil": "floor"}  # fmt: skip
# Nothing in these changes what comes out.
LEFT_OUT = (ast.Raise, ast.JoinedStr, ast.Yield)
# What holds for every dataclass, and for every operator and command.
EVERYWHERE = ["tests/test_house.py::test_dataclasses_are_frozen"]
FRONT = {
    "operators": ["interface", "every_path", "what_properties_choose", "ends_of_properties", "what_all_keep", "drags"],
    "commands": ["interface", "what_options_choose", "what_all_refuse", "warnings", "twins", "every_command"],
}
SHORTEST = 1500


def bugs(source: bytes) -> list[Bug]:
    """The bugs that may be put into a module."""
    begin = [0]
    for line in source.split(b"\n"):
        begin.append(begin[-1] + len(line) + 1)

    def span(node) -> tuple[int, int]:
        return begin[node.lineno - 1] + node.col_offset, begin[node.end_lineno - 1] + node.end_col_offset

    def between(a, b, kind) -> Iterator[Bug]:
        old, new = SWAPPED.get(kind, ("", ""))
        low, high = span(a)[1], span(b)[0]
        if old and source[low:high].decode().count(old) == 1:
            at = low + source[low:high].decode().index(old)
            yield at, at + len(old), new, f"{old} -> {new}"

    def visit(node) -> Iterator[Bug]:
        if isinstance(node, LEFT_OUT) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
            return
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            yield from between(node.left, node.comparators[0], type(node.ops[0]))
        elif isinstance(node, ast.BinOp):
            yield from between(node.left, node.right, type(node.op))
        elif isinstance(node, ast.BoolOp):
            yield from between(node.values[0], node.values[1], type(node.op))
        elif isinstance(node, ast.UnaryOp) and not isinstance(node.operand, ast.Constant):
            yield span(node)[0], span(node.operand)[0], "", "without its sign"
        elif isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            end = span(node.func)[1]
            if name in CALLED:
                yield end - len(name), end, CALLED[name], f"{name} -> {CALLED[name]}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
            yield *span(node), repr(not node.value), f"not {node.value}"
        elif isinstance(node, ast.Constant) and node.value in (0, 1, 2) and isinstance(node.value, int):
            yield *span(node), str(node.value + 1), f"{node.value} -> {node.value + 1}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, float) and node.col_offset < 40:
            yield *span(node), repr(node.value * 100), "x 100"
        inner = [node.value] if isinstance(node, ast.AnnAssign) and node.value else ast.iter_child_nodes(node)
        if isinstance(node, ast.FunctionDef):
            inner = node.body
        for child in inner:
            yield from visit(child)

    return list(visit(ast.parse(source)))


def tests_of(module: Path) -> list[str]:
    """Files of tests of a module: that of its name, or those that import it, three at most."""
    beside = Path("tests") / module.relative_to("omt_uv").parent
    own = beside / f"test_{module.stem}.py"
    if own.exists():
        return [str(own)]
    package = ".".join(module.parent.parts)
    words = f"{package}.{module.stem} import", f"{package} import {module.stem}"
    some = [*sorted(beside.glob("*.py")), *sorted(Path("tests").glob(f"{beside.parts[-1]}/**/*.py"))]
    found = [str(path) for path in some if any(word in path.read_text() for word in words)]
    return list(dict.fromkeys(found))[:3]


def users_of(module: Path) -> list[str]:
    """Files of tests that import a module of the package by its own name or have it, those of its folder first; and of
    a command or an operator those that run it."""
    dotted = ".".join(module.with_suffix("").parts)
    package, name = dotted.rsplit(".", 1)
    ways = [f"{dotted} import", f"import {dotted}", f'"{dotted}', f'"{dotted.removeprefix("omt_uv.")}"']
    among = rf"from {package} import (?:\([^)]*|.*)\b{name}\b"
    way = re.compile("|".join([*map(re.escape, [*ways, *names_of(module)]), among]))
    some = sorted(Path("tests").rglob("test_*.py"), key=lambda path: (path.parts[1:-1] != module.parts[1:-1], path))
    return [str(path) for path in some if path.name == f"test_{name}.py" or way.search(path.read_text())]


def names_of(module: Path) -> list[str]:
    """How tests call the command or the operators that a module is of."""
    if module.parts[1] == "batch":
        return ['"batch"']
    if module.parts[1] == "commands":
        return [f'"{module.stem.replace("_", "-")}"']
    return [found.rpartition(".")[2] for found in re.findall(r'bl_idname = "(.*omt.*)"', module.read_text())]


def ends(tests: list[str], seconds: int) -> str:
    """How tests end in a process of their own: passed, failed, or late."""
    child = os.fork()
    if not child:
        import pytest

        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1), os.dup2(nowhere, 2)
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
        sys.dont_write_bytecode = True
        os._exit(int(pytest.main([*tests, "-x", "-q", "-p", "no:cacheprovider", "--tb=no"])))
    status = os.waitpid(child, 0)[1]
    late = os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL)
    return "late" if late else "failed" if status else "passed"


def try_one(module: Path, bug: Bug, seconds: int) -> str:
    """`seen` or `SURVIVED`; the module is as it was then."""
    source = module.read_bytes()
    broken = source[: bug[0]] + bug[2].encode() + source[bug[1] :]
    folder = module.parts[1]
    front = [f"tests/{folder}/test_{name}.py" for name in FRONT.get(folder, [])]
    own = tests_of(module)
    rest = [path for path in dict.fromkeys([*users_of(module), *front]) if path not in own]
    try:
        for tests in [own, EVERYWHERE, *([path] for path in rest)]:
            module.write_bytes(broken)
            found = ends(tests, seconds)
            module.write_bytes(source)
            # What is right may take as long.
            if found == "failed" or (found == "late" and ends(tests, seconds) != "late"):
                return "seen"
    finally:
        module.write_bytes(source)
    return "SURVIVED"


def copied() -> Path:
    """A copy of all that git knows, in a folder of its own."""
    target = Path(tempfile.mkdtemp(prefix="omt_uv_mutate_"))
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, names.split("\0")):
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, target / name)
    return target


def main() -> None:
    """Try as many bugs as are asked for, each in another module."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--only", default="omt_uv/", help="modules whose path begins so")
    parser.add_argument("--seconds", type=int, default=60, help="of processor time, after which a bug counts as seen")
    args = parser.parse_args()
    log, folder = args.log.resolve(), copied()
    known = log.read_text() if log.exists() else ""
    os.chdir(folder)
    sys.path[:0] = [str(folder)]
    os.environ["PYTHONPATH"] = str(folder)
    choose = random.Random(args.seed)
    modules = [
        p for p in sorted(Path("omt_uv").rglob("*.py")) if p.name != "__init__.py" and str(p).startswith(args.only)
    ]
    modules = [p for p in modules if p.stat().st_size > SHORTEST and f"{p}:" not in known and tests_of(p)]
    choose.shuffle(modules)
    for module in modules[: args.count]:
        source = module.read_bytes()
        bug = choose.choice(bugs(source))
        line = source[: bug[0]].count(b"\n")
        text = source.split(b"\n")[line].decode().strip()
        found = try_one(module, bug, args.seconds)
        with open(log, "a") as file:
            print(found, f"{module}:{line + 1}", bug[3], "|", text, file=file)
    lines = log.read_text().splitlines()
    print(f"{sum(line.startswith('seen') for line in lines)} of {len(lines)} seen")
    os.chdir(ROOT)
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
