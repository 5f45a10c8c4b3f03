"""Make a website of ./docs in ./build/site, with no program but Python's own: a page for every document.

usage: site.py [--out FOLDER]

Every link is followed: one that leads nowhere ends it with 1. Addresses are those that omt_uv/links.py gives to
Blender's Online Manual: operators/unwrap/ for docs/operators/unwrap.md.
"""

from __future__ import annotations

import argparse
import html
import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
# What begins an item of a list.
MARK = re.compile(r"^\s*([-*]|\d+\.) ")
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title} - OMT UV</title><style>
body {{ font: 16px/1.55 sans-serif; margin: 0; display: flex; color: #222; background: #fff }}
nav {{ flex: 0 0 15em; padding: 1.5em; background: #f3f3f3; min-height: 100vh; box-sizing: border-box }}
nav a {{ display: block; color: #265787; text-decoration: none; padding: .1em 0 }}
nav b {{ display: block; margin-top: 1em }}
main {{ padding: 1.5em 2.5em; max-width: 54em; min-width: 0 }} img {{ max-width: 100% }}
table {{ border-collapse: collapse }} td, th {{ border: 1px solid #ccc; padding: .3em .6em; vertical-align: top }}
pre {{ background: #f3f3f3; padding: .8em; overflow: auto }} code {{ background: #f3f3f3 }}
@media (prefers-color-scheme: dark) {{ body {{ color: #ddd; background: #1d1d1d }}
nav, pre, code {{ background: #2a2a2a }}
a, nav a {{ color: #8ab8e6 }} td, th {{ border-color: #444 }} }}
</style></head><body><nav>{menu}</nav><main>{body}</main></body></html>
"""


def address(path: Path) -> Path:
    """The folder of a document's page, below the site."""
    inside = path.relative_to(DOCS)
    return inside.parent if inside.name == "README.md" else inside.with_suffix("")


def title_of(path: Path) -> str:
    """The first heading."""
    found = re.search(r"^# (.+)$", path.read_text(), re.MULTILINE)
    return found[1] if found else path.stem


def inline(text: str, link) -> str:
    """Code, pictures, links, bold and slanted words of a line; link(target) is the address of a link."""
    kept: list[str] = []

    def keep(made: str) -> str:
        kept.append(made)
        return f"\0{len(kept) - 1}\0"

    text = re.sub(r"`([^`]+)`", lambda m: keep(f"<code>{html.escape(m[1])}</code>"), text)
    text = re.sub(
        r"!\[([^]]*)\]\(([^)]+)\)", lambda m: keep(f'<img alt="{html.escape(m[1])}" src="{link(m[2])}">'), text
    )
    text = re.sub(
        r"(?<!\\)\[([^]]+)\]\(([^)]+)\)", lambda m: keep(f'<a href="{link(m[2])}">') + m[1] + keep("</a>"), text
    )
    text = html.escape(text, quote=False)
    text = re.sub(r"\*\*([^*]+)\*\*", r"<b>\1</b>", text)
    text = re.sub(r"(?<![\w*])\*([^*\s][^*]*)\*(?!\w)", r"<i>\1</i>", text)
    while "\0" in text:
        text = re.sub(r"\0(\d+)\0", lambda m: kept[int(m[1])], text)
    return text.replace("\\|", "|")


def table(lines: list[str], link) -> str:
    """Rows of a table; the first is its head."""
    rows = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip().strip("|"))] for line in lines]
    made = []
    for k, row in enumerate(rows):
        if k == 1 and all(re.fullmatch(r":?-+:?", cell) for cell in row):
            continue
        kind = "th" if k == 0 else "td"
        made.append("<tr>" + "".join(f"<{kind}>{inline(cell, link)}</{kind}>" for cell in row) + "</tr>")
    return "<table>" + "".join(made) + "</table>"


def body_of(text: str, link) -> str:
    """The document as HTML: headings, lists, tables, code, paragraphs; what is none of these is a paragraph."""
    made = []
    for block in re.split(r"\n\s*\n(?!    )", re.sub(r"```\w*\n(.*?)```", _indented, text, flags=re.DOTALL)):
        lines = block.strip("\n").split("\n")
        first = lines[0]
        if heading := re.match(r"(#+) (.+)", first):
            level = len(heading[1])
            name = re.sub(r"[^\w]+", "-", heading[2].lower()).strip("-")
            made.append(f'<h{level} id="{name}">{inline(heading[2], link)}</h{level}>')
            if lines[1:]:
                made.append(body_of("\n".join(lines[1:]), link))
        elif first.startswith("    "):
            made.append(f"<pre>{html.escape(chr(10).join(line[4:] for line in lines))}</pre>")
        elif first.lstrip().startswith("|"):
            made.append(table(lines, link))
        elif re.match(r"\s*([-*]|\d+\.) ", first):
            items = re.split(r"\n(?=\s{0,3}(?:[-*]|\d+\.) )", "\n".join(lines))
            kind = "ul" if re.match(r"\s*[-*]", first) else "ol"
            words = [inline(MARK.sub("", item), link) for item in items]
            inner = "".join(f"<li>{each}</li>" for each in words)
            made.append(f"<{kind}>{inner}</{kind}>")
        elif block.strip():
            made.append(f"<p>{inline(' '.join(lines), link)}</p>")
    return "\n".join(made)


def _indented(match: re.Match) -> str:
    return "\n" + "\n".join("    " + line for line in match[1].rstrip("\n").split("\n")) + "\n"


def menu_of(pages: list[Path], up: str) -> str:
    """Links to all pages, by folder."""
    parts, folder = [f'<a href="{up}operators/">OMT UV</a>'], None
    for page in pages:
        if page.parent != folder:
            folder = page.parent
            parts.append(f"<b>{'Documents' if folder == DOCS else folder.name.capitalize()}</b>")
        parts.append(f'<a href="{up}{address(page).as_posix()}/">{html.escape(title_of(page))}</a>')
    return "".join(parts)


def main() -> int:
    """Make all pages; 1 where a link leads nowhere."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "site")
    out = parser.parse_args().out
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(DOCS / "pictures", out / "pictures")
    pages = sorted(DOCS.glob("**/*.md"), key=lambda p: (p.parent, p.name != "README.md", p.name))
    broken: list[str] = []
    for page in pages:
        target = out / address(page)
        target.mkdir(parents=True, exist_ok=True)
        up = "../" * len(address(page).parts)

        def link(goal: str, page: Path = page, up: str = up) -> str:
            name, _, mark = goal.partition("#")
            if re.match(r"\w+:", goal) or not name:
                return html.escape(goal)
            path = (page.parent / name).resolve()
            if not path.exists():
                broken.append(f"{page.relative_to(ROOT)}: {goal}")
            if path.suffix == ".md" and path.is_relative_to(DOCS):
                return f"{up}{address(path).as_posix()}/" + (f"#{mark}" if mark else "")
            return up + path.relative_to(DOCS).as_posix() if path.is_relative_to(DOCS) else html.escape(goal)

        body = body_of(page.read_text(), link)
        (target / "index.html").write_text(
            PAGE.format(title=html.escape(title_of(page)), menu=menu_of(pages, up), body=body)
        )
    (out / "index.html").write_text('<meta http-equiv="refresh" content="0; url=operators/">')
    print(f"{out}: {len(pages)} pages" + "".join(f"\n  nowhere: {line}" for line in broken))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
