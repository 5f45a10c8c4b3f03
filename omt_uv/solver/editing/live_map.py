"""Let a map follow a balance or a pin that is being dragged, by a few Newton steps at a time from where it is."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ..linalg.additive_schwarz import schwarz_solver
from ..linalg.kept_factor import KeptFactor
from ..maps.polygon_elements import with_convex_quads
from ..mesh.topology import boundary_edges
from ..refinement.continuation import MapProblem, rescaled
from ..refinement.continuation_rules import FIRST_PRESSURE, NO_ENERGY, QUALITIES, final_weight
from ..refinement.elimination_order import renumbered
from ..refinement.hessian_blocks import assembly_of
from ..refinement.pins import PinEnergy, Pins, placed_like
from ..refinement.projected_newton import FreeMotion, NewtonProblem, newton_direction, newton_step
from .refine_island import island_elements, island_start, meets_itself

# Of the springs between pins and where they are dragged to, energy per squared length in units of the map: stiff, as
# the barrier against folds must only just win.
STIFFNESS = 1e6
# Of springs that give: the island follows as a whole, and the pins are where its shape lets them be.
SOFT_STIFFNESS = 1.0
# Newton promises less than this share of the energy: nothing is left to see.
AT_REST = 1e-3


class LiveMap:
    """An island whose map can be asked for at any balance and with its pins anywhere.

    Parameters
    ----------
    vertices, triangles, uv : (n,3), (m,3), (n,2) a connected surface and its map
    pins : vertices (k,) and their places (k,2)
    polygons : (m,) polygon of every triangle; by default each is its own
    soft : whether the pins give way to the shape of the island, which follows them as a whole
    target : (m,) density of the area that each triangle asks for, see `refine_island.refine_island`

    Attributes
    ----------
    at_rest : whether following further would change nothing

    Raises
    ------
    FoldedUVError, PinError : see `refine_island.refine_island`
    """

    def __init__(
        self,
        vertices: np.ndarray,
        triangles: np.ndarray,
        uv: np.ndarray,
        pins: tuple[np.ndarray, np.ndarray] | None = None,
        polygons: np.ndarray | None = None,
        soft: bool = False,
        target: np.ndarray | None = None,
    ):
        self._mesh = mesh = renumbered(vertices, triangles, uv, pins, polygons)
        self._given = given = mesh.uv @ [1, 1j]
        self._faces = faces = island_elements(mesh, polygons, target)
        self._area = float(abs(faces.areas(given).sum()))
        boundary = boundary_edges(mesh.triangles)
        start, self.warnings = island_start(mesh.vertices, mesh.triangles, given, boundary, mesh.pins is not None)
        guard = None if meets_itself(start, boundary) else boundary
        motion = FreeMotion(np.zeros(len(given), bool))
        # Large islands by parts, and all by factors of steps before: a step that is nearly right, and there sooner, is
        # what a slider wants.
        parts = schwarz_solver(mesh.vertices, mesh.triangles)
        assembly = assembly_of(faces, len(given), parts or KeptFactor())
        self._task = MapProblem(faces, assembly, motion, guard, False)
        if parts is not None:
            # Factors for the first steps are made before the slider is moved.
            weight = final_weight(0.0, QUALITIES["standard"])
            newton_direction(NewtonProblem(faces, assembly, motion, weight), start, FIRST_PRESSURE)
        self._w, self._pins, self._guarded = start, mesh.pins, False
        self._balance = -1.0
        self._stiffness = SOFT_STIFFNESS if soft else STIFFNESS
        self.at_rest = False

    def follow(self, balance: float, places: np.ndarray | None = None, seconds: float = 0.1) -> np.ndarray:
        """The map (n,2) after at least one step towards its best at this balance, and no more than so many seconds.

        places (k,2): where the pins are by now, in the order in which they were given
        """
        if places is not None and self._pins is not None:
            self._pull(self._pins, places)
        if balance != self._balance:
            self._balance, self.at_rest = balance, False
        end = time.perf_counter() + seconds
        while not self.at_rest:
            self._step()
            if time.perf_counter() >= end:
                break
        return self.uv

    @property
    def uv(self) -> np.ndarray:
        """The map (n,2) as it is; without pins it lies as the given one did."""
        pinned = self._pins is not None
        return self._mesh.original(
            self._w if pinned else placed_like(self._w, self._given, self._faces, area=self._area)
        )

    def _pull(self, pins: Pins, places: np.ndarray) -> None:
        # `renumbered` sorts pins by vertex, which `_pins` keeps.
        target = (places * self._mesh.mirror) @ [1, 1j]
        if not np.array_equal(target, pins.places):
            self._pins, self.at_rest = replace(pins, places=target), False

    def _step(self) -> None:
        """One Newton step; where the boundary would cross itself, the next goes on with a barrier."""
        task = replace(self._task, faces=with_convex_quads(self._faces, self._w))
        extras: tuple = ()
        if self._pins is not None:
            task = rescaled(task, self._w)
            unit = np.sqrt(np.abs(task.faces.areas(self._w)).sum())
            extras = (PinEnergy(self._pins, self._stiffness, unit),)
        if self._guarded:
            extras = (*extras, task.barrier(self._w))
        weight = final_weight(self._balance, QUALITIES["standard"])
        problem = NewtonProblem(task.faces, task.assembly, task.motion, weight, extras)
        value = problem.energy(self._w)
        step = newton_step(problem, self._w, value, FIRST_PRESSURE)
        if step.share == 0:
            step = newton_step(problem, self._w, value)
        if not self._guarded and task.boundary_crosses(step.w):
            self._guarded = task.loop is not None
            return
        self._w = step.w
        self.at_rest = step.share == 0 or step.decrement < AT_REST * max(value, NO_ENERGY)
