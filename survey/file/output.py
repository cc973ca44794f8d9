"""The netCDF file of a map, written piece by piece and put in its place at once."""

import contextlib
import hashlib
from pathlib import Path

import numpy as np

from survey.file.disk import digest_of, publish, refused, write_atomically
from survey.grid import halved

TILE_POINTS = 2**16


class OutputFile:
    """The netCDF file of a map, written piece by piece beside the blocks; `publish` puts it in its place.

    `coordinates`, `variables` and `layout` are those of `survey.file.labels`; `shape` is the map's.
    """

    def __init__(self, path, folder, coordinates, variables, layout, shape, tile):
        from survey.file import netcdf

        self.path, self.part, self.beside = Path(path), folder / "output.nc", {}
        self.file, self.published = None, False
        with refused(self.path):
            try:
                self.file = netcdf.File(self.part)
                self._define_map(coordinates, variables, layout, shape, tile)
            except BaseException:
                self.discard()
                raise

    def discard(self):
        """Close and remove what is not published."""
        if self.file:
            self.file.discard()
        if not self.published:
            with contextlib.suppress(OSError):  # the folder goes with what is left in it
                self.part.unlink(missing_ok=True)

    def put(self, name, values, where=()):
        """Write values of a variable of the map, all or those at `where` (slices at the edges of tiles)."""
        from survey.file import tiles

        self.file.write(tiles.write, name, values, where)

    def publish(self, attributes, further=()):
        """Add the `further` datasets' variables but those that are there and the attributes, `complete` last; put the
        file in its place, its digest beside it (`OUT.nc.sha256`)."""
        for ds in further:
            self._add(ds)
        self.file.describe(attributes | {"complete": np.int8(1)})
        self.file.close()
        with open(self.part, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        beside = digest_of(self.path)
        # both digests stand until the rename is done, so that no instant shows a sound file as damaged
        old = beside.read_bytes() if beside.exists() and self.path.exists() else b""
        line = f"{digest}  {self.path.name}\n".encode()
        write_atomically(beside, old + line, self.part.parent)
        publish(self.part, self.path)
        self.published = True
        write_atomically(beside, line, self.part.parent)

    def _define_map(self, coordinates, variables, layout, shape, tile):
        for name, (dims, values, meaning) in coordinates.items():
            values = np.asarray(values)
            if values.dtype.kind == "U":  # CF knows labels of a dimension as arrays of characters only
                values = np.char.encode(values, "utf-8")
                values = values.view("S1").reshape(*values.shape, -1)
                dims, meaning = (*dims, f"{name}_length"), meaning | {"_Encoding": "utf-8"}
            self.file.define(name, dims, values.shape, values.dtype, meaning, values=values)
        self.beside = {name: set(dims) for name, (dims, _, _) in coordinates.items() if name not in dims}
        for name, (dims, meaning) in variables.items():
            dtype, _, extra = layout[name]
            self.file.define(name, dims, shape + extra, dtype, meaning | self._beside(dims), tile + extra)

    def _add(self, ds):
        for name, variable in ds.variables.items():
            if name not in self.file:
                tile, meaning = halved(variable.shape, TILE_POINTS), variable.attrs | self._beside(variable.dims)
                self.file.define(
                    name, variable.dims, variable.shape, variable.dtype, meaning, tile, values=variable.values
                )

    def _beside(self, dims):
        """The attribute that names the coordinates that are no dimensions of their own."""
        names = sorted(name for name, needed in self.beside.items() if needed <= set(dims))
        return {"coordinates": " ".join(names)} if names else {}
