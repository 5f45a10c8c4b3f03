"""The command of the benchmarks: parts with their own options, and a part that is the same on every machine."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from benchmarks import run
from benchmarks.part import BOUNDARIES
from omt_uv.solver.maps.untangle import count_folds, map_energy
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization.initial_map import HOPELESS, coarse_initial_map
from omt_uv.solver.parameterization.polygons.polygon_disk import DiskMesh
from omt_uv.solver.progress import RunLog, drain


def test_every_part_says_what_it_shows():
    assert len(run.PARTS) == sum(len(module.PARTS) for module in run.MODULES), "no name is there twice"
    for part in run.PARTS.values():
        assert part.description and part.table.__doc__


def test_an_option_is_one_option_wherever_it_is_taken():
    for part in run.PARTS.values():
        for option in part.options:
            assert run.OPTIONS[option.name] is option


def test_without_names_all_parts_run_but_those_that_say_otherwise():
    _, parts = run.parse([])
    named = {"clicks", "flows", "hard", "invariance", "level", "limbs", "live", "match", "metric", "million", "nearest"}
    named |= {"cage_least", "pace", "packing", "partition", "polygons", "profile", "volumes"}
    assert {p.name for p in run.PARTS.values()} - {p.name for p in parts} == named


def test_options_that_are_not_given_have_their_defaults():
    args, parts = run.parse(["counts", "--models", "cone"])
    assert [p.name for p in parts] == ["counts"]
    assert args.models == ["cone"] and args.boundaries == BOUNDARIES and args.runs == 3


@pytest.mark.parametrize(
    ("words", "complaint"), [(["nothing"], "unknown part nothing"), (["counts", "--sites", "5"], "--sites")]
)
def test_what_no_part_can_use_is_refused(words, complaint, capsys):
    with pytest.raises(SystemExit):
        run.parse(words)
    assert complaint in capsys.readouterr().err


def test_counts_are_those_of_the_report_and_the_same_again(capsys):
    # A strip has no room in a disk for an embedding, and comes by way of the transport.
    args, (part,) = run.parse(["counts", "--models", "spiral_strip", "--boundaries", "disk"])
    first, again = part.table(args), part.table(args)
    assert first.rows == again.rows
    (row,) = first.rows
    cells = dict(zip(first.columns, row, strict=True))
    assert cells["model"] == "spiral_strip" and cells["faces"] == str(len(meshes.spiral_strip()[1]))
    assert int(cells["Newton transport"]) > 0 and int(cells["factorisations"]) > 0
    assert "Counts of one unwrap" in capsys.readouterr().out


def test_bodies_of_limbs_are_closed_but_for_holes_of_the_skin():
    from benchmarks.parts import pace

    for name in pace.LIMB_BODIES:
        V, F = pace.limb_body(name, 2000)
        assert len(F) >= 2000 and F.max() == len(V) - 1
        edges, uses = np.unique(np.sort(F[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True)
        assert (uses <= 2).all() and (uses == 1).mean() < 0.02


def test_a_surface_that_no_sphere_has_is_left_out_by_its_reason(capsys):
    args, (part,) = run.parse(["sphere", "--models", "cone", "torus"])
    rows = part.table(args).rows
    assert [row[0] for row in rows] == ["cone", "torus"]
    assert all("left out: " in row[-1] for row in rows) and rows[0][-1] != rows[1][-1]


def test_a_coarse_mesh_without_an_embedding_in_double_precision_is_freed_by_a_coarser_one():
    """Arms hang on their circles, and every ring of a mean value map is a share of the one before."""
    from benchmarks.parts import pace

    V, F = pace.limb_body("octopus", 40_000)
    disk = DiskMesh(V, F, face_areas(V, F), boundary_loops(F)[0])
    assert map_energy(disk.embedded, V, F) > 1e15
    shown = []
    found = drain(coarse_initial_map(disk, 0.0, RunLog()), lambda progress: shown.append(progress.fraction))
    assert found.freed and count_folds(found.uv, F) == 0 and map_energy(found.uv, V, F) < HOPELESS
    assert (np.diff(shown) >= -1e-12).all() and len(np.unique(shown)) > 20
