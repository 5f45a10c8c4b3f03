"""Which cuts a search for seams tries in turn, and which it takes, with the cuts of coarse surfaces written in
advance."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import told, worked

from omt_uv.solver.progress import drain
from omt_uv.solver.seams import search as searches
from omt_uv.solver.seams.search import SeamSearch


@dataclass
class Cut:
    """A cut on a coarse surface: what it costs, and whether it is stuck."""

    name: str
    score: float
    is_stuck: bool = False
    whole: bool = True

    @property
    def task(self):
        return SimpleNamespace(graph=SimpleNamespace(is_whole=lambda *_: self.whole))


@pytest.fixture
def best(monkeypatch):
    """The best cut, and what was tried for it."""

    def run(
        *, exact=None, near=None, first=None, shorter=None, mirror=None, trials=3, chosen=None, worth=1.2, plain=False
    ):
        tried = []
        line = SimpleNamespace(exact=False)
        monkeypatch.setattr(searches, "with_line", lambda component, m: line)

        def symmetric(self, component, base, bound, m):
            tried.append("exact" if m.exact else "near")
            assert base == "base"
            return worked(exact if m.exact else near)

        def modelled(self, component):
            tried.append("model")
            return "coarse", "model"

        def grown(self, setting, task, base, m):
            tried.append("first")
            assert m is None and base == "free"
            return worked(first)

        def shortened(self, found):
            tried.append(f"shorten {found.name}")
            return worked(shorter or Cut(f"short {found.name}", 0.95 * found.score))

        def several(self, component, base, m, bound, more):
            tried.append(list(more))
            assert (base, m) == ("free", None)
            return worked([Cut(f"other {k}", 1.0) for k in more])

        setting = SimpleNamespace(task=lambda bound, root: (bound, root), extremity=lambda: "root")
        monkeypatch.setattr(SeamSearch, "_symmetric", symmetric)
        monkeypatch.setattr(SeamSearch, "_modelled", modelled)
        monkeypatch.setattr(SeamSearch, "_grown_on", grown)
        monkeypatch.setattr(SeamSearch, "_shortened", shortened)
        monkeypatch.setattr(SeamSearch, "_several_grown", several)
        monkeypatch.setattr(SeamSearch, "_setting", lambda *_: setting)
        monkeypatch.setattr(SeamSearch, "_trials", lambda *_: trials)
        monkeypatch.setattr(SeamSearch, "_worth_of_symmetry", lambda *_: worth)
        pick = (lambda cuts: cuts[0]) if chosen is None else (lambda cuts: cuts[chosen])
        rehearsal = SimpleNamespace(best_of=lambda cuts, asked: worked(pick(cuts)))
        monkeypatch.setattr(SeamSearch, "_rehearsal", lambda *_: rehearsal)
        mine = SeamSearch(np.zeros(1), None, None)
        given = ("coarse", "model") if plain else None
        found, fractions = told(mine._best("component", ("base", "free"), 0.5, mirror, given))
        assert (np.diff(fractions) > -1e-9).all() and fractions[-1] <= 1
        return found.name, tried

    return run


EXACT = SimpleNamespace(exact=True)
NEAR = SimpleNamespace(exact=False)
ALIKE = SimpleNamespace(alike=True)


def test_without_a_mirror_the_best_of_several_surfaces_is_made_shorter(best):
    assert best(first=Cut("first", 1.0)) == ("short first", ["model", "first", [1, 2], "shorten first"])
    assert best(first=Cut("first", 1.0), chosen=1)[0] == "short other 1"
    assert best(first=Cut("first", 1.0), trials=1, plain=True) == ("short first", ["first", [], "shorten first"])


def test_an_exact_mirror_that_is_whole_needs_no_other(best):
    assert best(exact=Cut("exact", 9.0), mirror=EXACT) == ("exact", ["exact"])
    # With what is stuck, or parted, a line near the plane is tried, too.
    first = Cut("first", 1.0)
    for exact in (Cut("exact", 1.0, True), Cut("exact", 1.0, whole=False), None):
        assert best(exact=exact, near=Cut("near", 1.0), first=first, mirror=EXACT)[1][:2] == ["exact", "near"]
    assert best(near=Cut("near", 1.0), first=first, mirror=NEAR)[1][0] == "near"


@pytest.mark.parametrize(("share", "name"), [(0.999, "exact"), (1.001, "near")])
def test_a_parted_exact_cut_is_taken_where_it_is_not_much_dearer_than_one_along_a_line(share, name, best):
    exact = Cut("exact", share * 1.1, whole=False)
    found, tried = best(exact=exact, near=Cut("near", 1.0), first=Cut("first", 10.0), mirror=EXACT)
    assert found == name and (tried == ["exact", "near"]) == (name == "exact")
    stuck = Cut("exact", 0.1, True, whole=False)
    assert best(exact=stuck, near=Cut("near", 1.0), first=Cut("first", 10.0), mirror=EXACT)[0] == "near"


def test_symmetric_cuts_may_cost_as_much_more_as_they_are_worth(best):
    # Others get shorter by a share when they are made shorter.
    most = (1 - 0.1) * 1.2
    assert best(near=Cut("near", 0.999 * most), first=Cut("first", 1.0), mirror=NEAR) == (
        "near",
        ["near", "model", "first"],
    )
    found, tried = best(
        near=Cut("near", 1.001 * most), first=Cut("first", 1.0), shorter=Cut("short", 0.99), mirror=NEAR
    )
    assert (found, tried[-1]) == ("near", "shorten first")
    # Shorter ones that are cheap enough are taken as they are.
    found, tried = best(near=Cut("near", 1.19), first=Cut("first", 1.0), shorter=Cut("short", 0.9), mirror=NEAR)
    assert found == "short" and tried[-2:] == ["shorten first", [1, 2]]
    found, tried = best(
        near=Cut("near", 1.19), first=Cut("first", 1.0), shorter=Cut("short", 0.9), mirror=NEAR, chosen=2
    )
    assert tried[-1] == "shorten other 2"
    found, tried = best(near=Cut("near", 1.21), first=Cut("first", 1.0), mirror=NEAR)
    assert found == "short first" and tried == ["near", "model", "first", [1, 2], "shorten first"]


def test_what_is_stuck_is_taken_where_all_is(best):
    near = Cut("near", 0.5, True)
    assert best(near=near, first=Cut("first", 1.0), mirror=NEAR)[0] == "short first"
    assert best(near=near, first=Cut("first", 1.0, True), mirror=NEAR)[0] == "near"
    assert best(exact=Cut("exact", 0.5, True), first=Cut("first", 1.0, True), mirror=EXACT)[0] == "exact"


@pytest.mark.parametrize("count", [0, 1, 3])
def test_symmetric_cuts_are_the_best_of_several_made_shorter(count, monkeypatch):
    cuts = [Cut(str(k), 1.0) for k in range(count)]
    monkeypatch.setattr(SeamSearch, "_trials", lambda *_: 4)
    monkeypatch.setattr(
        SeamSearch,
        "_several_grown",
        lambda self, c, base, m, bound, trials: worked(cuts if list(trials) == [0, 1, 2, 3] else None),
    )
    monkeypatch.setattr(
        SeamSearch, "_rehearsal", lambda *_: SimpleNamespace(best_of=lambda cuts, asked: worked(cuts[-1]))
    )
    monkeypatch.setattr(SeamSearch, "_shortened", lambda self, found: worked(Cut("short " + found.name, 1.0)))
    found, fractions = told(SeamSearch(np.zeros(1), None, None)._symmetric(None, None, 0.5, ALIKE))
    assert found is None if not count else found.name == f"short {count - 1}"
    grown = 0.5
    assert fractions == pytest.approx([0, grown] + ([grown, grown + 0.2, grown + 0.2, 1.0] if count else []))


@pytest.mark.parametrize("mirror", [None, EXACT, NEAR])
@pytest.mark.parametrize("broken", [None, 0, 2])
@pytest.mark.parametrize("by_surface", [False, True])
def test_cuts_are_grown_on_surfaces_until_one_cannot_get_along_the_plane(by_surface, broken, mirror, monkeypatch):
    asked, made = [], []

    def modelled(self, component, mirror, trial, finer):
        made.append((trial, finer))
        return trial, "model"

    def setting(self, component, base, mirror, coarse, model):
        def whole(share=None):
            asked.append(share)
            return coarse != broken

        graph = SimpleNamespace(is_whole=whole)
        return SimpleNamespace(
            extremity=lambda: 7, task=lambda bound, root: SimpleNamespace(bound=bound, root=root, graph=graph)
        )

    monkeypatch.setattr(SeamSearch, "_modelled", modelled)
    monkeypatch.setattr(SeamSearch, "_setting", setting)
    monkeypatch.setattr(
        SeamSearch, "_grown_on", lambda self, setting, task, base, mirror: worked((task.bound, task.root))
    )
    bound = (lambda coarse, model: 10 + coarse) if by_surface else 0.5
    mine = SeamSearch(np.zeros(1), None, None)
    found, fractions = told(mine._several_grown(None, None, mirror, bound, range(3), 2.0))
    count = 3 if mirror is None or broken is None else broken
    assert found == [(10 + k if by_surface else 0.5, 7) for k in range(count)]
    assert made[0] == (0, 2.0) and len(made) == (3 if count == 3 else count + 1)
    assert set(asked) <= {0.5 if mirror is EXACT else searches.REACHED} and bool(asked) == (mirror is not None)
    assert fractions == pytest.approx([x for k in range(count) for x in (k / 3, (k + 1) / 3)])


# ---- again --------------------------------------------------------------------------------------------------


@dataclass
class Grown:
    """A cut of a spread on a coarse surface whose task has the bound 1."""

    name: str
    spread: float = 0.5
    is_stuck: bool = False

    @property
    def cut(self):
        return SimpleNamespace(spread=self.spread)

    @property
    def task(self):
        return SimpleNamespace(bound=1.0)

    @property
    def setting(self):
        return SimpleNamespace(coarse="coarse", model="model")

    def carried(self, component):
        return Carried(self.name)


@dataclass(frozen=True)
class Carried:
    name: str
    rehearsed: float | None = None
    is_stuck: bool = False


@pytest.fixture
def again(monkeypatch):
    def run(share, *, adding=False, told=None, rehearse=False, added=None, further=None, finer=(), mirror=None):
        tried, rest = [], list(finer)

        def added_to(self, component, found, spread):
            tried.append("added")
            return worked(added or Grown("added"))

        def grown_further(self, component, found, spread):
            tried.append("further")
            return worked(further or Grown("further"))

        def grown_finer(self, component, found, spread):
            tried.append("finer" if found.mirror is None else "finer mirrored")
            return worked(rest.pop(0) if rest else Grown("finer"))

        def kept(best, asked):
            tried.append(f"rehearsed {asked:.3f}")
            return worked((best, 0.25))

        monkeypatch.setattr(SeamSearch, "_added", added_to)
        monkeypatch.setattr(SeamSearch, "_grown_further", grown_further)
        monkeypatch.setattr(SeamSearch, "_grown_finer", grown_finer)
        monkeypatch.setattr(SeamSearch, "_rehearsal", lambda *_: SimpleNamespace(kept=kept))
        monkeypatch.setattr(
            SeamSearch, "_shortened", lambda self, best: worked(Grown("short " + best.name, is_stuck=best.is_stuck))
        )

        @dataclass(frozen=True)
        class Before:
            rehearsed: float | None
            mirror: object

        mine = SeamSearch(np.zeros(1), None, None, adding=adding, rehearse=(lambda *_: None) if rehearse else None)
        return drain(mine._again(None, Before(told, mirror), share)), tried

    return run


def test_where_little_is_missing_arcs_are_added(again):
    assert again(0.85) == (Carried("added"), ["added"])
    assert again(0.1, adding=True) == (Carried("added"), ["added"])
    # Where that does not do, finer surfaces have to.
    found, tried = again(0.85, added=Grown("added", 1.1))
    assert found == Carried("short finer") and tried == ["added", "finer"]


def test_what_a_map_has_told_holds_for_what_is_added(again):
    found, tried = again(0.1, adding=True, told=0.4, rehearse=True, added=Grown("added", 9.0))
    assert found == Carried("added", rehearsed=0.25) and tried == ["added", "rehearsed 0.040"]
    near = 0.6
    assert again(near, told=0.4, rehearse=True)[1] == ["added", f"rehearsed {0.4 * near:.3f}"]
    # What was told counts only while rehearsals do.
    assert again(near, told=0.4)[1] == ["finer"]
    assert again(0.99 * near, told=0.4, rehearse=True)[1] == ["finer"]


def test_where_more_is_missing_it_is_grown_on_or_on_finer_surfaces(again):
    near = 0.6 ** (1 / searches.SPREAD_BY_SHEAR)
    assert again(1.001 * near) == (Carried("short further"), ["further"])
    assert again(1.001 * near, further=Grown("further", 1.01))[1] == ["further", "finer"]
    assert again(0.999 * near)[1] == ["finer"]


@pytest.mark.parametrize(("free_stuck", "name"), [(False, "free"), (True, "mirrored")])
def test_symmetric_ones_that_are_stuck_are_given_up_where_others_are_not(free_stuck, name, again):
    finer = [Grown("mirrored", is_stuck=True), Grown("free", is_stuck=free_stuck)]
    found, tried = again(0.1, finer=finer, mirror="mirror")
    assert tried == ["finer mirrored", "finer"] and found == Carried(f"short {name}", is_stuck=name == "mirrored")
    assert again(0.1, finer=[Grown("mirrored")], mirror="mirror")[1] == ["finer mirrored"]
    assert again(0.1, finer=[Grown("stuck", is_stuck=True)])[1] == ["finer"]
