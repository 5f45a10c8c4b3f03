"""Cuts that turn every part of a surface into a disk, short and where they are least seen.

Boundaries are joined by shortest paths, handles are opened along short loops, and a surface that has to be cut
anyway is cut to the extremities that would be distorted most, or, where its sides are flat, to a net.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ..mesh.geometry import face_areas
from ..mesh.gluing import Gluing, components, corner_classes, groups, orientations, turn_over
from ..mesh.repair import Repaired, coincident_boundary_vertices, repaired_gluing
from ..mesh.surface import Surface, chosen_triangles, is_seam, is_sharp
from ..mesh.topology import pair_keys
from .component import NOISE, SEAM, SHARP, Kind, Piece, classify, edge_graph, fingerprint, make_piece, rim_loops
from .cut_graph import greedy_arcs, path_to, shorten
from .developable_nets import is_long, net
from .handle_partition import parting_pairs
from .hole_filling import MANY, fill_holes
from .protrusions import log_scale, spread
from .steiner_points import MOST_ENDS, meeting_points

MOST_EXTREMITIES = 8
# A further cut does not pay where the lengths of a flat map are predicted to be off by a factor of e^0.5 at most,
# in the mean square over the surface.
BEARABLE = 0.5**2
ROOT_TRIALS = 4
# A net may be so many times as long as another cut, and as long as `nets.is_long` says anyway.
LONGER = 1.5


@dataclass(frozen=True)
class PieceCut:
    """How one part was opened: triangles, boundaries, handles (crosscaps where one_sided), cut length, and the
    vertices of the surface (k,) that it was opened through."""

    triangles: int
    boundaries: int
    handles: int
    one_sided: bool
    length: float
    extremities: np.ndarray


@dataclass(frozen=True)
class Cuts:
    """Edges (k,2) of the surface to add to its seams, their length, and the parts that were opened.

    torn (t,2): edges where more than two faces meet, which no map can join, among the edges.
    """

    edges: np.ndarray
    length: float
    pieces: tuple[PieceCut, ...]
    torn: np.ndarray
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Opened:
    """The surface and its sheets, cut into disks and all looking to the same side, and the cuts.

    Surface and sheets are those given, or with the triangles that fill holes; extent: size of a box around them.
    """

    surface: Surface
    gluing: Gluing
    cuts: Cuts
    extent: float


def cut(
    surface: Surface,
    faces: np.ndarray | None = None,
    *,
    avoid: np.ndarray | None = None,
    fill: bool = False,
    sieve: int | None = MANY,
    extremities: int = MOST_EXTREMITIES,
) -> Cuts:
    """Edges to mark as seams so that every part of the polygons `faces` (f,) bool is a disk; disks are left alone.

    Parameters
    ----------
    avoid : (n,) in [0,1], vertices to keep free of seams
    fill : take holes for filled, all boundaries but the longest of every part
    sieve : without `fill`, take holes for filled where a part has more than so many, and take parts with many handles
        apart, see `apart.parting_pairs`; None: nowhere
    extremities : tips that a surface is opened through, at most, where it has no net

    Raises
    ------
    EmptyMeshError, NonFiniteError : see `charts.strict_charts`; everything else is repaired and said in the warnings
    """
    faces, triangles, owner = chosen_triangles(surface, faces)
    repaired = repaired_gluing(surface, faces, triangles, owner)
    return open_sheets(surface, repaired, avoid=avoid, fill=fill, sieve=sieve, extremities=extremities).cuts


def open_sheets(
    surface: Surface,
    repaired: Repaired,
    *,
    avoid: np.ndarray | None = None,
    fill: bool = False,
    sieve: int | None = None,
    extremities: int = MOST_EXTREMITIES,
) -> Opened:
    """Repaired sheets cut into disks; see `cut`."""
    vertex_count = len(surface.positions)
    positions, unit = _in_unit_box(surface, repaired.gluing)
    gluing, one_sided = _looking_out(repaired.gluing, positions)
    # What has one side only is not told to look to the other.
    turned = gluing.triangles[:, 1] != repaired.gluing.triangles[:, 1]
    gone = np.zeros(len(gluing.first), dtype=bool)
    if sieve is not None:
        gone = parting_pairs(gluing, positions, one_sided)
    gluing, parting = gluing.without(gone), np.stack(gluing.ends(gluing.first[gone]), axis=1)
    apart = positions[parting[:, 0]] - positions[parting[:, 1]]
    holes, sieves = 0, not fill
    if fill or sieve is not None:
        filled = fill_holes(surface, gluing, one_sided, None if fill else sieve)
        surface, gluing, holes = filled.surface, filled.gluing, filled.holes
        one_sided = np.append(one_sided, np.zeros(len(gluing.triangles) - len(one_sided), dtype=bool))
        positions, unit = _in_unit_box(surface, gluing)
    weight = np.ones(len(positions))
    weight[:vertex_count] = 0
    if avoid is not None:
        weight[:vertex_count] = np.clip(np.asarray(avoid, float), 0, 1)
    gone, report, touching = _cut_parts(surface, gluing, one_sided, positions, unit, weight, extremities, sieves)
    edges = np.stack(gluing.ends(gluing.first[gone]), axis=1)
    edges = edges[(edges < vertex_count).all(axis=1)]
    # Parts that could not be oriented can be, now that they are open.
    gluing, _ = _looking_out(gluing.without(gone), positions)
    length = sum(p.length for p in report) + unit * float(np.linalg.norm(apart, axis=1).sum())
    edges = np.concatenate([edges, parting, repaired.torn]).astype(np.int64)
    backwards = len(np.unique(repaired.gluing.owner[turned]))
    warnings = (*repaired.warnings, *_said(len(parting), backwards, holes * sieves, touching))
    return Opened(surface, gluing, Cuts(edges, length, tuple(report), repaired.torn, warnings), unit)


def sieved(holes: int) -> str:
    """The warning that so many holes of sieves are filled."""
    return f"{holes} holes are filled for the map: cuts to them would leave it no shape"


def _said(parting: int, backwards: int, holes: int, touching: int) -> Iterator[str]:
    """Warnings, from the numbers of edges a part came apart at, faces turned over, holes of sieves, and doubles."""
    if parting:
        yield "A part with many handles was taken apart, along the hard edges of its holes or into fragments"
    if backwards:
        yield _turned_faces(backwards)
    if holes:
        yield sieved(holes)
    if touching:
        yield f"{touching} boundary vertices lie on one another; Merge by Distance joins the parts there"


def _cut_parts(
    surface, gluing, one_sided, positions, unit, weight, extremities, sieves
) -> tuple[np.ndarray, list[PieceCut], int]:
    """Pairs (p,) bool to cut so that every part is a disk, what was done to those that were none, and how many
    vertices a weld would join.

    sieves : what has been filled are sieves, which are cut to extremities as closed parts are, disks too
    """
    part, corner_class = components(gluing), corner_classes(gluing)
    kind = classify(gluing, corner_class, part, one_sided)
    ease = ease_of_cuts(surface, gluing)
    gone = np.zeros(len(gluing.first), dtype=bool)
    members = groups(part)
    order, start = _by_part(part[gluing.first // 3], len(members))
    report = []
    # A mesh may hold the same part many times: rivets, teeth, leaves.
    known: dict[tuple[bytes, ...], tuple[np.ndarray, np.ndarray]] = {}
    patched = np.zeros(len(members), dtype=bool)
    patched[part[gluing.owner < 0]] = True
    for k in np.flatnonzero(~kind.is_disk | (patched & sieves)):
        mine = order[start[k] : start[k + 1]]
        piece = make_piece(gluing, positions, corner_class, members[k], mine, weight, ease)
        name = fingerprint(piece)
        if name not in known:
            known[name] = _best_cut(piece, kind, k, extremities, bool(patched[k]) and not sieves)
        chosen, tips = known[name]
        gone[piece.sheet_pair[chosen]] = True
        length = float(piece.length[chosen].sum()) * unit
        figures = int(kind.boundaries[k]), int(kind.handles[k]), bool(kind.one_sided[k])
        report.append(PieceCut(len(piece.triangles), *figures, length, piece.vertex_ids[tips]))
    return gone, report, coincident_boundary_vertices(surface, gluing, part, kind.is_disk)


def _best_cut(piece: Piece, kind: Kind, k: int, extremities: int, filled: bool) -> tuple[np.ndarray, np.ndarray]:
    """The net of the piece, if it has one that is not much longer than other cuts; else those."""
    unrolled = net(piece) if extremities and not filled else None
    if unrolled is not None and not is_long(piece, unrolled[0]):
        return unrolled
    other = open_piece(piece, kind, k, extremities)
    if unrolled is not None and piece.length[unrolled[0]].sum() <= LONGER * piece.length[other[0]].sum():
        return unrolled
    return other


def ease_of_cuts(surface: Surface, gluing: Gluing) -> np.ndarray:
    """Factor (p,) on the cost of cutting each pair: less where the artist marked a seam or a sharp edge.

    What cannot be oriented is rather opened where its faces look to opposite sides: then none has to be turned over.
    """
    key = pair_keys(*gluing.ends(gluing.first))
    ease = np.where(is_sharp(surface, key) | gluing.parallel(), SHARP, 1.0)
    ease[is_seam(surface, key)] = SEAM
    return ease


def _turned_faces(count: int) -> str:
    who = "A face looks" if count == 1 else f"{count} faces look"
    return (
        f"{who} to the other side than the faces around; mapped with them, so that the texture is mirrored there. "
        "Use Mesh > Normals > Recalculate Outside"
    )


def _by_part(part: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Items in the order of their parts (p,), and where each of the `count` parts begins, (count+1,)."""
    order = np.argsort(part, kind="stable")
    return order, np.searchsorted(part[order], np.arange(count + 1))


def _looking_out(gluing: Gluing, positions: np.ndarray) -> tuple[Gluing, np.ndarray]:
    """Gluing in which neighbours look to the same side, and the triangles (m,) bool of parts where they cannot."""
    area = face_areas(positions, gluing.vertex[gluing.triangles])
    turned, one_sided = orientations(gluing, area)
    return turn_over(gluing, turned), one_sided


def _in_unit_box(surface: Surface, gluing: Gluing) -> tuple[np.ndarray, float]:
    """Positions (n,3) of the surface such that the triangles lie in a unit box, and its size; 0 where unused."""
    used = np.unique(gluing.vertex[gluing.triangles])
    p = surface.positions[used]
    low, high = p.min(axis=0), p.max(axis=0)
    # Halves first: the difference of two huge numbers may be infinite.
    unit = 2 * float((high / 2 - low / 2).max()) or 1.0
    positions = np.zeros(surface.positions.shape)
    positions[used] = p / unit - low / unit
    return positions, unit


def open_piece(piece: Piece, kind: Kind, k: int, extremities: int) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e,) bool that open the piece, of `kind` number k, into a disk, and the tips (t,) that they reach."""
    closed = kind.boundaries[k] == 0
    if closed and kind.handles[k] == 0:
        tips = _first_tips(piece)
    else:
        tips = np.zeros(0, dtype=np.int64)
    if closed and len(tips) == 0:
        chosen = _best_root(piece)
    else:
        chosen = greedy_arcs(piece, tips)
    if kind.handles[k]:
        chosen = shorten(piece, chosen, tips)
    while len(tips) < extremities:
        scale = log_scale(piece, chosen)
        if spread(piece, scale) <= BEARABLE:
            break
        # A tip is worth its cut where much distortion is far from the boundary.
        far = _distance(piece, _cut_vertices(piece, chosen))
        tips = np.append(tips, _peak(scale * far * piece.welcome()))
        path = path_to(piece, _cut_vertices(piece, chosen), tips[-1])
        chosen = shorten(piece, chosen | path, tips, around=path)
    chosen = shorten(piece, chosen, tips)
    if extremities and kind.handles[k] == 0 and 2 < len(tips) + kind.boundaries[k] <= MOST_ENDS:
        chosen = min(chosen, _branching_tree(piece, tips), key=lambda edges: piece.cost[edges].sum())
    return chosen, tips


def _first_tips(piece: Piece) -> np.ndarray:
    """The sharpest extremity of a sphere-like piece and the vertex farthest from it, (2,); (3,) if they are neighbours.

    A slit of a single edge would not open anything.
    """
    scale = log_scale(piece, np.zeros(len(piece.pair), dtype=bool))
    tips = _farthest(piece, np.array([_peak(scale * piece.welcome())]), 1)
    neighbours = (np.sort(piece.ends, axis=1) == np.sort(tips)).all(axis=1).any()
    return _farthest(piece, tips, 1) if neighbours else tips


def _farthest(piece: Piece, points: np.ndarray, more: int) -> np.ndarray:
    """The points (k,) and `more` others, each as far from those before it as the edges go."""
    for _ in range(more):
        points = np.append(points, _peak(_distance(piece, points) * piece.welcome()))
    return points


def _distance(piece: Piece, vertices: np.ndarray) -> np.ndarray:
    """Cost (n,) of the cheapest path from the vertices (k,)."""
    graph = edge_graph(piece, np.arange(len(piece.pair)), piece.ends, piece.count)
    return dijkstra(graph, indices=vertices, min_only=True)


def _peak(value: np.ndarray) -> int:
    """Vertex of the largest value (n,) >= 0; on symmetric models rounding shall not choose between equals."""
    return int(np.argmax(value * (1 + NOISE * np.random.default_rng(0).random(len(value)))))


def _cut_vertices(piece: Piece, chosen: np.ndarray) -> np.ndarray:
    start = piece.on_boundary()
    start[piece.ends[chosen].ravel()] = True
    return np.flatnonzero(start)


def _branching_tree(piece: Piece, tips: np.ndarray) -> np.ndarray:
    """Edges (e,) bool of a short tree that joins the tips (k,) and all boundaries of a piece without handles."""
    ends = [np.array([tip]) for tip in tips] + rim_loops(piece)
    distance = np.array([_distance(piece, end) for end in ends])
    between = np.array([distance[:, end].min(axis=1) for end in ends])
    points = meeting_points(distance, between)
    return shorten(piece, greedy_arcs(piece, np.union1d(tips, points)), tips)


def _best_root(piece: Piece) -> np.ndarray:
    """Shortest of the greedy systems of loops from a few roots, spread evenly: edges (e,) bool."""
    roots = _farthest(piece, np.array([0]), ROOT_TRIALS)[1:]
    systems = [greedy_arcs(piece, np.array([root])) for root in roots]
    return min(systems, key=lambda edges: piece.cost[edges].sum())
