"""Connect triangles by flat arrays: halfedges, twins, boundary loops and components.

Halfedge ``3 t + k`` of triangle ``t`` goes from ``T[t, k]`` to ``T[t, (k + 1) % 3]``; the boundary
has twin -1 and is walked with the surface on its left.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

# Nodes of graphs whose components are found without a sparse matrix.
FEW_NODES = 2000
# Corners of triangles up to which all their sides are sorted in the time that it takes to leave out those within.
FEW_CORNERS = 1000
# Pairs up to which it takes longer to count than to compare them.
FEW_PAIRS = 8000
# So many times as many as there are integers the largest may be where they are counted.
COUNTED = 4
# Places of a table for each key that is looked up, at least; and what scatters keys over it, 2^64 over the golden mean.
TABLE = 16
SCATTER = np.uint64(0x9E3779B97F4A7C15)
# Triangles that are looked at at once: what is found on the way stays in the cache.
PART = 1 << 15
# Of more sides between two places none meet: four are those of two polygons that both have two sides.
MOST_SIDES = 4


def halfedges(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tail and head vertex of every halfedge, (3m,) each, of triangles (m,3)."""
    return triangles.ravel(), triangles.take((1, 2, 0), axis=1).ravel()


def next_corners(face_start: np.ndarray) -> np.ndarray:
    """The corner (c,) after each one in its polygon, of polygons that begin at face_start (f+1,)."""
    after = np.arange(int(face_start[-1])) + 1
    filled = face_start[1:] > face_start[:-1]
    after[face_start[1:][filled] - 1] = face_start[:-1][filled]
    return after


def pair_keys(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """One int64 key (k,) per unordered pair of integers a, b (k,) from 0 to 2^31 - 1."""
    a, b = (x.astype(np.int64, copy=False) for x in (a, b))
    keys = np.minimum(a, b)
    # In place: of the sides of a large mesh each of these takes as much memory as its triangles.
    keys <<= 32
    keys |= np.maximum(a, b)
    return keys


def paired(keys: np.ndarray) -> np.ndarray:
    """The pairs (k,2) of integers that keys (k,) of `pair_keys` stand for, the smaller one first."""
    return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1)


def row_labels(rows: np.ndarray) -> np.ndarray:
    """A number (k,), from 0 on, for each of rows (k,q) of integers >= 0: the same where rows are."""
    rows = np.ascontiguousarray(rows, np.int64)
    bits = int(rows.max(initial=0)).bit_length()
    if bits * rows.shape[1] < 64:
        # One integer for a row is found ten times as fast.
        keys = (rows << (bits * np.arange(rows.shape[1]))).sum(axis=1)
    else:
        keys = rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1]))).ravel()
    return np.unique(keys, return_inverse=True)[1].ravel()


def order_of_pairs(keys: np.ndarray) -> np.ndarray:
    """The stable ascending order (k,) of keys (k,) of `pair_keys`; by counting, in linear time, where they are many."""
    if len(keys) > FEW_PAIRS:
        larger = np.empty(len(keys), np.int32)
        np.bitwise_and(keys, 0xFFFFFFFF, out=larger, casting="unsafe")
        most = int(larger.max())
        if most < 2 * len(keys):
            order = _counted(larger, most)
            smaller = np.right_shift(keys, 32, out=larger, casting="unsafe")[order]
            return order[_counted(smaller, most)].astype(np.int64)
    return np.argsort(keys, kind="stable")


def order_of_numbers(values: np.ndarray) -> np.ndarray:
    """The stable ascending order (k,) of integers (k,) >= 0; by counting where there are many, and none is large."""
    most = int(values.max(initial=0))
    if len(values) > FEW_PAIRS and most < 2 * len(values):
        return _counted(values.astype(np.int32), most).astype(np.int64)
    return np.argsort(values, kind="stable")


def distinct(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (k,) that occur among integers of any shape, ascending, and the place of each one's, flat: those of
    `np.unique`, by counting where none is large.

    >>> distinct(np.array([[5, 2], [2, 7]]))
    (array([2, 5, 7]), array([1, 0, 0, 2]))
    """
    flat = numbers.ravel()
    most = _counted_up_to(flat)
    if most is None:
        values, place = np.unique(flat, return_inverse=True)
        return values, place.ravel()
    seen = np.zeros(most + 1, bool)
    seen[flat] = True
    return np.flatnonzero(seen).astype(flat.dtype, copy=False), (np.cumsum(seen) - 1)[flat]


def first_places(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (k,) that occur among integers of any shape, ascending, and where each does first, flat: those of
    `np.unique`, by counting where none is large.

    >>> first_places(np.array([5, 2, 2, 7]))
    (array([2, 5, 7]), array([1, 0, 3]))
    """
    flat = numbers.ravel()
    most = _counted_up_to(flat)
    if most is None:
        return np.unique(flat, return_index=True)
    first = np.full(most + 1, -1)
    # Of several that are written to one place the last one stays.
    first[flat[::-1]] = np.arange(len(flat))[::-1]
    values = np.flatnonzero(first >= 0)
    return values.astype(flat.dtype, copy=False), first[values]


def _counted_up_to(flat: np.ndarray) -> int | None:
    """The largest of integers (k,) that take less long to count than to compare; None for others."""
    most = int(flat.max(initial=-1))
    return most if most <= COUNTED * len(flat) and int(flat.min(initial=0)) >= 0 else None


def are_among(keys: np.ndarray, few: np.ndarray) -> np.ndarray:
    """Which of the keys (k,) are among few others (f,), (k,) bool: `np.isin` sorts all of both."""
    if not len(few) or not len(keys):
        return np.zeros(len(keys), bool)
    if len(few) > max(FEW_PAIRS, len(keys)):
        few = few[_may_be_among(few, keys)]
        if not len(few):
            return np.zeros(len(keys), bool)
    ordered = np.sort(few)
    return ordered[np.minimum(np.searchsorted(ordered, keys), len(ordered) - 1)] == keys


def _may_be_among(many: np.ndarray, keys: np.ndarray) -> np.ndarray:
    """Which of many integers (f,) share their place in a table with one of the keys (k,), (f,) bool: each that is one
    of them, and few others, so that most are never sorted."""
    one, other = places_in_table(many, len(keys)), places_in_table(keys, len(keys))
    taken = np.zeros(max(int(one.max()), int(other.max())) + 1, bool)
    taken[other] = True
    return taken[one]


def places_in_table(keys: np.ndarray, count: int) -> np.ndarray:
    """The place (k,) of each of the keys (k,), integers, in a table for so many: those of neighbours are scattered
    (Knuth, The art of computer programming 3, section 6.4)."""
    shift = np.uint64(64 - (TABLE * count).bit_length())
    return ((keys.astype(np.int64, copy=False).view(np.uint64) * SCATTER) >> shift).astype(np.int64)


def runs(ordered: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (r,) that occur in an ordered array (k,), and the number (k,) of each entry's: what `np.unique` would sort
    for again.

    >>> runs(np.array([2, 2, 5]))
    (array([2, 5]), array([0, 0, 1]))
    """
    begins = np.ones(len(ordered), dtype=bool)
    np.not_equal(ordered[1:], ordered[:-1], out=begins[1:])
    return ordered[begins], np.cumsum(begins) - 1


def _counted(values: np.ndarray, most: int) -> np.ndarray:
    """The stable order (k,) of int32 values (k,) from 0 to `most`: a matrix of one a row is transposed by counting."""
    k = len(values)
    rows = csr_matrix((np.zeros(k, np.int8), values, np.arange(k + 1, dtype=np.int32)), shape=(k, most + 1))
    return rows.tocsc().indices


def pair_up(keys: np.ndarray, order: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the two members of every key (k,) that occurs exactly twice, (p,) and (p,); order (k,) : that of
    `order_of_pairs`, where it is known."""
    order = order_of_pairs(keys) if order is None else order
    ordered = keys[order]
    alike = np.zeros(len(keys) + 1, dtype=bool)
    np.equal(ordered[1:], ordered[:-1], out=alike[1:-1])
    twice = np.flatnonzero(alike[1:-1] & ~alike[:-2] & ~alike[2:])
    # The order is a stable one: whichever comes first does so on every processor.
    return order[twice], order[twice + 1]


def only_once(keys: np.ndarray) -> np.ndarray:
    """Positions of the keys (k,) that occur once, ascending."""
    _, first, count = np.unique(keys, return_index=True, return_counts=True)
    return np.sort(first[count == 1])


def opposite_sides(
    place: np.ndarray, ends: np.ndarray, twin: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (p,) and (p,) of pairs of sides (2,s) between vertices that lie at the same places (n,), the other way
    round, where neither has a third one to choose.

    twin (s,) : the same for polygons that lie on one another: both sides of a leaf do not meet, but each goes on where
    its neighbour has two sides as well; none do by default
    """
    tail, head = place[ends]
    key = pair_keys(tail, head)
    order = order_of_pairs(key)
    begin = np.flatnonzero(np.diff(key[order], prepend=-1))
    count = np.diff(begin, append=len(key))
    pairs = []
    for step in range(1, MOST_SIDES):
        several = np.flatnonzero((count > step) & (count <= MOST_SIDES))
        row, k = expand(count[several] - step)
        pairs.append(np.stack([begin[several][row] + k, begin[several][row] + k + step]))
    first, second = order[np.concatenate(pairs, axis=1)]
    against = (tail[first] == head[second]) & (tail[first] != head[first])
    against &= True if twin is None else twin[first] != twin[second]
    first, second = first[against], second[against]
    once = np.bincount(np.concatenate([first, second]), minlength=len(key)) == 1
    alone = once[first] & once[second]
    return first[alone], second[alone]


def joined_along(n: int, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """A number (n,) for each of n vertices, the same where sides (2,p) are joined with others (2,p), head to tail."""
    return graph_components(first.ravel(), second[::-1].ravel(), n)[1]


def first_of(label: np.ndarray) -> np.ndarray:
    """The first (n,) of those with the same label (n,), from 0 on, for each."""
    return np.unique(label, return_index=True)[1][label]


def twins(triangles: np.ndarray) -> np.ndarray:
    """Opposite halfedge of every halfedge, (3m,), -1 on the boundary, of an oriented manifold mesh (m,3)."""
    first, second = pair_up(pair_keys(*halfedges(triangles)))
    twin = np.full(triangles.size, -1, dtype=np.int64)
    twin[first], twin[second] = second, first
    return twin


def boundary_edges(triangles: np.ndarray) -> np.ndarray:
    """Edges (b,2) of all boundaries of triangles (m,3), surface on the left, in the order of their halfedges."""
    tail, head = halfedges(triangles)
    boundary = twins(triangles) < 0
    return np.column_stack([tail[boundary], head[boundary]])


def inner_vertices(triangles: np.ndarray, n: int) -> np.ndarray:
    """Which of n vertices (n,) bool are on no boundary of an oriented manifold mesh (m,3): their neighbours after them
    are those before them. Sums of random numbers tell that, in a third of the memory of twins."""
    number = np.random.default_rng(0).integers(1 << 62, size=n)
    balance = np.zeros(n, np.int64)
    for begin in range(0, len(triangles), PART):
        tail, head = halfedges(triangles[begin : begin + PART])
        np.add.at(balance, tail, number[head])
        np.subtract.at(balance, head, number[tail])
    return balance == 0


def euler_characteristic(n: int, m: int, b: int) -> int:
    """Vertices - edges + triangles of a manifold of n vertices and m triangles, with b edges on boundaries.

    >>> euler_characteristic(4, 4, 0), euler_characteristic(4, 2, 4)
    (2, 1)
    """
    return n - (3 * m + b) // 2 + m


def vertices_around(triangles: np.ndarray, chosen: np.ndarray, n: int, rings: int) -> np.ndarray:
    """Vertices (n,) bool at most `rings` edges away from the chosen triangles, (m,) bool, of (m,3)."""
    near = np.zeros(n, dtype=bool)
    near[triangles[chosen]] = True
    for _ in range(rings):
        near[triangles[near[triangles].any(axis=1)]] = True
    return near


def across_edges(triangles: np.ndarray, twin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One halfedge (k,) of every inner edge of triangles (m,3) with twins (3m,), and the corners (k,2) opposite it: of
    its own triangle, and of its twin's."""
    head, h = halfedges(triangles)[1], np.flatnonzero(twin > np.arange(len(twin)))
    return h, np.stack([head[next_halfedge(h)], head[next_halfedge(twin[h])]], axis=1)


def next_halfedge(h: np.ndarray) -> np.ndarray:
    """The following halfedge (k,) of each (k,), within the same triangle."""
    return h + 1 - 3 * (h % 3 == 2)


def previous_halfedge(h: np.ndarray) -> np.ndarray:
    """The preceding halfedge (k,) of each (k,), within the same triangle."""
    return h - 1 + 3 * (h % 3 == 0)


def expand(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For rows of `counts` (k,) entries: the row of every entry, and its place within the row."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)


def graph_components(a: np.ndarray, b: np.ndarray, n: int) -> tuple[int, np.ndarray]:
    """Number of components of a graph of n nodes with the edges a, b (e,), and the component (n,) of every node."""
    if n <= FEW_NODES:
        return _few_components(np.asarray(a), np.asarray(b), n)
    # An edge that is there twice joins no more: its rows are counted, and nothing is sorted or summed.
    edges, one, other = len(a), np.asarray(a, np.int32), np.asarray(b, np.int32)
    rows = csr_matrix((np.zeros(edges, np.int8), one, np.arange(edges + 1, dtype=np.int32)), shape=(edges, n)).tocsc()
    return connected_components(
        csr_matrix((np.ones(edges), other[rows.indices], rows.indptr), shape=(n, n)), directed=False
    )


def triangle_parts(triangles: np.ndarray, n: int) -> np.ndarray:
    """The number (m,) of the connected part that each triangle (m,3) of n vertices is in; some may be those of none."""
    return graph_components(*halfedges(triangles), n)[1][triangles[:, 0]]


def edge_runs(ends: np.ndarray) -> np.ndarray:
    """The run (e,) that each of the edges (e,2) between nodes, which may have any numbers, hangs together with."""
    nodes, end = np.unique(ends, return_inverse=True)
    one, other = end.reshape(-1, 2).T
    return graph_components(one, other, len(nodes))[1][one]


def _few_components(a: np.ndarray, b: np.ndarray, n: int) -> tuple[int, np.ndarray]:
    """The same by pointer doubling: to make a sparse matrix of a small graph takes longer than to walk through it."""
    root = np.arange(n)
    while True:
        one, other = root[a], root[b]
        apart = one != other
        if not apart.any():
            break
        np.minimum.at(root, np.maximum(one, other)[apart], np.minimum(one, other)[apart])
        while True:
            further = root[root]
            if (further == root).all():
                break
            root = further
    first, label = distinct(root)
    return len(first), label


def on_boundary(triangles: np.ndarray, n: int) -> np.ndarray:
    """Which of n vertices are at an edge that does not have two faces, (n,) bool, of any triangles (m,3)."""
    tail, head = halfedges(triangles)
    keys = pair_keys(tail, head)
    order = order_of_pairs(keys)
    number, open_edge = runs(keys[order])[1], np.empty(len(keys), bool)
    open_edge[order] = np.bincount(number)[number] != 2
    boundary = np.zeros(n, bool)
    boundary[tail[open_edge]] = boundary[head[open_edge]] = True
    return boundary


def boundary_loops(triangles: np.ndarray) -> list[np.ndarray]:
    """Vertices of every boundary loop (k,) of triangles (m,3) in order, surface on the left; longest loop first.

    The mesh must be an oriented manifold with one fan per vertex (`charts.strict_charts` guarantees it).
    """
    vertices, size = vertices_along_boundary(triangles)
    return sorted(np.split(vertices, np.cumsum(size)[:-1]), key=len, reverse=True) if len(size) else []


def split_fans(triangles: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (m,3) of n vertices with a vertex of its own for every fan: those that only touch at a vertex no longer
    do. And which vertex (k,) each one was, the first n themselves.

    >>> import numpy as np
    >>> split_fans(np.array([[0, 1, 2], [0, 3, 4]]), 5)[0].tolist()
    [[0, 1, 2], [5, 3, 4]]
    """
    tail, head = halfedges(triangles)
    order = np.argsort(pair_keys(tail, head), kind="stable")
    key = pair_keys(tail, head)[order]
    i, j = (side[key[1:] == key[:-1]] for side in (order[:-1], order[1:]))
    ahead = np.arange(len(tail)) // 3 * 3 + (np.arange(len(tail)) + 1) % 3
    # Across an edge of any number of faces, corners at the same end are of one fan.
    along = tail[i] == tail[j]
    at_tail, at_head = np.where(along, j, ahead[j]), np.where(along, ahead[j], j)
    label = graph_components(np.r_[i, ahead[i]], np.r_[at_tail, at_head], len(tail))[1]
    _, first, fan = np.unique(label, return_index=True, return_inverse=True)
    vertex = tail[first]
    again = np.ones(len(first), bool)
    again[np.unique(vertex, return_index=True)[1]] = False
    number = np.where(again, n + np.cumsum(again) - 1, vertex)
    return number[fan.ravel()].reshape(-1, 3), np.r_[np.arange(n), vertex[again]]


def with_fans(vertices: np.ndarray, triangles: np.ndarray, loops: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n,3) and triangles (m,3) with these boundary loops (k,) closed, each by a fan around its mean."""
    if not loops:
        return vertices, triangles
    centres = [vertices[loop].mean(axis=0) for loop in loops]
    fans = [
        np.column_stack([np.roll(loop, -1), loop, np.full(len(loop), len(vertices) + k)])
        for k, loop in enumerate(loops)
    ]
    return np.concatenate([vertices, centres]), np.concatenate([triangles, *fans])


def vertices_along_boundary(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (b,) of all boundary loops, one after the other by their first vertices, and the sizes (l,) of these.

    See `boundary_loops`.
    """
    n = int(triangles.max(initial=-1)) + 1
    edges = boundary_edges(triangles) if triangles.size <= max(FEW_CORNERS, n) else _edges_of_loops(triangles, n)
    if len(edges) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    edges = edges[np.argsort(edges[:, 0], kind="stable")]
    vertices = edges[:, 0]
    following = np.minimum(np.searchsorted(vertices, edges[:, 1]), len(vertices) - 1)
    label = graph_components(np.arange(len(vertices)), following, len(vertices))[1]
    size = np.bincount(label)
    start = np.unique(label, return_index=True)[1]
    ahead = _steps_to(following, start, int(size.max()))
    order = np.lexsort((size[label] - ahead, ahead > 0, label))
    return vertices[order], size


def _edges_of_loops(triangles: np.ndarray, n: int) -> np.ndarray:
    """`boundary_edges` (b,2) of an oriented manifold mesh (m,3) of n vertices: both ends of such an edge are on a
    boundary, and only edges between two of these need to be sorted."""
    tail, head = halfedges(triangles)
    inner = inner_vertices(triangles, n)
    few = np.flatnonzero(~(inner[tail] | inner[head]))
    tail, head, alone = tail[few], head[few], np.ones(len(few), bool)
    alone[np.concatenate(pair_up(pair_keys(tail, head)))] = False
    return np.column_stack([tail[alone], head[alone]])


def _steps_to(following: np.ndarray, goals: np.ndarray, most: int) -> np.ndarray:
    """Steps (b,) from every node to the goal on its cycle, by pointer doubling; cycles have `most` nodes at most."""
    jump, steps = following.copy(), np.ones(len(following), np.int64)
    jump[goals], steps[goals] = goals, 0
    for _ in range(most.bit_length()):
        steps = steps + steps[jump]
        jump = jump[jump]
    return steps
