"""Values of options: what is none ends with one line that says so."""

from __future__ import annotations

import argparse

import numpy as np
import pytest

GOOD = [("share", "0", 0.0), ("share", "1", 1.0), ("shear", "1.01", 1.01), ("shear", "0", 0.0), ("margin", "0", 0.0),
        ("tile", "1999", 1999), ("tile", "1001", 1001), ("texture_size", "1", 1), ("positive", "1e-9", 1e-9),
        ("angle", "180", 180.0), ("vertices", "357913941", 357913941), ("faces", "1", 1),
        ("faces", "715827882", 715827882), ("aspect", "0", 0.0), ("aspect", "9999", 9999.0),
        ("subdivision", "6", 6), ("subdivision", "0", 0), ("subdivision", "off", 0)]  # fmt: skip
BAD = [("share", "-0.1"), ("share", "nan"), ("shear", "1"), ("shear", "0.5"), ("shear", "-1"), ("shear", "inf"),
       ("margin", "-1"), ("margin", "nan"), ("tile", "1000"), ("tile", "2000"), ("texture_size", "0"),
       ("positive", "0"), ("positive", "-inf"), ("angle", "181"), ("angle", "nan"),
       ("vertices", "0"), ("vertices", "357913942"), ("faces", "-1"),
       ("faces", "715827883"), ("aspect", "10000"), ("aspect", "-1"), ("subdivision", "7"), ("subdivision", "-1"),
       ("gigabytes", "0.4")]  # fmt: skip


@pytest.mark.parametrize("name, text, value", GOOD)
def test_values_at_the_ends_are_taken(package, name, text, value):
    assert getattr(package("commands.options"), name)(text) == value


@pytest.mark.parametrize("name, text", BAD)
def test_values_beyond_are_refused_by_what_they_are(package, name, text):
    with pytest.raises(argparse.ArgumentTypeError, match=f"^{text} "):
        getattr(package("commands.options"), name)(text)


OWN = [
    ("volumes.flow", "_count", ["1", "1000"], ["0", "1001", "-1"]),
    ("shapes.match", "_weight", ["0", "3"], ["-1e-9"]),
    ("shapes.partition", "rounds", ["0", "5"], ["-1"]),
    ("compare", "_count", ["1", "7"], ["0", "-1"]),
    ("remesh", "_positive", ["1"], ["0"]),
    ("remesh", "_growth", ["0", "0.5"], ["-0.1"]),
    ("remesh", "_ratio", ["1e-9", "0.999"], ["0", "1", "2", "-1"]),
    ("magnify", "times", ["1", "9"], ["0"]),
    ("batches.batch", "_count", ["1"], ["0"]),
]


@pytest.mark.parametrize("module, name, good, bad", OWN, ids=[f"{m}.{n}" for m, n, *_ in OWN])
def test_values_of_single_commands_at_their_ends(package, module, name, good, bad):
    found = getattr(package(f"commands.{module}"), name)
    assert [found(text) for text in good] == [float(text) for text in good]
    for text in bad:
        with pytest.raises(argparse.ArgumentTypeError, match=f"^{text} "):
            found(text)


@pytest.mark.parametrize("text, part", [("1/1", (1, 1)), ("2/5", (2, 5)), ("5/5", (5, 5))])
def test_parts_of_a_folder_are_one_of_several(package, text, part):
    found = package("commands.batches.batch")._part
    assert found(text) == part
    for none in ("0/5", "6/5", "1/0"):
        with pytest.raises(argparse.ArgumentTypeError, match="is no part"):
            found(none)


def test_as_little_memory_as_blender_starts_with_is_taken(package):
    """Or, where nothing holds a program to it, refused as any other."""
    options = package("commands.options")
    if package("supervision").MEMORY_IS_LIMITED:
        assert options.gigabytes("0.5") == 0.5
    else:
        with pytest.raises(argparse.ArgumentTypeError, match="does not hold"):
            options.gigabytes("0.5")


def test_choices_are_those_of_the_settings_in_lower_case(package):
    assert package("commands.options").names(package("settings").QUALITIES) == ["draft", "standard", "exact"]


def commands(package):
    """Pairs of the name and the parser of every command."""
    (every,) = (a for a in package("cli").parser()._actions if isinstance(a, argparse._SubParsersAction))
    return {name: c for name, c in every.choices.items() if not c.get_default("alone")}.items()


def _taken(action):
    """A value that an option takes."""
    return "x" if action.type is None or getattr(action.type, "__name__", "") == "Path" else "9"


def complete(command, beside):
    """Arguments that make a command complete beside an action."""
    exclusive = [group._group_actions for group in command._mutually_exclusive_groups]
    needed = [a for a in command._actions if a.required and a.option_strings and a is not beside]
    more = ["b.obj"] if any(a.dest == "others" for a in command._actions) else []
    words = ["in.obj", *more, *(word for a in needed for word in (a.option_strings[-1], _taken(a)))]
    free = [actions[0].option_strings[0] for actions in exclusive if beside not in actions]
    return [*words, *(word for name in free for word in (name, "uv" if name == "--transfer" else "9"))]


def test_every_option_of_numbers_refuses_what_is_no_finite_number(package, run):
    """By reflection: no option can be added that takes one."""
    tried = 0
    for name, command in commands(package):
        for action in command._actions:
            if action.type is not None and getattr(action.type, "__name__", "") != "Path":
                for value in ("nan", "inf", "-inf", "1e999"):
                    words = [*complete(command, action), f"{action.option_strings[0]}={value}"]
                    status, out, err = run(name, *words)
                    assert (status, out) == (2, ""), (name, action.option_strings, value)
                    assert action.option_strings[0] in err.splitlines()[-1] and "Traceback" not in err
                    tried += 1
    assert tried > 100


def test_every_command_has_the_options_of_input_and_limits(package):
    for name, command in commands(package):
        have = {text for action in command._actions for text in action.option_strings}
        assert have >= {"--object", "--scene", "--skip-linked", "--strict", "--timeout", "--memory"}, name


def test_lists_of_names_are_taken_apart_at_commas(package):
    kinds = package("commands.shapes.match").kinds_of
    known = package("commands.options").names(package("pipelines.shapes.choices").TRANSFERS)
    assert kinds(f" {known[0]} ,{known[1]},") == (known[0], known[1])
    for text in ("", " , ", "nothing", f"{known[0]},x"):
        with pytest.raises(argparse.ArgumentTypeError, match="is none of"):
            kinds(text)
    pair = package("commands.shapes.distance").pair_of_markers
    assert pair(" a , b ") == ("a", "b")
    for text in ("a", "a,", ",b", "a,b,c", ""):
        with pytest.raises(argparse.ArgumentTypeError, match="two names"):
            pair(text)


def test_up_in_files_becomes_up_in_the_world(package):
    """A rotation, that keeps what is right and takes Y, up in files, to Z, up in Blender."""
    turn = np.array(package("commands.common").Y_TO_Z, float)
    np.testing.assert_array_equal(turn @ turn.T, np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1)
    np.testing.assert_array_equal(turn @ [1, 0, 0], [1, 0, 0])
    assert (turn @ [0, 1, 0]).tolist() == [0, 0, 1]


@pytest.mark.parametrize("name, up", [("a.obj", "Y"), ("a.OFF", "Y"), ("a.ply", "Y"), ("a.blend", "Z"), ("a.glb", "Z")])
def test_objects_of_files_stand_as_their_axes_say_and_where_they_are(package, name, up):
    """A picture is of them upright: turned as a whole, places and all."""
    from pathlib import Path

    import scenes
    from mathutils import Matrix

    common, mesh = package("commands.common"), package("blender.mesh")
    obj = scenes.bump(2, 2, offset=0.3)
    obj.matrix_world = Matrix.LocRotScale((1.0, 2.0, -3.0), Matrix.Rotation(0.7, 3, (0.6, 0.0, 0.8)), (1, 1, 1))
    reading = mesh.read(obj)
    (placed,) = common.place_objects(argparse.Namespace(input=Path(name)), [(obj, reading)])
    world = np.array([obj.matrix_world @ v.co for v in obj.data.vertices])
    expected = np.stack([world[:, 0], -world[:, 2], world[:, 1]], axis=1) if up == "Y" else world
    vertex = reading.surface.positions @ placed.rotation.T + placed.shift
    np.testing.assert_allclose(vertex, expected, atol=1e-5)
