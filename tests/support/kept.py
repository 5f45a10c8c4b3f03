"""Tables of what is an interface, kept in files: a change is seen, and made on purpose.

OMT_UV_ACCEPT=1 writes the files anew; what changed in them is then a line in CHANGELOG.md.
"""

from __future__ import annotations

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def modules() -> list[str]:
    """Names of all modules of the package that may be imported one by one."""
    return [
        ".".join(p.relative_to(ROOT).with_suffix("").parts)
        for p in sorted((ROOT / "omt_uv").glob("**/*.py"))
        if not p.stem.startswith("__") and "presets" not in p.parts
    ]


def check(path: Path, lines: list[str]) -> None:
    """Compare lines with those of a file, which is written where that is asked for.

    A line is known by its first three cells. What is new passes; what is known may neither change nor go.
    """
    if os.environ.get("OMT_UV_ACCEPT"):
        path.write_text("\n".join(lines) + "\n")
    kept = path.read_text().splitlines()
    known = {_name(line) for line in kept}
    gone = [f"- {line}" for line in kept if line not in set(lines)]
    other = [f"+ {line}" for line in lines if line not in set(kept) and _name(line) in known]
    assert not gone + other, "\n".join([*gone, *other, "OMT_UV_ACCEPT=1 accepts this"])


def _name(line: str) -> str:
    return "\t".join(line.split("\t")[:3])


class Recorder:
    """A layout that writes down what is drawn, and where that counts or can be chosen."""

    def __init__(self, record: list[str], state: str = "") -> None:
        self.__dict__.update(record=record, state=state, kept={})

    def __setattr__(self, name, value) -> None:
        if name in ("active", "enabled", "alert"):
            self.__dict__["state"] = f"{self.state}{name[0]}{int(value)}"
        else:
            self.record.append(f"{name}={value}")

    def __getattr__(self, name):
        if name in ("column", "row", "split", "box", "grid_flow", "column_flow"):
            # What is drawn without a gap is marked.
            return lambda *_, align=False, **__: Recorder(self.record, self.state + "~" * align)
        if name in ("emboss", "operator_context", "ui_units_x"):
            return ""
        return lambda *given, **named: self._written(name, given, named)

    def _written(self, kind, given, named):
        words = [x for x in given if isinstance(x, str)] + [f"{k}={v}" for k, v in named.items() if k != "icon_value"]
        if kind not in ("separator", "context_pointer_set"):
            self.record.append(f"{kind}({','.join(map(str, words))}){self.state}")
        return type("Properties", (), {})()


def plain(value) -> str:
    """A value in few digits: those of single precision that Blender keeps."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple, set)) or (hasattr(value, "__len__") and not isinstance(value, str)):
        return " ".join(map(plain, value))
    return str(value)
