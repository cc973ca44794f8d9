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
from survey.wording import shown

PIECE = 2**20  # points that are read at once where a file has no tiles
NETCDF = (b"\x89HDF", b"CDF")  # first bytes of a netCDF file
DIGEST = 2**12  # bytes: a line or two
IN_MEMORY = 2**28  # bytes: a larger file is opened lazily


def attributes_of(path):
    """The global attributes of a netCDF file."""
    import netCDF4

    with netCDF4.Dataset(path) as file:
        return {name: file.getncattr(name) for name in file.ncattrs()}


def load(path, chunks="auto"):
    """The complete dataset in `path`: in memory and the file closed if it takes at most IN_MEMORY
    bytes, else lazy.

    Lazy means dask arrays; with `chunks` None, arrays that read what is indexed from the file
    immediately. Raises BadInput (not a file of survey) or Damaged (incomplete, or its bits have
    changed).
    """
    import netCDF4

    try:
        path = Path(path)
    except TypeError:
        several = "; survey.concat joins several" if isinstance(path, list | tuple) else ""
        raise BadInput(
            f"open: give the path of a netCDF file written by survey run, not {shown(path)}{several}"
        ) from None
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
        raise Damaged(
            error
            if str(error).startswith(str(path))
            else f"{path}: {error}; ask its author for an intact copy"
        ) from None
    except PermissionError:
        raise BadInput(
            f"{path}: permission denied: make it readable, for example with chmod u+r"
        ) from None
    except Exception as error:  # the libraries that decode an untrusted file may raise anything
        raise Damaged(f"{path}: cannot be read ({error}); run the workflow again") from None


def _opened(path, chunks=None):
    """The checked dataset, lazy."""
    import xarray as xr

    ds = xr.open_dataset(
        path, engine="netcdf4", chunks=chunks, decode_times=False, decode_timedelta=False
    )
    try:
        schema.check(ds)
    except BaseException:
        ds.close()
        raise
    return ds


def _refuse_absent(path):
    left = {} if path.exists() else unfinished.summary(path)
    if left:
        raise Damaged(f"{path}: this file does not exist yet; {unfinished.sentence(left)}")
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "there is no such file"
        raise BadInput(f"{path}: {what}; name a netCDF file written by survey run")


def _refuse_changed(path):
    """Raise Damaged if the file does not match its digest, BadInput if it has none and is not a
    netCDF file.
    """
    digest = digest_of(path)
    with open(path, "rb") as file:
        if digest.exists():
            if hashlib.file_digest(file, "sha256").hexdigest().encode() not in _head(digest):
                raise Damaged(
                    f"{path}: the file's bits differ from the digest in {digest.name}; run the workflow again"
                )
        elif not file.read(4).startswith(NETCDF):
            raise BadInput(
                f"{path}: this is not a netCDF file of survey; name one written by survey run"
            )


def _head(path):
    """The beginning of a digest's file; nothing if it is not a regular file."""
    if not path.is_file():
        return b""
    with open(path, "rb") as file:
        return file.read(DIGEST)


def _refuse_foreign(path, file):
    """Raise BadInput if survey did not write the open netCDF file, Damaged if it is not complete."""
    names = file.ncattrs()
    if "status" not in file.variables or "scene" not in names:
        raise BadInput(
            f"{path}: this netCDF file was not written by survey; name one written by survey run"
        )
    if "complete" not in names or not np.array_equal(np.ravel(file.getncattr("complete")), [1]):
        raise Damaged(f"{path}: the file is incomplete; run the workflow again")


def undigested(path):
    """[a sentence on what is checked nevertheless] if there is no digest beside the file, else []."""
    path, digest = Path(path), digest_of(path)
    if digest.exists():
        return []
    return [
        f"{path}: there is no digest {digest.name} beside it, so a change by another program would go unnoticed (the "
        "checksums of its data, counts, status, and some points solved again are checked); copy the digest here too, "
        f"or accept the file as it is: sha256sum {shlex.quote(str(path))} > {shlex.quote(str(digest))}"
    ]


def check(path, ds=None):
    """Sentences on what is wrong with the file (none if it is sound): digest, checksums, counts,
    status.

    `ds` is the dataset of `load`, if it is already open. Raises what `load` raises.
    """
    ds = load(path) if ds is None else ds
    complaints = undigested(path)
    recount = tally(ds)
    wrong = {}
    for arrays in pieces(ds):
        recount.add(arrays)
        wrong |= dict.fromkeys(_unsound(path, arrays))
    for key, right in recount.attributes.items():
        stored = ds.attrs.get(key)
        if not any(
            np.array_equal(stored, value)
            for value in (right, recount.old_attributes.get(key, right))
        ):
            complaints.append(f"{path}: {key} is {stored!r}, but the data give {right!r}")
    for name, number in recount.counts.items():
        if sum(number.values()) != recount.points:
            complaints.append(f"{path}: {name} contains codes that are not among its flag_values")
    if recount.counts["status"].get("pending"):
        complaints.append(f"{path}: some points are still pending")
    return complaints + list(wrong)


def pieces(ds):
    """Yield the map's variables, one row of tiles at a time: {name: array}, the points' dimensions first."""
    point = ds.status.dims
    names = [name for name in ds.data_vars if set(point) <= set(ds[name].dims)]
    first_dim = point[:1]
    rows = max(1, PIECE // max(1, prod(ds.status.shape[1:])))
    step = (ds.status.encoding.get("chunksizes") or (rows,))[0] if first_dim else 1
    for first in range(0, ds.sizes[first_dim[0]] if first_dim else 1, step):
        part = ds[names].isel({dim: slice(first, first + step) for dim in first_dim})
        yield {name: part[name].transpose(*point, ...).values for name in names}


def _unsound(path, arrays):
    """Yield what contradicts a status of ok or an error bar."""
    bad = arrays["status"] != status.OK
    for name in arrays:
        if f"{name}_error" not in arrays:
            continue
        if not (np.isfinite(arrays[name]) == np.isfinite(arrays[f"{name}_error"])).all():
            yield f"{path}: {name} and its error bar are not finite at the same points"
        if np.isinf(arrays[name].reshape(*bad.shape, -1)[~bad]).any():
            yield f"{path}: {name} is infinite where status is ok"
