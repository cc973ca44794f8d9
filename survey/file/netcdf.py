"""netCDF-4 files written with h5py into a file that is ours: HDF5 never meets a system call that fails.

Where the disk refuses, HDF5 keeps what it could not write and may end the process at any later call, even as it closes
the file. So a `Sink` writes for it, keeps the first error to itself, and serves what is not on the disk from memory.
Structure: netCDF-4 format, NetCDF User's Guide, Appendix B (dimensions are HDF5's dimension scales).
"""

import contextlib
import os

import h5py
import numpy as np

VERSIONS = ("earliest", "v108")  # of HDF5, whose readers know all that is written: as netCDF's own library does
# checksummed compression: readable everywhere, and every flipped bit is found
PACKED = {"compression": "gzip", "compression_opts": 1, "shuffle": True, "fletcher32": True}
BARE = "This is a netCDF dimension but not a netCDF variable.{:10d}"


class Sink:
    """A new file for HDF5 that never refuses: `error` is the first OSError, and what comes after it stays in memory."""

    def __init__(self, path):
        self.descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o666)
        self.at, self.size, self.error, self.unwritten = 0, 0, None, []

    def seek(self, offset, whence=os.SEEK_SET):
        self.at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self.at, os.SEEK_END: self.size}[whence]
        return self.at

    def tell(self):
        return self.at

    def read(self, count):
        content = bytearray(count)
        return bytes(content[: self.readinto(content)])

    def readinto(self, room):
        room = memoryview(room).cast("B")
        count = max(0, min(len(room), self.size - self.at))
        self._keep(self._read, room[:count])
        for at, content in self.unwritten:
            first, end = max(at, self.at), min(at + len(content), self.at + count)
            if first < end:
                room[first - self.at : end - self.at] = content[first - at : end - at]
        self.at += count
        return count

    def write(self, content):
        content = memoryview(content).cast("B")
        if not self.error:
            self._keep(self._write, content)
        if self.error:
            self.unwritten.append((self.at, bytes(content)))
        self.at += len(content)
        self.size = max(self.size, self.at)
        return len(content)

    def truncate(self, size):
        if not self.error:
            self._keep(os.ftruncate, self.descriptor, size)
        self.size = size
        return size

    def flush(self):
        """Nothing is held back."""

    def sync(self):
        os.fsync(self.descriptor)

    def close(self):
        descriptor, self.descriptor = self.descriptor, None
        if descriptor is not None:
            os.close(descriptor)

    def _keep(self, call, *given):
        """Do this, and keep the first error that is raised."""
        try:
            call(*given)
        except OSError as error:
            self.error = self.error or error

    def _read(self, room):
        done = 0
        while some := os.preadv(self.descriptor, [room[done:]], self.at + done):  # beyond the end are zeros
            done += some

    def _write(self, content):
        done = 0
        while done < len(content):
            done += os.pwrite(self.descriptor, content[done:], self.at + done)


class File:
    """A new netCDF-4 file at `path`: `define` its variables, `close` it. OSError says that the disk refused.

    What is written is complete only once it is closed. `discard` closes it whatever happened.
    """

    def __init__(self, path):
        self.sink, self.dimensions, self.variables = Sink(path), {}, {}
        self.file = h5py.File(self.sink, "w", track_order=True, libver=VERSIONS, locking=False)
        try:
            self.describe({"_NCProperties": f"version=2,h5py={h5py.__version__},hdf5={h5py.version.hdf5_version}"})
        except OSError:
            self.discard()
            raise

    def __contains__(self, name):
        return name in self.file

    def __getitem__(self, name):
        """The h5py dataset of a variable."""
        return self.file[name]

    def define(self, name, dims, shape, dtype, attributes, tile=None, values=None):
        """A new variable, compressed in tiles of these lengths (if any), NaN where floats are not written.

        The dimensions that the file lacks are made.
        """
        dtype = np.dtype(dtype)
        text = dtype.kind in "UO"  # strings are not packed: HDF5 keeps them elsewhere
        packed = PACKED | {"chunks": tuple(tile)} if tile and np.prod(shape) and not text else {}
        fill = np.nan if dtype.kind == "f" and tile is not None else None
        kind = h5py.string_dtype() if text else dtype
        with self._reported():
            made = self.file.create_dataset(name, shape, kind, fillvalue=fill, track_order=True, **packed)
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
        with self._reported():
            for key, value in attributes.items():
                _attach(self.file, key, value)

    def write(self, put, name, *given):
        """put(variable, *given) for a variable of the file."""
        with self._reported():
            put(self.file[name], *given)

    def close(self):
        """Complete the file, durably."""
        with self._reported():
            self._scale()
            self.file.close()
        self.sink.sync()
        self.sink.close()

    def discard(self):
        """Close what nobody wants any more."""
        self.sink.error = self.sink.error or OSError("not wanted any more")
        with contextlib.suppress(Exception):  # nothing of it is of use
            self.file.close()
        with contextlib.suppress(OSError):
            self.sink.close()

    def _scale(self):
        """Make the dimensions, and tell each variable which are its own."""
        place = {dim: number for number, dim in enumerate(self.dimensions)}
        for dim, size in self.dimensions.items():
            bare = dim not in self.variables
            scale = self.file.create_dataset(dim, (size,), ">f4", track_order=True) if bare else self.file[dim]
            scale.make_scale(BARE.format(size) if bare else dim)
            scale.attrs.create("_Netcdf4Dimid", place[dim], dtype=np.int32)
        for name, dims in self.variables.items():
            if name in place:  # a scale has no scales
                self.file[name].attrs.create("_Netcdf4Coordinates", [place[dim] for dim in dims], dtype=np.int32)
                continue
            for axis, dim in enumerate(dims):
                self.file[name].dims[axis].attach_scale(self.file[dim])

    @contextlib.contextmanager
    def _reported(self):
        """Raise what the disk has refused meanwhile, rather than what HDF5 makes of it."""
        try:
            yield
        except (OSError, RuntimeError, ValueError, KeyError) as error:
            if self.sink.error is None:
                raise OSError(f"HDF5: {error}") from error
        if self.sink.error:
            raise self.sink.error


def _attach(to, name, value):
    """An attribute as netCDF's library stores it: ASCII text as characters, numbers in one dimension."""
    if isinstance(value, str) and value.isascii():
        value = np.bytes_(value.encode()) if value else h5py.Empty("S1")
        to.attrs.create(name, value)
        return
    values = np.atleast_1d(np.asarray(value))
    text = values.dtype.kind in "UO"
    to.attrs.create(name, values.astype(object) if text else values, dtype=h5py.string_dtype() if text else None)
