"""Blocks through dask -> dataset: the only place that knows dask."""

import hashlib
import itertools
import json
import os
import shutil
import time
from dataclasses import replace
from math import prod

import dask
import numpy as np
import psutil
from dask.callbacks import Callback

from survey import store
from survey.dataset import command, count, describe, layout, now, provenance, round_up
from survey.errors import BadInput, Stopped

BLOCK_SECONDS = 0.5
BLOCK_POINTS = 50_000


def seconds_per_point(scene, request, grid):
    """The scene's rough figure for this grid."""
    return scene.cost(request.options, {name: values.size for name, (_, values) in grid.parameters.items()})


def points_per_block(scene, request, grid):
    """Points that keep one block near BLOCK_SECONDS of kernel time."""
    return int(np.clip(BLOCK_SECONDS / seconds_per_point(scene, request, grid), 1, BLOCK_POINTS))


def blocks_of(workflow):
    """The blocks of a workflow's grid."""
    return workflow.grid.blocks(points_per_block(workflow.scene, workflow.request, workflow.grid))


def solve_block(scene, request, grid, block):
    """The variables of `layout` in one block of the grid."""
    shape = tuple(len(range(*cut.indices(size))) for cut, size in zip(block, grid.shape, strict=True))
    return solve_point(scene, replace(request, lines=grid.lines), grid.point(block), shape)


def solve_point(scene, request, point, shape):
    """The variables of `layout` at `point` ({name: array that broadcasts to shape}), as they are stored.

    Values outside a parameter's domain reach the scene as NaN.
    """
    used = {p.name: p for p in scene.PARAMETERS}
    valid = {key: np.where(used[key].holds(values), values, np.nan) for key, values in point.items()}
    with np.errstate(all="ignore"):  # what overflows or is undefined gets a status, not a warning
        solved = scene.solve({key: np.atleast_1d(values) for key, values in valid.items()}, request)
    return stored(scene, request, solved, shape)


def stored(scene, request, solved, shape):
    """What a scene solved, in the types of the file and the block's shape."""
    arrays = {}
    for name, (dtype, _, extra) in layout(scene, request).items():
        values = round_up(solved[name]) if name.endswith("_error") else np.asarray(solved[name])
        arrays[name] = values.astype(dtype, copy=False).reshape(shape + extra)
    return arrays


def compute(grid, scene, request, threads=None):
    """All variables of the grid, in memory: {name: array in the grid's shape}."""
    result = _empty(grid, scene, request)

    def task(block):
        for name, values in solve_block(scene, request, grid, block).items():
            result[name][block] = values

    blocks = grid.blocks(points_per_block(scene, request, grid))
    if len(blocks) == 1:
        task(blocks[0])
    else:
        _through_dask(lambda number: task(blocks[number]), range(len(blocks)), threads=threads)
    return result


def run(workflow, workers=None, scheduler=None, fresh=False, progress=None):
    """Run or resume the survey, write its netCDF file and return the dataset.

    `progress(done, total, reused)` is called as blocks finish, and with what they are as parts of the boundaries do.
    Raises BadInput, Damaged or Stopped.
    """
    started = time.time()
    _refuse_too_large(workflow)
    scheduler = _client(scheduler) if scheduler else None
    blocks = blocks_of(workflow)
    with store.Blocks(workflow.path, fingerprint(workflow), fresh) as kept:
        reused = kept.done()
        todo = [number for number in range(len(blocks)) if number not in reused]

        def task(number):
            kept.save(number, solve_block(workflow.scene, workflow.request, workflow.grid, blocks[number]))

        def finished(done):
            if progress:
                progress(len(reused) + done, len(blocks), len(reused))

        _through_dask(task, todo, workers, scheduler, finished)
        arrays = _empty(workflow.grid, workflow.scene, workflow.request)
        for number, block in enumerate(blocks):
            for name, values in kept.load(number).items():
                arrays[name][block] = values
        ds = label(workflow, arrays)
        if workflow.boundaries:
            from survey import boundaries

            def each(task, numbers, what):
                told = progress and (lambda done: progress(done, len(numbers), 0, what))
                _through_dask(task, numbers, finished=told)

            ds = ds.merge(boundaries.find(workflow, each)).assign_attrs(boundaries=workflow.boundaries)
        ds.attrs["wall_time_s"] = round(time.time() - started, 3)
        ds.attrs["blocks_reused"] = len(reused)
        store.write(ds, workflow.path)
        kept.remove()
    return ds.assign_attrs(complete=np.int8(1))


def plan(workflow):
    """What a run would do: points, blocks, bytes, method, estimated seconds. No kernel is called."""
    scene, request, grid = workflow.scene, workflow.request, workflow.grid
    seconds = grid.points * seconds_per_point(scene, request, grid)
    return {
        "scene": workflow.name,
        "options": ", ".join(f"{key}={value}" for key, value in request.options.items()),
        "axes": {name: f"{size} values" for name, size in grid.sizes.items()},
        "points": grid.points,
        "blocks": len(blocks_of(workflow)),
        "bytes": grid.points * bytes_per_point(scene, request),
        "method": request.method,
        "rtol": request.rtol,
        "variables": ", ".join(name for name in layout(scene, request)),
        "output": str(workflow.path),
        "threads": cpus(),
        "estimated_seconds": float(f"{seconds / cpus():.2g}"),
    }


def _refuse_too_large(workflow):
    """Raise BadInput if the map does not fit into this machine's memory or onto the disk of its output."""
    grid, scene, request = workflow.grid, workflow.scene, workflow.request
    needed = grid.points * bytes_per_point(scene, request)
    memory = psutil.virtual_memory().total
    disk = shutil.disk_usage(workflow.path.parent).free
    for room, what in ((memory, "memory"), (disk, "free disk")):
        if needed > room:
            raise BadInput(
                f"{grid.points:,} points need {needed / 2**30:,.0f} GiB, and the machine has {room / 2**30:,.0f} GiB "
                f"of {what}; take fewer points, or name fewer outputs in output.variables"
            )


def bytes_per_point(scene, request):
    """Bytes of all variables at one point."""
    return sum(dtype.itemsize * prod(extra) for dtype, _, extra in layout(scene, request).values())


def label(workflow, arrays):
    """The dataset of a workflow with its counts and its history."""
    ds = count(describe(workflow.grid, workflow.scene, workflow.name, workflow.request, arrays))
    ds.attrs |= {"title": workflow.title, "workflow": workflow.text, "date_created": now()}
    ds.attrs["history"] = f"{now()}: {command()}"
    return ds


def fingerprint(workflow):
    """What must be unchanged for finished blocks to be used again."""
    digest = hashlib.sha256()
    for name, (dims, values) in workflow.grid.parameters.items():
        digest.update(f"{name}{dims}{np.shape(values)}".encode() + np.asarray(values).tobytes())
    request = workflow.request
    return {
        "scene": workflow.name,
        "options": json.dumps(dict(request.options)),
        "axes": digest.hexdigest(),
        "method": request.method,
        "rtol": request.rtol,
        "variables": sorted(request.variables),
        "blocks": len(blocks_of(workflow)),
        "kernels": provenance()["kernel_hash"],
    }


def cpus():
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _empty(grid, scene, request):
    return {
        name: np.full(grid.shape + extra, fill, dtype) for name, (dtype, fill, extra) in layout(scene, request).items()
    }


def _through_dask(task, numbers, workers=None, scheduler=None, finished=None, threads=None):
    """Call the task for every number: on threads of this machine, on worker processes, or on a dask cluster."""
    done = itertools.count(1)
    callback = Callback(posttask=lambda *_: finished(next(done)) if finished else None)
    call = dask.delayed(task, pure=False, traverse=False)
    where = {"scheduler": "processes", "num_workers": workers} if workers else {"scheduler": "threads"}
    where = {"num_workers": threads or cpus()} | where
    if scheduler:
        where = {"scheduler": scheduler}
    if finished:
        finished(0)
    try:
        with callback:
            dask.compute(*[call(number) for number in numbers], **where)
    except OSError as error:
        raise Stopped(f"the run stopped ({error}); run the command again to go on") from None
    except Exception as error:
        if type(error).__name__ in ("BrokenProcessPool", "KilledWorker", "CommClosedError"):
            raise Stopped(f"a worker died ({error}); run the command again to go on") from None
        raise


def _client(address):
    """A client of the dask cluster at `address` (or in a scheduler file)."""
    try:
        from dask.distributed import Client
    except ImportError:
        raise BadInput("--scheduler needs dask.distributed: pip install 'survey[cluster]'") from None
    try:
        return Client(scheduler_file=address, timeout=10) if os.path.exists(address) else Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise Stopped(f"no dask scheduler answers at {address!r} ({error}); start one with dask scheduler") from None
