"""Values of options: what is none ends with one line that says so."""

from __future__ import annotations

import argparse

import pytest

GOOD = [("share", "0", 0.0), ("share", "1", 1.0), ("shear", "1.01", 1.01), ("margin", "0", 0.0), ("tile", "1999", 1999),
        ("tile", "1001", 1001), ("texture_size", "1", 1)]  # fmt: skip
BAD = [("share", "-0.1"), ("share", "nan"), ("shear", "1"), ("shear", "inf"), ("margin", "-1"), ("margin", "nan"),
       ("tile", "1000"), ("tile", "2000"), ("texture_size", "0")]  # fmt: skip


@pytest.mark.parametrize("name, text, value", GOOD)
def test_values_at_the_ends_are_taken(package, name, text, value):
    assert getattr(package("commands.options"), name)(text) == value


@pytest.mark.parametrize("name, text", BAD)
def test_values_beyond_are_refused_by_what_they_are(package, name, text):
    with pytest.raises(argparse.ArgumentTypeError, match=f"^{text} "):
        getattr(package("commands.options"), name)(text)


def test_choices_are_those_of_the_settings_in_lower_case(package):
    assert package("commands.options").names(package("settings").QUALITIES) == ["draft", "standard", "exact"]
