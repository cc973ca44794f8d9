"""What a run would do, without a kernel call."""

import shutil

from rich import filesize

from survey.errors import BadInput
from survey.file import unfinished
from survey.file.labels import layout
from survey.kernels import jit
from survey.sweep import edges_and_cells
from survey.sweep.cost import blocks_of, bytes_per_point, lone_cost, seconds_per_point
from survey.sweep.dispatch import cpus
from survey.wording import counted

# what remains to be compiled
ALL = "all kernels, once: none has been compiled on this machine yet (up to a minute)"
FURTHER = "kernels that no run on this machine has needed yet, once"


def plan(workflow):
    """What a run would do: points, blocks, bytes, method, estimated seconds, as plain data; no kernel is called."""
    scene, request, grid = workflow.scene, workflow.request, workflow.grid
    seconds = grid.points * seconds_per_point(scene, request, grid)
    parts = {}
    for name, module in edges_and_cells.requested(workflow).items():
        parts[name], more = module.plan(workflow, lone_cost(scene, request, grid))
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
        **parts,
        "output": str(workflow.path),
        "threads": cpus(),
        "estimated_seconds": float(f"{seconds / cpus():.2g}"),
        "not_estimated": f"writing the file; compiling {ALL if jit.is_new() else FURTHER}",
    }


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
