"""Images that are not read or written, and files that cannot be: one line about the file."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest


@pytest.fixture
def images(package):
    return package("files.images")


@pytest.mark.parametrize(
    ("size", "channels", "words"),
    [
        ((2, 3), 4, None),
        ((2, 3), 3, "3 channels"),
        ((2, 3), 1, "1 channels"),
        ((0, 3), 4, "pixels"),
        ((2, 0), 4, "pixels"),
    ],
)
def test_images_have_pixels_of_four_channels(images, size, channels, words):
    given = np.arange(4 * size[0] * size[1], dtype=np.float32)

    def foreach_get(values):
        values[:] = given

    image = SimpleNamespace(name="it", size=size, channels=channels, pixels=SimpleNamespace(foreach_get=foreach_get))
    if words is None:
        assert images.pixels_of(image).tolist() == given.reshape(size[1], size[0], 4).tolist()
    else:
        with pytest.raises(images.ImageError, match=words):
            images.pixels_of(image)


@pytest.mark.parametrize("text", ["Error: no space\n", " "])
def test_an_image_that_cannot_be_written_is_one_line_and_gone(images, text, monkeypatch, tmp_path):
    import bpy

    def fails(*_):
        raise RuntimeError(text)

    monkeypatch.setattr(images, "check_whole", fails)
    before = set(bpy.data.images.keys())
    like = bpy.data.images.new("like", 2, 2, alpha=True)
    path = tmp_path / "made.png"
    with pytest.raises(images.ImageError) as caught:
        images.save(path, np.zeros((2, 2, 4), np.float32), like)
    said = str(caught.value)
    assert said == f"{path}: {text.strip() or 'cannot be written'}"
    assert not list(tmp_path.iterdir()) and set(bpy.data.images.keys()) == before | {"like"}
    bpy.data.images.remove(like)
