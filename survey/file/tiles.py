"""Tiles of a variable packed as its netCDF file says, but with ISA-L's deflate, ten times as fast as that of HDF5.

Any reader of HDF5 undoes it: the filters are its own (HDF5 File Format Specification 3.0, IV.A.2.l), in their order.
"""

import itertools

import numpy as np
from isal import isal_zlib

COLUMNS = 512  # of the table whose sums a checksum takes; they stay far below 2^64


def write(variable, values, where):
    """Write values at `where` (slices at the edges of tiles; those left out take all) of an h5py dataset.

    Raises ValueError where the values do not fill whole tiles.
    """
    values = np.asarray(values, variable.dtype)
    if not variable.chunks:
        variable[(*where, ...)] = values
        return
    where = (*where, *map(slice, variable.shape[len(where) :]))
    cuts = [range(*cut.indices(size)) for cut, size in zip(where, variable.shape, strict=True)]
    ends = zip(cuts, variable.chunks, variable.shape, strict=True)
    whole = all(cut.start % tile == 0 and (cut.stop % tile == 0 or cut.stop == size) for cut, tile, size in ends)
    if not whole or values.shape != tuple(map(len, cuts)):
        raise ValueError(f"{variable.name}: values of shape {values.shape} do not fill whole tiles at {where}")
    plist = variable.id.get_create_plist()
    filters = [(code, parameters) for code, _, parameters, _ in map(plist.get_filter, range(plist.get_nfilters()))]
    for corner in itertools.product(*map(range, [0] * values.ndim, values.shape, variable.chunks)):
        tile = values[tuple(slice(at, at + size) for at, size in zip(corner, variable.chunks, strict=True))]
        place = tuple(cut.start + at for cut, at in zip(cuts, corner, strict=True))
        variable.id.write_direct_chunk(place, packed(_whole(tile, variable), filters))


def _whole(tile, variable):
    """The tile, filled up where it reaches over the variable's edge: a file holds whole ones only."""
    if tile.shape == variable.chunks:
        return tile
    whole = np.full(variable.chunks, variable.fillvalue, variable.dtype)
    whole[tuple(map(slice, tile.shape))] = tile
    return whole


def packed(tile, filters):
    """The bytes of a tile after these filters of HDF5: [(code, parameters)]."""
    content = tile.tobytes()
    for code, parameters in filters:
        content = FILTERS[code](content, *parameters)
    return content


def deflated(content, _level):
    """zlib's format, at the level that is as small as zlib's first."""
    return isal_zlib.compress(content, 1)


def shuffled(content, size):
    """All first bytes of the elements, then all second ones and so on; what is left over stays at the end."""
    whole = len(content) // size * size
    return np.frombuffer(content, np.uint8, whole).reshape(-1, size).T.tobytes() + content[whole:]


def checked(content):
    """The content and its Fletcher checksum."""
    return content + fletcher32(content).to_bytes(4, "little")


def fletcher32(content):
    """HDF5's Fletcher-32: sums, modulo 2^16 - 1, of the big-endian words of 16 bits, and of these sums."""
    words = np.frombuffer(content + bytes(len(content) % 2), "<u2").astype(np.uint16, copy=False)
    count, whole = len(words), len(words) // COLUMNS * COLUMNS
    table, rest = words[:whole].reshape(-1, COLUMNS), words[whole:]
    # word i is in the sum of sums count - i times: its row and column tell i, so that their sums do
    rows, columns = table.sum(axis=1, dtype=np.uint64), table.sum(axis=0, dtype=np.uint64)
    total = int(rows.sum()) + int(rest.sum(dtype=np.uint64))
    before = COLUMNS * _weighted(rows) + _weighted(columns) + _weighted(rest, whole)
    # a swap of a word's bytes is a product with 2^8, as 2^16 is 1 here
    first, second = (_reduced(sums << 8) for sums in (total, count * total - before))
    return second << 16 | first


def _weighted(sums, first=0):
    """The sum of sums[i] (first + i)."""
    return int((np.arange(first, first + len(sums), dtype=np.uint64) * sums).sum())


def _reduced(number):
    """The number modulo 2^16 - 1 as HDF5 finds it: zero only if it is zero."""
    return (number - 1) % 0xFFFF + 1 if number else 0


FILTERS = {1: deflated, 2: shuffled, 3: checked}
