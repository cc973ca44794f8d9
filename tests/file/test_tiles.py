import h5py
import netCDF4
import numpy as np
import pytest

from survey.file import tiles

PACKED = {"compression": "zlib", "complevel": 1, "shuffle": True, "fletcher32": True}
RNG = np.random.default_rng(5)
CONTENTS = {
    "zeros": np.zeros((40, 31)),
    "ones": np.full((40, 31), -1, np.int64),
    "one word of ones": np.pad(np.full((1, 4), 0xFFFF, np.uint16), ((0, 39), (0, 27))),
    "one bit": np.pad(np.ones((1, 1), np.int32), ((39, 0), (30, 0))),
    "float32": RNG.normal(size=(40, 31)).astype("f4"),
    "bytes, oddly many": RNG.integers(-128, 128, (40, 31), "i1"),
    "pairs": RNG.normal(size=(40, 31, 2)),
    "big-endian": RNG.normal(size=(40, 31)).astype(">f8"),
}


def written(path, values, tile, by_us, **packing):
    """A file of these values, packed by us or by HDF5."""
    with netCDF4.Dataset(path, "w") as file:
        for number, size in enumerate(values.shape):
            file.createDimension(f"x{number}", size)
        how = (
            PACKED
            | {"chunksizes": tile, "endian": "big" if values.dtype.byteorder == ">" else "little"}
            | packing
        )
        made = file.createVariable("x", values.dtype, tuple(file.dimensions), **how)
        if not by_us:
            made[:] = values
    if by_us:
        with h5py.File(path, "r+") as file:
            tiles.write(file["x"], values, ())
    return path


def read(path):
    with netCDF4.Dataset(path) as file:
        file.set_auto_mask(False)
        return file["x"][:]


@pytest.mark.parametrize("packing", [{}, {"shuffle": False}, {"fletcher32": False}], ids=str)
@pytest.mark.parametrize("values", CONTENTS.values(), ids=CONTENTS)
def test_hdf5_undoes_what_is_packed_here(tmp_path, values, packing):
    """HDF5 refuses tiles of another checksum. Tiles at the edges reach over them."""
    tile = (17, 9, 2)[: values.ndim]
    np.testing.assert_array_equal(
        read(written(tmp_path / "x.nc", values, tile, True, **packing)), values
    )


@pytest.mark.parametrize("values", CONTENTS.values(), ids=CONTENTS)
def test_without_deflate_a_tile_has_the_very_bytes_that_hdf5_gives_it(tmp_path, values):
    """But for what lies beyond the edges: tiles that fit."""
    values, tile = values[:34, :27], (17, 9, 2)[: values.ndim]
    paths = [
        written(tmp_path / f"{by_us}.nc", values, tile, by_us, compression=None)
        for by_us in (True, False)
    ]
    with h5py.File(paths[0]) as ours, h5py.File(paths[1]) as theirs:
        for place in [(0,) * values.ndim, (17, 18, 0)[: values.ndim]]:
            assert ours["x"].id.read_direct_chunk(place) == theirs["x"].id.read_direct_chunk(place)


def test_a_flipped_bit_in_a_tile_is_found(tmp_path):
    path = written(tmp_path / "x.nc", CONTENTS["float32"], (17, 9), True, compression=None)
    with h5py.File(path) as file:
        at = file["x"].id.get_chunk_info_by_coord((17, 9)).byte_offset + 100
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)
    with pytest.raises(RuntimeError, match="HDF error"):
        read(path)


def test_pieces_come_to_their_places_in_any_order(tmp_path):
    values = RNG.normal(size=(40, 31))
    path = written(tmp_path / "x.nc", np.zeros_like(values), (8, 9), True)
    with h5py.File(path, "r+") as file:
        for where in [
            (slice(16, 40), slice(18, 31)),
            (slice(0, 16),),
            (slice(16, 40), slice(0, 18)),
        ]:
            tiles.write(file["x"], values[where], where)
    np.testing.assert_array_equal(read(path), values)


def test_values_that_do_not_fill_whole_tiles_are_refused(tmp_path):
    values = RNG.normal(size=(10, 3))
    path = written(tmp_path / "x.nc", values, (4, 3), True)
    with h5py.File(path, "r+") as file:
        for where in [(slice(0, 6),), (slice(2, 8),), (slice(0, 4), slice(0, 2))]:
            with pytest.raises(ValueError, match=r"x: values .* do not fill complete tiles"):
                tiles.write(file["x"], values[where], where)
        for given in (values[:6], np.zeros((12, 3)), values[0]):
            with pytest.raises(ValueError, match=r"x: values .* do not fill complete tiles"):
                tiles.write(file["x"], given, ())
    np.testing.assert_array_equal(read(path), values)


def test_variables_without_tiles_are_written_as_they_are(tmp_path):
    with netCDF4.Dataset(tmp_path / "x.nc", "w") as file:
        file.createDimension("pair", 2)
        file.createVariable("x", float, ())
        file.createVariable("y", float, ("pair",))
    with h5py.File(tmp_path / "x.nc", "r+") as file:
        tiles.write(file["x"], 3.5, ())
        tiles.write(file["y"], np.array([1.5, 2.5]), ())
    with netCDF4.Dataset(tmp_path / "x.nc") as file:
        assert file["x"][()] == 3.5 and file["y"][:].tolist() == [1.5, 2.5]
