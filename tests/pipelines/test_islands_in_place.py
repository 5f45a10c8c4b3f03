"""Refined and magnified islands, of several surfaces in one run: what each keeps, and every figure that is told."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from readings import reading

from omt_uv.pipelines import refine
from omt_uv.pipelines.arranging.actions import symmetrize_islands
from omt_uv.pipelines.layout import Refusal
from omt_uv.pipelines.magnify import Magnified, Region, magnify
from omt_uv.pipelines.refine import refine_islands
from omt_uv.pipelines.regions.several import JointShares, NamedRegion, magnify_several, region_factors
from omt_uv.settings import MagnifySettings, RefineSettings
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.parameterization.chart_indices import CornerPins
from omt_uv.solver.progress import Progress, drain
from omt_uv.solver.subdivision.modifier import SubdivisionModifier

FIGURES = ("area_l1", "area_sd", "angle_mean", "folds")


class Patch:
    """A surface of several patches, each an island with sheared UVs at a place, a size and a turn of its own."""

    def __init__(self, seed, count, mirrored=(), pins=None):
        rng = np.random.default_rng(seed)
        V, F, uv, self.of = [], [], [], []
        for k in range(count):
            points, faces = meshes.grid(5 + k, 4)
            points = points - points.mean(axis=0)
            points[:, 2] = 0.3 * rng.uniform(0.5, 1) * np.sin(3 * points[:, 0]) * np.cos(2 * points[:, 1])
            turn, size = rng.uniform(0, 6), 0.1 * rng.uniform(0.5, 2)
            sheared = size * (points[:, :2] @ [[1.0, 0.2], [0.1, 0.6]]) @ [[1j], [1]]
            w = sheared.ravel() * np.exp(1j * turn) + 3 * k + 9j * seed
            w = -w.conj() + 6 * k if k in mirrored else w
            F.append(faces + sum(map(len, V)))
            V.append((1 + k) * points + [9.0 * k, 0, 0])
            uv.append(np.column_stack([w.real, w.imag])[faces].reshape(-1, 2))
            self.of += [k] * len(faces)
        self.of = np.array(self.of)
        self.uv = np.concatenate(uv)
        self.vertices, self.faces = np.concatenate(V), np.concatenate(F)
        self.surface = reading(self.vertices, self.faces).surface
        self.pinned = np.isin(self.faces.ravel(), () if pins is None else pins)

    def given(self, faces=None):
        return (
            self.surface,
            np.ones(len(self.faces), bool) if faces is None else faces,
            CornerPins(self.pinned, self.uv),
        )

    def after(self, corners, uv):
        """The UVs of all corners."""
        full = self.uv.copy()
        full[corners] = uv
        return full

    def figures(self, uv, island):
        mine = self.of == island
        return distortion(self.vertices, self.faces[mine], uv.reshape(-1, 3, 2)[mine], overlap=False)

    def areas(self, uv):
        """Areas in space, and signed in the UVs, of every triangle."""
        return face_areas(self.vertices, self.faces), signed_areas(uv, np.arange(3 * len(self.faces)).reshape(-1, 3))

    def middle(self, uv, island):
        """Mean of the UVs over the surface of an island."""
        area, _ = self.areas(uv)
        mine = self.of == island
        return area[mine] @ uv.reshape(-1, 3, 2)[mine].mean(axis=1) / area[mine].sum()

    def turn(self, uv, island):
        """How far an island is turned against the UVs there were."""
        mine = np.repeat(self.of == island, 3)
        z, w = (x[mine] @ [1, 1j] for x in (self.uv, uv))
        return np.angle(np.vdot(z - z.mean(), w - w.mean()))


def vertex_of(patch, island, k=0):
    """Some vertex of an island."""
    return np.unique(patch.faces[patch.of == island])[k]


def run(patches, settings, faces=None):
    """The result of refining, and what was told of it meanwhile."""
    seen = []
    given = [p.given(None if faces is None else faces[k]) for k, p in enumerate(patches)]
    found = drain(refine_islands(given, settings), seen.append)
    fractions = [p.fraction for p in seen]
    assert all(isinstance(p, Progress) for p in seen) and min(fractions) >= 0 and max(fractions) <= 1
    assert fractions == sorted(fractions)
    return found, [p.after(c, uv) for p, c, uv in zip(patches, found.corners, found.uv, strict=True)]


def test_islands_stay_where_they_are_at_one_density_with_the_area_that_they_had():
    patches = [Patch(0, 3, mirrored=(1,)), Patch(1, 2)]
    found, uvs = run(patches, RefineSettings(quality="draft"))
    areas = [p.areas(uv) for p, uv in zip(patches, uvs, strict=True)]
    before = [p.areas(p.uv) for p in patches]
    assert sum(abs(a).sum() for _, a in areas) == pytest.approx(sum(abs(a).sum() for _, a in before), rel=0.02)
    density = []
    for patch, uv, (space, covered), (_, old) in zip(patches, uvs, areas, before, strict=True):
        for k in range(patch.of.max() + 1):
            mine = patch.of == k
            density.append(abs(covered[mine].sum()) / space[mine].sum())
            assert (np.sign(covered[mine]) == np.sign(old[mine].sum())).all()
            assert patch.middle(uv, k) == pytest.approx(patch.middle(patch.uv, k), abs=1e-9)
            # By its direction as a whole: the shear that goes turns it a little.
            assert abs(patch.turn(uv, k)) < 0.1
    assert density == pytest.approx([density[0]] * 5, rel=1e-9)
    assert [len(rows) for rows in found.reports] == [3, 2] and not found.warnings
    for patch, uv, rows in zip(patches, uvs, found.reports, strict=True):
        for k, row in enumerate(rows):
            mine = patch.of == k
            assert (row["vertices"], row["faces"], row["triangles"], row["pins"]) == (
                len(np.unique(patch.faces[mine])), mine.sum(), mine.sum(), 0)  # fmt: skip
            for values, figures in ((row["before"], patch.figures(patch.uv, k)), (row, patch.figures(uv, k))):
                for name in FIGURES:
                    assert values[name] == pytest.approx(getattr(figures, name), rel=1e-6, abs=1e-9), name
            assert row["area_l1"] < 0.1 * row["before"]["area_l1"] and row["folds"] == 0 and row["warnings"] == []
            assert row["newton_refinement"] > 0 and row["status"] == "converged" and 0 <= row["residual_refinement"] < 1


@pytest.mark.parametrize("balance", [0.5, 1.0])
def test_a_balance_shears_less_and_keeps_areas_less(balance):
    patches = [Patch(0, 1)]
    (exact, _), (found, _) = (run(patches, RefineSettings(quality="draft", balance=b)) for b in (0.0, balance))
    (a,), (b,) = exact.reports[0], found.reports[0]
    assert b["angle_mean"] < a["angle_mean"] and b["area_l1"] > a["area_l1"]


@pytest.mark.parametrize("count", [1, 2])
def test_pins_stay_and_scale_their_island_where_there_are_two(count):
    patch = Patch(2, 3)
    pins = [vertex_of(patch, 1, k) for k in (0, -1)][:count]
    patch.pinned = np.isin(patch.faces.ravel(), pins)
    found, (uv,) = run([patch], RefineSettings(quality="draft"))
    # What is pinned is where it shall be, and is not written.
    assert not patch.pinned[found.corners[0]].any() and len(found.corners[0]) == (~patch.pinned).sum()
    assert [row["pins"] for row in found.reports[0]] == [0, count, 0]
    space, covered = patch.areas(uv)
    density = [abs(covered[patch.of == k].sum()) / space[patch.of == k].sum() for k in range(3)]
    assert density[0] == pytest.approx(density[2], rel=1e-9)
    assert (density[1] == pytest.approx(density[0], rel=1e-6)) == (count == 1)
    # About the pin, and not about its middle.
    corner, other = (np.flatnonzero(patch.faces.ravel() == v)[0] for v in (pins[0], vertex_of(patch, 1, 7)))
    assert uv[corner] == pytest.approx(patch.uv[corner], abs=1e-12) and not np.allclose(uv[other], patch.uv[other])
    # Everything else has the area that the others had.
    loose = np.isin(patch.of, [0, 2] if count == 2 else [0, 1, 2])
    assert covered[loose].sum() == pytest.approx(patch.areas(patch.uv)[1][loose].sum(), rel=0.02)


def test_an_outline_that_is_kept_stays_and_islands_keep_their_sizes():
    patch = Patch(3, 2, mirrored=(0,))
    found, (uv,) = run([patch], RefineSettings(quality="draft", keep_boundary=True))
    edges = np.sort(patch.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    once, count = np.unique(edges, axis=0, return_counts=True)
    outline = np.isin(patch.faces.ravel(), once[count == 1])
    assert uv[outline] == pytest.approx(patch.uv[outline], abs=1e-9) and not np.allclose(uv, patch.uv, atol=1e-4)
    for row in found.reports[0]:
        assert row["area_l1"] < 0.7 * row["before"]["area_l1"] and row["folds"] == 0


@pytest.mark.parametrize("pinned", [False, True])
def test_only_islands_without_pins_are_packed(pinned):
    patches = [Patch(4, 2), Patch(5, 1)]
    if pinned:
        patches[0].pinned = np.isin(patches[0].faces.ravel(), [vertex_of(patches[0], 0)])
    settings = RefineSettings(quality="draft", pack=True, margin=8, texture_size=256)
    found, uvs = run(patches, settings)
    loose = [np.repeat(patches[0].of == 1, 3) if pinned else np.ones(len(uvs[0]), bool), np.ones(len(uvs[1]), bool)]
    inside = np.concatenate([uv[k] for uv, k in zip(uvs, loose, strict=True)])
    assert inside.min() > 0 and inside.max() < 1 and inside.max() > 0.9
    if pinned:
        still = np.repeat(patches[0].of == 0, 3)
        # Its size is that of one density, about its pin; its place stays.
        corner = patches[0].pinned & still
        assert uvs[0][corner] == pytest.approx(patches[0].uv[corner]) and found.corners[0].size != len(still)
    # As far apart as asked for.
    boxes = [uvs[0][np.repeat(patches[0].of == k, 3)] for k in ((1,) if pinned else (0, 1))] + [uvs[1]]
    for a in range(len(boxes)):
        for b in range(a):
            near = np.linalg.norm(boxes[a][:, None] - boxes[b], axis=2).min()
            assert near >= 8 / 256 * (1 - 1e-6)


def test_faces_that_are_not_chosen_stay_to_the_bit():
    patches = [Patch(6, 3), Patch(7, 2)]
    faces = [patches[0].of == 1, np.zeros(len(patches[1].faces), bool) | (patches[1].of == 0)]
    found, uvs = run(patches, RefineSettings(quality="draft"), faces)
    for patch, uv, chosen, corners in zip(patches, uvs, faces, found.corners, strict=True):
        assert (uv[~np.repeat(chosen, 3)] == patch.uv[~np.repeat(chosen, 3)]).all()
        assert set(corners) == set(np.flatnonzero(np.repeat(chosen, 3)))
    assert [len(rows) for rows in found.reports] == [1, 1]


def test_islands_that_grew_into_one_another_are_told_of_and_those_apart_are_not():
    near, second = Patch(8, 2), np.repeat(Patch(8, 2).of == 1, 3)
    assert not drain(refine_islands([near.given()], RefineSettings(quality="draft"))).warnings
    # Beside the first, and much smaller than it will be, as it is of more surface.
    small = 0.2 * (near.uv[second] - near.uv[second].mean(axis=0))
    top = near.uv[~second][near.uv[~second, 1].argmax()]
    near.uv[second] = small - small[small[:, 1].argmin()] + top + [0.0, 1e-3]
    found, (uv,) = run([near], RefineSettings(quality="draft"))
    ((index, text),) = found.warnings
    assert index == -1 and text.startswith("Islands grew into each other, by ")
    share = float(text.split(" by ")[1].split(" %")[0]) / 100
    measured = distortion(near.vertices, near.faces, uv.reshape(-1, 3, 2)).overlap
    assert share == pytest.approx(measured, rel=0.1)


@pytest.mark.parametrize("which", [0, 1])
def test_a_refusal_says_whose_it_is_and_which_faces(which):
    patches = [Patch(9, 2), Patch(10, 2)]
    given = [p.given() for p in patches]
    given[which] = (*given[which][:2], None)
    with pytest.raises(Refusal, match="no UVs to refine") as caught:
        drain(refine_islands(given, RefineSettings()))
    assert caught.value.index == which


@pytest.mark.parametrize("keep", [False, True])
@pytest.mark.parametrize("pinned", [False, True])
def test_islands_on_a_subdivided_surface_stay_where_they_are_too(keep, pinned):
    """One surface has a modifier, the other has none: it is refined as without the first one's."""
    patches = [Patch(19, 2, mirrored=(1,)), Patch(20, 1)]
    if pinned:
        patches[0].pinned = np.isin(patches[0].faces.ravel(), [vertex_of(patches[0], 0)])
    settings = RefineSettings(quality="draft", keep_boundary=keep)
    given = [p.given() for p in patches]
    found = drain(refine_islands(given, settings, [SubdivisionModifier(1), None]))
    uvs = [p.after(c, uv) for p, c, uv in zip(patches, found.corners, found.uv, strict=True)]
    for patch, uv, rows in zip(patches, uvs, found.reports, strict=True):
        _, old = patch.areas(patch.uv)
        _, new = patch.areas(uv)
        edges = np.sort(patch.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        once, count = np.unique(edges, axis=0, return_counts=True)
        outline = np.isin(patch.faces.ravel(), once[count == 1])
        for k, row in enumerate(rows):
            mine = patch.of == k
            assert (np.sign(new[mine]) == np.sign(old[mine].sum())).all() and row["folds"] == 0
            assert row["area_l1"] < 0.8 * row["before"]["area_l1"]
            corners = np.repeat(mine, 3)
            if keep:
                assert uv[corners & outline] == pytest.approx(patch.uv[corners & outline], abs=1e-7)
            elif not (pinned and patch is patches[0] and k == 0):
                assert patch.middle(uv, k) == pytest.approx(patch.middle(patch.uv, k), abs=0.02)
                assert abs(patch.turn(uv, k)) < 0.15
        if pinned and patch is patches[0]:
            assert (uv[patch.pinned] == patch.uv[patch.pinned]).all()
    alone = drain(refine_islands(given[1:], settings))
    if keep:
        np.testing.assert_allclose(alone.uv[0], found.uv[1], atol=1e-12)


@pytest.mark.parametrize("status, told", [("steps", 1), ("converged", 0), ("stalled", 0)])
def test_a_refinement_that_used_up_its_steps_is_told(status, told):
    found = refine._unfinished(SimpleNamespace(status=status))
    assert len(found) == told and all("stopped before it was done" in text for text in found)


@pytest.mark.parametrize("unfinished", [(), (1,), (0, 2), (0, 1, 2)], ids=str)
def test_refinements_that_used_up_their_steps_are_told_of_their_object(unfinished, monkeypatch):
    refine_island, count = refine.refine_island, iter(range(3))

    def island(*args, **options):
        found = yield from refine_island(*args, **options)
        return replace(found, status="steps" if next(count) in unfinished else "converged", warnings=("own",))

    monkeypatch.setattr(refine, "refine_island", island)
    patches = [Patch(1, 1), Patch(2, 2)]
    found = drain(refine_islands([p.given() for p in patches], RefineSettings(quality="draft")))
    told = [owner for owner, text in found.warnings if "stopped before it was done" in text]
    assert told == [(0, 1, 1)[k] for k in unfinished]
    assert [owner for owner, text in found.warnings if text == "own"] == [0, 1, 1]
    assert [row["status"] == "steps" for rows in found.reports for row in rows] == [k in unfinished for k in range(3)]


# ---- regions of islands ---------------------------------------------------------------------------------------


def spot(patch, island, inside=0.5, place=(0.0, 0.0)):
    """Weights (n,) that fall off from a place of an island, 0 elsewhere."""
    mine = np.unique(patch.faces[patch.of == island])
    points = patch.vertices[mine]
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    at = (points[:, :2] - low) / (high - low) * 2 - 1 - place
    weights = np.zeros(len(patch.vertices))
    weights[mine] = np.clip(1.5 - np.linalg.norm(at, axis=1) / inside, 0, 1)
    return weights


def region(patch, weights, faces=None):
    chosen = np.ones(len(patch.faces), bool) if faces is None else faces
    return Region(patch.surface, chosen, weights, CornerPins(patch.pinned, patch.uv))


def share(patch, weights, uv, islands):
    """Share of the UV area of some islands that is a region's."""
    mine = np.isin(patch.of, islands)
    area = np.abs(patch.areas(uv)[1])[mine]
    return area @ weights[patch.faces].mean(axis=1)[mine] / area.sum()


@pytest.mark.parametrize("boundary", ["own", "free", "disk", "square"])
def test_every_figure_of_magnified_islands_is_that_of_their_uvs(boundary):
    patches = [Patch(11, 3, mirrored=(1,)), Patch(12, 2)]
    weights = [spot(patches[0], 0) + spot(patches[0], 1), spot(patches[1], 1)]
    settings = MagnifySettings(quality="draft", factor=1.6, source="uv", boundary=boundary)
    found = drain(magnify([region(p, w) for p, w in zip(patches, weights, strict=True)], settings))
    uvs = [p.after(c, uv) for p, c, uv in zip(patches, found.corners, found.uv, strict=True)]
    touched = [[0, 1], [1]]
    total, sums = 0.0, np.zeros(3)
    for patch, w, uv, islands, rows, corners in zip(
        patches, weights, uvs, touched, found.reports, found.corners, strict=True
    ):
        assert set(corners) == set(np.flatnonzero(np.repeat(np.isin(patch.of, islands), 3)))
        assert len(rows) == len(islands)
        for k, row in zip(islands, rows, strict=True):
            mine = patch.of == k
            before, after = share(patch, w, patch.uv, [k]), share(patch, w, uv, [k])
            assert row["share_before"] == pytest.approx(before, rel=1e-9)
            assert row["share_after"] == pytest.approx(after, rel=1e-9)
            assert row["share_asked"] == pytest.approx(1.6 * before, rel=1e-9)
            assert after == pytest.approx(1.6 * before, rel=0.03) and row["folds"] == 0 and row["overlap"] == 0
            assert (row["vertices"], row["triangles"]) == (len(np.unique(patch.faces[mine])), mine.sum())
            assert (row["outline"] == boundary) == (boundary in ("free", "disk", "square")) and row["area_l1"] < 0.05
            old, new = patch.areas(patch.uv)[1][mine], patch.areas(uv)[1][mine]
            assert (np.sign(new) == np.sign(old.sum())).all() and row["newton_refinement"] > 0
            size = np.abs(old).sum()
            total += size
            sums += size * np.array([before, 1.6 * before, after])
    shares = found.shares
    assert [shares.before, shares.target, shares.after] == pytest.approx(sums / total, rel=1e-9)
    missed = abs(shares.after / shares.target - 1)
    assert [index for index, text in found.warnings if "instead of" in text] == [-1] * (missed > 5e-3)


@pytest.mark.parametrize("boundary", ["own", "free"])
@pytest.mark.parametrize("cascade", [1, 2])
def test_every_figure_of_several_regions_is_that_of_their_uvs(boundary, cascade):
    patches = [Patch(13, 3, mirrored=(1,)), Patch(14, 2)]
    parts = {"eyes": (1.3, [spot(patches[0], 0, 0.4, (0.5, 0.5)), np.zeros(len(patches[1].vertices))]),
             "mouth": (0.8, [spot(patches[0], 0, 0.4, (-0.5, -0.5)), spot(patches[1], 1)])}  # fmt: skip
    regions = [NamedRegion(name, factor, tuple(region(p, w) for p, w in zip(patches, weights, strict=True)))
               for name, (factor, weights) in parts.items()]  # fmt: skip
    settings = MagnifySettings(quality="draft", source="uv", boundary=boundary, cascade=cascade)
    found = drain(magnify_several(regions, settings))
    uvs = [p.after(c, uv) for p, c, uv in zip(patches, found.corners, found.uv, strict=True)]
    touched, total, sums = [[0], [1]], 0.0, np.zeros((3, 2))
    factors = np.array([1.3, 0.8]) ** cascade
    for k, (patch, uv, islands) in enumerate(zip(patches, uvs, touched, strict=True)):
        (row,), (island,) = found.reports[k], islands
        mine = patch.of == island
        before, after = (
            np.array([share(patch, weights[k], x, islands) for _, weights in parts.values()]) for x in (patch.uv, uv)
        )
        asked = np.where(before > 0, factors * before, before)
        assert row["share_before"] == pytest.approx(before) and row["share_after"] == pytest.approx(after)
        assert row["share_asked"] == pytest.approx(asked, rel=1e-6)
        assert after == pytest.approx(asked, rel=0.03, abs=1e-12)
        assert row["folds"] == 0 and (row["vertices"], row["triangles"]) == (
            len(np.unique(patch.faces[mine])),
            mine.sum(),
        )
        size = np.abs(patch.areas(patch.uv)[1][mine]).sum()
        total += size
        sums += size * np.array([before, asked, after])
        assert set(found.corners[k]) == set(np.flatnonzero(np.repeat(mine, 3)))
    shares = found.shares
    assert shares.names == ("eyes", "mouth")
    for values, expected in zip((shares.before, shares.target, shares.after), sums / total, strict=True):
        assert values == pytest.approx(expected, rel=1e-6)
    assert shares.report() == [{"region": n, "before": b, "asked": t, "after": a} for n, b, t, a in
                               zip(shares.names, *(x.tolist() for x in (shares.before, shares.target, shares.after)),
                                   strict=True)]  # fmt: skip


@pytest.mark.parametrize("exact", [False, True])
def test_several_regions_of_several_surfaces_have_their_shares_of_the_whole(exact):
    patches = [Patch(15, 1), Patch(16, 1)]
    weights = {"a": (1.5, [spot(patches[0], 0), np.zeros(len(patches[1].vertices))]),
               "b": (0.7, [np.zeros(len(patches[0].vertices)), spot(patches[1], 0)])}  # fmt: skip
    regions = []
    for name, (factor, ws) in weights.items():
        parts = (replace(region(p, w), pins=None) for p, w in zip(patches, ws, strict=True))
        regions.append(NamedRegion(name, factor, tuple(parts)))
    settings = MagnifySettings(quality="draft", source="mesh", exact=exact, max_shear=0.0)
    found = drain(magnify_several(regions, settings))
    areas, spaces, inside = [], [], []
    for k, patch in enumerate(patches):
        full = np.zeros_like(patch.uv)
        full[found.corners[k]] = found.uv[k]
        space, covered = patch.areas(full)
        areas.append(np.abs(covered)), spaces.append(space)
        inside.append([ws[k][patch.faces].mean(axis=1) for _, ws in weights.values()])
    every = np.concatenate(inside, axis=1)
    before, after = (every @ np.concatenate(x) / np.concatenate(x).sum() for x in (spaces, areas))
    assert found.shares.before == pytest.approx(before) and found.shares.after == pytest.approx(after, rel=1e-6)
    if exact:
        assert found.shares.target == pytest.approx(before * [1.5, 0.7])
        assert after == pytest.approx(before * [1.5, 0.7], rel=2e-3)


def test_an_outline_of_another_kind_is_refused_for_several_regions_and_for_none_is_said_whose():
    patch = Patch(17, 2)
    regions = [NamedRegion("a", 2.0, (region(patch, spot(patch, 0)),))]
    for boundary in ("disk", "square"):
        with pytest.raises(Refusal, match="keep the outline") as caught:
            drain(magnify_several(regions, MagnifySettings(source="uv", boundary=boundary)))
        assert caught.value.index == 0
    everywhere = NamedRegion("all", 2.0, (region(patch, np.ones(len(patch.vertices))),))
    with pytest.raises(Refusal, match="of the region 'all' and a rest"):
        drain(magnify_several([regions[0], everywhere], MagnifySettings(source="uv", boundary="own")))
    wrong = spot(patch, 0)
    wrong[7] = 2.0
    with pytest.raises(Refusal) as caught:
        drain(magnify_several([regions[0], NamedRegion("b", 2.0, (region(patch, wrong),))], MagnifySettings()))
    assert caught.value.error.elements.tolist() == [7]


def test_an_island_that_is_painted_all_over_stays_and_is_counted():
    patch = Patch(18, 4)
    weights = spot(patch, 0)
    for k in (1, 3):
        weights[np.unique(patch.faces[patch.of == k])] = 0.5
    settings = MagnifySettings(quality="draft", source="uv", boundary="own", factor=1.5)
    found: Magnified = drain(magnify([region(patch, weights)], settings))
    assert (-1, "2 islands are painted all over, and stay as before") in found.warnings
    assert set(found.corners[0]) == set(np.flatnonzero(np.repeat(patch.of == 0, 3)))
    with pytest.raises(Refusal, match=r"no part|both a part"):
        drain(magnify([region(patch, np.where(patch.vertices[:, 0] > 4, 1.0, 0.0))], settings))


@pytest.mark.parametrize("after, told", [([0.2, 0.5], []), ([0.2 * 1.004, 0.5], []), ([0.2 * 1.006, 0.5], ["a"]),
                                         ([0.2 * 0.994, 0.5 * 1.2], ["a", "b"])])  # fmt: skip
def test_regions_that_miss_their_shares_are_named(after, told):
    shares = JointShares(("a", "b"), np.array([0.1, 0.4]), np.array([0.2, 0.5]), np.array(after))
    assert [text.split(" ")[0] for text in shares.warnings()] == told
    assert all("instead of" in text for text in shares.warnings())
    assert shares.said()[0] == ("a", f"10.000 % to {100 * after[0]:.3f} %")
    assert shares.text().startswith("Of the texture, a from 10 % to") and "(50 % asked)" in shares.text()


def test_factors_are_read_from_what_stands_behind_the_last_sign():
    assert region_factors(["a=b=2", " c = .5 ", "d=1e1"]) == [("a=b", 2.0), ("c", 0.5), ("d", 10.0)]
    for texts, words in (
        (["a"], "no region and factor"),
        (["=3"], "names no region"),
        (["a=1", "a =2"], "named twice"),
    ):
        with pytest.raises(ValueError, match=words):
            region_factors(texts)


@pytest.mark.parametrize("stacked", [False, True])
@pytest.mark.parametrize("gap", [0.05, 2.0])
def test_halves_that_come_to_lie_in_one_another_are_said_unless_that_was_asked_for(stacked, gap):
    V, F = meshes.grid(4, 3)
    V = V * [1, 0.7, 1] + [0.5, 0, 0]
    V[:, 2] = np.sin(2 * V[:, 0] + V[:, 1])
    n = len(V)
    small = V[:, :2] * 0.05
    both = reading(np.concatenate([V * [-1, 1, 1], V]), np.concatenate([F[:, ::-1], F + n]),
                   np.concatenate([small - small.max(axis=0) + [0.5 - gap, 0.4], V[:, :2]]))  # fmt: skip
    found = symmetrize_islands([both], 0, stacked)
    assert found.changed == 2
    said = [text for _, text in found.warnings if "grew into each other" in text]
    assert len(said) == (not stacked and gap < 1)
