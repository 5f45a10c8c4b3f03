"""The glossary: words that it bans stand in no name, comment, string or page; those that it gives stand somewhere."""

from __future__ import annotations

import functools
import io
import re
import tokenize
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
GLOSSARY = ROOT / "docs" / "glossary.md"
# The glossary names the words it bans, and what has been released keeps its words.
EXCEPTED = {"docs/glossary.md", "CHANGELOG.md", "LICENSE"}
FOLDERS = ("omt_uv", "benchmarks", "scripts", "examples", "tests", "docs")
ENDINGS = {".py", ".md", ".sh", ".toml"}
# Python 3.12 has tokens for what stands in f-strings.
FSTRINGS = tuple(getattr(tokenize, name) for name in ("FSTRING_MIDDLE",) if hasattr(tokenize, name))
# A word within a name: of snake_case, of CamelCase, or by itself.
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")


def rows() -> list[list[str]]:
    """The cells of the glossary's table."""
    lines = [line for line in GLOSSARY.read_text().splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def forms_of(term: str) -> list[tuple[str, ...]]:
    """The words of a term, in the singular and in the plural."""
    words = words_of(term)
    return [words, *((*words[:-1], plural) for plural in plurals(words[-1]))]


def plurals(word: str) -> list[str]:
    """What the plural of a word may be."""
    return [word + "s", word + "es", word.removesuffix("y") + "ies"]


def banned() -> list[str]:
    """The words of the last column."""
    return [term.strip() for row in rows() for term in row[3].split(",") if term.strip()]


def words_of(text: str) -> tuple[str, ...]:
    """The words of names and of prose, in lower case."""
    return tuple(word.lower() for word in WORD.findall(text))


@functools.cache
def files() -> list[Path]:
    """The project's own text."""
    paths = [*ROOT.glob("*"), *(p for folder in FOLDERS for p in (ROOT / folder).glob("**/*"))]
    return sorted(p for p in paths if p.suffix in ENDINGS and str(p.relative_to(ROOT)) not in EXCEPTED and p.is_file())


@functools.cache
def lines_of(path: Path) -> list[tuple[int, str]]:
    """Pairs of line number and text: the file's name; of Python names, comments and strings, of others all."""
    return list(_lines_of(path))


def _lines_of(path: Path):
    yield 0, path.stem
    if path.suffix != ".py":
        yield from enumerate(path.read_text().splitlines(), 1)
        return
    for token in tokenize.generate_tokens(io.StringIO(path.read_text()).readline):
        if token.type not in (tokenize.NAME, tokenize.COMMENT, tokenize.STRING, *FSTRINGS):
            continue
        for k, line in enumerate(token.string.splitlines()):
            yield token.start[0] + k, line


def pattern_of(terms: list[str]) -> re.Pattern[str]:
    """What finds terms, each a group of its own, in words with a blank around each."""
    forms = ["|".join(" ".join(form) for form in forms_of(term)) for term in terms]
    return re.compile("(?<= )(?:" + "|".join(f"({form})" for form in forms) + ")(?= )")


@functools.cache
def spaced(text: str) -> str:
    """The words of a text with a blank around each."""
    return f" {' '.join(words_of(text))} "


@functools.cache
def whole(path: Path) -> str:
    """The words of a file's name and of all that is in it, spaced; what the lines below have stands in it, too."""
    return f" {' '.join(words_of(f'{path.stem} {path.read_text()}'))} "


def found(terms: list[str], paths: list[Path]):
    """Pairs of place and term, wherever a term stands."""
    pattern = pattern_of(terms)
    # To tell names, comments and strings from the rest takes ten times as long.
    for path in (p for p in paths if pattern.search(whole(p))):
        for number, line in lines_of(path):
            for match in pattern.finditer(spaced(line)):
                yield f"{path.relative_to(ROOT)}:{number}", terms[match.lastindex - 1]


def test_the_words_of_a_name_are_told_apart():
    assert spaced("UVIslands of _flat_shape, FLIP2") == " uv islands of flat shape flip "
    pattern = pattern_of(["flat shape", "glass"])
    assert [bool(pattern.search(spaced(t))) for t in ("FlatShapes", "glasses", "shape, flat", "glas")] == [1, 1, 0, 0]


def test_no_word_that_the_glossary_bans_is_used():
    assert len(banned()) > 5
    assert not [f"{place}: {term}" for place, term in found(banned(), files())]


def test_every_word_that_the_glossary_gives_is_used():
    paths = [p for p in files() if p.is_relative_to(ROOT / "omt_uv")]
    assert not [row[0] for row in rows() if not any(found([row[0]], paths))]


def test_no_word_stands_twice_in_the_glossary():
    given = [row[0] for row in rows()]
    assert all(len(row) == 4 and row[1] for row in rows())
    assert len(set(given)) == len(given) and not set(given) & set(banned())
