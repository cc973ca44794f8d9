"""What a run would do, without a kernel call."""

import shutil

from rich import filesize

from survey.errors import BadInput
from survey.file import unfinished
from survey.file.labels import layout
from survey.sweep import announce, edges_and_cells, measured
from survey.sweep.cost import blocks_of, bytes_per_point, lone_cost, seconds_per_point
from survey.sweep.dispatch import cpus
from survey.wording import counted

START, PICTURE = 1.2, 1.0  # seconds of a process's start, and of drawing a picture
WRITTEN = 5e7  # bytes a second
LEARNT = "runs on this machine"
GUESSED = (
    "a typical machine; the next plan will use the time that this run takes, if it is over a second"
)


def estimates(workflow, threads=None):
    """({"kernels", "further": seconds of a usual machine}, what is known of edges and cells), on so
    many threads, by default one for each processor.
    """
    scene, request, grid = workflow.scene, workflow.request, workflow.grid
    threads = threads or cpus()
    one_thread = grid.points * seconds_per_point(scene, request, grid)
    seconds = {"kernels": one_thread / threads, "further": 0.0}
    parts = {}
    for name, module in edges_and_cells.requested(workflow).items():
        parts[name], more = module.plan(workflow, lone_cost(scene, request, grid), threads)
        seconds["further"] += more
    return seconds, parts


def plan(workflow):
    """What a run would do: points, blocks, bytes, method, estimated seconds, as plain data; no
    kernel is called.

    Estimates are corrected by what earlier runs on this machine have taken.
    """
    scene, request, grid = workflow.scene, workflow.request, workflow.grid
    seconds, parts = estimates(workflow)
    size = grid.points * bytes_per_point(scene, request)
    total = sum(value * measured.factor(workflow, name, value) for name, value in seconds.items())
    total += START + PICTURE * len(workflow.figures) + size / WRITTEN
    return {
        "scene": workflow.name,
        "options": ", ".join(f"{key}={value}" for key, value in request.options.items()),
        "axes": {name: counted(size, "value") for name, size in grid.sizes.items()},
        "points": grid.points,
        "blocks": len(blocks_of(workflow)),
        "bytes": size,
        "size": filesize.decimal(size),
        "method": request.method,
        **_remark(scene),
        "rtol": request.rtol,
        "variables": ", ".join(name for name in layout(scene, request)),
        **parts,
        "output": str(workflow.path),
        "threads": cpus(),
        "estimated_seconds": float(f"{total:.2g}"),
        "time": lasting(total),
        "time_from": LEARNT if measured.knows(workflow) else GUESSED,
        "compiling": _compiling(workflow),
    }


def _remark(scene):
    """What the scene itself says of its cost, if anything."""
    words = getattr(scene, "remark", None)
    return {"remark": words} if words else {}


def _compiling(workflow):
    """What the estimated time leaves out: compiling, in words."""
    spent, done = measured.compiling(workflow)
    if done:
        return "done already"
    usual = announce.seconds(
        workflow.name, workflow.scene, workflow.refine is not None, workflow.request
    )
    about = lasting(usual if spent is None else spent)
    own = announce.always_compiled(workflow.scene)
    when = "at each run, as the equation is your own" if own else "once on this machine"
    return f"{about} besides, {when}"


def lasting(seconds):
    """`about 40 s`, `about 3 min`, `about 5.2 h`."""
    for unit, length in (("h", 5400.0), ("min", 90.0)):
        if seconds >= length:
            return f"about {seconds / (3600.0 if unit == 'h' else 60.0):.2g} {unit}"
    return f"about {max(seconds, 1.0):.2g} s"


def refuse_too_large(workflow):
    """Raise BadInput if the map's blocks and its file do not fit onto the disk of its output.

    The space that an interrupted run has used already counts as free.
    """
    grid = workflow.grid
    needed = 2 * grid.points * bytes_per_point(workflow.scene, workflow.request)
    free = shutil.disk_usage(workflow.path.parent).free
    if needed > free and needed > free + unfinished.size(workflow.path):
        raise BadInput(
            f"{counted(grid.points, 'point')} need {filesize.decimal(needed)}, and the disk of {workflow.path} has "
            f"{filesize.decimal(free)} free; use fewer points, or name fewer outputs in output.variables"
        )
