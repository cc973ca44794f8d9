"""The netCDF file of a run as it grows."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from survey.file import disk, output
from survey.file.labels import Tally, attributes, command, coordinates, layout, now, variables


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
            self.output = self.writer.submit(output.OutputFile, self.workflow.path, self.kept.folder, *self.map)
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
        with disk.refused(workflow.path):
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
        with disk.refused(self.workflow.path):
            for name, values in self.room.items():
                self.output.result().put(name, values, region)
