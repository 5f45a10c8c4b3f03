"""Counts beyond all memory are refused by every function that takes one, before any of it is asked for."""

from __future__ import annotations

import os
import tracemalloc

import numpy as np
import pytest
from meshes import cube
from tetrahedra import grid_of_tets

from omt_uv import solver
from omt_uv.display.textures.layouts import cells_picture, layout_picture
from omt_uv.display.textures.patterns import picture_of
from omt_uv.solver.api.arrays import polygon_surface
from omt_uv.solver.counts import MOST_LEVELS, check_memory, check_pixels, quadrupled
from omt_uv.solver.editing.inset_images import warp_with_insets
from omt_uv.solver.errors import CountError
from omt_uv.solver.flows import ball_domain, handle_paths, mesh_domain
from omt_uv.solver.maps.overlap import overlap_share
from omt_uv.solver.partition import divide
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing import RemeshOptions, RemeshSource
from omt_uv.solver.remeshing import remesh as remesh_source
from omt_uv.solver.signatures.marked import marked_signature
from omt_uv.solver.signatures.signature import signature
from omt_uv.solver.subdivision import SubdivisionModifier, bilinear, cage_of, subdivide, subdivided_surface
from omt_uv.solver.volumes import ball_index, filled, interior_points, shell_surfaces, tetrahedra, volume_map
from omt_uv.solver.volumes.shells import icosphere

# Bytes of the machine, and how much of it a refusal may take.
MACHINE, LITTLE = 10**9, 10**7
V, F = cube()
TRIANGLE = np.array([[[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]]])
POINTS, TETS = grid_of_tets(1)
CAGE = cage_of(np.arange(4), np.array([0, 4]), 4)
FACES = RemeshOptions(count_of="faces")
TAKES = {
    "remesh": lambda n: solver.remesh(V, F, n),
    "remesh by faces": lambda n: solver.remesh(V, F, n, count_of="faces"),
    "remesh with grading": lambda n: solver.remesh(V, F, n, density=np.arange(1.0, len(F) + 1), grading=0.5),
    "remesh of a source": lambda n: drain(remesh_source(RemeshSource(V, F), n, FACES)),
    "divide": lambda n: drain(divide(V, F, n)),
    "tetrahedra": lambda n: tetrahedra(V, F, n),
    "filled": lambda n: filled(V, F, n),
    "volume_map": lambda n: drain(volume_map(V, F, count=n)),
    "ball_index by levels": lambda n: ball_index(n, 1),
    "ball_index by shells": lambda n: ball_index(0, n),
    "icosphere": icosphere,
    "interior_points": lambda n: interior_points(POINTS, POINTS, TETS, n),
    "shell_surfaces": lambda n: shell_surfaces(POINTS, POINTS, TETS, n),
    "signature": lambda n: drain(signature(V, F, n)),
    "marked_signature": lambda n: drain(marked_signature(V, F, 0, 1, n)),
    "overlap_share": lambda n: overlap_share(TRIANGLE, samples=n),
    "ball_domain": lambda n: ball_domain(np.zeros(3), 1.0, n),
    "disk_domain": lambda n: ball_domain(np.zeros(2), 1.0, n),
    "mesh_domain": lambda n: mesh_domain(V, F, n),
    "handle_paths": lambda n: handle_paths(V, V + 1, np.zeros(len(V), int), "straight", n, np.zeros(3), 1.0),
    "subdivide": lambda n: subdivide(CAGE, n),
    "bilinear": lambda n: bilinear(CAGE, n),
    "picture of a checker": lambda n: picture_of("checker", n),
    "picture of circles": lambda n: picture_of("circles", n),
    "picture of the world": lambda n: picture_of("world", n),
    "layout_picture": lambda n: layout_picture([], "area", n),
    "cells_picture": lambda n: cells_picture(None, n),
    "warp_with_insets": lambda n: warp_with_insets(np.zeros((2, 2, 3)), TRIANGLE, TRIANGLE, size=(1, n)),
}


@pytest.fixture
def small_machine(monkeypatch):
    """A machine of a gigabyte."""
    monkeypatch.setattr(os, "sysconf", {"SC_PAGE_SIZE": 1, "SC_PHYS_PAGES": MACHINE}.__getitem__, raising=False)


@pytest.mark.parametrize("count", [10**9, np.int64(10**9), 10**18, 10**400], ids=["int", "int64", "large", "no float"])
@pytest.mark.parametrize("function", TAKES)
def test_a_count_without_end_is_refused_before_memory_is_asked_for(function, count, small_machine):
    tracemalloc.start()
    try:
        with pytest.raises(CountError, match=r"takes more memory to make than the 1 GB of this machine\. Ask for "):
            TAKES[function](count)
        assert tracemalloc.get_traced_memory()[1] < LITTLE
    finally:
        tracemalloc.stop()


def test_levels_of_a_modifier_without_end_end_where_quads_do(small_machine):
    surface = polygon_surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    assert subdivided_surface(surface, SubdivisionModifier(10**9), most=64).levels == 3


def test_what_fits_is_not_refused(small_machine):
    check_memory(MACHINE // 8, 8, "{}")
    check_pixels(MACHINE // 24, 1)
    check_pixels(6454, 6454)
    for refused in (lambda: check_memory(MACHINE // 8 + 1, 8, "{}"), lambda: check_pixels(6455, 6455)):
        with pytest.raises(CountError):
            refused()
    with pytest.raises(CountError, match="nan of them"):
        check_memory(np.nan, 8, "{} of them")
    assert [quadrupled(k) for k in (0, 1, 3, MOST_LEVELS, MOST_LEVELS + 1)] == [1, 4, 64, 4.0**32, 4.0**32]


def test_a_system_that_does_not_tell_its_memory_refuses_nothing(monkeypatch):
    monkeypatch.delattr(os, "sysconf", raising=False)
    check_memory(1e30, 8, "{}")
