"""Blocks on disk, manifest, lock, atomic netCDF, digest, verify."""

import contextlib
import hashlib
import json
import os
import shutil
import socket
import zipfile
from pathlib import Path

import filelock
import netCDF4
import numpy as np
import xarray as xr

from survey import status
from survey.dataset import count, counts, encoding, error_bars
from survey.errors import BadInput, Damaged, Stopped

FORMAT = 1


class Blocks:
    """The finished blocks of a run in `OUT.nc.blocks/`: one writer, each block durable as it finishes.

    Use as a context manager; raises BadInput if another run holds the output, or if the blocks that are there
    belong to another survey (unless `fresh`).
    """

    def __init__(self, path, fingerprint, fresh=False):
        self.folder = Path(f"{path}.blocks")
        self.path = Path(path)
        self.fingerprint = {"format": FORMAT, **fingerprint}
        self.fresh = fresh
        self.lock = filelock.FileLock(f"{path}.lock", timeout=0)

    def __enter__(self):
        with refused(self.path):
            self._hold()
            if self.fresh:
                shutil.rmtree(self.folder, ignore_errors=True)
            self.folder.mkdir(exist_ok=True)
            self._same_survey()
            write_atomically(self.folder / "holder.json", json.dumps(_holder()).encode())
        return self

    def __exit__(self, *_):
        self.lock.release()

    def __getstate__(self):
        return self.__dict__ | {"lock": None}  # a worker process saves blocks; only the parent holds the lock

    def done(self):
        """Numbers of the blocks that are finished."""
        return {int(file.stem) for file in self.folder.glob("*.npz")}

    def save(self, number, arrays):
        """Keep the arrays of block `number`; once this returns, a power cut does not lose them."""
        with refused(self.path):
            write_atomically(self._file(number), lambda file: np.savez(file, **arrays))

    def load(self, number):
        """The arrays of block `number`; raises Damaged (and removes the block) if its checksum fails."""
        try:
            with np.load(self._file(number)) as file:
                return dict(file)
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            self._file(number).unlink(missing_ok=True)
            raise Damaged(f"{self._file(number)}: this block is damaged ({error}); run the command again") from None

    def remove(self):
        """Drop the blocks once the output is complete."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self.lock.release()
        Path(f"{self.path}.lock").unlink(missing_ok=True)

    def _file(self, number):
        return self.folder / f"{number:08d}.npz"

    def _hold(self):
        try:
            self.lock.acquire()
        except filelock.Timeout:
            try:
                holder = json.loads((self.folder / "holder.json").read_text())
            except (OSError, ValueError):
                holder = {"host": "another host", "pid": "unknown"}
            raise BadInput(
                f"{self.path}: another run is writing it (host {holder['host']}, pid {holder['pid']}); wait, or use -o"
            ) from None

    def _same_survey(self):
        manifest = self.folder / "manifest.json"
        if manifest.exists():
            old = json.loads(manifest.read_text())
            changed = [key for key in self.fingerprint if old.get(key) != self.fingerprint[key]]
            if changed:
                raise BadInput(
                    f"{self.folder}: these blocks belong to another survey ({', '.join(changed)} changed: "
                    f"{_short(old.get(changed[0]))} -> {_short(self.fingerprint[changed[0]])}); --fresh starts anew"
                )
        else:
            write_atomically(manifest, json.dumps(self.fingerprint, indent=1).encode())


@contextlib.contextmanager
def refused(path):
    """Turn a disk that refuses into one line."""
    try:
        yield
    except OSError as error:
        raise Stopped(
            f"{path}: writing failed ({error.strerror or error}); mend it and run the command again"
        ) from None


def write_atomically(path, content):
    """Write bytes, or what `content(file)` writes, so that `path` is absent, old or new at every instant."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with open(part, "wb") as file:
            content(file) if callable(content) else file.write(content)
            file.flush()
            os.fsync(file.fileno())
        publish(part, path)
    finally:
        part.unlink(missing_ok=True)


def publish(part, path):
    """Rename a complete file into place and make the rename durable."""
    os.replace(part, path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def write(ds, path):
    """Write the complete dataset to `path` atomically, its digest beside it (`OUT.nc.sha256`, for sha256sum)."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    with refused(path):
        try:
            ds.to_netcdf(part, engine="netcdf4", encoding=encoding(ds))
            with netCDF4.Dataset(part, "a") as file:
                file.complete = np.int8(1)
            with open(part, "rb+") as file:
                os.fsync(file.fileno())
                digest = hashlib.file_digest(file, "sha256").hexdigest()
            beside = Path(f"{path}.sha256")
            # both digests stand until the rename is done, so that no instant shows a sound file as damaged
            old = beside.read_text() if beside.exists() and path.exists() else ""
            line = f"{digest}  {path.name}\n"
            write_atomically(beside, (old + line).encode())
            publish(part, path)
            write_atomically(beside, line.encode())
        finally:
            part.unlink(missing_ok=True)


def load(path):
    """The complete dataset in `path`, in memory and the file closed; raises BadInput or Damaged."""
    path = Path(path)
    if not _digest_holds(path):
        raise Damaged(f"{path}: the file's bits differ from the digest in {path.name}.sha256; run the workflow again")
    try:
        ds = xr.load_dataset(path, engine="netcdf4")
    except (OSError, RuntimeError, ValueError) as error:
        raise Damaged(f"{path}: cannot be read ({error}); run the workflow again") from None
    if "status" not in ds or "scene" not in ds.attrs:
        raise BadInput(f"{path}: this netCDF file was not written by survey run")
    if ds.attrs.get("complete") != 1:
        raise Damaged(f"{path}: the file is incomplete; run the workflow again")
    return ds


def check(path):
    """Sentences that say what is wrong with the file (none if it is sound): digest, reading, counts, status."""
    beside = Path(f"{path}.sha256")
    ds = load(path)
    complaints = [] if beside.exists() else [f"{path}: there is no digest {beside.name} beside it"]
    again = count(ds.copy())
    for key in ("points", "accuracy_missed", "status_counts", "verdict_counts"):
        if again.attrs.get(key) != ds.attrs.get(key):
            complaints.append(f"{path}: {key} says {ds.attrs.get(key)!r}, the data say {again.attrs.get(key)!r}")
    if counts(ds.status)["pending"]:
        complaints.append(f"{path}: some points are still pending")
    bad = (ds.status != status.OK).values
    for name in error_bars(ds):
        finite = np.isfinite(ds[name].values) == np.isfinite(ds[f"{name}_error"].values)
        if not finite.all():
            complaints.append(f"{path}: {name} and its error bar are not finite at the same points")
        if np.isinf(ds[name].values.reshape(*bad.shape, -1)[~bad]).any():
            complaints.append(f"{path}: {name} is infinite where status is ok")
    return complaints


def _digest_holds(path):
    """Has the file at `path` the bits of the digest beside it (or no digest)? Raises BadInput if there is no file."""
    beside = Path(f"{path}.sha256")
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "there is no such file"
        raise BadInput(f"{path}: {what}; name the netCDF file that survey run wrote")
    with open(path, "rb") as file:
        return not beside.exists() or hashlib.file_digest(file, "sha256").hexdigest() in beside.read_text()


def _holder():
    return {"host": socket.gethostname(), "pid": os.getpid()}


def _short(value):
    text = str(value)
    return text if len(text) < 40 else text[:37] + "..."
