"""Surfaces in a box of three parameters on which functions are 0, as triangles whose corners are
bracketed.

The signs of a function on LINES lines each way show where a surface passes: cubes whose corners
differ are cut by polygons with corners on the cubes' edges (marching cubes; on a face with
alternating signs negative corners are kept apart, from both sides, so that neighbours fit). Each
corner is then moved along its edge to the zero of the function, and bracketed there by signs that
are certain. A surface that lies between two lines everywhere, or two that lie closer than them, may
be missed; where a number that changes on surfaces alone shows that one is missing, that is counted.
Triangles of which a corner cannot be made certain are left out.

Positions are those of `survey.measures.square`, in three dimensions.

Source: W. E. Lorensen, H. E. Cline, Marching cubes, Computer Graphics 21 (1987) 163; signs on
faces: G. M. Nielson, B. Hamann, The asymptotic decider, IEEE Visualization (1991) 83.
"""

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from survey.measures.hill.edges import close_in
from survey.measures.tasks import in_turn

LINES = 65
TOGETHER = 1024  # corners that are sharpened in one task
NEAR = 1e-4  # of the box: how near zeros of the cubics through four values of the lattice are
HALVINGS = 8  # of the edge of a cube, where that fails
SURE = 1e-6  # the widest bracket of a corner, half of it, that is drawn
BEYOND = 0.05  # of an edge: how far a zero may lie beyond an end of uncertain sign
COUNTS = "counts"  # beside the names of classes
CORNERS = np.array(list(product((0, 1), repeat=3)))


@dataclass
class Surfaces:
    """Pieces one after another: class `kind`, and so many `vertices` and `triangles` each.

    Per vertex its position `x` (m, 3), its `error` (m) along the axis `axis` (m), and `along`:
    {name: (values, errors)}; `corners` (t, 3) of the triangles are numbers of vertices. `left_out`:
    triangles that are not there since a corner is not certain; `unexplained`: edges of the lattice
    along which the number of `on_lattice` changes and no surface passes, None if it has none.
    """

    kind: np.ndarray
    vertices: np.ndarray
    triangles: np.ndarray
    x: np.ndarray
    error: np.ndarray
    axis: np.ndarray
    along: dict
    corners: np.ndarray
    left_out: int
    unexplained: int | None


def find(functions, grain, names, each=in_turn, once=lambda name, make: make()):
    """The Surfaces of all classes of `functions` (see QUESTIONS of `survey.measures`); `names`: of
    what is `along`.

    `grain`: the rounding of positions. `each`, `once`: see `survey.sweep.boundaries.find`.
    """
    ticks = np.linspace(0.0, 1.0, LINES)
    plane = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)

    def lattice(i):
        def make():
            x = np.column_stack([np.full(len(plane), ticks[i]), plane])
            values, counts = functions.on_lattice(x)
            found = {str(kind): _signed(*both) for kind, both in values.items()}
            return found if counts is None else found | {COUNTS: counts}

        return once(f"surfaces-{LINES}-{i}", make)

    planes = each(lattice, range(LINES), "planes of the surfaces' lattice")
    cube = (LINES, LINES, LINES)
    on_lattice = {
        name: np.stack([plane[name] for plane in planes]).reshape(cube) for name in planes[0]
    }
    counts = on_lattice.pop(COUNTS, None)
    on_lattice = {name: _with_open_signs(values) for name, values in on_lattice.items()}
    # edges on which a surface passes, or may
    told = np.zeros((*cube, 3), bool)
    parts = []
    left_out = 0
    for kind, values in ((int(name), values) for name, values in on_lattice.items()):
        cut, corners = marched(values)

        def sharp(first, kind=kind, values=values, cut=cut):
            def make():
                return _sharpened(functions, kind, values, cut[first : first + TOGETHER], grain)

            return once(f"surfaces-{LINES}-{kind}-{first}", make)

        found = each(sharp, range(0, len(cut), TOGETHER), "parts of the surfaces")
        if not found:
            continue
        found = {name: np.concatenate([part[name] for part in found]) for name in found[0]}
        certain = np.isfinite(found["error"])
        left_out += int((~certain[corners].all(axis=1)).sum())
        told[tuple(cut[found["passes"] | ~certain].T)] = True
        parts += _pieces(kind, found, corners[(certain & found["passes"])[corners].all(axis=1)])
    lost = None if counts is None else int((_changing(counts) & ~told).sum())
    return _joined(parts, names, left_out, lost)


def _changing(counts):
    """A mask (n, n, n, 3) of the lattice's edges, by their lower end and axis, along which a number
    changes that is known at both ends.
    """
    changes = np.zeros((*counts.shape, 3), bool)
    for axis in range(3):
        low, high = [np.s_[:]] * 3, [np.s_[:]] * 3
        low[axis], high[axis] = np.s_[:-1], np.s_[1:]
        one, two = counts[tuple(low)], counts[tuple(high)]
        changes[(*low, axis)] = (one != two) & (one >= 0) & (two >= 0)
    return changes


def _signed(values, bars):
    """The values, 0 where their signs are not certain."""
    return np.where(np.isnan(values), np.nan, np.where(abs(values) > bars, values, 0.0))


def _with_open_signs(values):
    """The values, where their sign is not certain (0) with that of all certain neighbours, or else
    a positive one; NaN where no neighbour's is certain.

    So a function that touches 0 without a change of its sign has no surface there, nor on the box's
    border.
    """
    near = np.ones((3, 3, 3))
    below, above = (binary_dilation(own, near) for own in (values < 0.0, values > 0.0))
    values = np.where((values == 0.0) & below & ~above, -np.finfo(float).tiny, values)
    # where none is certain all around, as where the function is 0 throughout, there is only noise
    return np.where((values == 0.0) & ~below & ~above, np.nan, values)


@cache
def polygons(code):
    """The triangles (m, 3) by which a cube is cut whose corner k of CORNERS is negative where
    `code` has the bit k.

    Corners of triangles are numbers 8 axis + k: the edge from the corner k along the axis.
    """
    following = {}
    for axis, side in product(range(3), (0, 1)):
        ring = np.zeros((4, 3), int)
        ring[:, axis] = side
        turn = [(0, 0), (1, 0), (1, 1), (0, 1)]  # anticlockwise from outside the cube
        ring[:, [(axis + 1) % 3, (axis + 2) % 3]] = turn if side else turn[::-1]
        numbers = ring @ [4, 2, 1]
        negative = [bool(code >> k & 1) for k in numbers]
        edges = [_edge(*pair) for pair in zip(numbers, np.roll(numbers, -1), strict=True)]
        enters = [i for i in range(4) if not negative[i] and negative[(i + 1) % 4]]
        for i in enters:  # the run of negative corners that begins there is cut off
            end = next(j % 4 for j in range(i + 1, i + 4) if not negative[(j + 1) % 4])
            following[edges[i]] = edges[end]
    found = []
    while following:
        first, then = following.popitem()
        ring = [first]
        while then != first:
            ring.append(then)
            then = following.pop(then)
        found += [(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)]
    return np.array(found, int).reshape(-1, 3)


def _edge(one, other):
    """The number of the edge between two corners of a cube."""
    low, high = min(one, other), max(one, other)
    return 8 * {4: 0, 2: 1, 1: 2}[int(high - low)] + int(low)


def marched(values):
    """(edges (m, 4), corners (t, 3)) of the surface values = 0 on a lattice, not negative counted
    as positive.

    An edge is the index of its lower end on the lattice and its axis; corners of triangles are
    numbers of edges. Cubes with a value that is not a number are not cut.
    """
    size = np.array(values.shape)
    known, negative = np.isfinite(values), values < 0.0

    def at_corner(array, k):
        return array[tuple(slice(c, n - 1 + c) for c, n in zip(CORNERS[k], size, strict=True))]

    code = sum(at_corner(negative, k).astype(np.int16) << k for k in range(8))
    cut = np.logical_and.reduce([at_corner(known, k) for k in range(8)]) & (code > 0) & (code < 255)
    cubes, codes = np.argwhere(cut), code[cut]
    strides = np.array([size[1] * size[2], size[2], 1])
    found = [np.zeros((0, 3), np.int64)]
    for own in np.unique(codes):
        table = polygons(int(own))
        corner = (cubes[codes == own][:, None, None] + CORNERS[table % 8]) @ strides
        found.append((3 * corner + table // 8).reshape(-1, 3))
    numbers, corners = np.unique(np.concatenate(found), return_inverse=True)
    nodes_at = np.stack(np.unravel_index(numbers // 3, values.shape), axis=1)
    return np.column_stack([nodes_at, numbers % 3]), corners.reshape(-1, 3)


def _sharpened(functions, kind, values, cut, grain):
    """{position, its error (infinite where it is not certain), axis, does it pass?, and what is
    along} of the edges.
    """
    nodes, axis, rows = cut[:, :3], cut[:, 3], np.arange(len(cut))
    step = 1.0 / (LINES - 1)
    x = nodes * step
    low = x[rows, axis]
    high = low + step
    start = low + step * _crossing(values, nodes, axis)
    error = np.full(len(cut), np.inf)

    def at(left, which, t):
        here = np.repeat(x[left[which], None], t.shape[1], axis=1)
        here[np.arange(len(t)), :, axis[left[which]]] = t
        value, bar = functions.sharp(here.reshape(-1, 3), kind)
        return value.reshape(t.shape), bar.reshape(t.shape)

    for halvings in (0, HALVINGS):
        left = np.flatnonzero(error == np.inf)
        if not left.size:
            break
        t, width = start[left], np.full(left.size, NEAR)
        if halvings:
            a, b = low[left], high[left]
            negative = values[tuple(nodes[left].T)] < 0.0
            for _ in range(halvings):
                t = 0.5 * (a + b)
                same = (at(left, np.arange(left.size), t[:, None])[0][:, 0] < 0.0) == negative
                a, b = np.where(same, t, a), np.where(same, b, t)
            t, width = 0.5 * (a + b), b - a
        t, width, sure = close_in(
            lambda which, t, left=left: at(left, which, t),
            t,
            width,
            np.full(left.size, grain),
            0.5 * step,
        )
        sure &= (width < SURE) & (abs(t - np.clip(t, low[left], high[left])) <= BEYOND * step)
        # one at the border itself would be there or not by chance
        sure &= (t - width >= 0.0) & (t + width <= 1.0)
        x[left[sure], axis[left[sure]]], error[left[sure]] = t[sure], width[sure] + grain
    passes, along = functions.passing(x, kind)
    known = {f"along-{name}-{i}": both[i] for name, both in along.items() for i in (0, 1)}
    return {"x": x, "error": error, "axis": axis, "passes": passes} | known


def _crossing(values, nodes, axis):
    """Where (0 to 1) along their edges the cubics through four values of the lattice are 0."""
    rows = np.arange(len(nodes))
    first = np.clip(nodes[rows, axis] - 1, 0, LINES - 4)
    nodes_at = np.repeat(nodes[:, None], 4, axis=1)
    nodes_at[rows, :, axis] = first[:, None] + np.arange(4)
    own = values[tuple(np.moveaxis(nodes_at, 2, 0))]
    offset = nodes[rows, axis] - first
    ends = own[rows, offset], own[rows, offset + 1]
    with np.errstate(all="ignore"):
        straight = np.nan_to_num(np.clip(ends[0] / (ends[0] - ends[1]), 0.0, 1.0), nan=0.5)
    nodes4 = np.arange(4.0)
    weights = np.array([1.0 / np.prod(k - np.delete(nodes4, k)) for k in range(4)])

    def cubic(t):
        s = (t + offset)[:, None]
        factors = [np.prod(np.delete(s - nodes4, k, axis=1), axis=1) for k in range(4)]
        return (own * weights * np.stack(factors, axis=1)).sum(axis=1)

    low, high, negative = np.zeros(len(nodes)), np.ones(len(nodes)), ends[0] < 0.0
    for _ in range(30):
        t = 0.5 * (low + high)
        same = (cubic(t) < 0.0) == negative
        low, high = np.where(same, t, low), np.where(same, high, t)
    return np.where(np.isfinite(own).all(axis=1), 0.5 * (low + high), straight)


def _pieces(kind, found, corners):
    """[(kind, found of a connected piece's vertices, its corners)], the largest first."""
    if not len(corners):
        return []
    m = len(found["error"])
    links = np.concatenate([corners[:, :2], corners[:, 1:]])
    graph = coo_array((np.ones(len(links), bool), tuple(links.T)), shape=(m, m))
    piece = connected_components(graph, directed=False)[1]
    own, sizes = np.unique(piece[corners[:, 0]], return_counts=True)
    parts = []
    for number in own[np.argsort(-sizes, kind="stable")]:
        of_piece = corners[piece[corners[:, 0]] == number]
        used, renumbered = np.unique(of_piece, return_inverse=True)
        parts.append(
            (
                kind,
                {name: values[used] for name, values in found.items()},
                renumbered.reshape(-1, 3),
            )
        )
    return parts


def _joined(parts, names, left_out, lost):
    """The Surfaces of the pieces."""
    vertices = np.array([len(found["error"]) for _, found, _ in parts], int)
    firsts = np.cumsum(vertices) - vertices

    def all_of(name, empty):
        return np.concatenate([empty, *(found[name] for _, found, _ in parts)])

    return Surfaces(
        kind=np.array([kind for kind, _, _ in parts], int),
        vertices=vertices,
        triangles=np.array([len(corners) for _, _, corners in parts], int),
        x=all_of("x", np.zeros((0, 3))),
        error=all_of("error", np.zeros(0)),
        axis=all_of("axis", np.zeros(0, int)),
        along={
            name: tuple(all_of(f"along-{name}-{i}", np.zeros(0)) for i in (0, 1)) for name in names
        },
        corners=np.concatenate(
            [
                np.zeros((0, 3), int),
                *(c + first for (_, _, c), first in zip(parts, firsts, strict=True)),
            ]
        ),
        left_out=left_out,
        unexplained=lost,
    )
