"""Search the seams of a component on its coarse surface, and carry them to its edges.

Arcs are grown one by one, each where it takes most of the predicted distortion for its length (`growth`), taken back
and grown anew (`improvement`), and only then led along edges (`fine_paths`). No map is made.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice

import numpy as np

from ..analysis.seam_costs import SeamCosts
from ..analysis.symmetry_plane import NEAR
from ..cutting.component import CutComponent, TurnedCopies, fingerprint
from ..mesh.surface import Surface
from ..progress import Progress, Steps, part_of
from .coarse_cut import CoarseCut, Found, Setting, best_of, hub, spread_along
from .coarse_surface import Coarsening, CoarseSurface, HalfSurface, coarsening, half_coarsening
from .cut_tree import Cut, Task, cut_along
from .fine_paths import FineMirror, fine_mirror, with_line
from .growth import growing
from .improvement import improved, rerouted, trimmed
from .options import SPREAD_BY_SHEAR, SearchOptions
from .path_graph import REACHED
from .predicted_scale import ScaleModel
from .rehearsal import Rehearsal
from .symmetric_base import symmetric_base

# Seams of what is nearly its own image are symmetric unless that makes them cost so many times what others do: of a
# body, and, with all between, of one that is hardly a mirror image any more.
DEARER = (1.5, 1.0)
# Share of the vertices in the plane that cuts have to be able to reach so that exactly symmetric ones are tried.
PARTLY = 0.5
# The spread that a cut leaves on the whole, over that on the half it was found on, where no limb is left without a cut.
OF_BOTH = 3.0
# Exactly symmetric seams may cost so many times what such along a line by the plane do, which miss a few edges.
EXACTLY = 1.1
# What a cut that was grown has to win by being made shorter, at most, as a rule a third of it.
SHORTENED = 0.1
# Cuts that end in a face are worth so much less; and those that end within one that has holes, in a mouth or a socket,
# hardly anything: they have come across it.
BARRED = 0.3
WITHIN = 0.03
# What is searched again is harder than it seemed: on a coarse surface of so many times the vertices, every time, and up
# to so many times as many as at first.
FINER = 1.5
FINEST = 2.5
# A cut grows on where this share of its spread is asked for, at least.
NEARLY_THERE = 0.6
# Where this share is, it is reached by a little more of the same: another cut can miss the bound by as much.
CLOSE = 0.85
# The least spread that is asked for: what is flat once it is cut has none but by rounding.
FLAT = 1e-9
# Where the time of a search goes, roughly: growth ends at this share of it.
GROWN = 0.5
# The square of log(shear) of a rehearsal, over that of the map: of about the same surface, and of a far finer one.
# Heads, animals and figures are within a tenth of it.
REHEARSED = (0.62, 0.88)


@dataclass(frozen=True)
class SeamSearch:
    """A search for seams, to be called with each component; yields progress and returns edges (e,) bool to cut.

    Attributes
    ----------
    spread (f,) : to be reached, of every polygon, see `predicted_scale.ScaleModel`; infinite where nothing is searched
    surface : whose components they are
    costs : gives what cutting its edges costs, when that is known to be needed
    density (f,) : area that polygons ask for, over their own; None for 1
    further : components whose seams were marked by hand are searched, too
    options : see `SearchOptions`
    share (f,) : of the spread that cuts left which were found before, that is asked for now; None for a first search
    adding : what was found for a part stays, and more is cut
    straighter : what was found for a part stays, but is led along edges that turn less
    stays_whole : bodies of hard sides do not come apart along these
    as_drawn : nothing else has helped, and they do along all creases, see `crease_sides.hard_borders`
    memory : what was found for parts, by their fingerprints, to which this search adds
    begun : surfaces of components on their way to coarse ones, and their triangles
    models : of the coarse surface of what was found last, which is asked for first
    asked : the square of log(shear) that maps may have
    rehearse : gives that of a small surface along its seams, with half the logarithm of the density (n,) at its
        vertices or None; None where predictions have to do
    rehearsed : what it has given
    copies : the parts that this search, and none that it was made from, has found seams for
    borders : parts and where they come apart at hard edges, as they are and as drawn, to which this search adds
    pockets : gives the edges (k,2) around pockets of faces, when those are needed; pocketed (k,2) : those that are cut
    """

    spread: np.ndarray
    surface: Surface
    costs: Callable[[], SeamCosts]
    density: np.ndarray | None = None
    further: bool = False
    options: SearchOptions = field(default_factory=SearchOptions)
    share: np.ndarray | None = None
    adding: bool = False
    straighter: bool = False
    stays_whole: bool = False
    as_drawn: bool = False
    memory: dict[tuple[bytes, ...], Found] = field(default_factory=dict)
    begun: dict[tuple, tuple[np.ndarray, Coarsening | HalfSurface | None]] = field(default_factory=dict)
    models: dict[int, tuple[CoarseSurface, ScaleModel]] = field(default_factory=dict)
    asked: float = 0.0
    rehearse: Callable[[Surface, np.ndarray | None], Steps[float | None]] | None = None
    rehearsed: dict[bytes, float | None] = field(default_factory=dict)
    copies: TurnedCopies = field(default_factory=TurnedCopies, init=False)
    borders: tuple[TurnedCopies, TurnedCopies] = field(default_factory=lambda: (TurnedCopies(), TurnedCopies()))
    pockets: Callable[[], np.ndarray] = lambda: np.zeros((0, 2), np.int64)
    pocketed: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))

    @property
    def is_again(self) -> bool:
        """Whether this is no first search."""
        return self.share is not None

    def wants(self, polygons: np.ndarray, marked: bool) -> bool:
        """Whether a component of these polygons (m,) is searched, some of whose boundary is marked as a seam or not."""
        return (self.further or not marked) and bool(np.isfinite(self.spread[polygons[polygons >= 0]]).any())

    def priced(self, component: CutComponent) -> CutComponent:
        """The component with the costs of where an artist would cut; what fills holes costs as before."""
        known = len(self.surface.positions)
        ends = component.vertex_ids[component.ends]
        real = (ends < known).all(axis=1)
        cost = component.cost.copy()
        cost[real] *= self.costs().of(*ends[real].T)
        return replace(component, cost=cost)

    def __call__(self, component: CutComponent, base: np.ndarray) -> Steps[np.ndarray]:
        """Seams of a component that is a disk, a sphere, or a disk once the edges `base` (e,) bool are cut: with these,
        or such as are symmetric where the component is; those of a part before it that is equal but for a motion."""
        yield Progress("Seams", 0.0)
        copy = self.copies.of(component) if self.density is None else None
        if copy is not None:
            return self._as_copied(component, *copy)
        edges = yield from self._searched(component, base)
        self.copies.tell(component, edges)
        return edges

    def _as_copied(
        self, component: CutComponent, other: CutComponent, edges: np.ndarray, edge: np.ndarray
    ) -> np.ndarray:
        """Seams (e,) bool as those of another part (k,) bool, whose edges (e,) these are, or -1 for none."""
        edges, found = self.copies.moved(edges, edge), self.memory.get(fingerprint(other))
        if found is not None:
            base, polygons = self.copies.moved(found.base, edge), component.polygons[component.polygons >= 0]
            copied = replace(found, edges=edges, base=base, polygons=polygons, is_copy=True)
            self.memory[fingerprint(component)] = copied
        return edges

    def _searched(self, component: CutComponent, base: np.ndarray) -> Steps[np.ndarray]:
        """Seams of a component that is no copy."""
        name, polygons = fingerprint(component), component.polygons[component.polygons >= 0]
        share, known = 1.0 if self.share is None else float(self.share[polygons].min()), self.memory.get(name)
        if self.as_drawn and known is not None:
            return known.edges  # Nothing of it came apart along creases.
        if self.share is not None and known is not None and not known.is_copy:
            self.memory[name] = yield from self._again(self.priced(component), known, share)
            return self.memory[name].edges
        bound = float(self.spread[polygons].min())
        bounded = bool(component.on_boundary().any())
        if bounded:
            coarse, model = self._modelled(component)
            if self.share is not None:
                # Nothing was cut of it before, since it was predicted to shear less than it does.
                bound = min(bound, share**SPREAD_BY_SHEAR * model.spread)
            if model.spread <= bound and not base.any():
                return base
        component = self.priced(component)
        mirror, free = self._mirror(component), base
        if mirror is not None and base.any():
            symmetric = symmetric_base(component, mirror)
            base, mirror = (base, None) if symmetric is None else (symmetric, mirror)
        if bounded and model.spread <= bound:
            return base
        plain = (coarse, model) if bounded else None
        best = yield from part_of(self._best(component, (base, free), bound, mirror, plain), 0.0, 0.7)
        coarser = min(self.options.vertices / component.vertex_count, 1.0)
        asked = self.asked * float(np.interp(coarser, (0, 1), REHEARSED[::-1]))
        best, kept = yield from part_of(self._rehearsal(component).kept(best, asked), 0.7, 0.2)
        gave_up = kept is not None and kept > asked
        self.memory[name] = replace(self._carried(best, component), rehearsed=kept, gave_up=gave_up)
        return self.memory[name].edges

    def _best(
        self,
        component: CutComponent,
        bases: tuple[np.ndarray, np.ndarray],
        bound: float,
        mirror: FineMirror | None,
        plain: tuple[CoarseSurface, ScaleModel] | None,
    ) -> Steps[CoarseCut]:
        """The best cut, a symmetric one where that is not much dearer.

        bases : edges (e,) bool that make a disk of it, for symmetric ones and for others; plain : the first of the
            coarse surfaces that know no mirror, where it is known
        """
        (base, free), exact = bases, None
        near: CoarseCut | None = None
        line, shorter = mirror, None
        if mirror is not None and mirror.exact:
            exact = yield from part_of(self._symmetric(component, base, bound, mirror), 0.0, 0.4)
            if exact is not None and exact.task.graph.is_whole() and not exact.is_stuck:
                return exact
            # Where the plane runs between the vertices, or through polygons, most go without those, along a line by it.
            line = with_line(component, mirror)
        if line is not None:
            near = yield from part_of(self._symmetric(component, base, bound, line), 0.4, 0.2)
        if exact is not None and near is not None and not exact.is_stuck and exact.score <= EXACTLY * near.score:
            return exact
        coarse, model = self._modelled(component) if plain is None else plain
        setting = self._setting(component, free, None, coarse, model)
        task = setting.task(bound, setting.extremity())
        first = yield from part_of(self._grown_on(setting, task, free, None), 0.6, 0.1)
        best = exact if near is None else near
        if best is not None and (first.is_stuck or not best.is_stuck):
            # One of the coarse surfaces says what other cuts cost, about.
            most = self._worth_of_symmetry() * first.score
            if best.score <= (1 - SHORTENED) * most:
                return best
            if best.score <= most:
                shorter = yield from part_of(self._shortened(first), 0.7, 0.1)
                if best.score <= self._worth_of_symmetry() * shorter.score:
                    return best
        more = range(1, self._trials(component))
        others = yield from part_of(self._several_grown(component, free, None, bound, more), 0.8, 0.05)
        choosing = self._rehearsal(component).best_of([first, *others], self.asked)
        found = yield from part_of(choosing, 0.85, 0.05)
        if found is first and shorter is not None:
            return shorter
        return (yield from part_of(self._shortened(found), 0.9, 0.1))

    def _symmetric(
        self, component: CutComponent, base: np.ndarray, bound: float, mirror: FineMirror
    ) -> Steps[CoarseCut | None]:
        """The best symmetric cut; None where there is hardly one."""
        trials, sure = range(self._trials(component)), mirror.alike or not mirror.halved
        width = 1.0 if sure else 0.5
        cuts = yield from part_of(self._several_grown(component, base, mirror, bound, trials), 0.0, width * GROWN)
        if not cuts:
            return None
        choosing = self._rehearsal(component).best_of(cuts, self.asked)
        best = yield from part_of(choosing, width * GROWN, width * 0.2)
        best = yield from part_of(self._shortened(best), width * (GROWN + 0.2), width * (0.8 - GROWN))
        if sure or self._holds_for_both(component, best):
            return best
        return (yield from part_of(self._symmetric(component, base, bound, replace(mirror, halved=False)), 0.5, 0.5))

    def _holds_for_both(self, component: CutComponent, found: CoarseCut) -> bool:
        """Whether a cut that was found on one half, and its image, leave about as much of the whole."""
        coarse, model = self._modelled(component)
        spread = spread_along(coarse, model, component.positions[component.ends[found.carried(component).edges]])
        return spread <= OF_BOTH * max(found.cut.spread, found.task.bound)

    def _trials(self, component: CutComponent, finer: float = 1.0) -> int:
        """Coarse surfaces of so many times the vertices to be tried; what is small has one, itself."""
        return self.options.trials if component.vertex_count > round(finer * self.options.vertices) else 1

    def _several_grown(
        self,
        component: CutComponent,
        base: np.ndarray,
        mirror: FineMirror | None,
        bound: float | Callable[[CoarseSurface, ScaleModel], float],
        trials: range,
        finer: float = 1.0,
    ) -> Steps[list[CoarseCut]]:
        """Cuts grown on several coarse surfaces, since where a search ends hangs on them; without those on which
        symmetric ones cannot get along the plane of the mirror.

        bound : of the spread, or what gives it for a surface
        """
        found = []
        for k, trial in enumerate(trials):
            coarse, model = self._modelled(component, mirror, trial, finer)
            setting = self._setting(component, base, mirror, coarse, model)
            task = setting.task(bound(coarse, model) if callable(bound) else bound, setting.extremity())
            if mirror is not None and not task.graph.is_whole(PARTLY if mirror.exact else REACHED):
                # Where one cannot, hardly another can: the plane is the same.
                break
            growing = self._grown_on(setting, task, base, mirror)
            found.append((yield from part_of(growing, k / len(trials), 1 / len(trials))))
        return found

    def _again(self, component: CutComponent, found: Found, share: float) -> Steps[Found]:
        """A cut with a share of the square of log(shear) that another has left: that one grown on, or where much is
        missing or its coarse surface is too coarse for that, one on finer surfaces. Or the same, but straighter."""
        best, spread = None, share**SPREAD_BY_SHEAR
        if self.straighter:
            edges = self._recalled(component, found, 1.0).carried(component, straighter=True).edges
            return replace(found, edges=edges)
        told = found.rehearsed if self.rehearse is not None else None
        if self.adding or share >= CLOSE or (told is not None and share >= NEARLY_THERE):
            best = yield from part_of(self._added(component, found, spread), 0.0, GROWN / 2)
            if told is not None:
                # What the map of the one before has told holds for those that are like it.
                keeping = self._rehearsal(component).kept(best, share * told)
                best, kept = yield from part_of(keeping, GROWN / 2, 1 - GROWN / 2)
                return replace(self._carried(best, component), rehearsed=kept)
            if best.cut.spread <= best.task.bound:
                return self._carried(best, component)
        elif spread >= NEARLY_THERE:
            best = yield from part_of(self._grown_further(component, found, spread), 0.0, GROWN / 2)
        if best is None or best.cut.spread > best.task.bound:
            best = yield from part_of(self._grown_finer(component, found, spread), GROWN / 2, GROWN / 2)
            if best.is_stuck and found.mirror is not None:
                free = yield from self._grown_finer(component, replace(found, mirror=None), spread)
                best = best if free.is_stuck else free
        best = yield from part_of(self._shortened(best), GROWN, 1 - GROWN)
        return replace(self._carried(best, component), is_stuck=best.is_stuck)

    def _carried(self, best: CoarseCut, component: CutComponent) -> Found:
        """A cut led along the edges of its component, whose model is kept for the next search."""
        self.models.clear()
        self.models[id(best.setting.coarse)] = best.setting.coarse, best.setting.model
        return best.carried(component)

    def _rehearsal(self, component: CutComponent) -> Rehearsal:
        # Where the coarse surface is the surface itself, the map that is to be made tells as much as a rehearsal.
        rehearse = self.rehearse if component.vertex_count > self.options.vertices else None
        return Rehearsal(component, partial(self._log_density, component), rehearse, self.rehearsed)

    def _added(self, component: CutComponent, found: Found, share: float) -> Steps[CoarseCut]:
        """A cut and arcs added to it: where it was tried by a map, that shears less with any more of them."""
        known = self._recalled(component, found, share)
        return replace(known, cut=(yield from self._grown(known.task, known.cut)))

    def _grown_further(self, component: CutComponent, found: Found, share: float) -> Steps[CoarseCut]:
        """A cut grown on from where it was, or anew on the same surface where that is better."""
        before, cuts = self._recalled(component, found, share), []
        for k, begin in enumerate((before.cut, None)):
            grown = yield from part_of(self._grown(before.task, begin), k / 2, 0.5)
            cuts.append(replace(before, cut=trimmed(before.task, rerouted(before.task, grown))))
        return best_of(cuts)

    def _recalled(self, component: CutComponent, found: Found, share: float) -> CoarseCut:
        """A cut as it was found, with the task to leave a share of what it does."""
        coarse = found.coarse
        known = self.models.get(id(coarse))
        model = ScaleModel.of(coarse, self._log_density(component, coarse)) if known is None else known[1]
        setting = self._setting(component, found.base, found.mirror, coarse, model)
        task = setting.task(0.0, found.root)
        cut = cut_along(task, found.steps)
        task = replace(task, bound=max(share * cut.spread, FLAT))
        return CoarseCut(setting, task, cut, found.base, found.mirror)

    def _grown_finer(self, component: CutComponent, found: Found, share: float) -> Steps[CoarseCut]:
        """A cut grown anew on finer surfaces, the best of several."""
        before = component.positions[component.ends[found.edges]]

        def bound(coarse: CoarseSurface, model: ScaleModel) -> float:
            return max(share * spread_along(coarse, model, before), FLAT)

        before_this = len(found.coarse.positions) / self.options.vertices
        finer = min(FINER * max(before_this, 1.0), FINEST)
        trials = range(max(self._trials(component, finer) - 1, 1))
        cuts = yield from self._several_grown(component, found.base, found.mirror, bound, trials, finer)
        if not cuts:
            return (yield from self._grown_finer(component, replace(found, mirror=None), share))
        return best_of(cuts)

    def _grown_on(self, setting: Setting, task: Task, base: np.ndarray, mirror: FineMirror | None) -> Steps[CoarseCut]:
        """A cut grown on a coarse surface from nothing."""
        cut = yield from self._grown(task)
        if setting.is_closed:
            task = setting.task(task.bound, hub(task.graph, cut.steps))
            cut = cut_along(task, cut.steps)
        return CoarseCut(setting, task, trimmed(task, rerouted(task, cut)), base, mirror)

    def _setting(self, component: CutComponent, base, mirror, coarse: CoarseSurface, model: ScaleModel) -> Setting:
        return Setting.of(component, coarse, base, mirror, model, self._tip_factor(component))

    def _shortened(self, found: CoarseCut) -> Steps[CoarseCut]:
        """The same, made shorter."""
        task = found.task
        # Again: what was trimmed leaves room for other ways.
        cut = trimmed(task, rerouted(task, found.cut))
        for k, better in enumerate(improved(task, cut, self.options.rounds)):
            cut = better
            yield Progress("Seams", (k + 1) / self.options.rounds)
        return replace(found, cut=cut)

    def _worth_of_symmetry(self) -> float:
        """How many times as much symmetric seams may cost."""
        plane = self.costs().plane
        return float(np.interp(0.0 if plane is None else plane.residual, [0, NEAR], DEARER))

    def _grown(self, task: Task, cut: Cut | None = None) -> Steps[Cut]:
        """The cut of arcs that pay most, one after another, from a cut on or from nothing."""
        cut = cut_along(task, np.zeros(0, np.int64)) if cut is None else cut
        begin = max(cut.spread, task.bound)
        for count, grown in enumerate(islice(growing(task, cut), self.options.arcs)):
            cut = grown
            # What is flat once it is cut has no spread at all.
            done = np.log(begin / max(cut.spread, task.bound)) / max(np.log(begin / task.bound), 1e-9)
            yield Progress(f"Seams, cut {count + 1}", min(max(done, 0.0), 1.0))
        return cut

    def _modelled(
        self, component: CutComponent, mirror: FineMirror | None = None, trial: int = 0, finer: float = 1.0
    ) -> tuple[CoarseSurface, ScaleModel]:
        """One of the coarse surfaces of a component, whose mirror plane stays a line, and its model."""
        line, count = None if mirror is None else mirror.plane, round(finer * self.options.vertices)
        parts, coarse = (component.positions, component.triangles, self.options.vertices), None
        if mirror is not None and mirror.halved:
            seen = mirror.plane, mirror.image, mirror.height, mirror.normal
            half = self._begun(component, line, partial(half_coarsening, *parts, *seen))
            coarse = None if half is None else half.ended(count, trial)
        if coarse is None:
            coarse = self._begun(component, line, partial(coarsening, *parts, line)).ended(count, trial)
        return coarse, ScaleModel.of(coarse, self._log_density(component, coarse))

    def _begun(self, component: CutComponent, line: np.ndarray | None, begin: partial):
        """What a component, with a line (n,) bool or none, is begun to be made coarse by."""
        name = (id(component.triangles), b"" if line is None else line.tobytes(), begin.func)
        if name not in self.begun:
            # With the array: as long as it is here, no other one has its name.
            self.begun[name] = component.triangles, begin()
        return self.begun[name][1]

    def _mirror(self, component: CutComponent) -> FineMirror | None:
        """The mirror image of the component in itself, if its vertices have one, and some are in the plane."""
        plane, real = self.costs().plane, component.vertex_ids < len(self.surface.positions)
        if plane is None or not self.options.symmetric:
            return None
        return fine_mirror(component, plane, self.surface.positions[component.vertex_ids[real]], real)

    def _tip_factor(self, component: CutComponent) -> np.ndarray:
        """Factor (n,) on what cuts are worth that end at a vertex: less on a face."""
        costs, real = self.costs(), component.vertex_ids < len(self.surface.positions)
        factor = np.ones(component.vertex_count)
        within = WITHIN if (component.polygons < 0).any() else BARRED
        barred = np.where(costs.within_face, within, np.where(costs.in_face, BARRED, 1.0))
        factor[real] = barred[component.vertex_ids[real]]
        return component.tip_factor() * factor

    def _log_density(self, component: CutComponent, coarse: CoarseSurface) -> np.ndarray | None:
        """Half the logarithm of the density at the vertices (c,) of the coarse surface."""
        if self.density is None:
            return None
        real = component.polygons >= 0
        value = np.repeat(0.5 * np.log(self.density[component.polygons[real]]), 3)
        vertices, n = component.triangles[real].ravel(), component.vertex_count
        total = np.bincount(vertices, value, n) / np.maximum(np.bincount(vertices, minlength=n), 1)
        return (total - total.mean())[coarse.kept]
