"""Pack islands into the unit square, as large as a search for the scale and the order finds them to fit.

One scale for all, a margin in pixels that is kept exactly, no island mirrored, and none turned but by quarters. Half of
the margin lies between islands and the border: tiles side by side have it whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import MarginError
from ..progress import Progress, Steps, part_of
from .crumbs import Gathered, gathered
from .outline_raster import IslandOutline, grown_cells, island_areas, outlines_of
from .placement import Item, Place, place, turned_masks
from .raster_grid import RasterGrid
from .shelves import Block, blocks_of

# Cells along a side of the raster on which a scale is looked for, ...
COARSE = 256
# ... and of the one on which the islands are placed in the end, ...
FINE = 512
# ... at a scale that is greater by this factor at most: what half a cell around every island was worth.
FINER = 1.1
# What is placed on the raster, at most: of more islands the smallest go into blocks, which are placed as one.
MOST_ITEMS = 128
# Of these so many are blocks.
BLOCKS = 64
# Islands with less than this share of the area of all may be turned by quarters, but never upside down; larger ones are
# the picture.
SMALL = 0.2
QUARTERS = (0, 1, 3)
ANY_SIDE = (0, 1, 2, 3)
# The first scale fills this share of the square; then come smaller ones until one fits, by this factor first, and then
# by one that is smaller every time.
FIRST_SHARE = 0.75
SMALLER = 0.95
HASTE = 0.99
# An order has room at larger scales by this factor, by its root where it has not, and so on, down to the other. By that
# one scales are larger that other orders are tried at; what these have room for is tried at first by the third, and by
# its square while it has.
LARGER = 1.04
EXACT = 1.004
LITTLE_LARGER = 1.006
# A scale this much below the first one that was tried is none: the margins fill the square.
LEAST_SCALE = 1e-3
# Orders that are tried at a scale, at least, and of few items as many as take about so many places: what found no room
# comes first in the second and the third; others are by sizes that chance has changed by about this much, as a
# logarithm.
ORDERS = 8
PLACES_TRIED = 100
STUCK_FIRST = 2
CHANCE = 0.15
# Of so many items or more, which take longer, only the first of them are, and those if this share of all cells found a
# place before.
MANY_ITEMS = 100
HOPEFUL = 0.8
# Masks of so many cells are kept with their turns.
SMALL_MASK = 4096
# Boxes of islands that go into blocks are so much apart, in cells, at least.
APART = 1e-6
# Coordinates beyond 2 to this power, or its inverse, are scaled before they are squared.
MOST_EXPONENT = 400


@dataclass(frozen=True)
class Packing:
    """Islands (n_i,2) in the unit square, `scale` from input to UV length, the packer's name, used area share."""

    islands: list[np.ndarray]
    scale: float
    packer: str
    coverage: float


@dataclass(frozen=True)
class _PackTask:
    """Outlines of islands, their triangles' area, which of them may lie on any side, and what the square is: pixels,
    margin, and outlines that stay; and small masks that were turned."""

    outlines: list[IslandOutline]
    areas: np.ndarray
    low: np.ndarray
    sizes: np.ndarray
    any_side: np.ndarray
    margin: float
    texture_size: int
    raster: int
    staying: list[IslandOutline]
    small: dict[tuple, Item] = field(default_factory=dict)

    @property
    def cells_per_pixel(self) -> float:
        """Cells of the raster per pixel."""
        return self.raster / self.texture_size

    @property
    def growth(self) -> float:
        """Half of the margin, in cells."""
        return 0.5 * self.margin * self.cells_per_pixel

    def item(self, mask: np.ndarray, quarters: tuple[int, ...]) -> Item:
        """A mask (h,w) bool in its turns. At most scales small islands have the same mask, and many are alike."""
        if mask.size > SMALL_MASK:
            return turned_masks(mask, quarters)
        name = mask.shape, quarters, mask.tobytes()
        if name not in self.small:
            self.small[name] = turned_masks(mask, quarters)
        return self.small[name]


@dataclass(frozen=True)
class _Raster:
    """Items at a scale in cells per length: single islands with the lower left cell of each, then blocks."""

    items: list[Item]
    single: np.ndarray
    corners: np.ndarray
    blocks: list[Block]


@dataclass(frozen=True)
class _Found:
    """Places of the items of a raster at a scale, and the order in which they were found."""

    task: _PackTask
    scale: float
    raster: _Raster
    places: list[Place]
    order: list[int]


def pack(
    islands: Sequence[np.ndarray],
    triangles: Sequence[np.ndarray],
    margin: float = 4,
    texture_size: int = 1024,
    around: Sequence[tuple[np.ndarray, np.ndarray]] = (),
    roughly: bool = False,
    any_side: np.ndarray | None = None,
) -> Steps[Packing]:
    """Place islands in the unit square without overlap, all scaled by the same factor.

    A single island is centred and never turned.

    Parameters
    ----------
    islands : (n_i,2) positions in one common unit of length
    triangles : (m_i,3) vertex indices; vertices that none uses come to lie in the middle of their island
    margin : least distance between islands, in pixels, half of which is left to the border
    texture_size : pixels along a side of the unit square
    around : points (n,2) and triangles (m,3), of islands that stay in the unit square as they are
    roughly : on the coarse raster alone, in half of the time, to be compared with another packing
    any_side : (k,) bool, islands that may lie on any side, none by default

    Raises
    ------
    MarginError : the margins alone fill the texture
    """
    if margin >= texture_size:
        raise MarginError(f"A margin of {margin:g} pixels fills a texture of {texture_size} pixels")
    # What no triangle uses, as the centres of filled holes, is not placed.
    used = list(map(np.unique, triangles))
    points = [p[u] for p, u in zip(islands, used, strict=True)]
    faces = [np.searchsorted(u, t) for u, t in zip(used, triangles, strict=True)]
    # Squares of sizes beyond these are no numbers; a power of two changes no digit.
    exponent = int(np.frexp(max(np.abs(p).max(initial=0.0) for p in points))[1])
    exponent = exponent if abs(exponent) > MOST_EXPONENT else 0
    points = [np.ldexp(p, -exponent) for p in points] if exponent else points
    heaped = gathered(points, faces, margin, texture_size)
    if len(heaped.points) == 1 and not len(around):
        placed, scale = _alone(points[0], (texture_size - margin) / texture_size)
    else:
        free = np.zeros(len(islands), dtype=bool) if any_side is None else any_side
        task = _task(heaped, heaped.kept(free), margin, texture_size, around)
        found = yield from _search(task, roughly)
        placed, scale = _filled(_placed(heaped.points, found), found.task, found.scale)
    placed = heaped.apart(placed)
    whole = [_spread(p, u, len(i)) for p, u, i in zip(placed, used, islands, strict=True)]
    return Packing(whole, float(np.ldexp(scale, -exponent)), "raster", covered_area(placed, faces))


def stack(islands: Sequence[np.ndarray]) -> Packing:
    """Islands centred one upon the other, all at the scale at which the largest fits the unit square."""
    size = max(float(np.ptp(p, axis=0).max()) for p in islands)
    centred = [(p - 0.5 * (p.min(axis=0) + p.max(axis=0))) / size + 0.5 for p in islands]
    return Packing([np.clip(p, 0, 1) for p in centred], 1 / size, "none", float("nan"))


def covered_area(islands: Sequence[np.ndarray], triangles: Sequence[np.ndarray]) -> float:
    """Share of the unit square that islands (n_i,2) without overlap cover."""
    return float(island_areas(islands, triangles).sum())


def _spread(points: np.ndarray, rows: np.ndarray, count: int) -> np.ndarray:
    """Points (k,2) in rows (k,) of (count,2), and their middle in all others."""
    if len(rows) == count:
        return points
    result = np.tile(points.mean(axis=0), (count, 1))
    result[rows] = points
    return result


def _alone(points: np.ndarray, width: float) -> tuple[list[np.ndarray], float]:
    """One island (n,2) in the middle of the unit square, as large as a square of this width allows, and its scale."""
    low, high = points.min(axis=0), points.max(axis=0)
    scale = width / float((high - low).max())
    return [(points - 0.5 * (low + high)) * scale + 0.5], scale


def _task(islands: Gathered, any_side: np.ndarray, margin: float, texture_size: int, around) -> _PackTask:
    points, faces = islands.points, islands.triangles
    low = np.array([p.min(axis=0) for p in points])
    staying = outlines_of([p * COARSE for p, _ in around], [t for _, t in around])
    return _PackTask(
        outlines=outlines_of(points, faces),
        areas=island_areas(points, faces),
        low=low,
        sizes=np.array([p.max(axis=0) for p in points]) - low,
        any_side=any_side,
        margin=margin,
        texture_size=texture_size,
        raster=COARSE,
        staying=staying,
    )


def _search(task: _PackTask, roughly: bool = False) -> Steps[_Found]:
    """The largest scale that is found to fit on a coarse raster, and from there, unless roughly, on a finer one."""
    found = yield from part_of(_first(task), 0.0, 0.2)
    found = yield from part_of(_larger(found, np.inf), 0.2, 0.3)
    if roughly:
        return found
    finer = replace(task, raster=FINE, staying=[s.scaled(FINE / COARSE, np.zeros(2)) for s in task.staying])
    start = replace(found, task=finer, scale=found.scale * FINE / COARSE)
    better = yield from part_of(_larger(start, FINER), 0.5, 0.5)
    return found if better is start else better


def _first(task: _PackTask) -> Steps[_Found]:
    """Any scale that fits: smaller ones are tried until one does.

    Raises
    ------
    MarginError : none does
    """
    free = task.raster**2 - int(_grid(task, 0).taken.sum())
    longest = float(task.sizes.min(axis=1).max())
    start = min(np.sqrt(free / task.areas.sum()), (task.raster - 2 * task.growth) / longest)
    order: list[int] = []
    scale = start * np.sqrt(FIRST_SHARE)
    step = SMALLER
    while scale >= LEAST_SCALE * start:
        yield Progress("Packing", 0.0)
        found, order = _fit(task, scale, order, STUCK_FIRST + 1)
        if found is not None:
            return found
        scale *= step
        step *= HASTE
    raise MarginError(f"No room for {len(task.outlines)} islands with a margin of {task.margin:g} pixels")


def _larger(found: _Found, most: float) -> Steps[_Found]:
    """Larger scales than one that fits, by a factor of `most` at most: as large as its order has room for, then as
    large as others have that fit where it does not, until none of them does.

    What is found is on the raster of the task of `found`, if anything is: otherwise it is what was given.
    """
    task, order, limit, best, others = found.task, found.order, most * found.scale, found, 0
    orders = max(ORDERS, PLACES_TRIED // len(order))
    while EXACT * best.scale <= limit:
        # What has no room for one order by much, has seldom for another: small steps first, that grow.
        step = min(LARGER if not others else LITTLE_LARGER, limit / best.scale)
        while step > EXACT:
            yield Progress("Packing", others / (others + 1))
            new, order = _fit(task, step * best.scale, order, 1)
            if new is None:
                step = np.sqrt(step)
            else:
                best, order, step = new, new.order, step**2 if others else step
            step = min(step, LARGER, limit / best.scale)
        yield Progress("Packing", others / (others + 1))
        scale = EXACT * best.scale
        new, order = (None, order) if scale > limit else _fit(task, scale, order, orders)
        if new is None:
            break
        best, order, others = new, new.order, others + 1
    return best


def _fit(task: _PackTask, scale: float, order: list[int], orders: int) -> tuple[_Found | None, list[int]]:
    """The items placed at a scale, if one of so many orders finds them a place; and the one to begin with next time."""
    raster = _rasterised(task, scale)
    sizes = np.array([item.turns[0].mask.size for item in raster.items], dtype=float)
    if len(order) != len(raster.items):
        order = np.argsort(-sizes, kind="stable").tolist()
    widest = max(item.widest for item in raster.items)
    cells = np.array([item.cells for item in raster.items])
    if cells.sum() > task.raster**2 or widest > task.raster:
        return None, order
    # The same draws at every scale: what has fitted at one is tried at the next.
    rng, tried, many = np.random.default_rng(0), order, len(cells) >= MANY_ITEMS
    empty, failed = _grid(task, widest), dict[tuple[int, ...], int]()
    for k in range(min(orders, STUCK_FIRST + 1) if many else orders):
        # Of few items chance has the same orders again.
        if tuple(tried) not in failed:
            places, failed[tuple(tried)] = place(raster.items, tried, empty.copy())
            if places:
                return _Found(task, scale, raster, places, tried), tried
        stuck = failed[tuple(tried)]
        hopeless = many and cells[tried[: tried.index(stuck)]].sum() < HOPEFUL * cells.sum()
        if k < STUCK_FIRST:
            tried = [stuck, *(item for item in tried if item != stuck)]
        else:
            tried = np.argsort(-sizes * np.exp(CHANCE * rng.normal(size=len(sizes))), kind="stable").tolist()
        if hopeless:
            break
    return None, tried if many else order


def _grid(task: _PackTask, widest: int) -> RasterGrid:
    """An empty raster but for the islands that stay."""
    grid = RasterGrid(task.raster, widest + 8)
    for cells, low in grown_cells(task.staying, task.growth):
        first = np.maximum(low, 0)
        last = np.minimum(low + cells.shape[::-1], task.raster)
        if (last > first).all():
            rows, columns = (slice(a, b) for a, b in zip((first - low)[::-1], (last - low)[::-1], strict=True))
            grid.take(cells[rows, columns], int(first[0]), int(first[1]))
    return grid


def _rasterised(task: _PackTask, scale: float) -> _Raster:
    """What is to be placed, at so many cells per length."""
    count = len(task.outlines)
    largest = np.argsort(-task.sizes.prod(axis=1), kind="stable")
    single = largest if count <= MOST_ITEMS else largest[: MOST_ITEMS - BLOCKS]
    turnable = task.areas < SMALL * task.areas.sum()
    scaled = [task.outlines[number].scaled(scale, scale * task.low[number]) for number in single.tolist()]
    grown = grown_cells(scaled, task.growth)
    ways = zip(task.any_side, turnable, strict=True)
    turns = [ANY_SIDE if any_side else QUARTERS if small else (0,) for any_side, small in ways]
    items = [task.item(cells, turns[k]) for k, (cells, _) in zip(single, grown, strict=True)]
    corners = np.array([low for _, low in grown], dtype=float)
    blocks = []
    if count > len(single):
        rest = largest[len(single) :]
        boxes = task.sizes[rest] * scale + 2 * task.growth + APART
        blocks = [Block(rest[b.members], b.corners, b.size) for b in blocks_of(boxes, BLOCKS)]
        items += [task.item(np.ones(np.ceil(b.size[::-1]).astype(int), dtype=bool), (0,)) for b in blocks]
    return _Raster(items, single, corners, blocks)


def _placed(points: list[np.ndarray], found: _Found) -> list[np.ndarray]:
    """Islands (n_i,2) in the unit square, where the items were placed."""
    placed, task = list(points), found.task
    raster, unit = found.raster, 1 / (task.cells_per_pixel * task.texture_size)

    def put(number: int, corner: np.ndarray) -> None:
        placed[number] = corner * unit

    for k, number in enumerate(raster.single.tolist()):
        where = found.places[k]
        upright = raster.items[k].turns[0].mask.shape
        inside = (points[number] - task.low[number]) * found.scale - raster.corners[k]
        put(number, _turned(inside, upright[::-1], where.quarters) + [where.x, where.y])
    for block, where in zip(raster.blocks, found.places[len(raster.single) :], strict=True):
        corners = block.corners + [where.x, where.y] + task.growth
        for number, corner in zip(block.members.tolist(), corners, strict=True):
            put(number, (points[number] - task.low[number]) * found.scale + corner)
    return placed


def _turned(points: np.ndarray, size: Sequence[int], quarters: int) -> np.ndarray:
    """Points (n,2) in a box of a size (2,), turned with it counterclockwise, its lower left corner at the origin."""
    width, height = size
    for _ in range(quarters):
        points = np.stack([height - points[:, 1], points[:, 0]], axis=1)
        width, height = height, width
    return points


def _filled(placed: list[np.ndarray], task: _PackTask, scale: float) -> tuple[list[np.ndarray], float]:
    """Islands enlarged together until half of the margin is left to the border, unless others stay, and their scale."""
    unit = 1 / (task.cells_per_pixel * task.texture_size)
    if task.staying:
        return placed, scale * unit
    low = np.min([p.min(axis=0) for p in placed], axis=0)
    high = np.max([p.max(axis=0) for p in placed], axis=0)
    border = 0.5 * task.margin / task.texture_size
    more = (1 - 2 * border) / float((high - low).max())
    return [(p - low) * more + border for p in placed], scale * unit * more
