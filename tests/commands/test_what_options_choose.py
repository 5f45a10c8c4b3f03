"""Every option of a command reaches the setting that it names, with its value, and no other one."""

from __future__ import annotations

import math

import command_runs
import pytest

# Command, the class of its settings, and what single options change.
CHOICES = {
    "unwrap": ("unwrap", "Settings", {
        "--boundary disk": {"boundary": "disk"},
        "--quality exact": {"quality": "exact"},
        "--balance 0.25": {"balance": 0.25},
        "--margin 7": {"margin": 7},
        "--texture-size 512": {"texture_size": 512},
        "--udim 1013": {"tile": 1013},
        "--no-pack": {"pack": False},
        "--pack-around": {"pack_around": True},
        "--turn-to-fit": {"turn_to_fit": True},
        "--seams existing": {"seams": "existing"},
        "--fill-holes": {"fill_holes": True},
        "--max-shear 1.25": {"max_shear": 1.25},
        "--cut-further": {"cut_further": True},
        "--map conformal": {"kind": "conformal"},
        "--aspect 2": {"aspect": 2.0},
        "--mark-seams": {},
        "--uv-layer other": {},
    }),
    "refine": ("refine", "RefineSettings", {
        "--quality exact": {"quality": "exact"},
        "--balance 0.25": {"balance": 0.25},
        "--keep-boundary": {"keep_boundary": True},
    }),
    "magnify": ("magnify", "MagnifySettings", {
        "--boundary disk": {"boundary": "disk"},
        "--quality exact": {"quality": "exact"},
        "--margin 7": {"margin": 7},
        "--texture-size 512": {"texture_size": 512},
        "--factor 3": {"factor": 3.0},
        "--max-shear 1.25": {"max_shear": 1.25},
        "--cascade 3": {"cascade": 3},
    }),
    "sphere": ("sphere", "GlobeSettings", {
        "--projection lambert": {"projection": "lambert"},
        "--quality exact": {"quality": "exact"},
        "--balance 0.25": {"balance": 0.25},
        "--method flow": {"method": "flow"},
        "--fill-holes": {"fill_holes": True},
        "--weight-factor 3": {},
    }),
    "remesh": ("remesh", "RemeshSettings", {
        "--density curvature": {"density": "curvature"},
        "--density fine": {"density": "weights", "source": "fine"},
        "--factor 3": {"factor": 3.0, "amount": 3.0},
        "--grading 0.5": {"grading": 0.5},
        "--levels 3": {"levels": 3},
        "--ratio 0.25": {"ratio": 0.25},
        "--strategy app-app": {"strategy": "app-app"},
        "--sharp": {"preserve_sharp": True, "sharp_angle": math.radians(40)},
        "--sharp 25": {"preserve_sharp": True, "sharp_angle": math.radians(25)},
        "--no-boundary": {"preserve_boundary": False},
        "--no-seams": {"preserve_seams": False},
        "--no-materials": {"preserve_materials": False},
        "--no-attributes": {"preserve_attributes": False},
    }),
}  # fmt: skip
# What a command without a choice has in place of the default of the class.
OWN = {
    "unwrap": {"quality": "draft"},
    "refine": {"quality": "draft"},
    "magnify": {"quality": "draft", "factor": 1.5, "source": "uv", "boundary": "own", "max_shear": 1.5},
    "sphere": {"quality": "draft"},
    "remesh": {"count": 60, "sharp_angle": 0.0},
}


class Stop(BaseException):
    """The settings are there: nothing is to be solved."""


@pytest.fixture
def settings_of(package, run, monkeypatch, tmp_path_factory):
    """The settings that a command makes of some words."""
    folder = tmp_path_factory.mktemp("bodies")
    command_runs.prepare(run, folder)

    def made(name, more):
        module, cls, _ = CHOICES[name]
        given = getattr(package(f"commands.{module}"), cls)

        def stop(**chosen):
            raise Stop(vars(given(**chosen)))

        monkeypatch.setattr(package(f"commands.{module}"), cls, stop)
        with pytest.raises(Stop) as found:
            run(*command_runs.words(name, folder), *more.split())
        monkeypatch.setattr(package(f"commands.{module}"), cls, given)
        return found.value.args[0], vars(given())

    return made


@pytest.mark.parametrize("name", CHOICES)
def test_every_option_reaches_its_setting_and_no_other(settings_of, name):
    base, plain = settings_of(name, "")
    own = {key: value for key, value in base.items() if value != plain[key]}
    assert own == OWN[name]
    for more, expected in CHOICES[name][2].items():
        found, _ = settings_of(name, more)
        assert {key: value for key, value in found.items() if value != base[key]} == pytest.approx(expected), more
