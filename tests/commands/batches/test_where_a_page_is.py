"""The pictures of a page are found from where the page is, however its folder was named."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from urllib.parse import unquote

import pytest


@pytest.mark.parametrize("way", ["whole", "relative", "up and down", "through a link", "beside the results"])
def test_pictures_are_found_from_where_the_page_is(package, monkeypatch, capsys, tmp_path, way):
    command, pages, manifest = package("commands.batches.page"), package("batch.pages"), package("batch.manifest")
    picture, deep = tmp_path / "results" / "out.previews" / "a b.png", tmp_path / "deep" / "down" / "here"
    for folder in (picture.parent, deep, tmp_path / "results" / "out"):
        folder.mkdir(parents=True, exist_ok=True)
    picture.touch()
    monkeypatch.chdir(deep.parent)
    path = {
        "whole": deep / "page.html",
        "relative": Path("here") / "page.html",
        "up and down": Path("here") / ".." / "here" / "page.html",
        "through a link": tmp_path / "link" / "page.html",
        "beside the results": None,
    }[way]
    if way == "through a link":
        try:
            (tmp_path / "link").symlink_to(deep, target_is_directory=True)
        except OSError:
            pytest.skip("no links here")
    monkeypatch.setattr(manifest, "found_beside", lambda folder: folder)
    monkeypatch.setattr(manifest, "rows_of", lambda found: [found])
    monkeypatch.setattr(pages, "page_of", lambda rows, folder, title: pages._link(str(picture), folder))
    command.run(Namespace(input=tmp_path / "results" / "out", output=path))
    told = Path(capsys.readouterr().out.strip())
    assert told == (path or tmp_path / "results" / "out.html")
    link = unquote(told.read_text())
    assert not Path(link).is_absolute() and (told.resolve().parent / link).resolve() == picture.resolve()
