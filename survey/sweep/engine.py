"""A run: blocks are solved, kept, and assembled into the netCDF file."""

import contextlib
import os
import socket
import time
import tomllib
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import tomli_w

from survey import status
from survey.file import disk
from survey.file.blocks import Blocks
from survey.file.labels import counts_in, layout
from survey.sweep import cluster, dispatch, edges_and_cells, measured
from survey.sweep.assembly import Assembly
from survey.sweep.compile_ahead import compiling_ahead
from survey.sweep.cost import regions_of
from survey.sweep.fingerprint import code_version, compilers, fingerprint, refuse_other_code
from survey.sweep.plan import estimates, refuse_too_large
from survey.sweep.reuse import solve_block
from survey.sweep.time_left import TimeLeft
from survey.waiting import compile_seconds

SAMPLES = 16  # blocks, spread over the map, that are solved first


@dataclass(frozen=True)
class Finished:
    """The result of a run: the file's attributes, the counts, and seconds of wall time that do not
    overlap.
    """

    attributes: dict[str, Any]
    counts: dict[str, dict[str, int]]
    compiling: float
    computing: float
    edges_and_cells: float
    writing: float
    already_complete: bool = False


class Solved(NamedTuple):
    """A worker's report on a block: its process, the seconds it has spent compiling in total and
    solving this block, and the block itself where the worker cannot write it beside the output."""

    number: int
    process: str
    compiling: float
    seconds: float | None
    content: bytes | None = None


def numbered(number, block):
    """A block as a Job takes it: (number, ((start, stop), ...)), which is small and hashable."""
    return number, tuple((cut.start, cut.stop) for cut in block)


@dataclass(frozen=True)
class Job:
    """All that a worker needs; called with a numbered block, it solves and keeps it.

    It is sent with every block, so it must not hold all of them.
    """

    scene: Any
    request: Any
    grid: Any
    kept: Blocks
    code: dict[str, str]
    earlier: Any = None

    def __call__(self, block):
        refuse_other_code(self.code)
        number, ends = block
        cuts = tuple(slice(*pair) for pair in ends)
        began, before = time.perf_counter(), compile_seconds()
        content = self.kept.keep(
            number, solve_block(self.scene, self.request, self.grid, cuts, self.earlier)
        )
        compiled = compile_seconds()
        seconds = time.perf_counter() - began - (compiled - before)
        return Solved(number, _process(), compiled, max(seconds, 0.0), content)

    def died(self, block):
        """Keep a block whose workers died repeatedly, with status worker_died."""
        number, ends = block
        shape = tuple(stop - start for start, stop in ends)
        table = layout(self.scene, self.request)
        arrays = {
            name: np.full(shape + extra, fill, kind) for name, (kind, fill, extra) in table.items()
        }
        arrays["status"][...] = status.WORKER_DIED
        self.kept.save(number, arrays)
        return Solved(number, "", 0.0, None)


def run(
    workflow, workers=None, scheduler=None, fresh=False, progress=None, resume_command=None, block_timeout=None,
    earlier=None,
):  # fmt: skip
    """Run or resume the survey and write its netCDF file; returns a Finished.

    A region of the file is written as soon as its blocks are finished, while others are computed.
    `progress(done, total, reused, what, left)` is called as blocks and parts of the boundaries
    finish; `left()` estimates the seconds left. `resume_command` resumes the run after an
    interruption. `block_timeout`: seconds after which a worker process that has finished no block
    is replaced. `earlier`: the values of another file that are taken over, a
    survey.sweep.reuse.Earlier; the output may replace that file. Raises BadInput, Damaged or
    Stopped.
    """
    started = time.perf_counter()
    refuse_too_large(workflow)
    client = cluster.client_of(scheduler) if scheduler else contextlib.nullcontext()
    tile, regions = regions_of(workflow)
    blocks = [block for _, blocks in regions for block in blocks]
    about = {
        "points": workflow.grid.points,
        "blocks": len(blocks),
        "code": code_version() | compilers(),
    }
    kept = Blocks(
        workflow.path, fingerprint(workflow), fresh, about, _findable(workflow), resume_command, workflow.text,
        earlier is not None and os.path.exists(workflow.path) and os.path.samefile(earlier.path, workflow.path),
    )  # fmt: skip
    with disk.refused(workflow.path, "the run"), client, kept:
        if kept.published:
            kept.remove()
            return Finished(kept.published, counts_in(kept.published), 0.0, 0.0, 0.0, 0.0, True)
        reused = kept.intact()
        job = Job(workflow.scene, workflow.request, workflow.grid, kept, code_version(), earlier)
        left = TimeLeft(workflow.grid.shape, blocks, reused)
        compiled = {}
        patience = dispatch.Patience(block_timeout)

        compiles_here = len(reused) < len(blocks) and not (workers or scheduler)
        compiler = (
            compiling_ahead(workflow.scene, workflow.request)
            if compiles_here
            else contextlib.nullcontext()
        )
        with compiler, Assembly(workflow, kept, tile, regions) as assembly:

            def finished(done, solved=None):
                if solved:
                    compiled[solved.process] = solved.compiling
                    if solved.content is not None:
                        kept.save_packed(solved.number, solved.content)
                    left.took(solved.number, solved.seconds)
                    patience.took(solved.seconds)
                    assembly.finished(solved.number)
                if progress:
                    progress(len(reused) + done, len(blocks), len(reused), left=left)

            before, began = compile_seconds(), time.perf_counter()
            for number in sorted(reused):
                assembly.finished(number)
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
            further = edges_and_cells.find(workflow, kept.once, progress)
            compiling_further = compile_seconds() - before
            compiling += compiling_further
            finding = time.perf_counter() - computed - compiling_further
            timings = {
                "wall_time_s": round(time.perf_counter() - started, 3),
                "compile_time_s": round(compiling, 3),
                "blocks_reused": len(reused),
            } | ({"points_reused": earlier.points} if earlier else {})
            written = assembly.finish(further, timings)
        kept.remove()
    writing = time.perf_counter() - computed - finding - compiling_further
    computing = max(0.0, computed - began - (compiling - compiling_further))
    if not (reused or earlier or workers or scheduler or workflow.proves):
        taken = {"kernels": computing, "further": finding}
        counts = assembly.tally.counts["status"]
        lost = sum(
            counts.get(name, 0) for name, c in status.CODES.items() if c in status.UNANSWERED
        )
        unanswered = lost / max(1, sum(counts.values()))
        measured.note(workflow, estimates(workflow)[0], taken, compiling, unanswered)
    return Finished(
        written, assembly.tally.counts, compiling, computing, finding if further else 0.0, writing
    )


def _findable(workflow):
    """The workflow's text, with the path of a scene's file relative to the current folder, not to
    the workflow.
    """
    table = tomllib.loads(workflow.text)
    return (
        workflow.text
        if table["scene"] == workflow.name
        else tomli_w.dumps(table | {"scene": workflow.name})
    )


def _spread(numbers):
    """The numbers in order, but first some spread over the map, so that the time left can soon be
    estimated.
    """
    first = numbers[:: max(1, len(numbers) // SAMPLES)] if len(numbers) > 4 * SAMPLES else []
    return first + sorted(set(numbers) - set(first))


def _process():
    """A name for this process that is unique among hosts."""
    return f"{socket.gethostname()} {os.getpid()}"
