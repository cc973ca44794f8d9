"""The cost of a point, and from it how a grid is cut into blocks and regions."""

from math import prod

from survey import measures
from survey.errors import BadInput
from survey.file.labels import layout
from survey.file.map_file import TILE_POINTS
from survey.wording import counted

BLOCK_SECONDS = 0.5
BLOCK_POINTS, IN_MEMORY = 2**17, 8
MAX_BLOCKS = 4 * 10**6  # each is a file
# what the writer holds at a time: enough for square tiles, little compared to the rest of the
# process
REGION_POINTS, REGION_BYTES = 2**20, 2**25


def seconds_per_point(scene, request, grid):
    """Estimated seconds per point: the scene's cost on this grid, times the method's factor for its
    family.
    """
    seconds = scene_cost(scene, request, grid)
    if request.method == "auto":
        return seconds
    return seconds * getattr(measures.method(request.method), "COST", {}).get(scene.FAMILY, 1.0)


def scene_cost(scene, request, grid):
    """The scene's own estimate for this grid, in seconds per point."""
    dear = getattr(scene, "SECONDS", {})  # such outputs come together
    seconds = scene.cost(
        request.options, {name: values.size for name, (_, values) in grid.parameters.items()}
    )
    return seconds + max((dear[name] for name in request.variables if name in dear), default=0.0)


def lone_cost(scene, request, grid):
    """As `scene_cost`, of points on their own, as edges and cells ask for."""
    return scene.cost(request.options, dict.fromkeys(grid.parameters, 1))


def points_per_block(scene, request, grid, share=0):
    """The number of points for which a block takes about BLOCK_SECONDS of kernel time: at most
    BLOCK_POINTS; or in memory, where a thread's `share` is more, that and IN_MEMORY times as many.
    """
    points = max(BLOCK_SECONDS / seconds_per_point(scene, request, grid), 1)
    return int(min(points, max(BLOCK_POINTS, min(share, IN_MEMORY * BLOCK_POINTS))))


def regions_of(workflow):
    """(lengths of a tile, [(region, its blocks)]) of a workflow's grid; regions have complete tiles
    and blocks.
    """
    scene, request, grid = workflow.scene, workflow.request, workflow.grid
    number = grid.points / points_per_block(scene, request, grid)
    if number > MAX_BLOCKS:
        raise BadInput(
            f"{counted(grid.points, 'point')} of {workflow.name} need {number:.1g} blocks of about {BLOCK_SECONDS} s; "
            f"at most {MAX_BLOCKS:.0e} can be stored: use fewer points, or several surveys"
        )
    region = max(1, min(REGION_POINTS, REGION_BYTES // bytes_per_point(scene, request)))
    return grid.tiled(points_per_block(scene, request, grid), region, TILE_POINTS)


def blocks_of(workflow):
    """The blocks of a workflow's grid, in the order of their numbers."""
    return [block for _, blocks in regions_of(workflow)[1] for block in blocks]


def block_geometry(workflow):
    """What determines the blocks and their numbers: points per block, and the first chunk sizes by
    dimension.
    """
    tile, regions = regions_of(workflow)
    region, blocks = regions[0]
    sizes = {"tile": tile} | {
        name: [cut.stop - cut.start for cut in cuts]
        for name, cuts in (("region", region), ("block", blocks[0]))
    }
    chunks = {
        name: dict(zip(workflow.grid.sizes, lengths, strict=True))
        for name, lengths in sizes.items()
    }
    return {"points": points_per_block(workflow.scene, workflow.request, workflow.grid)} | chunks


def bytes_per_point(scene, request):
    """Bytes of all variables at one point."""
    return sum(dtype.itemsize * prod(extra) for dtype, _, extra in layout(scene, request).values())
