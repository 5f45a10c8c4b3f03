"""The documents: links lead somewhere, README.md leads to every page, and names of code are those of the code."""

from __future__ import annotations

import ast
import functools
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SOLVER = ROOT / "omt_uv" / "solver"
METHOD = sorted((ROOT / "docs" / "method").glob("*.md"))
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("**/*.md"))]
PACKAGES = sorted(p.name for p in SOLVER.iterdir() if (p / "__init__.py").exists() and p.name != "api")
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
# Code such as `module.name` or `package/module.name.part`.
CODE = re.compile(r"`(?:(\w+)/)?([a-z_]+)\.(\w+)(?:\.(\w+))?`")


def links(page: Path) -> list[tuple[Path, str]]:
    """Targets of a page's links within the project, as files and headings."""
    found = [target.partition("#") for target in LINK.findall(page.read_text()) if "://" not in target]
    return [((page.parent / path).resolve() if path else page, heading) for path, _, heading in found]


def anchors(page: Path) -> set[str]:
    """The names of a page's headings, as links know them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", "-") for heading in headings}


@functools.cache
def names(module: Path) -> dict[str, ast.stmt]:
    """What stands at the top of a module, by name."""
    found: dict[str, ast.stmt] = {}
    for node in ast.parse(module.read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found[node.name] = node
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            found[node.targets[0].id] = node
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    lost = [target for target, _ in links(page) if not target.exists()]
    lost += [f"{target}#{heading}" for target, heading in links(page) if heading and heading not in anchors(target)]
    assert not lost


def test_every_page_is_reached_from_the_first():
    reached, ahead = set(), {ROOT / "README.md"}
    while ahead:
        reached |= ahead
        ahead = {t for page in ahead for t, _ in links(page) if t.suffix == ".md" and t.exists()} - reached
    assert {p for p in PAGES if p.is_relative_to(ROOT / "docs")} <= reached


def test_every_picture_is_shown():
    shown = {target for page in PAGES for target, _ in links(page)}
    assert set((ROOT / "docs" / "pictures").glob("**/*.png")) <= shown


@pytest.mark.parametrize("page", METHOD, ids=lambda p: p.name)
def test_method_names_what_there_is(page):
    """A module without a folder before it stands in the page's own package."""
    lost = []
    for folder, module, name, member in CODE.findall(page.read_text()):
        if name == "py":
            continue
        if folder:
            paths = list((ROOT / "omt_uv").glob(f"**/{folder}/{module}.py"))
        else:
            paths = list((SOLVER if page.stem == "README" else SOLVER / page.stem).glob(f"**/{module}.py"))
        there = [names(p)[name] for p in paths if name in names(p)]
        if not there or (member and not any(getattr(n, "name", "") == member for n in ast.walk(there[0]))):
            lost.append(f"{folder}/{module}.{name}.{member}")
    assert not lost


@pytest.mark.parametrize("package", PACKAGES)
def test_method_has_a_page_for_every_package_that_names_its_modules(package):
    """A new module gets a sentence there: what it does, and by which method."""
    text = (ROOT / "docs" / "method" / f"{package}.md").read_text()
    modules = {p.stem for p in (SOLVER / package).glob("**/*.py")} - {"__init__", "options"}
    assert not {m for m in modules if not re.search(rf"`(\w+/)?{m}[.`]", text)}


def test_method_has_no_other_page():
    assert {p.stem for p in METHOD} == {*PACKAGES, "README"}
