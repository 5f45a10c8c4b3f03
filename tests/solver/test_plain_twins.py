"""Pieces of solvers and of what is shown, against twins that are plain: loops, dense matrices, Python's own colours."""

from __future__ import annotations

import colorsys
import json
from itertools import product
from pathlib import Path

import meshes
import numpy as np
import pytest
import scipy.sparse as sp

from omt_uv.batch import figures, pages
from omt_uv.batch.figures import ADDED, WORST, _of_parts, columns_of
from omt_uv.display.textures.patterns import hsv
from omt_uv.pipelines.measuring.region_figures import diameter, perimeter
from omt_uv.solver.editing import outline
from omt_uv.solver.linalg.vertex_rows import RowPattern, VertexRows
from omt_uv.solver.maps.energy import elements, energies, energy
from omt_uv.solver.maps.tutte import arc_length_parameters, tutte
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.repair import _least_height
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.packing.placement import _beside, turned_masks
from omt_uv.solver.packing.raster_grid import FreePlaces, RasterGrid
from omt_uv.solver.refinement.vertex_sweeps import WORST as WORST_STARS
from omt_uv.solver.refinement.vertex_sweeps import Smoother


@pytest.mark.parametrize("seed", range(4))
def test_the_matrix_between_motions_is_that_of_the_whole_matrix(seed):
    V, F = meshes.bumpy(6, 5)
    n, rng = len(V), np.random.default_rng(seed)
    pattern = RowPattern([F, np.zeros((0, 4), np.int64)], n)
    half = rng.normal(size=(len(F), 6, 6))
    local = half @ half.transpose(0, 2, 1)
    more = sp.random(2 * n, 2 * n, 0.01, random_state=seed) if seed % 2 else None
    more = None if more is None else (more + more.T).tocsr()
    rows = VertexRows(pattern, VertexRows.summed(pattern, [(pattern.places()(F), local)]), more)
    rows.add_diagonal(rng.random(2 * n))
    dense = np.column_stack([rows @ x for x in np.eye(2 * n)])
    np.testing.assert_allclose(dense, dense.T, atol=1e-9)
    motions = sp.random(2 * n, 7, 0.2, random_state=seed).tocsr()
    expected = motions.toarray().T @ dense @ motions.toarray()
    np.testing.assert_allclose(rows.between(motions.copy()).toarray(), expected, atol=1e-9)
    x = rng.normal(size=2 * n)
    np.testing.assert_allclose(rows @ x, dense @ x, atol=1e-9)


@pytest.mark.parametrize("sweeps", [0, 1, 3])
def test_sweeps_after_a_step_move_the_worst_stars_alone_and_lower_the_energy(sweeps):
    V, F = meshes.head(16)
    loop = boundary_loops(F)[0]
    turn = 2 * np.pi * arc_length_parameters(V, loop)
    w = tutte(V, F, loop, np.column_stack([np.cos(turn), np.sin(turn)])) @ [1, 1j]
    faces = elements(V, F, face_areas(V, F) * np.random.default_rng(0).uniform(0.5, 2, len(F)))
    found = Smoother(F, len(V)).smoothed(faces, w, 30.0, sweeps)
    star = np.bincount(F.ravel(), np.repeat(energies(faces, w, 30.0), 3), len(w))
    bad = star > WORST_STARS * star.mean()
    bad[loop] = False
    moved = found != w
    assert not (moved & ~bad).any() and moved.any() == (sweeps > 0)
    if sweeps:
        assert moved[bad].mean() > 0.9 and energy(faces, found, 30.0) < energy(faces, w, 30.0)
        assert (signed_areas(np.column_stack([found.real, found.imag]), F) > 0).all()


def test_heights_are_the_least_of_sound_triangles_around_or_across_bad_ones():
    V, F = meshes.random_disk(60, 1)
    V = V.copy()
    # A triangle without area, and what is around it.
    a, b, c = F[17]
    V[c] = (V[a] + V[b]) / 2
    found = _least_height(V, F)
    p = V[F]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    height = area / np.linalg.norm(p - p[:, [1, 2, 0]], axis=2).max(axis=1)
    sound = area > 1e-6
    for v in range(len(V)):
        mine = height[(v == F).any(axis=1) & sound]
        if len(mine):
            assert found[v] <= mine.min() * (1 + 1e-12)
        alone = (v == F).any(axis=1)
        if sound[alone].all() and not np.isin(F[alone], F[~sound]).any():
            assert found[v] == pytest.approx(mine.min())
    assert np.isfinite(found).all() and (found > 0).all()
    flat = _least_height(np.zeros((4, 3)), np.array([[0, 1, 2], [0, 2, 3]]))
    np.testing.assert_allclose(flat, 1 / 2)


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_what_touches_a_mask_is_counted_cell_by_cell_wherever_it_lies(quarters):
    rng = np.random.default_rng(quarters)
    mask = rng.random((4, 6)) > 0.4
    mask[0], mask[:, 0] = True, True
    (turned,) = turned_masks(mask, [quarters]).turns
    np.testing.assert_array_equal(turned.mask, np.rot90(mask, -quarters))
    assert {tuple(cell) for cell in turned.beside.tolist()} == {tuple(c) for c in _beside(turned.mask).tolist()}
    grid, side = RasterGrid(20, 8), 20
    blob = rng.random((5, 7)) > 0.3
    grid.take(blob, 9, 6)
    taken = np.zeros((side, side), bool)
    taken[6:11, 9:16] = blob
    height, width = turned.mask.shape
    for x, y in ((0, 0), (3, 5), (side - width, side - height), (7, 2), (0, side - height)):
        count = 0
        for dx, dy in turned.beside.tolist():
            cx, cy = x + dx, y + dy
            count += not (0 <= cx < side and 0 <= cy < side) or bool(taken[cy, cx])
        share = grid.taken_share(turned.beside, np.array([[x, y]]))
        assert share == pytest.approx(count / len(turned.beside))


def test_places_at_the_ends_of_outermost_rows_and_columns():
    free = np.zeros((6, 7), bool)
    for y, x in ((1, 2), (1, 4), (3, 1), (4, 5), (4, 3), (2, 5)):
        free[y, x] = True
    assert FreePlaces(np.packbits(free, axis=1)).ends() == {(2, 1), (4, 1), (3, 4), (5, 4), (1, 3), (5, 2)}


@pytest.mark.parametrize("count", [4, 8, 12, 40, 64])
@pytest.mark.parametrize("shape", ["circle", "polygon", "curve", "star"])
def test_outlines_are_circles_sides_or_neither(count, shape):
    turn = 2 * np.pi * np.arange(count) / count
    around = np.exp(1j * turn)
    if shape == "polygon":
        # A square, with its corners among the vertices.
        corners = np.array([1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j])
        part = 4 * np.arange(count) / count
        k, t = part.astype(int), part % 1
        around = corners[k] * (1 - t) + corners[(k + 1) % 4] * t
    elif shape == "curve":
        around = around * (1 + 0.3 * np.cos(3 * turn))
    elif shape == "star":
        around = around * (1 + 0.5 * (np.arange(count) % 2))
    w = np.append(around + (3 - 2j), 3 - 2j)
    found = outline.recognise_outline(w, np.arange(count))
    if shape == "circle":
        assert (found.kind == "circle") == (count >= 12)
    elif shape == "polygon":
        assert found.kind == "sides"
    # Whatever it is taken for, it is where it was.
    back = found.w + found.centre
    assert np.abs(back - w)[:count].max() < 0.05 * np.abs(around).max()
    if found.kind == "free":
        np.testing.assert_array_equal(found.w, w)
    centre, radius = outline.fitted_circle(np.exp(1j * turn[: count // 2 + 1]) * 2.5 + (1 + 1j))
    assert centre == pytest.approx(1 + 1j, abs=1e-9) and radius == pytest.approx(2.5)


@pytest.mark.parametrize("kind", ["random", "line", "point", "two", "round", "doubled"])
def test_a_diameter_is_the_greatest_distance_of_two(kind):
    rng = np.random.default_rng(3)
    t = rng.random(60)
    turn = np.linspace(0, 2 * np.pi, 1300, endpoint=False)
    points = {
        "random": rng.normal(size=(70, 2)), "line": np.column_stack([t, 3 - 2 * t]), "point": np.ones((5, 2)),
        "two": np.array([[0.0, 1.0], [4.0, -2.0]]), "round": np.column_stack([np.cos(turn), 1.1 * np.sin(turn)]),
        "doubled": np.repeat(rng.normal(size=(3, 2)), 4, axis=0),
    }[kind]  # fmt: skip
    plain = max(np.linalg.norm(points - p, axis=1).max() for p in points)
    assert diameter(points) == pytest.approx(plain, rel=1e-12, abs=1e-300)


def test_a_perimeter_is_that_of_edges_with_one_side():
    V, F = meshes.bumpy(5, 4)
    chosen = F[np.random.default_rng(0).random(len(F)) > 0.4]
    sides: dict[frozenset, int] = {}
    for face in chosen.tolist():
        for k in range(3):
            edge = frozenset((face[k], face[(k + 1) % 3]))
            sides[edge] = sides.get(edge, 0) + 1
    plain = sum(np.linalg.norm(np.subtract(*V[list(edge)])) for edge, count in sides.items() if count == 1)
    assert perimeter(V, chosen) == pytest.approx(plain)


def test_figures_of_parts_are_sums_means_by_faces_and_the_worst():
    parts = [{"faces": 3, "area_l1": 0.1, "own": 2.0, "chart": 0}, {"faces": 1, "area_l1": 0.5, "seconds.map": 2.0},
             {"area_l1": 0.3, "own": 5.0}]  # fmt: skip
    row = _of_parts(parts)
    assert row["faces"] == 4 and row["seconds.map"] == 2.0 and "chart" not in row
    # A part that tells no faces counts as one.
    assert row["area_l1"] == pytest.approx((3 * 0.1 + 0.5 + 0.3) / 5) and row["own"] == pytest.approx((3 * 2 + 5) / 4)
    assert row["area_l1.worst"] == 0.5 and set(row) == {"faces", "area_l1", "own", "seconds.map", "area_l1.worst"}
    nothing = _of_parts([{"faces": 0, "own": 2.0}, {"faces": 0, "own": 4.0}])
    assert nothing["own"] == 3.0 and nothing["faces"] == 0
    assert set(ADDED).isdisjoint(WORST)
    columns = columns_of([{"z": 1, "name": "a"}, {"y": 2, "z": 3}])
    assert columns[-2:] == ["z", "y"] and columns.count("name") == 1 and columns[0] == "name"


def test_colours_of_patterns_are_those_of_python():
    every = list(product(np.linspace(0, 1, 13), (0.0, 0.42, 1.0), (0.0, 0.3, 0.88, 1.0)))
    found = hsv(*(np.array([one[k] for one in every]) for k in range(3)))
    np.testing.assert_allclose(found, [colorsys.hsv_to_rgb(*one) for one in every], atol=1e-12)


@pytest.mark.parametrize("preview", ["", "/results/out.previews/a b.png"])
def test_a_page_shows_the_first_columns_first_and_every_value_where_it_belongs(preview):
    rows = []
    for k, name in enumerate(("a</script>.obj", "b.obj")):
        own = {"name": name, "warnings": '["w"]', "preview": preview, "words": '["x", "y z"]'}
        row = dict.fromkeys(figures.OWN, k) | own
        rows.append(row | {"report": json.dumps({"faces": 3 + k, "rms": 0.123456789, "strange": float(k)})})
    text = pages.page_of(rows, Path("/results"), "a title")
    start = text.index('{"title"')
    table = json.JSONDecoder().raw_decode(text[start:])[0]
    assert table["title"] == "a title" and "a</script>" not in text
    shown = table["columns"][: table["shown"]]
    assert shown == [name for name in pages.FIRST if name in table["columns"]] and {"name", "faces", "rms"} <= set(
        shown
    )
    assert len(set(table["columns"])) == len(table["columns"]) and not {"picture", "words"} & set(table["columns"])
    flat = [figures.flat_row(row) for row in rows]
    for given, line in zip(flat, table["rows"], strict=True):
        for column, value in zip(table["columns"], line, strict=True):
            there = given[column]
            assert value == (pytest.approx(there, rel=1e-5) if isinstance(there, float) else there)
    assert table["words"] == ["x y z"] * 2
    assert table["pictures"] == (["out.previews/a%20b.png"] * 2 if preview else ["", ""])
