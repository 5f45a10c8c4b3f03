"""As in `tests/solver/test_every_warning.py`: every sentence that the pipelines may say, on both sides of its bound."""

from __future__ import annotations

import functools
import itertools
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from bodies import hourglass
from readings import reading, together
from said import Scenes, sentences
from scripted_steps import worked
from sphere_shapes import blob

from omt_uv.pipelines import gate, globe, layout, magnify, refine, remesh, subdivision, unwrap
from omt_uv.pipelines.arranging import actions
from omt_uv.pipelines.regions import several
from omt_uv.pipelines.shapes import match, partition, wrap
from omt_uv.pipelines.shapes.landmark_pairs import LandmarkPoint, Pairs
from omt_uv.settings import RemeshSettings, Settings
from omt_uv.solver import errors
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain
from omt_uv.solver.registration.results import RegistrationOptions
from omt_uv.xatlas_charts import SegmentationError

SENTENCES = [s for s in sentences("pipelines") if s.module != "pipelines/volumes/vtu.py"]
SCENES = Scenes()
says = SCENES.says
NO_WARNINGS = {
    ("pipelines/distortion.py", "on the subdivided surface"): "a row of figures",
    ("pipelines/distortion.py", "Area error"): "a report",
    ("pipelines/regions/several.py", "Several regions of existing"): "an error",
    ("pipelines/regions/several.py", "No island has both"): "an error",
    ("pipelines/shapes/distance.py", "{} vertices are marked"): "an error",
}
MERGING = "merging vertices that coincide"
DISSOLVE = "dissolve faces without area"


def test_every_sentence_has_a_scene_or_a_reason_why_not():
    assert SCENES.without(SENTENCES, NO_WARNINGS) == []


@pytest.mark.parametrize("key", SCENES.of, ids=" ".join)
def test_a_sentence_is_told_from_its_bound_on_and_only_there(key, monkeypatch):
    SCENES.check(key, SENTENCES, monkeypatch)


def spoken(warnings, owner=-1):
    """Texts of pairs of owner and text, which are all of that owner."""
    assert all(index == owner for index, _ in warnings), warnings
    return [text for _, text in warnings]


def apart(*grids):
    """Grids beside one another in space and in the UVs, as one reading."""
    V, F = together(*grids)
    at = np.repeat(np.arange(len(grids)), [len(v) for v, _ in grids])
    W = V + np.column_stack([2.0 * at, 0 * at, 0 * at])
    return reading(W, F, W[:, :2].copy())


# ---- islands -----------------------------------------------------------------------------------------------------


@says("pipelines/arranging/actions.py", "No two islands have the same shape")
def no_two_alike(patch):
    for other, told in ((meshes.grid(2, 2), []), (meshes.grid(2, 3), ["No two islands have the same shape"])):
        yield spoken(actions.stack_islands([apart(meshes.grid(2, 2), other)], False).warnings), told


@says("pipelines/arranging/actions.py", "{} as before")
def not_arranged(patch):
    """Halves without a partner, and islands that are no grids."""
    patch.setattr(actions, "halves", lambda jobs, *_: SimpleNamespace(uv=[j[2] for j in jobs], partner=partner))
    patch.setattr(actions, "_rectified", lambda given, island: rectified(island.uv))
    stays = (
        "An island has no image on the other side, and stays as before",
        "islands have none there, and stay as before",
    )
    rests = "An island is no grid of quads, and stays as before", "islands are no grids of quads, and stay as before"

    def rectified(uv):
        fails.append(1)
        if len(fails) <= count:
            raise errors.GridError("No grid")
        return uv

    for count in (0, 1, 2):
        several, fails = apart(*[meshes.grid(2, 2)] * 3), []
        partner = np.where(np.arange(3) < count, -1, 0)
        found = actions.symmetrize_islands([several], 0, False)
        assert found.changed == 3 - count
        yield spoken(found.warnings), [[], [stays[0]], [f"2 {stays[1]}"]][count]
        found = actions.rectify_islands([several])
        assert found.changed == 3 - count
        yield spoken(found.warnings), [[], [rests[0]], [f"2 {rests[1]}"]][count]


@says("pipelines/layout.py", "Islands grew into each other")
def grown(patch):
    island = layout.PlacedIsland
    V, F = meshes.grid(1, 1)
    chart = SimpleNamespace(triangles=F)
    for over, before in ((0.0, 0.0), (0.99e-4, 0.0), (1.1e-4, 0.0), (0.25, 0.0), (0.25, 0.25)):
        # Of so much of one square lies on the other one.
        pair = [island(0, chart, V[:, :2], V[:, :2]),
                island(0, chart, V[:, :2] + [1 - 2 * over, 0], V[:, :2] + [1 - 2 * before, 0])]  # fmt: skip
        patch.setattr(layout, "overlap_share", share_of_two)
        told = layout.grown_together(pair)
        by = f"{100 * over:.1f}"
        text = f"Islands grew into each other, by {by} % of the UV area; pack them"
        yield [told] if told else [], [text] if over - before > 1e-4 else []
        assert layout.grown_together(pair[:1]) == ""


def share_of_two(uv):
    """The share of the area of two unit squares, side by side, that lies under both."""
    right = uv[2:, :, 0].min()
    return max(0.0, 1 - right) / 2


@says("pipelines/gate.py", "{} folded in the UVs")
def folded(patch):
    for folds, before, told in (
        (0, None, []), (1, None, ["1 face is folded in the UVs"]), (2, None, ["2 faces are folded in the UVs"]),
        (2, 1, ["2 faces are folded in the UVs"]), (2, 2, ["2 faces are folded in the UVs, as before"]),
    ):  # fmt: skip
        yield gate.Gate(9, folds, 0.0).warnings(None if before is None else gate.Gate(9, before, 0.0)), told
    # Of a mesh with other faces, as remeshing makes, the share counts.
    for faces, told in ((4, ["2 faces are folded in the UVs"]), (8, ["2 faces are folded in the UVs, as before"])):
        yield gate.Gate(faces, 2, 0.0).warnings(gate.Gate(8, 2, 0.0)), told


@says("pipelines/gate.py", "{} of the UV area is under several faces")
def overlapping(patch):
    text = "{} % of the UV area is under several faces"
    for share, before, told in (
        (0.9973, None, [text.format(100)]),
        (1e-4, None, []), (1.01e-4, None, [text.format("0.01")]), (0.256, None, [text.format(26)]),
        (0.25, 0.2498, [text.format(25)]), (0.25, 0.24995, [text.format(25) + ", as before"]),
    ):  # fmt: skip
        yield gate.Gate(9, 0, share).warnings(None if before is None else gate.Gate(9, 0, before)), told


@says("pipelines/unwrap.py", "{} joined to them for the map")
def joined(patch):
    V, F = meshes.grid(2, 2)
    one, many = "A boundary vertex lies on another and is", "{} boundary vertices lie on others and are"
    for shift, who in (([2.0, 0, 0], ""), ([1.0, 0.5, 0], many.format(2)), ([1.0, 0, 0], many.format(3))):
        W, G = np.concatenate([V, V + shift]), np.concatenate([F, F + len(V)])
        _, text = unwrap._joined(0, unwrap.UnwrapJob(triangle_surface(W, G)))
        yield (
            [text] if text else [],
            [f"{who} joined to them for the map; {MERGING} joins them in the mesh, too"] * bool(who),
        )
    patch.setattr(unwrap, "joined_vertices", lambda surface, faces, _: np.where(np.arange(9) == 8, 7, np.arange(9)))
    _, text = unwrap._joined(0, unwrap.UnwrapJob(triangle_surface(V, F)))
    assert text == f"{one} joined to them for the map; {MERGING} joins them in the mesh, too"


@says("pipelines/unwrap.py", "{} with two corners at one place")
def flat(patch):
    V, F = meshes.grid(2, 2)
    for rows, who in (((), ""), ((0,), "A triangle"), ((0, 5), "2 triangles")):
        G = np.vstack([F, F[list(rows)][:, [0, 1, 1]]])
        told = drain(unwrap.lay_out([unwrap.UnwrapJob(triangle_surface(V, G))], Settings())).warnings
        text = f"{who} with two corners at one place, left out of the map; {DISSOLVE}"
        yield spoken(told, 0), [text] if rows else []


@says("pipelines/unwrap.py", "{} in place")
@says("pipelines/unwrap.py", "; the others were packed")
def with_pins(patch):
    rest = "; the others were packed as if there were none"
    two = "2 islands with pins stay in place"
    for pinned, others, told in ((1, 0, "An island with pins stays in place"), (2, 0, two), (2, 1, two + rest)):
        yield [unwrap._in_place(pinned, others)], [told]
    V, F = meshes.grid(2, 2)
    (W, G), uv = together((V, F), (V + [2, 0, 0], F)), np.concatenate([V, V + [2, 0, 0]])[:, :2]
    corners = uv[G.ravel()]
    for count in (0, 1, 2):
        pinned = np.repeat(np.arange(2) < count, F.size)
        job = unwrap.UnwrapJob(triangle_surface(W, G), pins=layout.CornerPins(pinned, corners) if count else None)
        told = ["", "An island with pins stays in place" + rest, two][count]
        yield spoken(drain(unwrap.lay_out([job], Settings())).warnings), [told] if told else []


@says("pipelines/unwrap.py", "{}; cut only where it has to be")
def no_charts(patch):
    V, F = meshes.grid(2, 2)
    for fails in (False, True):

        def seams(*_, fails=fails):
            if fails:
                raise SegmentationError("No charts")
            return np.zeros((0, 2), int)

        patch.setattr(unwrap, "chart_seams", seams)
        _, text = unwrap._with_charts(0, unwrap.UnwrapJob(triangle_surface(V, F)))
        yield [text] if text else [], ["No charts; cut only where it has to be"] if fails else []


@says("pipelines/refine.py", "The refinement of an island stopped")
def unfinished(patch):
    text = "The refinement of an island stopped before it was done"
    for status, told in (("converged", []), ("stalled", []), ("steps", [text])):
        yield refine._unfinished(SimpleNamespace(status=status)), told


@says("pipelines/subdivision.py", "Areas on the subdivided surface")
def coarse_cage(patch):
    """Told above two percent, where areas come first."""
    how = "the mesh is too coarse for its UVs to follow that surface; apply one level of the modifier before"
    found = SimpleNamespace(maps=[SimpleNamespace(uv=np.zeros((4, 2)), area_weight=1.0)], warnings=("first",))
    patch.setattr(subdivision, "refinable", lambda surface: True)
    patch.setattr(subdivision, "subdivided_surface", lambda *_: None)
    patch.setattr(subdivision, "_fixed", lambda *_: None)
    patch.setattr(subdivision, "_refined_in_stages", lambda *_: worked(np.zeros((4, 2))))
    patch.setattr(subdivision, "_with_figures", lambda old, *_: old)
    patch.setattr(subdivision, "replace", lambda old, **new: SimpleNamespace(**{**vars(old), **new}))
    for error, first, told in (
        (0.02, True, []), (0.0201, True, [f"Areas on the subdivided surface are 2 % off: {how}"]),
        (0.123, True, [f"Areas on the subdivided surface are 12 % off: {how}"]), (0.123, False, []),
    ):  # fmt: skip
        part = SimpleNamespace(
            corners=np.zeros((1, 4, 3)), resized=lambda found, fixed: found, area_error=lambda uv, error=error: error,
            mapping=SimpleNamespace(matrix=np.eye(4), quads=np.zeros((1, 4), int)), chart=np.zeros(1, int),
            first=np.array([0, 4]),
        )  # fmt: skip
        patch.setattr(subdivision, "_mapped_part", lambda *_, part=part: part)
        done = drain(subdivision.refined_on_subdivision(None, found, None, None, "free", None, first))
        yield done.warnings, ["first", *told]


# ---- regions -----------------------------------------------------------------------------------------------------


@says("pipelines/magnify.py", "The region has {} % of the texture")
@says("pipelines/magnify.py", "The region went from")
def missed(patch):
    went = "The region went from 10 % to {:.4g} % of the texture (40 % asked)"
    for after, told in ((0.4 * 1.0049, False), (0.4 * 1.0051, True), (0.4 * 0.9951, False), (0.4 * 0.9949, True)):
        shares = magnify.Shares(0.1, 0.4, after, 6.0)
        text = f"The region has {100 * after:.4g} % of the texture instead of 40 %"
        yield shares.warnings(), [text] if told else []
        yield [shares.text()], [went.format(100 * after)]


@says("pipelines/regions/several.py", "{} has {} % of the texture")
@says("pipelines/regions/several.py", "{} from {} % to {} %")
@says("pipelines/regions/several.py", "Of the texture, {}")
@says("pipelines/regions/several.py", "{} % to {} %")
def several_missed(patch):
    for after, told in (
        ([0.4 * 1.0049, 0.3 * 0.9951], []),
        ([0.4 * 1.0051, 0.3], ["eyes has 40.2 % of the texture instead of 40 %"]),
        ([0.4, 0.3 * 0.9949], ["mouth has 29.85 % of the texture instead of 30 %"]),
    ):
        shares = several.JointShares(("eyes", "mouth"), np.array([0.1, 0.2]), np.array([0.4, 0.3]), np.array(after))
        yield shares.warnings(), told
        one, other = (f"{100 * share:.4g} %" for share in after)
        rows = f"eyes from 10 % to {one} (40 % asked), mouth from 20 % to {other} (30 % asked)"
        yield [shares.text()], [f"Of the texture, {rows}"]
        said = [f"10.000 % to {100 * after[0]:.3f} %", f"20.000 % to {100 * after[1]:.3f} %"]
        yield [text for _, text in shares.said()], said


@says("pipelines/magnify.py", "{} as before")
def painted_all_over(patch):
    texts = (
        [],
        ["An island is painted all over, and stays as before"],
        ["2 islands are painted all over, and stay as before"],
    )
    for count in (0, 1, 2):
        weights = [np.full(2, 0.5)] * count + [np.zeros(2), np.array([0, 0.5])]
        islands = [SimpleNamespace(uv=w) for w in weights]
        patch.setattr(magnify, "islands_of", lambda *_, islands=islands: SimpleNamespace(warnings=[], islands=islands))
        patch.setattr(magnify, "_weights_of", lambda region, island: island.uv)
        found, warnings = magnify._islands([None])
        assert len(found) == 1
        yield spoken(warnings), texts[count]


# ---- globes and new meshes ---------------------------------------------------------------------------------------


@says("pipelines/globe.py", "{} within a face, which is stretched")
@says("pipelines/globe.py", "{} folded over near a pole")
def poles(patch):
    how = "subdivide the mesh, or turn the globe"
    within = [], ["A pole of the projection lies"], ["2 poles of the projection lie"]
    over = [], ["A face is"], ["2 faces are"]
    for missed in range(3):
        for folds in range(3):
            told = [f"{who} within a face, which is stretched there; {how}" for who in within[missed]]
            told += [f"{who} folded over near a pole of the projection; {how}" for who in over[folds]]
            yield globe._pole_warnings(missed, folds), told


@says("pipelines/globe.py", "{} closed parts; every one")
def several_globes(patch):
    made = [SimpleNamespace(corners=np.zeros(1, int), uv=np.zeros((1, 2)), warnings=[]) for _ in range(3)]
    for groups in ([1], [2], [1, 2]):
        first = np.cumsum([0, *groups])
        mine = [made[a:b] for a, b in itertools.pairwise(first)]
        patch.setattr(globe, "_globes", lambda job, settings: worked(job))
        patch.setattr(globe, "in_turn", lambda steps: worked([drain(s) for s in steps]))
        count = sum(groups)
        told = [f"{count} closed parts; every one has the whole texture to itself"] if count > 1 else []
        yield spoken(drain(globe.project(mine, SimpleNamespace(inside=False))).warnings), told


@says("pipelines/remesh.py", "turned over in the new mesh")
@says("pipelines/remesh.py", "sides stay as they are")
@says("pipelines/remesh.py", " joined the wrong way round")
def looking_back(patch):
    V, F = meshes.icosphere(1)
    for rows, who in (
        ((), ""), ((3,), "A face looks to another side than its neighbours"), ((3, 50), "2 faces look to another side"),
    ):  # fmt: skip
        G = F.copy()
        G[list(rows)] = G[list(rows)][:, ::-1]
        yield remesh.oriented(triangle_surface(V, G)).warnings, [f"{who}; turned over in the new mesh"] if rows else []
    W, G = hourglass(10, 16)
    above = W[G][:, :, 2].mean(axis=1) > 0
    G[above] = G[above][:, ::-1]
    # Either half may be the one that is turned back.
    odd = (
        f"{above.sum()} faces are joined the wrong way round to others that look outwards, too; sides stay as they are"
    )
    assert above.sum() == len(G) / 2
    yield remesh.oriented(triangle_surface(W, G)).warnings, [odd]


@says("pipelines/remesh.py", "{} too small for triangles")
def too_small(patch):
    V, F = meshes.grid(4, 4)
    one = "1 region is too small for triangles of this size and not kept apart"
    two = "2 regions between features are too small for triangles of this size and not kept apart"
    surface = triangle_surface(V, F)
    for count, told in ((0, []), (1, [one]), (2, [two])):
        patch.setattr(remesh, "resolved_features", lambda p, t, f, size, count=count: (f[count:], count))
        lines = np.array([[0, 1], [1, 2], [2, 3]])
        job = remesh.RemeshJob(surface, lines, lines[:0], None)
        kept, texts = remesh._features(job, F, None, 20)
        assert len(kept) == 3 - count
        yield texts, told
        assert remesh._features(remesh.RemeshJob(surface, lines[:0], lines[:0], None), F, None, 20)[1] == ()


@says("pipelines/remesh.py", "{} through others, as none does")
def passing_through(patch):
    V = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, -1], [2, 1, -1], [1, 1, 1]], float)
    one, apart = np.array([[0, 1, 2], [3, 4, 5]]), np.array([[0, 1, 2]])
    words = "2 faces of the new mesh pass through others, as none does in the old one: "
    told = [words + "parts are thinner than the new triangles. Ask for more"]
    for new, old, texts in ((one, apart, told), (one, one, []), (apart, apart, []), (apart, one, [])):
        yield remesh._crossings(V, new, V, old), texts


def test_faces_that_reach_across_a_seam_are_counted():
    """Of every level, with its name where there are several."""
    V, F = meshes.bumpy(6, 6)
    job = remesh.RemeshJob(triangle_surface(V, F), np.zeros((0, 2), int), np.zeros((0, 2), int), None)
    for levels in (1, 2):
        with pytest.MonkeyPatch.context() as patch:
            reached = iter([0, 3] if levels == 2 else [1])

            def level(*given, reached=reached, true=remesh._level):
                found = yield from true(*given)
                return layout.replace(
                    found, correspondence=layout.replace(found.correspondence, extended=next(reached))
                )

            patch.setattr(remesh, "_level", level)
            found = drain(remesh.remesh_series(job, RemeshSettings(count=40, levels=levels, ratio=0.5)))
        how = "across a seam; UVs are continued there"
        assert found.warnings == ([f"LOD1: 3 faces reach {how}"] if levels == 2 else [f"A face reaches {how}"])


# ---- shapes ------------------------------------------------------------------------------------------------------


@says("pipelines/shapes/match.py", "{} of the {} went along")
def smaller_parts(patch):
    V, F = blob(1)
    job, found = matched()
    patch.setattr(match, "register", lambda *_: worked(found.found))
    for counts, told in (
        ((0, 0), []), ((1, 0), ["1 smaller part of the source went along with the largest"]),
        ((0, 2), ["2 smaller parts of the target went along with the largest"]),
    ):  # fmt: skip
        parts = [[(0.2 * V + [3 + k, 0, 0], F) for k in range(count)] for count in counts]
        surfaces = [triangle_surface(*together((V, F), *rest)) for rest in parts]
        yield (
            drain(
                match.match_surfaces(match.MatchJob(*surfaces, job.pairs, job.options, surfaces[0].seams[:0]))
            ).warnings,
            told,
        )


@functools.cache
def matched():
    """A body and itself, by four landmarks: the job, and the match."""
    V, F = blob(1)
    points = tuple(LandmarkPoint(str(k), vertex=k) for k in (0, 7, 20, 33))
    surface = triangle_surface(V, F)
    job = match.MatchJob(surface, surface, Pairs(points, points), RegistrationOptions(polish=False), surface.seams[:0])
    return job, drain(match.match_surfaces(job))


@says("pipelines/shapes/wrap.py", "{} through one another")
def through_one_another(patch):
    job, found = matched()
    who = [], ["A pair of faces of the wrapped source passes"], ["2 pairs of faces of the wrapped source pass"]
    patch.setattr(wrap, "match_surfaces", lambda job: worked(found))
    for count in range(3):
        pairs = np.zeros((count, 2), int)
        patch.setattr(wrap, "without_new_intersections", lambda before, after, *_, pairs=pairs: (after, pairs))
        patch.setattr(wrap, "smoothed_apart", lambda before, at, *_, pairs=pairs: (at, pairs))
        done = drain(wrap.wrap_surfaces(job))
        assert done.intersections == count
        yield done.warnings, [f"{text} through one another" for text in who[count]]


@says("pipelines/shapes/partition.py", "Every separate part has whole cells")
def unequal(patch):
    text = "Every separate part has whole cells, so that cells of different parts differ by up to"
    for more, residual, told in (
        (1.0e-6, 1e-4, []), (1.1e-6, 0.0, [f"{text} 0.00011 %"]), (0.0999, 1e-4, [f"{text} 10 %"]),
        (0.256, 0.0, [f"{text} 26 %"]),
        (0.0123, 0.0, [f"{text} 1.2 %"]),
    ):  # fmt: skip
        division = SimpleNamespace(unequal=residual + more if told == [] else more, residual=residual)
        none = SimpleNamespace(empty=np.zeros(0, int), torn=np.zeros(0, int))
        for write in ("mesh", "points", "attribute"):
            yield partition._warnings(division, none, none.torn, partition.PartitionSettings(write=write)), told


@says("pipelines/shapes/partition.py", "{} without a face")
@says("pipelines/shapes/partition.py", "{} in several pieces")
@says("pipelines/shapes/partition.py", "{} ({}) {}")
def cells_told(patch):
    calm, how = (
        SimpleNamespace(unequal=0.0, residual=0.0),
        "being smaller than one; cut the mesh, or ask for fewer cells",
    )
    for empty, torn, told in (
        ([], [], []),
        ([4], [1, 2], [f"1 cell (4) is without a face, {how}", "2 cells (1, 2) are in several pieces"]),
        (list(range(7)), [], [f"7 cells (0, 1, 2, 3, 4, ...) are without a face, {how}"]),
    ):
        whole = SimpleNamespace(empty=np.array(empty, int), torn=np.array(torn, int))
        of_mesh = np.array(torn[:1], int)
        yield partition._warnings(calm, whole, of_mesh, partition.PartitionSettings(write="attribute")), told
        yield partition._warnings(calm, whole, of_mesh, partition.PartitionSettings(write="points")), []
        asked = ["1 cell (1) is in several pieces"] if torn else []
        yield partition._warnings(calm, whole, of_mesh, partition.PartitionSettings(write="mesh")), asked
