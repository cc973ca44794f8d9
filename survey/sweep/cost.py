"""What a point costs, and so how a grid is cut into blocks and regions."""

from math import prod

import numpy as np

from survey import measures
from survey.errors import BadInput
from survey.file import output
from survey.file.labels import layout
from survey.wording import counted

BLOCK_SECONDS = 0.5
BLOCK_POINTS = 2**17
MOST_BLOCKS = 4 * 10**6  # each is a file
# what the writer holds at a time: enough for the tiles to be square, little beside what else a process takes
REGION_POINTS, REGION_BYTES = 2**20, 2**25


def seconds_per_point(scene, request, grid):
    """The scene's rough figure for this grid, and the method's for this scene."""
    seconds = _cost(scene, request, grid)
    if request.method == "auto":
        return seconds
    return seconds * getattr(measures.method(request.method), "COST", {}).get(scene.FAMILY, 1.0)


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
    return grid.tiled(points_per_block(scene, request, grid), region, output.TILE_POINTS)


def blocks_of(workflow):
    """The blocks of a workflow's grid, in the order of their numbers."""
    return [block for _, blocks in regions_of(workflow)[1] for block in blocks]


def bytes_per_point(scene, request):
    """Bytes of all variables at one point."""
    return sum(dtype.itemsize * prod(extra) for dtype, _, extra in layout(scene, request).values())
