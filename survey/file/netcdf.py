"""netCDF-4 files written with h5py through a file object of our own: HDF5 never meets a system call
that fails.

After a failed write, HDF5 retries what it could not write and may crash the process at any later
call, even on closing the file. So a `Sink` writes for it, records the first error, and serves what
is not on the disk from memory. Structure: netCDF-4 format, NetCDF User's Guide, Appendix B
(dimensions are HDF5's dimension scales).
"""

import contextlib
import os

import h5py
import numpy as np

# of HDF5 whose readers can read the file, as the netCDF library chooses them
VERSIONS = ("earliest", "v108")
# compression with checksums: readable everywhere, and every flipped bit is detected
PACKED = {"compression": "gzip", "compression_opts": 1, "shuffle": True, "fletcher32": True}
BARE = "This is a netCDF dimension but not a netCDF variable.{:10d}"


class Sink:
    """A new file for HDF5 that never fails: `error` is the first OSError; later writes stay in memory."""

    def __init__(self, path):
        # that one on Windows
        flags = os.O_RDWR | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0)
        self.descriptor = os.open(path, flags, 0o666)
        self.at = 0
        self.size = 0
        self.error = None
        self.unwritten = []

    def seek(self, offset, whence=os.SEEK_SET):
        self.at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self.at, os.SEEK_END: self.size}[whence]
        return self.at

    def tell(self):
        return self.at

    def read(self, count):
        content = bytearray(count)
        return bytes(content[: self.readinto(content)])

    def readinto(self, buffer):
        buffer = memoryview(buffer).cast("B")
        count = max(0, min(len(buffer), self.size - self.at))
        self._try(self._read, buffer[:count])
        for at, content in self.unwritten:
            first = max(at, self.at)
            end = min(at + len(content), self.at + count)
            if first < end:
                buffer[first - self.at : end - self.at] = content[first - at : end - at]
        self.at += count
        return count

    def write(self, content):
        content = memoryview(content).cast("B")
        if not self.error:
            self._try(self._write, content)
        if self.error:
            self.unwritten.append((self.at, bytes(content)))
        self.at += len(content)
        self.size = max(self.size, self.at)
        return len(content)

    def truncate(self, size):
        if not self.error:
            self._try(os.ftruncate, self.descriptor, size)
        self.size = size
        return size

    def flush(self):
        """Nothing is buffered."""

    def sync(self):
        os.fsync(self.descriptor)

    def close(self):
        descriptor, self.descriptor = self.descriptor, None
        if descriptor is not None:
            os.close(descriptor)

    def _try(self, call, *arguments):
        """Call, and record the first error that is raised."""
        try:
            call(*arguments)
        except OSError as error:
            self.error = self.error or error

    def _read(self, buffer):
        done = 0
        os.lseek(self.descriptor, self.at, os.SEEK_SET)
        while content := os.read(self.descriptor, len(buffer) - done):  # zeros beyond the end
            buffer[done : done + len(content)] = content
            done += len(content)

    def _write(self, content):
        done = 0
        os.lseek(self.descriptor, self.at, os.SEEK_SET)
        while done < len(content):
            done += os.write(self.descriptor, content[done:])


class NewFile:
    """A new netCDF-4 file at `path`: `define` its variables, then `close` it. Raises OSError where
    the disk does.

    The file is complete only once it is closed. `discard` closes it whatever has happened.
    """

    def __init__(self, path):
        self.sink = Sink(path)
        self.dimensions = {}
        self.variables = {}
        self.file = h5py.File(self.sink, "w", track_order=True, libver=VERSIONS, locking=False)
        try:
            self.describe(
                {
                    "_NCProperties": f"version=2,h5py={h5py.__version__},hdf5={h5py.version.hdf5_version}"
                }
            )
        except OSError:
            self.discard()
            raise

    def __contains__(self, name):
        return name in self.file

    def __getitem__(self, name):
        """The h5py dataset of a variable."""
        return self.file[name]

    def define(self, name, dims, shape, dtype, attributes, tile=None, values=None):
        """Create a variable, compressed in tiles of these lengths (if any), with floats NaN until
        they are written.

        Dimensions that the file lacks are created. Integers have the fill value that is among the
        attributes, if any.
        """
        dtype = np.dtype(dtype)
        text = dtype.kind in "UO"  # strings are not compressed: HDF5 stores them elsewhere
        packed = PACKED | {"chunks": tuple(tile)} if tile and np.prod(shape) and not text else {}
        fill = np.nan if dtype.kind == "f" and tile is not None else attributes.get("_FillValue")
        kind = h5py.string_dtype() if text else dtype
        with self._disk_errors():
            made = self.file.create_dataset(
                name, shape, kind, fillvalue=fill, track_order=True, **packed
            )
            if fill is not None:
                attributes = {"_FillValue": dtype.type(fill)} | attributes
            for key, value in attributes.items():
                _attach(made, key, value)
            if values is not None and np.size(values):
                made[...] = np.asarray(values, object if text else dtype)
        self.dimensions |= dict(zip(dims, shape, strict=True))
        self.variables[name] = tuple(dims)

    def describe(self, attributes):
        """Give the file these attributes."""
        with self._disk_errors():
            for key, value in attributes.items():
                _attach(self.file, key, value)

    def write(self, write, name, *arguments):
        """write(variable, *arguments) for a variable of the file."""
        with self._disk_errors():
            write(self.file[name], *arguments)

    def close(self):
        """Complete the file, durably."""
        with self._disk_errors():
            self._scale()
            self.file.close()
        self.sink.sync()
        self.sink.close()

    def discard(self):
        """Close a file that is not needed any more."""
        self.sink.error = self.sink.error or OSError("discarded")
        with contextlib.suppress(Exception):  # nothing in it is of use
            self.file.close()
        with contextlib.suppress(OSError):
            self.sink.close()

    def _scale(self):
        """Create the dimension scales, and attach them to the variables."""
        ids = {dim: number for number, dim in enumerate(self.dimensions)}
        for dim, size in self.dimensions.items():
            bare = dim not in self.variables
            scale = (
                self.file.create_dataset(dim, (size,), ">f4", track_order=True)
                if bare
                else self.file[dim]
            )
            scale.make_scale(BARE.format(size) if bare else dim)
            scale.attrs.create("_Netcdf4Dimid", ids[dim], dtype=np.int32)
        for name, dims in self.variables.items():
            if name in ids:  # a scale has no scales
                self.file[name].attrs.create(
                    "_Netcdf4Coordinates", [ids[dim] for dim in dims], dtype=np.int32
                )
                continue
            for axis, dim in enumerate(dims):
                self.file[name].dims[axis].attach_scale(self.file[dim])

    @contextlib.contextmanager
    def _disk_errors(self):
        """Raise the error of the disk, rather than what HDF5 makes of it."""
        try:
            yield
        except (OSError, RuntimeError, ValueError, KeyError) as error:
            if self.sink.error is None:
                raise OSError(f"HDF5: {error}") from error
        if self.sink.error:
            raise self.sink.error


def _attach(to, name, value):
    """Attach an attribute as the netCDF library stores it: ASCII text as characters, numbers in one
    dimension.
    """
    if isinstance(value, str) and value.isascii():
        value = np.bytes_(value.encode()) if value else h5py.Empty("S1")
        to.attrs.create(name, value)
        return
    values = np.atleast_1d(np.asarray(value))
    text = values.dtype.kind in "UO"
    to.attrs.create(
        name, values.astype(object) if text else values, dtype=h5py.string_dtype() if text else None
    )
