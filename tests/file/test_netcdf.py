"""Files are those that netCDF's own library would write, and HDF5 never hears that the disk refuses."""

import errno
import os

import netCDF4
import numpy as np
import pytest
import xarray as xr

from survey.file import netcdf, tiles

RNG = np.random.default_rng(3)
MEANING = {
    "units": "1",
    "long_name": "Länge",
    "flag_values": np.array([0, 1], np.int8),
    "number": 3,
    "empty": "",
}
MEANING |= {
    "rtol": 1e-10,
    "small": np.float32(2),
    "names": ["a", "bé"],
    "numbers": [1, 2],
    "long": "x" * 100_000,
}
VARIABLES = {  # name: (dimensions, values, lengths of a tile)
    "k": (("k",), np.linspace(0, 1, 5), None),
    "alone": ((), np.float64(3.5), None),
    "y": (("k", "rho"), RNG.random((5, 7)), (4, 4)),
    "rho": (("rho",), np.linspace(0, 1, 7), None),  # after a variable along it
    "status": (("k", "rho"), np.ones((5, 7), np.int8), (4, 4)),
    "label": (("label", "label_length"), np.array([[b"a", b"b"], [b"c", b""]], "S1"), None),
    "word": (("bare",), np.array(["aé", "b"], object), (2,)),
    "none": (("nothing",), np.zeros(0), (0,)),
}


def theirs(path):
    with netCDF4.Dataset(path, "w") as file:
        for name, (dims, values, tile) in VARIABLES.items():
            for dim, size in zip(dims, values.shape, strict=True):
                if dim not in file.dimensions:
                    file.createDimension(dim, size)
            packed = {
                "compression": "zlib",
                "complevel": 1,
                "shuffle": True,
                "fletcher32": True,
                "chunksizes": tile,
            }
            fill = np.nan if values.dtype.kind == "f" and tile else None
            kind = str if values.dtype.kind == "O" else values.dtype
            # HDF5 packs no strings, and old netCDF does not know that
            if kind is str or not (tile and values.size):
                packed = {"chunksizes": tile} if kind is str else {}
            made = file.createVariable(name, kind, dims, fill_value=fill, **packed)
            made.setncatts(MEANING)
            made[...] = values
        file.setncatts(MEANING)


def ours(path):
    file = netcdf.NewFile(path)
    for name, (dims, values, tile) in VARIABLES.items():
        file.define(
            name,
            dims,
            values.shape,
            values.dtype,
            MEANING,
            tile,
            values=None if name == "status" else values,
        )
    file.write(tiles.write, "status", VARIABLES["status"][1], ())
    file.describe(MEANING)
    file.close()


def attributes(of):
    return {name: (type(value := of.getncattr(name)), repr(value)) for name in of.ncattrs()}


def test_files_are_read_as_those_of_netcdf_itself(tmp_path):
    ours(tmp_path / "ours.nc")
    theirs(tmp_path / "theirs.nc")
    with (
        netCDF4.Dataset(tmp_path / "ours.nc") as one,
        netCDF4.Dataset(tmp_path / "theirs.nc") as other,
    ):
        assert attributes(one) == attributes(other) and list(one.variables) == list(other.variables)
        assert {name: len(dim) for name, dim in one.dimensions.items()} == {
            name: len(dim) for name, dim in other.dimensions.items()
        }
        for name in VARIABLES:
            own, known = one[name], other[name]
            assert (own.dtype, own.dimensions, own.shape) == (
                known.dtype,
                known.dimensions,
                known.shape,
            )
            assert attributes(own) == attributes(known)
            if name not in ("word", "none"):  # strings and nothing are not packed here
                assert (own.filters(), own.chunking()) == (known.filters(), known.chunking())
    xr.testing.assert_identical(
        *(xr.load_dataset(tmp_path / name) for name in ("ours.nc", "theirs.nc"))
    )
    with netCDF4.Dataset(tmp_path / "ours.nc", "a") as file:  # whoever wants to may go on
        file.createVariable("more", float, ("k", "rho"))[...] = 1.0


@pytest.mark.parametrize("at", [*range(0, 40, 3), 60, 160])
def test_the_first_error_is_reported_and_hdf5_hears_of_none(tmp_path, monkeypatch, at):
    """From the at-th call on, the disk is full."""
    calls, write = 0, os.write

    def full(*given):
        nonlocal calls
        calls += 1
        if calls > at:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(*given)

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(OSError, match="No space left"):
        file = netcdf.NewFile(tmp_path / "x.nc")
        try:
            for number in range(20):
                values = RNG.random((64, 64))
                file.define(f"x{number}", ("a", "b"), values.shape, float, MEANING, (32, 32))
                file.write(tiles.write, f"x{number}", values, ())
            file.close()
        finally:
            file.discard()
            assert not file.file, "HDF5 has closed it"
    assert calls == at + 1


def test_what_the_disk_does_not_have_is_read_from_memory(tmp_path):
    sink = netcdf.Sink(tmp_path / "x")
    sink.write(b"0123456789")
    sink.error = OSError(errno.EIO, "Input/output error")
    sink.seek(8)
    sink.write(b"abcd")
    sink.seek(6)
    assert sink.read(99) == b"67abcd" and sink.tell() == 12 and sink.seek(-2, os.SEEK_END) == 10
    os.close(sink.descriptor)
    assert (tmp_path / "x").read_bytes() == b"0123456789"
