"""Blocks -> dataset: what is solved where and when, what is kept, what the file gets."""

import contextlib
import hashlib
import json
import os
import shutil
import socket
import subprocess
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from importlib.metadata import version
from math import prod
from typing import Any, NamedTuple

import numpy as np
import tomli_w
from rich import filesize

from survey import cluster, dispatch, methods, modules, status, store, unfinished
from survey.dataset import Tally, attributes, command, coordinates, counts_in, layout, now, round_up, variables
from survey.dispatch import cpus
from survey.errors import BadInput, Stopped
from survey.kernels import jit
from survey.kernels.jit import compile_seconds
from survey.wording import counted

BLOCK_SECONDS = 0.5
BLOCK_POINTS = 2**17
MOST_BLOCKS = 4 * 10**6  # each is a file
SAMPLES = 16  # blocks from all over the map that are solved first
NEAR = 0.02  # of the map: what a block so near has cost tells this one's cost well enough
# what the writer holds at a time: enough for the tiles to be square, little beside what else a process takes
REGION_POINTS, REGION_BYTES = 2**20, 2**25
# what a plan says of the kernels
NEW = "all kernels, once: this machine has none of them yet (up to a minute)"
KNOWN = "kernels that no run on this machine has needed yet, once"


def seconds_per_point(scene, request, grid):
    """The scene's rough figure for this grid, and the method's for this scene."""
    seconds = _cost(scene, request, grid)
    if request.method == "auto":
        return seconds
    return seconds * getattr(modules.load(methods, request.method, "method"), "COST", {}).get(scene.FAMILY, 1.0)


def _cost(scene, request, grid):
    """The scene's rough figure for this grid, in seconds per point."""
    return scene.cost(request.options, {name: values.size for name, (_, values) in grid.parameters.items()})


def points_per_block(scene, request, grid):
    """Points that keep one block near BLOCK_SECONDS of kernel time."""
    return int(np.clip(BLOCK_SECONDS / seconds_per_point(scene, request, grid), 1, BLOCK_POINTS))


def regions_of(workflow):
    """(lengths of a tile, [(region, its blocks)]) of a workflow's grid: a region holds whole tiles and whole blocks."""
    scene, request, grid = workflow.scene, workflow.request, workflow.grid
    number = grid.points / points_per_block(scene, request, grid)
    if number > MOST_BLOCKS:
        raise BadInput(
            f"{counted(grid.points, 'point')} of {workflow.name} need {number:.1g} blocks of about {BLOCK_SECONDS} s; "
            f"at most {MOST_BLOCKS:.0e} can be kept: take fewer points, or several surveys"
        )
    region = max(1, min(REGION_POINTS, REGION_BYTES // bytes_per_point(scene, request)))
    return grid.tiled(points_per_block(scene, request, grid), region, store.TILE_POINTS)


def blocks_of(workflow):
    """The blocks of a workflow's grid, in the order of their numbers."""
    return [block for _, blocks in regions_of(workflow)[1] for block in blocks]


def solve_block(scene, request, grid, block):
    """The variables of `layout` in one block of the grid."""
    return solve_point(scene, replace(request, lines=grid.lines), grid.point(block), _shape(grid, block))


def _shape(grid, block):
    return tuple(len(range(*cut.indices(size))) for cut, size in zip(block, grid.shape, strict=True))


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
    """What a scene solved, in the types of the file and the block's shape; `overflow` where these cannot hold a bar."""
    arrays, table = {}, layout(scene, request)
    for name, (dtype, _, extra) in table.items():
        values = round_up(solved[name]) if name.endswith("_error") else np.asarray(solved[name])
        arrays[name] = values.astype(dtype, copy=False).reshape(shape + extra)
    unbounded = [bad for bad in (np.isinf(arrays[name]) for name in table if name.endswith("_error")) if bad.any()]
    for bad in unbounded:
        lost = bad.reshape(*shape, -1).any(axis=-1)
        for name, (dtype, fill, extra) in table.items():
            where = lost.reshape(shape + (1,) * len(extra))
            if name == "status":
                where, fill = lost & ~np.isin(arrays[name], list(status.UNANSWERED)), status.OVERFLOW
            arrays[name] = np.where(where, dtype.type(fill), arrays[name])
    return arrays


def compute(grid, scene, request, threads=None):
    """All variables of the grid, in memory: {name: array in the grid's shape}."""
    result = {name: np.empty(grid.shape + extra, kind) for name, (kind, _, extra) in layout(scene, request).items()}

    def task(block):
        for name, values in solve_block(scene, request, grid, block).items():
            result[name][block] = values

    blocks = grid.blocks(points_per_block(scene, request, grid))
    if len(blocks) == 1:
        task(blocks[0])
    else:
        dispatch.on_threads(lambda number: task(blocks[number]), range(len(blocks)), threads=threads)
    return result


@dataclass(frozen=True)
class Finished:
    """What a run has written: the file's attributes, the counts, and seconds of wall time (they do not overlap)."""

    attributes: dict[str, Any]
    counts: dict[str, dict[str, int]]
    compiling: float
    computing: float
    beside: float  # edges, cells
    writing: float
    before: bool = False  # was the file complete already?


class Solved(NamedTuple):
    """What a worker tells of a block: its process, the seconds it has compiled in all, those of this block; and the
    block itself where the worker cannot write it beside the output."""

    number: int
    process: str
    compiling: float
    seconds: float | None
    content: bytes | None = None


def numbered(number, block):
    """A block as a Job takes it: (number, ((start, stop), ...)), which is small and can be hashed."""
    return number, tuple((cut.start, cut.stop) for cut in block)


@dataclass(frozen=True)
class Job:
    """All that a worker needs; called with a numbered block, it solves and keeps it.

    It is sent with each block, so it does not hold them all.
    """

    scene: Any
    request: Any
    grid: Any
    kept: store.Blocks
    code: dict[str, str]

    def __call__(self, block):
        _refuse_other_code(self.code)
        number, ends = block
        cuts = tuple(slice(*pair) for pair in ends)
        began, before = time.perf_counter(), compile_seconds()
        content = self.kept.keep(number, solve_block(self.scene, self.request, self.grid, cuts))
        compiled = compile_seconds()
        seconds = time.perf_counter() - began - (compiled - before)
        return Solved(number, _process(), compiled, max(seconds, 0.0), content)

    def died(self, block):
        """Keep a block with the status of points whose worker died again and again."""
        number, ends = block
        shape = tuple(stop - start for start, stop in ends)
        table = layout(self.scene, self.request)
        arrays = {name: np.full(shape + extra, fill, kind) for name, (kind, fill, extra) in table.items()}
        arrays["status"][...] = status.WORKER_DIED
        self.kept.save(number, arrays)
        return Solved(number, "", 0.0, None)


def run(workflow, workers=None, scheduler=None, fresh=False, progress=None, again=None, block_timeout=None):
    """Run or resume the survey and write its netCDF file; returns what was Finished.

    A part of the file is written as soon as the blocks of its region are there, while others are computed.
    `progress(done, total, reused, what, left)` is called as blocks finish, and as parts of the boundaries do;
    `left()` estimates the seconds that are left. `again` is the command that goes on after an interruption.
    `block_timeout`: seconds after which a worker process that has finished no block is replaced.
    Raises BadInput, Damaged or Stopped.
    """
    started = time.perf_counter()
    _refuse_too_large(workflow)
    client = cluster.client_of(scheduler) if scheduler else contextlib.nullcontext()
    tile, regions = regions_of(workflow)
    blocks = [block for _, blocks in regions for block in blocks]
    about = {"points": workflow.grid.points, "code": _code() | _compilers()}
    kept = store.Blocks(workflow.path, fingerprint(workflow), fresh, about, _findable(workflow), again, workflow.text)
    with store.refused(workflow.path, "the run"), client, kept:
        if kept.published:
            kept.remove()
            return Finished(kept.published, counts_in(kept.published), 0.0, 0.0, 0.0, 0.0, True)
        reused = kept.sound()
        job = Job(workflow.scene, workflow.request, workflow.grid, kept, _code())
        left = Remaining(workflow.grid.shape, blocks, reused)
        compiled, patience = {}, dispatch.Patience(block_timeout)

        here = len(reused) < len(blocks) and not (workers or scheduler)
        ahead = _compiling_ahead(workflow.scene, workflow.request) if here else contextlib.nullcontext()
        with ahead, Assembly(workflow, kept, tile, regions) as assembly:

            def finished(done, solved=None):
                if solved:
                    compiled[solved.process] = solved.compiling
                    if solved.content is not None:
                        kept.put(solved.number, solved.content)
                    left.took(solved.number, solved.seconds)
                    patience.took(solved.seconds)
                    assembly.has(solved.number)
                if progress:
                    progress(len(reused) + done, len(blocks), len(reused), left=left)

            before, began = compile_seconds(), time.perf_counter()
            for number in sorted(reused):
                assembly.has(number)
            todo = _spread([number for number in range(len(blocks)) if number not in reused])
            todo = [numbered(number, blocks[number]) for number in todo]
            if scheduler:
                cluster.on_cluster(job, todo, finished, job.died, client, patience)
            elif workers:
                dispatch.on_processes(job, todo, finished, job.died, workers, patience)
            else:
                dispatch.on_threads(job, todo, finished)
            computed = time.perf_counter()
            if _process() in compiled:
                compiled[_process()] -= before
            compiling = max(compiled.values(), default=0.0)  # processes compile side by side
            before = compile_seconds()
            further = extras(workflow, kept.once, progress)
            more = compile_seconds() - before
            compiling, beside = compiling + more, time.perf_counter() - computed - more
            told = {
                "wall_time_s": round(time.perf_counter() - started, 3),
                "compile_time_s": round(compiling, 3),
                "blocks_reused": len(reused),
            }
            written = assembly.finish(further, told)
        kept.remove()
    writing = time.perf_counter() - computed - beside - more
    computing = max(0.0, computed - began - (compiling - more))
    return Finished(written, assembly.tally.counts, compiling, computing, beside if further else 0.0, writing)


def _findable(workflow):
    """The workflow's text, a scene that is a file named as it is found from here, not from beside the workflow."""
    table = tomllib.loads(workflow.text)
    return workflow.text if table["scene"] == workflow.name else tomli_w.dumps(table | {"scene": workflow.name})


def _spread(numbers):
    """The numbers in order, but first some from all over the map, so that the time it takes can be told soon."""
    first = numbers[:: max(1, len(numbers) // SAMPLES)] if len(numbers) > 4 * SAMPLES else []
    return first + sorted(set(numbers) - set(first))


class Remaining:
    """The seconds that are left, when called: each block costs, a point, what the nearest block took that is known."""

    def __init__(self, shape, blocks, reused):
        self.points = np.array([prod(cut.stop - cut.start for cut in block) for block in blocks], float)
        self.places = np.array([[(cut.start + cut.stop) / 2 for cut in block] for block in blocks], float)
        self.places /= np.array(shape, float)
        self.open = np.ones(len(blocks), bool)
        self.open[list(reused)] = False
        self.nearest, self.cost = np.full(len(blocks), np.inf), np.zeros(len(blocks))
        self.began, self.worked = np.inf, 0.0

    def took(self, number, seconds):
        """Block `number` took so many seconds of one worker, what it compiled left out; None: its worker died."""
        self.open[number] = False
        if seconds is None:
            return
        self.began = min(self.began, time.perf_counter() - seconds)
        self.worked += seconds
        if self.nearest[number] < NEAR**2:
            return  # so that a million blocks take no longer, each, than some
        distance = ((self.places - self.places[number]) ** 2).sum(axis=1)
        nearer = distance < self.nearest
        self.nearest[nearer], self.cost[nearer] = distance[nearer], seconds / self.points[number]

    def __call__(self):
        if not self.worked:
            return 0.0
        workers = self.worked / (time.perf_counter() - self.began)  # as many as have been at work
        return float((self.cost * self.points)[self.open].sum() / workers)


def _process():
    """What names this process among those of all hosts."""
    return f"{socket.gethostname()} {os.getpid()}"


@cache
def _code():
    """What names the code that solves blocks: it must be the same on every worker, the processor need not."""
    return {"survey": version("survey"), "sources": jit.SOURCE_HASH}


def _compilers():
    """What else makes the code another one."""
    return {name: version(name) for name in ("numba", "llvmlite")}


def _refuse_other_code(code):
    """Raise Stopped unless this process runs the code that the run was started with."""
    own = _code()
    for what, value in code.items():
        if own[what] != value:
            raise Stopped(
                f"the worker on {socket.gethostname()} has other code ({what}: {own[what]}, this run: {value}); "
                "install the same survey, numba and llvmlite there and run the command again to go on"
            )


def program_ahead(scene, variables):
    """The program that compiles what the scene names for a map of these variables."""
    return f"import gc; gc.disable(); from {scene.__name__} import compile_ahead; compile_ahead({list(variables)})"


@contextlib.contextmanager
def _compiling_ahead(scene, request):
    """On a new machine, a process compiles some of the kernels while this one compiles the longest."""
    if not (hasattr(scene, "compile_ahead") and request.method == "auto" and jit.is_new() and cpus() > 1):
        yield
        return
    words = [sys.executable, "-c", program_ahead(scene, request.variables)]
    process = jit.ahead = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        jit.ahead = None
        process.kill()
        process.wait()


def extras(workflow, once, progress=None):
    """Datasets that go into the file beside the map, their attributes with its own; `once` as in `store.Blocks`."""
    further, parts = [], _parts_beside(workflow)
    if "edges" in parts:

        def each(task, numbers, what):
            told = (lambda done, _=None: progress(done, len(numbers), 0, what)) if progress else (lambda *_: None)
            dispatch.on_threads(task, numbers, told)

        further.append(parts["edges"].find(workflow, each, once))
    if "cells" in parts:
        further.append(parts["cells"].find(workflow, dispatch.on_threads, once, getattr(progress, "refining", None)))
    return further


def _parts_beside(workflow):
    """{what the file gets beside the map: the module that finds it}."""
    asked = {"edges": ("boundaries", workflow.boundaries), "cells": ("refine", workflow.refine)}
    return {what: import_module(f"survey.{name}") for what, (name, wanted) in asked.items() if wanted}


class Assembly:
    """The netCDF file of a run as it grows: one thread writes each region once its blocks are finished.

    Use as a context manager around the run; what it does not `finish` leaves no file.
    """

    def __init__(self, workflow, kept, tile, regions):
        self.workflow, self.kept = workflow, kept
        self.layout = layout(workflow.scene, workflow.request)
        self.regions, self.waiting, self.place = [], [], []
        for region, blocks in regions:
            first = len(self.place)
            self.place += [len(self.regions)] * len(blocks)
            self.regions.append((region, first, blocks))
            self.waiting.append(len(blocks))
        scene, request, grid = workflow.scene, workflow.request, workflow.grid
        meanings = variables(grid, scene, request)
        flags = {name: meanings[name][1] for name in ("status", "verdict") if name in meanings}
        self.tally = Tally(flags, request.rtol)
        self.map = coordinates(grid, scene, request), meanings, self.layout, grid.shape, tile
        self.output, self.writer, self.writes, self.room = None, ThreadPoolExecutor(1), [], {}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.writer.shutdown(cancel_futures=True)
        if self.output and not (self.output.cancelled() or self.output.exception()):
            self.output.result().discard()

    def has(self, number):
        """Block `number` is finished. Raises what writing another part has raised."""
        if not self.output:  # not sooner: it takes a while, in which the first block may be solved
            self.output = self.writer.submit(store.Output, self.workflow.path, self.kept.folder, *self.map)
            self.writes.append(self.output)
        place = self.place[number]
        self.waiting[place] -= 1
        if not self.waiting[place]:
            self.writes.append(self.writer.submit(self._write, *self.regions[place]))
        while self.writes and self.writes[0].done():
            self.writes.pop(0).result()

    def finish(self, further, told):
        """Wait for the map's variables, write `further` datasets, the counts and the history; publish the file."""
        for write in self.writes:
            write.result()
        workflow = self.workflow
        written = attributes(workflow.scene, workflow.name, workflow.request) | self.tally.attributes
        written |= {"title": workflow.title, "workflow": workflow.text, "date_created": now()}
        written["history"] = f"{now()}: {command()}"
        for ds in further:
            written |= ds.attrs
        written |= told | {"fingerprint": self.kept.of_output}
        self.kept.refuse_lost_lock()
        with store.refused(workflow.path):
            self.output.result().publish(written, further)
        return written | {"complete": 1}

    def _write(self, region, first, blocks):
        """Write the region whose blocks are numbered from `first`."""
        shape = tuple(cut.stop - cut.start for cut in region)
        if self.room.get("status", np.empty(0)).shape != shape:
            self.room = {name: np.empty(shape + extra, kind) for name, (kind, _, extra) in self.layout.items()}
        for number, block in enumerate(blocks, first):
            inside = tuple(slice(b.start - r.start, b.stop - r.start) for b, r in zip(block, region, strict=True))
            arrays = self.kept.load(number)
            self.tally.add(arrays)
            for name, values in arrays.items():
                self.room[name][inside] = values
        with store.refused(self.workflow.path):
            for name, values in self.room.items():
                self.output.result().put(name, values, region)


def plan(workflow):
    """What a run would do: points, blocks, bytes, method, estimated seconds. No kernel is called."""
    scene, request, grid = workflow.scene, workflow.request, workflow.grid
    seconds = grid.points * seconds_per_point(scene, request, grid)
    beside = {}
    for name, part in _parts_beside(workflow).items():
        beside[name], more = part.plan(workflow, _cost(scene, request, grid))
        seconds += more
    return {
        "scene": workflow.name,
        "options": ", ".join(f"{key}={value}" for key, value in request.options.items()),
        "axes": {name: counted(size, "value") for name, size in grid.sizes.items()},
        "points": grid.points,
        "blocks": len(blocks_of(workflow)),
        "bytes": grid.points * bytes_per_point(scene, request),
        "method": request.method,
        "rtol": request.rtol,
        "variables": ", ".join(name for name in layout(scene, request)),
        **beside,
        "output": str(workflow.path),
        "threads": cpus(),
        "estimated_seconds": float(f"{seconds / cpus():.2g}"),
        "not_estimated": f"writing the file; compiling {NEW if jit.is_new() else KNOWN}",
    }


def _refuse_too_large(workflow):
    """Raise BadInput if the map's blocks and its file do not fit onto the disk of its output.

    What an interrupted run has written there already needs no more room.
    """
    grid = workflow.grid
    needed = 2 * grid.points * bytes_per_point(workflow.scene, workflow.request)
    room = shutil.disk_usage(workflow.path.parent).free
    if needed > room and needed > room + unfinished.size(workflow.path):
        raise BadInput(
            f"{counted(grid.points, 'point')} need {filesize.decimal(needed)}, and the disk of {workflow.path} has "
            f"{filesize.decimal(room)} free; take fewer points, or name fewer outputs in output.variables"
        )


def bytes_per_point(scene, request):
    """Bytes of all variables at one point."""
    return sum(dtype.itemsize * prod(extra) for dtype, _, extra in layout(scene, request).values())


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
        "kernels": jit.SOURCE_HASH,
        "scene_hash": getattr(workflow.scene, "HASH", ""),
    }
