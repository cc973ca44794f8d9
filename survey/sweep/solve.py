"""Solving one block of a grid: the variables that are stored, in their types."""

from dataclasses import replace
from functools import cache

import numpy as np

from survey import status
from survey.errors import BadInput
from survey.file.labels import layout
from survey.kernels.math.rounding import round_up
from survey.sweep import dispatch
from survey.sweep.compile_ahead import compiling_ahead
from survey.sweep.cost import bytes_per_point, points_per_block, seconds_per_point
from survey.wording import listed

QUICK_SECONDS, QUICK_BYTES = 0.05, 2**23  # what takes no more is done before threads have begun
BLOCKS_PER_THREAD = 4


def solve_block(scene, request, grid, block, out=None):
    """The variables of `layout` in one block of the grid; in the arrays `out`, if these are given."""
    _keep_freed_memory()
    return solve_point(
        scene,
        replace(request, lines=grid.lines, fixed=grid.fixed, ranges=grid.ranges, out=out or {}),
        grid.point(block),
        _shape(grid, block),
        out,
    )


@cache
def _keep_freed_memory():
    """Have glibc keep what a call frees for the next one: it raises its thresholds to the size of the
    largest array that was ever freed.

    Measured: beside another library a third of the time of 60,000 points of Brun's problem went into fetching
    10 MB from the system again and again.
    """
    np.empty(31 << 20, np.uint8)


def _shape(grid, block):
    return tuple(
        len(range(*cut.indices(size))) for cut, size in zip(block, grid.shape, strict=True)
    )


def solve_point(scene, request, point, shape, out=None):
    """The variables of `layout` at `point` ({name: array that broadcasts to shape}), as they are
    stored; in the arrays `out`, if these are given.

    Values outside a parameter's domain reach the scene as NaN.
    """
    used = {p.name: p for p in scene.PARAMETERS}
    valid = {}
    for key, values in point.items():
        if used[key].holds_all(values, request.variables):
            valid[key] = values
        else:
            inside = used[key].holds(values, request.variables)
            valid[key] = np.where(inside, values, np.nan)
    with np.errstate(all="ignore"):  # what overflows or is undefined gets a status, not a warning
        solved = scene.solve({key: np.atleast_1d(values) for key, values in valid.items()}, request)
    return stored(scene, request, solved, shape, out)


def stored(scene, request, solved, shape, out=None):
    """A scene's results in the file's types and the block's shape, in the arrays `out`, if these are
    given; status `overflow` where a bar does not fit.
    """
    arrays, infinite = {}, False
    table = layout(scene, request)
    left_out = [name for name in table if name not in solved]
    if left_out:
        raise BadInput(f"{scene.TITLE}: solve returns no {listed(left_out)}, which OUTPUTS declare")
    for name, (dtype, _, extra) in table.items():
        values = np.asarray(solved[name]).reshape(shape + extra)
        if name.endswith("_error") and values.dtype != dtype:
            arrays[name] = np.empty(values.shape, dtype) if out is None else out[name]
            infinite |= _round_up(values, arrays[name])
        else:
            arrays[name] = values.astype(dtype, copy=False)
    if infinite:
        _overflow(arrays, table, shape)
    for name, array in out.items() if out else ():
        if arrays[name] is not array:
            array[...] = arrays[name]
    return arrays if out is None else out


def _round_up(values, out):
    """Fill `out` with error bars, rounded up; returns whether one is infinite. Those that are the same
    along an axis are rounded once.
    """
    few = tuple(slice(None) if step else slice(1) for step in values.strides)
    bars = np.asarray(values[few], dtype=float, order="C")
    bars = bars if bars.flags.writeable else bars.copy()  # the kernel would be compiled again
    whole = out.flags.c_contiguous and bars.shape == out.shape
    kept = out if whole else np.empty(bars.shape, np.float32)
    infinite = round_up(bars.reshape(-1), kept.reshape(-1))
    if not whole:
        out[...] = kept
    return infinite


def _overflow(arrays, table, shape):
    """Take back the answers of points that have an infinite error bar; changes `arrays`."""
    unbounded = [np.isinf(arrays[name]) for name in table if name.endswith("_error")]
    for bad in unbounded:
        lost = bad.reshape(*shape, -1).any(axis=-1)
        for name, (dtype, fill, extra) in table.items():
            where = lost.reshape(shape + (1,) * len(extra))
            if name == "status":
                where = lost & ~np.isin(arrays[name], list(status.UNANSWERED))
                fill = status.OVERFLOW
            arrays[name] = np.where(where, dtype.type(fill), arrays[name])


def compute(grid, scene, request, threads=None, progress=None):
    """All variables of the grid, in memory: {name: array in the grid's shape}; `progress(done,
    total)` of blocks.
    """
    result = {
        name: np.empty(grid.shape + extra, kind)
        for name, (kind, _, extra) in layout(scene, request).items()
    }

    def task(block):
        out = {name: values[(*block, ...)] for name, values in result.items()}
        solve_block(scene, request, grid, block, out)

    seconds = grid.points * seconds_per_point(scene, request, grid)
    quick = (
        seconds <= QUICK_SECONDS and grid.points * bytes_per_point(scene, request) <= QUICK_BYTES
    )
    workers = 1 if quick else threads or dispatch.cpus()
    # the fewer blocks the better, but threads should end at the same time
    share = grid.points if workers == 1 else grid.points // (BLOCKS_PER_THREAD * workers)
    blocks = grid.blocks(points_per_block(scene, request, grid, share))

    def report(done, _=None):
        if progress:
            progress(done, len(blocks))

    with compiling_ahead(scene, request):
        if len(blocks) == 1 or workers == 1:
            for number, block in enumerate(blocks, 1):
                task(block)
                report(number)
        else:
            dispatch.on_threads(
                lambda number: task(blocks[number]), range(len(blocks)), report, threads=workers
            )
    return result
