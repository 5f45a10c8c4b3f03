"""The raster under the packer: cells that an island's margin touches, every free place of a mask, blocks of boxes."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.topology import boundary_edges
from omt_uv.solver.packing import outline_raster
from omt_uv.solver.packing.outline_raster import IslandOutline, grown_cells, outlines_of
from omt_uv.solver.packing.placement import BESIDE, place, turned_masks
from omt_uv.solver.packing.raster_grid import RasterGrid, rectangles_of
from omt_uv.solver.packing.shelves import blocks_of


def blob(rng, height, width):
    mask = rng.random((height, width)) < 0.6
    mask[height // 2, width // 2] = True
    return mask


def free_places(grid, mask):
    """The cells at which a mask is free; None where there are none."""
    found = grid.places(rectangles_of(mask).tolist(), *mask.shape)
    return found and np.unpackbits(found.bits, axis=1, count=grid.side - mask.shape[1] + 1).astype(bool)


@pytest.mark.parametrize("growth", [0.0, 0.7, 2.3, 5.0])
def test_cells_are_those_that_the_grown_island_touches(growth):
    V, F = meshes.random_disk(count=120)
    points = V[:, :2] * 17.3 + [3.3, -8.1]
    ((cells, low),) = grown_cells(outlines_of([points], [F]), growth)
    rng = np.random.default_rng(0)
    # Samples of the island, and of a circle of that radius around its outline, all lie in the cells.
    weights = rng.dirichlet(np.ones(3), (len(F), 40))
    inside = np.einsum("mkj,mjd->mkd", weights, points[F]).reshape(-1, 2)
    outline = outlines_of([points], [F])[0]
    t = rng.random((len(outline.tail), 60, 1))
    on_it = (outline.tail[:, None] * (1 - t) + outline.head[:, None] * t).reshape(-1, 2)
    angle = rng.uniform(0, 2 * np.pi, len(on_it))
    around = on_it + growth * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for samples in (inside, around):
        column, row = (np.floor(samples).astype(int) - low).T
        assert cells[row, column].all()
    # No cell is much farther away than that.
    rows, columns = np.nonzero(cells)
    centres = np.stack([columns, rows], axis=1) + low + 0.5
    samples = np.concatenate([inside, on_it])
    nearest = np.array([np.hypot(*(samples - c).T).min() for c in centres])
    assert nearest.max() < growth + np.sqrt(0.5) + 0.2


@pytest.mark.parametrize("growth", [0.0, 1.5])
@pytest.mark.parametrize("most", [300, 10**6])
def test_cells_of_several_islands_are_those_of_each(growth, most, monkeypatch):
    monkeypatch.setattr(outline_raster, "MOST_CELLS", most)
    several = [meshes.random_disk(count=30), meshes.grid(3, 2), meshes.random_disk(count=20)]
    outlines = outlines_of([V[:, :2] * 9 - 2.3 for V, _ in several], [F for _, F in several])
    for (cells, low), outline in zip(grown_cells(outlines, growth), outlines, strict=True):
        ((alone, corner),) = grown_cells([outline], growth)
        assert np.array_equal(cells, alone) and np.array_equal(low, corner)
    assert grown_cells([], growth) == []


def test_a_row_that_rounding_puts_out_of_reach_has_no_cells():
    growth, row = 1.1, 8
    reach = growth + outline_raster.ROUNDING
    height = np.nextafter(row - reach, 0)
    assert np.floor(height + reach) == row and row - height > reach
    line = IslandOutline(np.array([[5.0, height - 3]]), np.array([[9.0, height]]))
    rows = outline_raster._CellRows(np.zeros(1, np.int64), np.array([[20, 50]]), 21 * 50)
    near = rows.near(line, growth).reshape(50, 21)
    assert near[row - 1].any() and not near[row].any()


@pytest.mark.parametrize("seed", range(4))
def test_rectangles_are_the_mask_and_rows_that_are_alike_are_one(seed):
    rng = np.random.default_rng(seed)
    mask = blob(rng, *rng.integers(1, 20, 2))
    found = np.zeros(mask.shape, bool)
    for power, tall, row, column in rectangles_of(mask):
        assert mask[row : row + 2**tall, column : column + 2**power].all()
        found[row : row + 2**tall, column : column + 2**power] = True
    assert np.array_equal(found, mask)
    # Of 2^k cells by 2^k one is enough, and of others two in either direction.
    assert rectangles_of(np.ones((16, 8), bool)).tolist() == [[3, 4, 0, 0]]
    assert len(rectangles_of(np.ones((13, 9), bool))) == 4


def test_outlines_of_several_islands_are_their_own():
    several = [meshes.random_disk(count=30), meshes.grid(3, 2), meshes.random_disk(count=20)]
    points, triangles = [V[:, :2] for V, _ in several], [F for _, F in several]
    for outline, mine, index in zip(outlines_of(points, triangles), points, triangles, strict=True):
        edges = boundary_edges(index)
        assert np.array_equal(outline.tail, mine[edges[:, 0]]) and np.array_equal(outline.head, mine[edges[:, 1]])
    assert outlines_of([], []) == []


@pytest.mark.parametrize("seed", range(4))
def test_cells_beside_a_mask_are_those_a_few_steps_away_in_every_turn(seed):
    rng = np.random.default_rng(seed)
    for turned in turned_masks(blob(rng, *rng.integers(1, 9, 2)), (0, 1, 2, 3)).turns:
        row, column = np.nonzero(turned.mask)
        covered = np.zeros(turned.mask.shape, bool)
        for power, tall, low, left in turned.rectangles:
            covered[low : low + 2**tall, left : left + 2**power] = True
        assert np.array_equal(covered, turned.mask)
        y, x = np.mgrid[-BESIDE : turned.mask.shape[0] + BESIDE, -BESIDE : turned.mask.shape[1] + BESIDE]
        steps = (np.abs(y[..., None] - row) + np.abs(x[..., None] - column)).min(axis=2)
        expected = (steps > 0) & (steps <= BESIDE)
        assert {*map(tuple, turned.beside)} == {*zip(x[expected].tolist(), y[expected].tolist(), strict=True)}
        assert len(turned.beside) == expected.sum()


@pytest.mark.parametrize("seed", range(5))
def test_places_are_all_free_ones_also_after_more_is_taken(seed):
    rng = np.random.default_rng(seed)
    grid, taken = RasterGrid(37, 16), np.zeros((37, 37), bool)
    for _ in range(4):
        mask = blob(rng, *rng.integers(1, 12, 2))
        height, width = mask.shape
        found = free_places(grid, mask)
        expected = np.array(
            [
                [not (taken[y : y + height, x : x + width] & mask).any() for x in range(38 - width)]
                for y in range(38 - height)
            ]
        )
        if found is None:
            assert not expected.any()
            continue
        assert np.array_equal(found, expected)
        y, x = np.argwhere(found)[rng.integers(found.sum())]
        grid.take(mask, int(x), int(y))
        taken[y : y + height, x : x + width] |= mask
        assert np.array_equal(grid.taken, taken)


def test_masks_as_wide_as_the_raster_have_the_places_that_they_have():
    grid, taken = RasterGrid(37, 45), np.zeros((37, 37), bool)
    for y, length in ((0, 37), (1, 36), (2, 33), (3, 5), (3, 31)):
        mask = np.ones((1, length), bool)
        found = free_places(grid, mask)
        expected = [[not row[x : x + length].any() for x in range(38 - length)] for row in taken]
        assert np.array_equal(found, expected)
        x = int(np.flatnonzero(found[y])[-1])
        grid.take(mask, x, y)
        taken[y, x : x + length] = True


def test_a_copy_of_a_raster_is_taken_by_itself():
    grid, mask = RasterGrid(20, 8), np.ones((3, 3), bool)
    other = grid.copy()
    other.take(mask, 4, 5)
    assert other.taken.sum() == 9 and not grid.taken.any()
    for _ in range(2):
        assert not free_places(other, mask)[5, 4] and free_places(grid, mask).all()
    grid.take(mask, 12, 11)
    assert not free_places(grid, mask)[11, 12] and free_places(grid, mask)[5, 4] and free_places(other, mask)[11, 12]


def test_placed_masks_share_no_cell():
    rng = np.random.default_rng(3)
    masks = [blob(rng, *rng.integers(2, 12, 2)) for _ in range(9)]
    items = [turned_masks(mask, (0, 1, 2, 3)) for mask in masks]
    grid = RasterGrid(48, 20)
    places, stuck = place(items, range(9), grid)
    assert stuck == -1 and grid.taken.sum() == sum(mask.sum() for mask in masks)
    places, stuck = place(items, range(9), RasterGrid(12, 20))
    assert places == [] and stuck >= 0


def test_boxes_in_blocks_do_not_overlap():
    rng = np.random.default_rng(0)
    sizes = rng.uniform(0.1, 1, (500, 2))
    blocks = blocks_of(sizes, 7)
    assert len(blocks) <= 7 and np.array_equal(np.sort(np.concatenate([b.members for b in blocks])), np.arange(500))
    for block in blocks:
        low, high = block.corners, block.corners + sizes[block.members]
        assert low.min() >= 0 and (high <= block.size + 1e-9).all()
        apart = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=2)
        assert apart[~np.eye(len(low), dtype=bool)].min() > -1e-9
        assert sizes[block.members].prod(axis=1).sum() > 0.6 * block.size.prod()


@pytest.mark.parametrize(
    ("growth", "beside"), [(0.0, [(0, 0)]), (2.0, [(2, 0), (0, 2)]), (5.0, [(5, 0), (3, 4), (4, 3)])]
)
def test_what_is_just_as_far_as_an_island_grows_lies_in_its_cells(growth, beside):
    """Else two islands could be nearer than the margin by what rounding takes."""
    square = np.array([[0, 0], [8, 0], [8, 8], [0, 8.0]])
    ((cells, low),) = grown_cells(outlines_of([square], [np.array([[0, 1, 2], [0, 2, 3]])]), growth)
    offsets = np.array([(sx * x, sy * y) for x, y in beside for sx in (1, -1) for sy in (1, -1)])
    points = (square[:, None] + offsets).reshape(-1, 2).astype(int)
    column, row = (points - low).T
    assert cells[row, column].all()
    y, x = np.nonzero(cells)
    gap = [np.maximum(0, np.maximum(-at - 1, at - 8)) for at in (x + low[0], y + low[1])]
    assert (np.hypot(*gap) <= growth).all()
