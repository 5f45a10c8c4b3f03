"""Each UDIM tile of the first hundred is a square ten in a row, for all that knows of tiles, and its number is told by
where the UVs are."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes

TILES = range(1001, 1101)
# Each row and each column twice, for what takes longer: all come by one function.
FEW = sorted({*range(1001, 1101, 11), *range(1010, 1092, 9)})
# What runs with a tile: an operator with arguments, or a command with words.
OPERATORS = {
    "unwrap": ("omt_unwrap", {"quality": "DRAFT", "max_shear": 0.0}),
    "refine": ("omt_refine", {"quality": "DRAFT", "pack": True}),
    "magnify": ("omt_magnify", {"quality": "DRAFT", "weight_group": "region", "factor": 1.5, "source": "MESH"}),
}
COMMANDS = {"unwrap": TILES, "queue": FEW}


def quads():
    """Two quads with UVs and a region."""
    obj = scenes.bump(2, 1)
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.5, (0.1, 0.2)))
    obj.vertex_groups.new(name="region").add([0, 3], 1.0, "REPLACE")
    return obj


def number(uv: np.ndarray) -> int:
    """The tile that UVs (k,2) are in, all of them."""
    (column, row), *others = np.unique(np.floor(uv).astype(int), axis=0).tolist()
    assert not others
    return 1001 + column + 10 * row


def check(found: dict[int, np.ndarray]) -> None:
    """UVs (k,2) by the tiles that they were asked for: in that tile, and there as in the first one."""
    for tile, uv in found.items():
        assert number(uv) == tile
        assert uv - np.floor(uv) == pytest.approx(found[1001], abs=2e-6)


@pytest.mark.parametrize("name", OPERATORS)
def test_operators_pack_into_the_tile_of_that_number(package, name):
    operator, arguments = OPERATORS[name]
    obj, found = quads(), {}
    before = scenes.uv_of(obj)
    for tile in FEW:
        scenes.set_uv(obj, before)
        assert getattr(bpy.ops.uv, operator)(**arguments, tile=tile) == {"FINISHED"}
        found[tile] = scenes.uv_of(obj).astype(float)
    check(found)


@pytest.mark.parametrize("name", COMMANDS)
def test_commands_pack_into_the_tile_of_that_number(run, tmp_path, name):
    points = [(0, 0, 0), (2, 0, 0), (2, 1, 0.5), (0, 1, 0)]
    lines = [*("v {} {} {}".format(*point) for point in points), "f 1 2 3 4"]
    (tmp_path / "in.obj").write_text("\n".join(lines) + "\n")
    found = {}
    for tile in COMMANDS[name]:
        words = [name, tmp_path / "in.obj", "-o", tmp_path / "out.obj", "--quality", "draft", "--udim", tile]
        assert run(*words)[0] == 0
        rows = [line.split()[1:] for line in (tmp_path / "out.obj").read_text().splitlines() if line[:3] == "vt "]
        found[tile] = np.array(rows, float)
    check(found)


@pytest.mark.parametrize("tile", [1000, 2000, 0, -1001, "1001.5", "u1_v1"])
def test_what_is_no_tile_is_refused(run, tmp_path, tile):
    status, _, err = run("unwrap", tmp_path / "in.obj", "-o", tmp_path / "out.obj", f"--udim={tile}")
    assert status == 2 and str(tile) in err


def test_all_tiles_are_told_apart_by_their_middles(package):
    """Whatever fills a tile is inside of it, and what passes a side of it is beyond."""
    beyond, settings = package("pipelines.texel_density").beyond_tile, package("settings").Settings
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    for tile in TILES:
        origin = np.array(settings(tile=tile).tile_origin)
        assert number(origin + 0.5 * square) == tile
        assert beyond(origin + square) == 0 and beyond(origin + 1.25 * square) == 0.25
