"""The netCDF file of a survey, read and checked: digest, completeness, counts."""

import hashlib
import shlex
from math import prod
from pathlib import Path

import numpy as np

from survey import status
from survey.errors import BadInput, Damaged, Stopped
from survey.file import schema, unfinished
from survey.file.disk import digest_of
from survey.file.labels import tally

PIECE = 2**20  # points that are read at once where a file has no tiles
NETCDF = (b"\x89HDF", b"CDF")  # how a netCDF file begins
DIGEST = 2**12  # bytes: a line or two
IN_MEMORY = 2**28  # bytes: a larger file is opened lazily


def attributes_of(path):
    """The global attributes of a netCDF file."""
    import netCDF4

    with netCDF4.Dataset(path) as file:
        return {name: file.getncattr(name) for name in file.ncattrs()}


def load(path, chunks="auto"):
    """The complete dataset in `path`: in memory and the file closed if it takes at most IN_MEMORY bytes, else lazy.

    Lazy means dask arrays; with `chunks` None, arrays that read from the file what is indexed, at once.
    Raises BadInput (no file of survey) or Damaged (one that is incomplete, or whose bits have changed).
    """
    import netCDF4

    path = Path(path)
    _refuse_absent(path)
    try:
        _refuse_changed(path)
        with netCDF4.Dataset(path) as file:
            _refuse_foreign(path, file)
            schema.check_declared(file, path.stat().st_size)
        with _opened(path) as ds:
            if ds.nbytes <= IN_MEMORY:
                return ds.load()
        return _opened(path, chunks)
    except (BadInput, Stopped):
        raise
    except Damaged as error:
        raise Damaged(error if str(error).startswith(str(path)) else f"{path}: {error}; ask who wrote it") from None
    except PermissionError:
        raise BadInput(f"{path}: this file must not be read; allow it, such as with chmod u+r") from None
    except Exception as error:  # a stranger's file may make the libraries that decode it raise anything
        raise Damaged(f"{path}: cannot be read ({error}); run the workflow again") from None


def _opened(path, chunks=None):
    """The checked dataset, lazy."""
    import xarray as xr

    ds = xr.open_dataset(path, engine="netcdf4", chunks=chunks, decode_times=False, decode_timedelta=False)
    try:
        schema.check(ds)
    except BaseException:
        ds.close()
        raise
    return ds


def _refuse_absent(path):
    left = {} if path.exists() else unfinished.summary(path)
    if left:
        raise Damaged(f"{path}: it is not there yet; {unfinished.sentence(left)}")
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "there is no such file"
        raise BadInput(f"{path}: {what}; name the netCDF file that survey run wrote")


def _refuse_changed(path):
    """Raise Damaged if the digest beside the file is of other bits, BadInput if it has none and is no netCDF file."""
    beside = digest_of(path)
    with open(path, "rb") as file:
        if beside.exists():
            if hashlib.file_digest(file, "sha256").hexdigest().encode() not in _head(beside):
                raise Damaged(
                    f"{path}: the file's bits differ from the digest in {beside.name}; run the workflow again"
                )
        elif not file.read(4).startswith(NETCDF):
            raise BadInput(f"{path}: this is not a netCDF file of survey; name one that survey run wrote")


def _head(path):
    """What a digest's file says; no more is read, and nothing of what is no file."""
    if not path.is_file():
        return b""
    with open(path, "rb") as file:
        return file.read(DIGEST)


def _refuse_foreign(path, file):
    """Raise BadInput if the open netCDF file is not of survey, Damaged if it is not complete."""
    names = file.ncattrs()
    if "status" not in file.variables or "scene" not in names:
        raise BadInput(f"{path}: this netCDF file was not written by survey; name one that survey run wrote")
    if "complete" not in names or not np.array_equal(np.ravel(file.getncattr("complete")), [1]):
        raise Damaged(f"{path}: the file is incomplete; run the workflow again")


def undigested(path):
    """[a sentence that says what is checked nonetheless] where no digest lies beside the file, else []."""
    path, beside = Path(path), digest_of(path)
    if beside.exists():
        return []
    return [
        f"{path}: there is no digest {beside.name} beside it, so what another program has changed goes unseen (what is "
        "checked: the checksums of its data, counts, status, and some points anew); copy the digest here too, or "
        f"take the file as it is: sha256sum {shlex.quote(str(path))} > {shlex.quote(str(beside))}"
    ]


def check(path, ds=None):
    """Sentences that say what is wrong with the file (none if it is sound): digest, reading, counts, status.

    `ds` is what `load` gave, if that is known. Raises what `load` raises.
    """
    ds = load(path) if ds is None else ds
    complaints = undigested(path)
    again, wrong = tally(ds), {}
    for arrays in pieces(ds):
        again.add(arrays)
        wrong |= dict.fromkeys(_unsound(path, arrays))
    for key, told in again.attributes.items():
        said = ds.attrs.get(key)
        if not any(np.array_equal(said, right) for right in (told, again.before.get(key, told))):
            complaints.append(f"{path}: {key} says {said!r}, the data say {told!r}")
    for name, number in again.counts.items():
        if sum(number.values()) != again.points:
            complaints.append(f"{path}: {name} holds codes that its flag_values do not name")
    if again.counts["status"].get("pending"):
        complaints.append(f"{path}: some points are still pending")
    return complaints + list(wrong)


def pieces(ds):
    """The map's variables, row by row of its tiles: {name: array} each time, the points' dimensions first."""
    point = ds.status.dims
    names = [name for name in ds.data_vars if set(point) <= set(ds[name].dims)]
    cut = point[:1]
    rows = max(1, PIECE // max(1, prod(ds.status.shape[1:])))
    step = (ds.status.encoding.get("chunksizes") or (rows,))[0] if cut else 1
    for first in range(0, ds.sizes[cut[0]] if cut else 1, step):
        some = ds[names].isel({dim: slice(first, first + step) for dim in cut})
        yield {name: some[name].transpose(*point, ...).values for name in names}


def _unsound(path, arrays):
    """What a status of ok, or an error bar, denies."""
    bad = arrays["status"] != status.OK
    for name in arrays:
        if f"{name}_error" not in arrays:
            continue
        if not (np.isfinite(arrays[name]) == np.isfinite(arrays[f"{name}_error"])).all():
            yield f"{path}: {name} and its error bar are not finite at the same points"
        if np.isinf(arrays[name].reshape(*bad.shape, -1)[~bad]).any():
            yield f"{path}: {name} is infinite where status is ok"
