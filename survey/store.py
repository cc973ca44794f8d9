"""Blocks on disk, manifest, lock, atomic netCDF, digest, verify."""

import contextlib
import hashlib
import io
import json
import os
import shlex
import shutil
import socket
import uuid
from math import prod
from pathlib import Path

import numpy as np
from isal import isal_zlib
from rich import filesize

from survey import lock, schema, status, unfinished
from survey.dataset import tally
from survey.errors import BadInput, Damaged, Stopped, SurveyError
from survey.grid import halved

FORMAT = 3
TILE_POINTS = 2**16
PIECE = 2**20  # points that are read at once where a file has no tiles
NETCDF = (b"\x89HDF", b"CDF")  # how a netCDF file begins
DIGEST = 2**12  # bytes: a line or two
IN_MEMORY = 2**28  # bytes: a larger file is opened lazily


class Blocks:
    """The finished blocks of a run in `OUT.nc.blocks/`: one writer, each block durable as it finishes.

    Each block says of which survey it is; the manifest beside them, which is made first and removed last, tells users.
    Use as a context manager; raises BadInput if another run holds the output, or if the blocks that are there
    belong to another survey (unless `fresh`), Damaged if it cannot be told to which. For users the folder keeps
    what `about` tells, the text of the `workflow`, and `again`, the command that goes on.
    If a run that did not end has left something beside a complete output of the same workflow, `published` is that
    output's attributes: all that is to be done is to `remove` what was left.
    """

    def __init__(self, path, fingerprint, fresh=False, about=None, workflow="", again=None, text=None):
        self.folder = unfinished.folder_of(path)
        self.path = Path(path)
        self.fingerprint = {"format": FORMAT, **fingerprint}
        self.identity = _hash(self.fingerprint)
        # of the output, which is the same however it was cut into blocks
        self.of_output = _hash({key: self.fingerprint[key] for key in self.fingerprint.keys() - {"format", "blocks"}})
        self.fresh = fresh
        self.about, self.workflow, self.text = about or {}, workflow, text
        name = {"host": socket.gethostname(), "pid": os.getpid(), "run": uuid.uuid4().hex}
        self.lock = lock.Lock(f"{path}.lock", name)
        self.holder = name | {"folder": os.getcwd(), "again": again}
        self.published = None

    def __enter__(self):
        with refused(self.path):
            left = self._hold()
            try:
                self._prepare(bool(left) or self.folder.exists())
            except BaseException:
                self.__exit__()
                raise
        return self

    def __exit__(self, *_):
        with contextlib.suppress(OSError):  # what ended the run is told, and the next one takes the lock
            self.lock.release()

    def __getstate__(self):
        # a worker saves blocks, wherever it runs; only the parent holds the lock
        return self.__dict__ | {"lock": None, "workflow": "", "text": None, "folder": self.folder.absolute()}

    def done(self):
        """Numbers of the blocks that are finished."""
        return {int(file.stem) for file in self.folder.glob("*.block") if file.stem.isdecimal()}

    def sound(self):
        """Numbers of the blocks that are finished and whose checksums hold; the others are removed."""
        return {number for number in self.done() if self._sound(number)}

    def save(self, number, arrays):
        """Keep the arrays of block `number`; once this returns, a power cut does not lose them."""
        with refused(self.path):
            write_atomically(self._file(number), lambda file: pack(arrays, file, self._label(number)))

    def keep(self, number, arrays):
        """Save the block where this process reaches the run's folder; else return the bytes that `put` saves there."""
        if self._reached():
            self.save(number, arrays)
            return None
        file = io.BytesIO()
        pack(arrays, file, self._label(number))
        return file.getvalue()

    def put(self, number, content):
        """Save a block that `keep` returned elsewhere."""
        with refused(self.path):
            write_atomically(self._file(number), content)

    def once(self, name, make):
        """The arrays that an earlier run kept under this name, else those of `make()`, kept from now on."""
        file, label = self.folder / f"{name}.extra", self._label(name)
        with contextlib.suppress(OSError, ValueError):
            return unpack(file.read_bytes(), label)
        arrays = make()
        with refused(self.path):
            write_atomically(file, lambda opened: pack(arrays, opened, label))
        return arrays

    def load(self, number):
        """The arrays of block `number`; raises Damaged (and removes the block) if its checksum fails."""
        with refused(self.path, "reading a block"):
            try:
                return self._read(number)
            except (FileNotFoundError, ValueError) as error:
                self._file(number).unlink(missing_ok=True)
                told = f"{self._file(number)}: this block is damaged ({error}); run the command again"
                raise Damaged(told) from None

    def refuse_lost_lock(self):
        """Raise Stopped if the lock names another run: where file systems share no locks, a halted run may lose it."""
        if not self.lock.owned():
            raise Stopped(f"{self.path}: another run has taken its lock, since this one had halted; wait, or use -o")

    def remove(self):
        """Drop the blocks once the output is complete, and the lock."""
        try:
            clear(self.folder)
            self.lock.release()
        except OSError as error:
            told = f"what the run kept beside it could not be removed ({error.strerror}: {error.filename})"
            raise Stopped(f"{self.path} is complete, but {told}; mend it and run the command again") from None

    def _reached(self):
        """Does this process see the very folder that the run's parent holds?"""
        return unfinished.table(self.folder / "holder.json") == self.holder

    def _file(self, number):
        return self.folder / f"{number:08d}.block"

    def _label(self, name):
        """What a file in the folder says of itself: of which survey, which part."""
        return f"{self.identity} {name}"

    def _read(self, number):
        return unpack(self._file(number).read_bytes(), self._label(number))

    def _sound(self, number):
        try:
            self._read(number)
        except (OSError, ValueError):
            self._file(number).unlink(missing_ok=True)
            return False
        return True

    def _hold(self):
        """Hold the lock; what it says of a run that has ended without removing it."""
        try:
            return self.lock.acquire()
        except lock.Held as held:
            raise BadInput(f"{self.path}: another run is writing it ({held}); wait, or use -o") from None

    def _prepare(self, left):
        if self.fresh:
            clear(self.folder)
        finished = [file for file in self.folder.glob("*") if file.suffix in (".block", ".extra")]
        self._refuse_other_survey(finished)
        if left and not self.fresh and self._complete():
            return
        if not finished:  # nothing is lost
            clear(self.folder)
        self.folder.mkdir(exist_ok=True)
        sync(self.path.parent)
        known = self.fingerprint | self.about
        if not self._is_own(unfinished.table(self.folder / "manifest.json")):
            write_atomically(self.folder / "workflow.toml", self.workflow.encode())
            write_atomically(self.folder / "manifest.json", json.dumps(known, indent=1).encode())
        write_atomically(self.folder / "holder.json", json.dumps(self.holder).encode())

    def _is_own(self, manifest):
        return all(manifest.get(key) == value for key, value in self.fingerprint.items())

    def _refuse_other_survey(self, finished):
        manifest = self.folder / "manifest.json"
        old = unfinished.table(manifest)
        if self._is_own(old) or not any(map(self._is_foreign, finished)):
            return
        changed = [key for key in self.fingerprint if old.get(key) != self.fingerprint[key]]
        if old:
            known = self.fingerprint | self.about
            raise BadInput(unfinished.drift(self.path, old, known, changed, self.workflow))
        raise Damaged(
            f"{manifest} is missing or damaged, and blocks beside it are of another survey; "
            "--fresh deletes them and starts anew, -o writes another file"
        )

    def _is_foreign(self, file):
        """Is the file sound and of another survey? (One that is not sound is of no use to any.)"""
        try:
            if label_of(file).startswith(f"{self.identity} "):
                return False
            checked(file.read_bytes())
        except (OSError, ValueError):
            return False
        return True

    def _complete(self):
        """Is the output complete and of this very workflow? Then `published` is known, and one digest beside it."""
        try:
            with open(self.path, "rb") as file:
                line = f"{hashlib.file_digest(file, 'sha256').hexdigest()}  {self.path.name}\n".encode()
            digests = digest_of(self.path).read_bytes()
            if line not in digests:
                return False
            attributes = attributes_of(self.path)
        except (OSError, RuntimeError):
            return False
        wanted = {"complete": 1, "fingerprint": self.of_output, "workflow": self.text}
        if any(attributes.get(key) != value for key, value in wanted.items()):
            return False
        if digests != line:  # the run ended between the file and its digest
            self.folder.mkdir(exist_ok=True)
            write_atomically(digest_of(self.path), line, self.folder)
        self.published = attributes
        return True


def _hash(table):
    """16 hex digits of a table's values."""
    return hashlib.sha256(json.dumps(table, sort_keys=True).encode()).hexdigest()[:16]


def clear(folder):
    """Remove a run's folder, its manifest last: whatever ends this half-way, what is left can be told."""
    if not folder.exists():
        return
    manifest = folder / "manifest.json"
    for file in sorted(folder.iterdir()):
        if file.is_dir() and not file.is_symlink():
            shutil.rmtree(file)
        elif file != manifest:
            file.unlink(missing_ok=True)
    manifest.unlink(missing_ok=True)
    folder.rmdir()


def pack(arrays, file, label=""):
    """Write the arrays to a binary file: a line with the label and their names, their bytes in multiples of 8, a
    checksum."""
    names = {name: (array.dtype.str, array.shape) for name, array in arrays.items()}
    parts = [json.dumps([label, names]).encode() + b"\n"] + [np.ascontiguousarray(array) for array in arrays.values()]
    check = 0
    for part in parts:
        for piece in (part, bytes(-memoryview(part).nbytes % 8)):
            file.write(piece)
            check = isal_zlib.crc32(piece, check)
    file.write(check.to_bytes(8, "little"))


def unpack(content, label=None):
    """The arrays that `pack` wrote; raises ValueError if a bit is not as it was, or if its label is another one."""
    body = checked(content)
    place = content.index(b"\n") + 1
    own, names = json.loads(content[:place])
    if label not in (None, own):
        raise ValueError("it is of another survey")
    arrays = {}
    for name, (kind, shape) in names.items():
        place += -place % 8
        arrays[name] = np.frombuffer(body, kind, prod(shape), place).reshape(shape)
        place += arrays[name].nbytes
    return arrays


def checked(content):
    """What a block of any format holds before its checksum; ValueError if a bit is not as it was."""
    body, check = memoryview(content)[:-8], content[-8:]
    if len(content) < 16 or isal_zlib.crc32(body).to_bytes(8, "little") != check:
        raise ValueError("its checksum fails")
    return body


def label_of(file):
    """The label that `pack` gave the file, not checked; empty for one that has none."""
    with open(file, "rb") as opened:
        head = json.loads(opened.readline())
    return head[0] if isinstance(head, list) and head and isinstance(head[0], str) else ""


@contextlib.contextmanager
def refused(path, what="writing"):
    """Turn a disk that refuses into one line; a file elsewhere is named in it."""
    try:
        yield
    except SurveyError:
        raise
    except OSError as error:
        told = error.strerror or error
        if isinstance(error.filename, (str, os.PathLike)) and not str(error.filename).startswith(str(path)):
            told = f"{told}: {error.filename}"
        with contextlib.suppress(OSError):
            told = f"{told}; {filesize.decimal(shutil.disk_usage(Path(path).parent).free)} are free"
        raise Stopped(f"{path}: {what} failed ({told}); mend it and run the command again") from None


def write_atomically(path, content, folder=None):
    """Write bytes, or what `content(file)` writes, so that `path` is absent, old or new at every instant.

    In `folder`, on the same disk, lies what is not yet complete; by default beside it.
    """
    part = (folder or path.parent) / f".{path.name}.{os.getpid()}.part"
    try:
        with open(part, "wb") as file:
            content(file) if callable(content) else file.write(content)
            file.flush()
            os.fsync(file.fileno())
        publish(part, path)
    except BaseException:
        with contextlib.suppress(OSError):  # what made it fail is told
            part.unlink(missing_ok=True)
        raise


def publish(part, path):
    """Rename a complete file into place and make the rename durable."""
    os.replace(part, path)
    sync(path.parent)


def sync(folder):
    """Make durable what was made, renamed or removed in the folder."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


class Output:
    """The netCDF file of a map, written piece by piece beside the blocks; `publish` puts it in its place.

    `coordinates`, `variables` and `layout` are those of `survey.dataset`; `shape` is the map's.
    """

    def __init__(self, path, folder, coordinates, variables, layout, shape, tile):
        from survey import netcdf

        self.path, self.part, self.beside = Path(path), folder / "output.nc", {}
        self.file, self.published = None, False
        with refused(self.path):
            try:
                self.file = netcdf.File(self.part)
                self._define_map(coordinates, variables, layout, shape, tile)
            except BaseException:
                self.discard()
                raise

    def discard(self):
        """Close and remove what is not published."""
        if self.file:
            self.file.discard()
        if not self.published:
            with contextlib.suppress(OSError):  # the folder goes with what is left in it
                self.part.unlink(missing_ok=True)

    def put(self, name, values, where=()):
        """Write values of a variable of the map, all or those at `where` (slices at the edges of tiles)."""
        from survey import tiles

        self.file.write(tiles.write, name, values, where)

    def publish(self, attributes, further=()):
        """Add the `further` datasets' variables but those that are there and the attributes, `complete` last; put the
        file in its place, its digest beside it (`OUT.nc.sha256`)."""
        for ds in further:
            self._add(ds)
        self.file.describe(attributes | {"complete": np.int8(1)})
        self.file.close()
        with open(self.part, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        beside = digest_of(self.path)
        # both digests stand until the rename is done, so that no instant shows a sound file as damaged
        old = beside.read_bytes() if beside.exists() and self.path.exists() else b""
        line = f"{digest}  {self.path.name}\n".encode()
        write_atomically(beside, old + line, self.part.parent)
        publish(self.part, self.path)
        self.published = True
        write_atomically(beside, line, self.part.parent)

    def _define_map(self, coordinates, variables, layout, shape, tile):
        for name, (dims, values, meaning) in coordinates.items():
            values = np.asarray(values)
            if values.dtype.kind == "U":  # CF knows labels of a dimension as arrays of characters only
                values = np.char.encode(values, "utf-8")
                values = values.view("S1").reshape(*values.shape, -1)
                dims, meaning = (*dims, f"{name}_length"), meaning | {"_Encoding": "utf-8"}
            self.file.define(name, dims, values.shape, values.dtype, meaning, values=values)
        self.beside = {name: set(dims) for name, (dims, _, _) in coordinates.items() if name not in dims}
        for name, (dims, meaning) in variables.items():
            dtype, _, extra = layout[name]
            self.file.define(name, dims, shape + extra, dtype, meaning | self._beside(dims), tile + extra)

    def _add(self, ds):
        for name, variable in ds.variables.items():
            if name not in self.file:
                tile, meaning = halved(variable.shape, TILE_POINTS), variable.attrs | self._beside(variable.dims)
                self.file.define(
                    name, variable.dims, variable.shape, variable.dtype, meaning, tile, values=variable.values
                )

    def _beside(self, dims):
        """The attribute that names the coordinates that are no dimensions of their own."""
        names = sorted(name for name, needed in self.beside.items() if needed <= set(dims))
        return {"coordinates": " ".join(names)} if names else {}


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
    left = {} if path.exists() else unfinished.told(path)
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


def digest_of(path):
    """Where the digest of the file at `path` lies."""
    return Path(f"{path}.sha256")


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
