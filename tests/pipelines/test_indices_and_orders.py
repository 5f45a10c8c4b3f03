"""Elements are those of the body that they are of, to the first and the last one, and what comes of several things does
not hang on their order: by brute force."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest

from omt_uv.batch import figures
from omt_uv.cli import parsed
from omt_uv.display import plots
from omt_uv.pipelines import unwrap
from omt_uv.pipelines.layout import UnwrapJob
from omt_uv.pipelines.regions import detail
from omt_uv.pipelines.shapes import signature_index
from omt_uv.pipelines.volumes import flow
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.signatures.signature import Signature


@pytest.mark.parametrize("polygons", [False, True])
def test_faces_that_cross_are_those_of_their_body(polygons):
    sizes = (4, 1, 6)
    own = [np.arange(n) // 2 if polygons else np.arange(n) for n in sizes]
    bodies = tuple(flow.FlowBody(str(n), np.zeros((3, 3)), np.zeros((n, 3), int), None, own[k] if polygons else None)
                   for k, n in enumerate(sizes))  # fmt: skip
    every = [(k, face) for k, n in enumerate(sizes) for face in range(n)]
    chosen = [*([t] for t in range(len(every))), [0, 3, 4, 5, 10], [], list(range(len(every)))]
    for triangles in chosen:
        found = flow._crossing(bodies, np.array(triangles, int))
        for k in range(len(sizes)):
            mine = {int(own[k][every[t][1]]) for t in triangles if every[t][0] == k}
            assert found[k].tolist() == sorted(mine), (triangles, k)


def test_parts_of_a_report_count_in_any_order():
    parts = [{"faces": 10, "area_l1": 0.1, "angle_mean": 1.5, "folds": 1, "seconds": {"all": 2}},
             {"faces": 30, "area_l1": 0.3, "angle_mean": 1.1, "folds": 0, "seconds": {"all": 3}},
             {"faces": 60, "area_l1": 0.2, "angle_mean": 1.2, "folds": 4, "seconds": {"all": 4}}]  # fmt: skip
    for order in itertools.permutations(parts):
        row = figures.figures_of(json.dumps({"charts": order}))
        assert row == pytest.approx({
            "charts": 3, "faces": 100, "folds": 5, "seconds.all": 9, "area_l1": 0.22, "area_l1.worst": 0.3,
            "angle_mean": 1.2, "angle_mean.worst": 1.5})  # fmt: skip


def test_points_of_a_curve_are_drawn_in_any_order():
    points = [(10.0, 1.0), (100.0, 30.0), (1000.0, 5.0), (3000.0, 80.0)]
    first = plots.plot({"a": points}, "title")
    for order in itertools.permutations(points):
        np.testing.assert_array_equal(plots.plot({"a": order}, "title"), first)


def test_words_of_a_batch_end_at_the_first_dashes():
    """Those behind are all of the command that it runs, whatever they are."""
    for rest in ([], ["--margin", "7"], ["--", "x"], ["--uv-layer", "--", "--pack", "--"]):
        options = parsed(["batch", "unwrap", "in", "-o", "out", "--", *rest])
        assert options.rest == rest and options.command == "unwrap"


@pytest.mark.parametrize("command", ["unwrap", "refine", "seams", "measure", "stack", "remesh"])
def test_what_stands_behind_dashes_is_a_file_of_every_other_command(command):
    """Also one whose name begins with a dash."""
    words = {"measure": [], "remesh": ["-o", "out.obj", "--vertices", "50"]}.get(command, ["-o", "out.obj"])
    options = parsed([command, *words, "--", "-in.obj"])
    assert str(options.input) == "-in.obj" and options.rest == []


def signature(seed):
    points = np.random.default_rng(seed).normal(size=(20, 3))
    return Signature(points / np.linalg.norm(points, axis=1, keepdims=True), np.full(20, 0.5), 0.1 * seed)


def test_a_new_signature_takes_the_place_of_the_old_one_and_others_stay():
    old = signature_index.index_of({"b": ("old b", signature(1)), "a": ("old a", signature(2))})
    new = signature_index.index_of({"c": ("new c", signature(3)), "b": ("new b", signature(4))}, old)
    assert (new.names, new.marks) == (("a", "b", "c"), ("old a", "new b", "new c"))
    for k, seed in enumerate((2, 4, 3)):
        np.testing.assert_array_equal(new.packed[k], signature_index.packed(signature(seed)))
        assert new.floors[k] == pytest.approx(0.1 * seed)
    part = signature_index.chosen(new, ["c", "a"])
    assert part.names == ("a", "c") and part.floors.tolist() == pytest.approx([0.2, 0.3])


@pytest.mark.parametrize("first", [False, True])
def test_where_vertices_are_joined_cuts_avoid_the_most_that_either_avoids(first):
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    surface = triangle_surface(V, np.array([[0, 1, 2], [3, 4, 5]]))
    avoid = np.array([0, 0.9, 0.1, 0.2, 0, 0.8] if first else [0, 0.2, 0.8, 0.9, 0, 0.1])
    job, text = unwrap._joined(0, UnwrapJob(surface, avoid=avoid))
    assert text.startswith("2 boundary vertices")
    kept = np.unique(job.surface.corner_vertex)
    assert len(kept) == 4
    for v in kept.tolist():
        there = np.flatnonzero((V[v] == V).all(axis=1))
        assert job.avoid[v] == avoid[there].max()


def test_a_margin_of_an_image_is_handed_on_in_whole_pixels(monkeypatch):
    told = []
    monkeypatch.setattr(detail, "layouts", lambda regions, result: (regions, result))
    monkeypatch.setattr(detail, "warp_with_insets", lambda *given: told.append(given))
    detail.detailed_picture("picture", "regions", "result", ["inset"], (3, 4), 7.9)
    assert told == [("picture", "regions", "result", ["inset"], (3, 4), 7)]
