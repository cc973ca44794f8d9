"""Tiles of a variable packed by the filters of its file, but with ISA-L's deflate, ten times as
fast as HDF5's.

Any reader of HDF5 decodes them: the filters are HDF5's (HDF5 File Format Specification 3.0,
IV.A.2.l), in its order.
"""

import itertools

import numpy as np
from isal import isal_zlib

COLUMNS = 512  # of the table whose sums give the checksum; they stay far below 2^64


def write(variable, values, where):
    """Write values at `where` (slices that begin and end at edges of tiles; omitted ones are full)
    of an h5py dataset.

    Raises ValueError where the values do not fill complete tiles.
    """
    values = np.asarray(values, variable.dtype)
    if not variable.chunks:
        variable[(*where, ...)] = values
        return
    where = (*where, *map(slice, variable.shape[len(where) :]))
    cuts = [range(*cut.indices(size)) for cut, size in zip(where, variable.shape, strict=True)]
    ends = zip(cuts, variable.chunks, variable.shape, strict=True)
    complete = all(
        cut.start % tile == 0 and (cut.stop % tile == 0 or cut.stop == size)
        for cut, tile, size in ends
    )
    if not complete or values.shape != tuple(map(len, cuts)):
        raise ValueError(
            f"{variable.name}: values of shape {values.shape} do not fill complete tiles at {where}"
        )
    plist = variable.id.get_create_plist()
    filters = [
        (code, parameters)
        for code, _, parameters, _ in map(plist.get_filter, range(plist.get_nfilters()))
    ]
    for corner in itertools.product(*map(range, [0] * values.ndim, values.shape, variable.chunks)):
        tile = values[
            tuple(slice(at, at + size) for at, size in zip(corner, variable.chunks, strict=True))
        ]
        offset = tuple(cut.start + at for cut, at in zip(cuts, corner, strict=True))
        variable.id.write_direct_chunk(offset, packed(_padded(tile, variable), filters))


def _padded(tile, variable):
    """The tile, padded where it extends beyond the variable: a file holds complete ones only."""
    if tile.shape == variable.chunks:
        return tile
    padded = np.full(variable.chunks, variable.fillvalue, variable.dtype)
    padded[tuple(map(slice, tile.shape))] = tile
    return padded


def packed(tile, filters):
    """The bytes of a tile after these filters of HDF5: [(code, parameters)]."""
    content = tile.tobytes()
    for code, parameters in filters:
        content = FILTERS[code](content, *parameters)
    return content


def deflated(content, level):
    """zlib's format. Level 1 is as small as that of zlib; there are none above 3."""
    return isal_zlib.compress(content, min(level, 3))


def shuffled(content, size):
    """The first bytes of all elements, then all second bytes and so on; a remainder stays at the end."""
    length = len(content) // size * size
    return np.frombuffer(content, np.uint8, length).reshape(-1, size).T.tobytes() + content[length:]


def checked(content):
    """The content and its Fletcher checksum."""
    return content + fletcher32(content).to_bytes(4, "little")


def fletcher32(content):
    """HDF5's Fletcher-32: sums, modulo 2^16 - 1, of the big-endian words of 16 bits, and of these sums."""
    words = np.frombuffer(content + bytes(len(content) % 2), "<u2").astype(np.uint16, copy=False)
    count = len(words)
    length = len(words) // COLUMNS * COLUMNS
    table = words[:length].reshape(-1, COLUMNS)
    rest = words[length:]
    # word i occurs count - i times in the sum of sums; i follows from its row and column, so their
    # sums suffice
    rows, columns = table.sum(axis=1, dtype=np.uint64), table.sum(axis=0, dtype=np.uint64)
    total = int(rows.sum()) + int(rest.sum(dtype=np.uint64))
    before = COLUMNS * _weighted(rows) + _weighted(columns) + _weighted(rest, length)
    # swapping the bytes of a word multiplies it by 2^8, as 2^16 = 1 here
    first, second = (_reduced(sums << 8) for sums in (total, count * total - before))
    return second << 16 | first


def _weighted(sums, first=0):
    """The sum of sums[i] (first + i)."""
    return int((np.arange(first, first + len(sums), dtype=np.uint64) * sums).sum())


def _reduced(number):
    """The number modulo 2^16 - 1 as HDF5 finds it: zero only if it is zero."""
    return (number - 1) % 0xFFFF + 1 if number else 0


FILTERS = {1: deflated, 2: shuffled, 3: checked}
