"""Where a workflow's netCDF file goes: can it be written there?"""

import errno
import os
import tempfile
from pathlib import Path

from survey.errors import BadInput, Stopped
from survey.wording import reason_of, shown

LONGEST_SUFFIX = 40  # bytes that the names of files beside the output are longer by
LONGEST_NAME = 255  # where the system does not say
OTHER_KINDS = set(
    ".cert .csv .html .ipynb .jpg .json .md .model .pdf .png .py .svg .toml .txt .xlsx .zarr .zip".split()
)


def check_path(path):
    """The output path; raises BadInput unless a file can be created there, Stopped where the disk
    is read-only.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise BadInput(f"output = {shown(path)}: give the path of a netCDF file, such as 'map.nc'")
    if not str(path):
        raise BadInput("output.path is empty; name a file, such as 'map.nc'")
    try:
        return _checked(Path(path))
    except (OSError, ValueError) as error:
        if isinstance(error, BadInput):
            raise
        raise BadInput(
            f"output.path = {shown(str(path), 120)}: no file can be created there ({reason_of(error)})"
        ) from None


def _checked(path):
    folder = path.parent
    key = f"output.path = {shown(str(path), 120)}"
    where = shown(str(folder), 120)
    if path.suffix.lower() in OTHER_KINDS:
        raise BadInput(f"{key} must be a netCDF file; name one, such as {shown(path.stem + '.nc')}")
    if path.is_file() and not _is_netcdf(path):
        raise BadInput(f"{key} exists and is not a netCDF file; move it away, or use -o OUT.nc")
    if path.is_dir():
        raise BadInput(
            f"{key} is a folder; name a file, such as {shown(str(path / 'map.nc'), 120)}"
        )
    if not folder.is_dir():
        raise BadInput(f"{key}: there is no folder {where}; create it first, or use -o OUT.nc")
    longest = os.pathconf(folder, "PC_NAME_MAX") if hasattr(os, "pathconf") else LONGEST_NAME
    if len(os.fsencode(path.name)) > longest - LONGEST_SUFFIX:
        raise BadInput(f"{key}: this name is too long for the files beside it; shorten it")
    if os.access(folder, os.W_OK | os.X_OK) and not str(folder.resolve()).startswith(
        ("/proc", "/sys")
    ):
        return path
    if _is_read_only(folder):
        raise Stopped(
            f"{key}: the disk of the folder {where} is read-only; make it writable and "
            "run the command again, or use -o OUT.nc"
        )
    raise BadInput(f"{key}: the folder {where} cannot be written to; use -o OUT.nc")


def _is_read_only(folder):
    """Is it the disk that takes no file, whoever asks?"""
    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        return error.errno == errno.EROFS
    return False


def _is_netcdf(path):
    with path.open("rb") as file:
        return file.read(4) == b"\x89HDF"
