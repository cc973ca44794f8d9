"""The netCDF file of a map, written piece by piece and then published in one step."""

import contextlib
import hashlib
from pathlib import Path

import numpy as np

from survey.file.disk import digest_of, publish, refused, write_atomically
from survey.grid import halved

TILE_POINTS = 2**16


class MapFile:
    """The netCDF file of a map, written piece by piece beside the blocks; `publish` moves it into
    place.

    `coordinates`, `variables` and `layout` are those of `survey.file.labels`; `shape` is the map's.
    """

    def __init__(self, path, folder, coordinates, variables, layout, shape, tile):
        from survey.file import netcdf

        self.path = Path(path)
        self.part = folder / "output.nc"
        self.auxiliary = {}
        self.file, self.published = None, False
        with refused(self.path):
            try:
                self.file = netcdf.NewFile(self.part)
                self._define_map(coordinates, variables, layout, shape, tile)
            except BaseException:
                self.discard()
                raise

    def discard(self):
        """Close and remove what is not published."""
        if self.file:
            self.file.discard()
        if not self.published:
            with contextlib.suppress(OSError):  # the folder is removed with what is left in it
                self.part.unlink(missing_ok=True)

    def write(self, name, values, where=()):
        """Write values of a variable of the map, all or those at `where` (slices from and to edges
        of tiles).
        """
        from survey.file import tiles

        self.file.write(tiles.write, name, values, where)

    def publish(self, attributes, further=()):
        """Add the new variables of the `further` datasets and the attributes, `complete` last; then
        move the file into place, with its digest beside it (`OUT.nc.sha256`)."""
        for ds in further:
            self._add(ds)
        self.file.describe(attributes | {"complete": np.int8(1)})
        self.file.close()
        with open(self.part, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        digest_path = digest_of(self.path)
        # both digests are kept until the rename is done, so that an intact file never looks damaged
        old = digest_path.read_bytes() if digest_path.exists() and self.path.exists() else b""
        line = f"{digest}  {self.path.name}\n".encode()
        write_atomically(digest_path, old + line, self.part.parent)
        publish(self.part, self.path)
        self.published = True
        write_atomically(digest_path, line, self.part.parent)

    def _define_map(self, coordinates, variables, layout, shape, tile):
        for name, (dims, values, attributes) in coordinates.items():
            values = np.asarray(values)
            # CF allows labels of a dimension as arrays of characters only
            if values.dtype.kind == "U":
                values = np.char.encode(values, "utf-8")
                values = values.view("S1").reshape(*values.shape, -1)
                dims, attributes = (*dims, f"{name}_length"), attributes | {"_Encoding": "utf-8"}
            self.file.define(name, dims, values.shape, values.dtype, attributes, values=values)
        self.auxiliary = {
            name: set(dims) for name, (dims, _, _) in coordinates.items() if name not in dims
        }
        for name, (dims, attributes) in variables.items():
            dtype, _, extra = layout[name]
            self.file.define(
                name, dims, shape + extra, dtype, attributes | self._coordinates(dims), tile + extra
            )

    def _add(self, ds):
        for name, variable in ds.variables.items():
            if name not in self.file:
                tile = halved(variable.shape, TILE_POINTS)
                attributes = variable.attrs | self._coordinates(variable.dims)
                self.file.define(
                    name,
                    variable.dims,
                    variable.shape,
                    variable.dtype,
                    attributes,
                    tile,
                    values=variable.values,
                )

    def _coordinates(self, dims):
        """CF's attribute that names the coordinates that are not dimensions themselves."""
        names = sorted(name for name, needed in self.auxiliary.items() if needed <= set(dims))
        return {"coordinates": " ".join(names)} if names else {}
