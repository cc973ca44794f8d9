"""The netCDF file of a run, assembled from its blocks as they finish."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from survey.file import disk
from survey.file.labels import Tally, attributes, command, coordinates, layout, now, variables
from survey.file.map_file import MapFile


class Assembly:
    """The netCDF file of a run as it grows: one thread writes each region once its blocks are
    finished.

    Use as a context manager around the run; without `finish` no file is left.
    """

    def __init__(self, workflow, kept, tile, regions):
        self.workflow, self.kept = workflow, kept
        self.layout = layout(workflow.scene, workflow.request)
        self.regions, self.unfinished, self.region_of = [], [], []
        for region, blocks in regions:
            first = len(self.region_of)
            self.region_of += [len(self.regions)] * len(blocks)
            self.regions.append((region, first, blocks))
            self.unfinished.append(len(blocks))
        scene, request, grid = workflow.scene, workflow.request, workflow.grid
        described = variables(grid, scene, request)
        flags = {name: described[name][1] for name in ("status", "verdict") if name in described}
        self.tally = Tally(flags, request.rtol)
        self.map = coordinates(grid, scene, request), described, self.layout, grid.shape, tile
        self.file = None
        self.writer = ThreadPoolExecutor(1)
        self.writes = []
        self.buffers = {}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.writer.shutdown(cancel_futures=True)
        if self.file and not (self.file.cancelled() or self.file.exception()):
            self.file.result().discard()

    def finished(self, number):
        """Block `number` is finished. Raises what writing an earlier region has raised."""
        # not sooner: creating it takes time in which the first block can be solved
        if not self.file:
            self.file = self.writer.submit(MapFile, self.workflow.path, self.kept.folder, *self.map)
            self.writes.append(self.file)
        region = self.region_of[number]
        self.unfinished[region] -= 1
        if not self.unfinished[region]:
            self.writes.append(self.writer.submit(self._write, *self.regions[region]))
        while self.writes and self.writes[0].done():
            self.writes.pop(0).result()

    def finish(self, further, timings):
        """Wait for the map's variables, add `further` datasets, counts and history, and publish the
        file.

        `timings` are attributes too. Returns the attributes of the file.
        """
        for write in self.writes:
            write.result()
        workflow = self.workflow
        written = (
            attributes(workflow.scene, workflow.name, workflow.request) | self.tally.attributes
        )
        written |= {"title": workflow.title, "workflow": workflow.text, "date_created": now()}
        written["history"] = f"{now()}: {command()}"
        for ds in further:
            written |= ds.attrs
        written |= timings | {"fingerprint": self.kept.of_output}
        self.kept.refuse_lost_lock()
        with disk.refused(workflow.path):
            self.file.result().publish(written, further)
        return written | {"complete": 1}

    def _write(self, region, first, blocks):
        """Write the region whose blocks are numbered from `first`."""
        shape = tuple(cut.stop - cut.start for cut in region)
        if self.buffers.get("status", np.empty(0)).shape != shape:
            self.buffers = {
                name: np.empty(shape + extra, kind)
                for name, (kind, _, extra) in self.layout.items()
            }
        for number, block in enumerate(blocks, first):
            inside = tuple(
                slice(b.start - r.start, b.stop - r.start)
                for b, r in zip(block, region, strict=True)
            )
            arrays = self.kept.load(number)
            self.tally.add(arrays)
            for name, values in arrays.items():
                self.buffers[name][inside] = values
        with disk.refused(self.workflow.path):
            for name, values in self.buffers.items():
                self.file.result().write(name, values, region)
