"""Errors with words of their own: a test asks for each by these words, and here are those that no other asks for."""

from __future__ import annotations

import argparse
import ast
import json
import re
from pathlib import Path
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
# Words, one after the other, by which an error is known, and the letters that they have at least.
WORDS = 2
LETTERS = 7
QUOTES = re.compile(r'"\s*[fr]*"')


def said_by_tests() -> str:
    """All that tests and their tables hold, with texts of several lines as one."""
    texts = [p.read_text() for kind in ("*.py", "*.tsv") for p in sorted((ROOT / "tests").rglob(kind))]
    return " ".join(QUOTES.sub("", " ".join(text.split())) for text in texts).replace("\\", "")


def errors():
    """Places and constant parts of the texts of all errors that are raised, but for those of one word."""
    for path in sorted((ROOT / "omt_uv").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Raise) or not isinstance(node.exc, ast.Call) or not node.exc.args:
                continue
            (text, *_) = node.exc.args
            parts = text.values if isinstance(text, ast.JoinedStr) else [text]
            own = [p.value for p in parts if isinstance(p, ast.Constant) and isinstance(p.value, str)]
            pairs = [
                " ".join(words[k : k + WORDS])
                for words in (part.strip(" .,;:()'").split() for part in own)
                for k in range(len(words) - WORDS + 1)
            ]
            if pairs := [pair for pair in pairs if len(pair) >= LETTERS]:
                yield f"{path.relative_to(ROOT)}:{node.lineno}", pairs


def test_every_error_is_asked_for_by_its_words():
    said = said_by_tests()
    found = dict(errors())
    assert len(found) > 500
    missing = [f"{place}: {pairs}" for place, pairs in found.items() if not any(pair in said for pair in pairs)]
    assert not missing, "\n".join(missing)


def test_growth_is_not_below_zero(package):
    module = package("commands.remesh")
    assert module._growth("0") == 0 and module._growth("0.5") == 0.5
    with pytest.raises(argparse.ArgumentTypeError, match=r"^-0.1 is no growth per length$"):
        module._growth("-0.1")


def test_accessors_count_no_more_than_there_is_and_are_not_compressed(package):
    data = package("files.in_place.glb_data")

    def of(count, extension=""):
        view = {"buffer": 0, "byteLength": 12, **({"extensions": {extension: {}}} if extension else {})}
        doc = {"accessors": [{"componentType": 5126, "type": "VEC3", "count": count, "bufferView": 0}],
               "bufferViews": [view], "buffers": [{"byteLength": 12}]}  # fmt: skip
        return data.Glb(doc, np.arange(3, dtype=np.float32).tobytes(), [])

    assert data.accessor(of(1), 0).tolist() == [[0, 1, 2]]
    for count in (-1, 13, 1.0):
        with pytest.raises(data.InPlaceError, match=f"^accessor 0 counts {count} values$"):
            data.accessor(of(count), 0)
    for extension in data.COMPRESSIONS:
        with pytest.raises(data.InPlaceError, match="its buffers are compressed"):
            data.accessor(of(1, extension), 0)


@pytest.mark.parametrize("key, known", [("move", True), ("group", True), ("mvoe", False)])
def test_what_a_handle_does_not_have_is_named_with_its_number(key, known, tmp_path, package):
    module = package("pipelines.volumes.handle_file")
    path = tmp_path / "h.json"
    path.write_text(json.dumps([{"group": "a"}, {key: [0, 0, 1]}]))
    if known:
        assert len(module.read_handle_file(path).handles) == 2
        return
    with pytest.raises(module.HandleFileError, match=r"handle 1 has 'mvoe'\. Known are .*group.*move"):
        module.read_handle_file(path)


KEEPS = [("feet", ("feet",)), (["feet"], ("feet",)), ([], ()), ("", ("",)),
         (["feet", "hands"], "names 2 vertex groups"), (3, "not the name of a vertex group"),
         ([3], "not the name of a vertex group"), ({"feet": 1}, "not the name of a vertex group"),
         (None, "not the name of a vertex group")]  # fmt: skip


@pytest.mark.parametrize(("keep", "found"), KEEPS, ids=str)
def test_what_stays_is_one_group_and_no_second_one_is_left_out_unsaid(keep, found, tmp_path, package):
    module = package("pipelines.volumes.handle_file")
    path = tmp_path / "h.json"
    path.write_text(json.dumps({"handles": [{"group": "a"}], "keep": keep}))
    if isinstance(found, tuple):
        assert module.read_handle_file(path).keep == found
        return
    with pytest.raises(module.HandleFileError, match=found):
        module.read_handle_file(path)


def test_what_is_lost_by_an_undo_is_disturbed(package):
    live, run = package("session.live"), package("session.run")
    for module, words in ((live, "^Something was undone$"), (run, "^Something was undone meanwhile$")):
        for kind in vars(module).values():
            check = getattr(kind, "_check", None) if module is live else getattr(kind, "check", None)
            if isinstance(kind, type) and kind.__module__ == module.__name__ and callable(check):
                with pytest.raises(run.Disturbed, match=words):
                    check(SimpleNamespace(_lost=True))


def test_parts_and_handles_of_what_is_matched_are_counted():
    from omt_uv.solver import errors as kinds
    from omt_uv.solver.registration.domains import checked

    V, F = meshes.icosphere(1)
    with pytest.raises(
        kinds.SeveralComponentsError, match=r"The source has 2 parts.*Match its parts one by one"
    ) as found:
        checked(np.concatenate([V, V + 5]), np.concatenate([F, F[3:] + len(V)]), "source")
    assert found.value.kind == "face" and found.value.elements.tolist() == list(range(len(F), 2 * len(F) - 3))
    with pytest.raises(kinds.TopologyMismatchError, match=r"The target has a handle\. Match surfaces without handles"):
        checked(*meshes.torus(8, 6), "target")


@pytest.mark.parametrize("old", [False, True])
def test_an_index_with_markers_and_one_without_do_not_mix(old, package, tmp_path, monkeypatch):
    library, common = package("commands.shapes.library"), package("commands.common")
    output = tmp_path / "index.npz"
    output.write_bytes(b"")
    module = package("pipelines.shapes.signature_index")
    monkeypatch.setattr(module, "read_index", lambda path: SimpleNamespace(names=(), marks=(), marked=old))
    options = argparse.Namespace(input=tmp_path, output=output, markers=None if old else ("a", "b"), json=False)
    monkeypatch.setattr(library, "check_paths", lambda *_: None)
    with pytest.raises(common.CommandError, match=f"has shapes with{'' if old else 'out'} markers. Name another."):
        library.run(options)


def test_an_unknown_format_is_named_beside_the_known_ones(package, tmp_path, monkeypatch):
    verified, volume = package("files.verified"), package("commands.volumes.volume")
    verified.check_suffix(tmp_path / "a.OBJ", (".ply", ".obj"))
    with pytest.raises(verified.FileError, match=r"a\.x: unknown format '\.x'\. Use one of \.ply \.obj\."):
        verified.check_suffix(tmp_path / "a.x", (".ply", ".obj"))
    monkeypatch.setattr(volume, "require_blender", lambda: None)
    error, known = package("commands.common").UsageError, " ".join(volume.WRITABLE)
    with pytest.raises(error, match=re.escape(f"unknown format '.obj'. Use one of {known}.")):
        volume.run_volume(argparse.Namespace(output=tmp_path / "a.obj"))


@pytest.mark.parametrize("place", ["NaN", "Infinity", "1.5"])
def test_a_landmark_is_at_a_place_that_is_one(place, package, tmp_path):
    module, path = package("pipelines.shapes.landmark_pairs"), tmp_path / "pairs.json"
    path.write_text(f"[[[0, 1, {place}], 4]]")
    if place == "1.5":
        assert module.read_pairs(path).source[0].position == (0, 1, 1.5)
    else:
        with pytest.raises(module.PairsError, match="pair 0 is none") as caught:
            module.read_pairs(path)
        assert str(caught.value.__cause__) == "no place"
