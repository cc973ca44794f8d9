"""The finished blocks of a run: one writer, each block durable as soon as it is finished."""

import contextlib
import hashlib
import io
import json
import os
import shutil
import socket
import uuid
from math import prod
from pathlib import Path

import numpy as np
from isal import isal_zlib

from survey.errors import BadInput, Damaged, Stopped
from survey.file import finished, lock, unfinished
from survey.file.disk import digest_of, refused, sync, write_atomically
from survey.file.unfinished import FUSED, from_processor

FORMAT = 3


class Blocks:
    """The finished blocks of a run in `OUT.nc.blocks/`: one writer, each block durable as soon as
    it is finished.

    Each block is labelled with its survey; the manifest, which is created first and removed last,
    informs users. Use as a context manager; raises BadInput if another run holds the output, or if
    the existing blocks belong to another survey (unless `fresh`), Damaged if their survey is
    unknown. For users, the folder also keeps `about`, the text of the `workflow`, and
    `resume_command`. If the output is complete and of the same workflow, `published` holds its
    attributes, and all that remains is to `remove` what a run may have left. A complete output of
    another one is refused, unless `fresh`, or this run `replaces` it, or its blocks show that it
    was asked to.
    """

    def __init__(
        self,
        path,
        fingerprint,
        fresh=False,
        about=None,
        workflow="",
        resume_command=None,
        text=None,
        replaces=False,
    ):
        self.folder = unfinished.folder_of(path)
        self.path = Path(path)
        self.fingerprint = {"format": FORMAT, **fingerprint}
        self.identity = _hash(self.fingerprint)
        self.of_output = of_output(fingerprint)
        self.fresh, self.replaces = fresh, replaces
        self.about, self.workflow, self.text = about or {}, workflow, text
        name = {"host": socket.gethostname(), "pid": os.getpid(), "run": uuid.uuid4().hex}
        self.lock = lock.Lock(f"{path}.lock", name)
        self.holder = name | {"folder": os.getcwd(), "resume_command": resume_command}
        self.published = None

    def __enter__(self):
        with refused(self.path):
            self._acquire()
            try:
                self._prepare()
            except BaseException:
                self.__exit__()
                raise
        return self

    def __exit__(self, *_):
        # the error that ended the run is reported, and the next run takes the lock
        with contextlib.suppress(OSError):
            self.lock.release()

    def __getstate__(self):
        # workers anywhere save blocks; only the parent process holds the lock
        return self.__dict__ | {
            "lock": None,
            "workflow": "",
            "text": None,
            "folder": self.folder.absolute(),
        }

    def done(self):
        """Numbers of the blocks that are finished."""
        return {int(file.stem) for file in self.folder.glob("*.block") if file.stem.isdecimal()}

    def intact(self):
        """Numbers of the finished blocks whose checksums are right; the others are removed."""
        return {number for number in self.done() if self._is_intact(number)}

    def save(self, number, arrays):
        """Keep the arrays of block `number`; once this returns, they survive a power cut."""
        with refused(self.path):
            write_atomically(
                self._file(number), lambda file: pack(arrays, file, self._label(number))
            )

    def keep(self, number, arrays):
        """Save the block if this process can reach the run's folder; else return the bytes for
        `save_packed`.
        """
        if self._reaches_folder():
            self.save(number, arrays)
            return None
        file = io.BytesIO()
        pack(arrays, file, self._label(number))
        return file.getvalue()

    def save_packed(self, number, content):
        """Save the bytes of a block that `keep` returned in another process."""
        with refused(self.path):
            write_atomically(self._file(number), content)

    def once(self, name, make):
        """The arrays that an earlier run has kept under this name, else those of `make()`, which are kept."""
        file, label = self.folder / f"{name}.extra", self._label(name)
        with contextlib.suppress(OSError, ValueError):
            return unpack(file.read_bytes(), label)
        arrays = make()
        with refused(self.path):
            write_atomically(file, lambda opened: pack(arrays, opened, label))
        return arrays

    def load(self, number):
        """The arrays of block `number`; raises Damaged (and removes the block) if its checksum is wrong."""
        with refused(self.path, "reading a block"):
            try:
                return self._read(number)
            except (FileNotFoundError, ValueError) as error:
                self._file(number).unlink(missing_ok=True)
                raise Damaged(
                    f"{self._file(number)}: this block is damaged ({error}); run the command again"
                ) from None

    def refuse_lost_lock(self):
        """Raise Stopped if the lock names another run: without shared locks, a suspended run may lose it."""
        if not self.lock.owned():
            raise Stopped(
                f"{self.path}: another run has taken its lock while this one was suspended; wait, or use -o"
            )

    def remove(self):
        """Remove the blocks and the lock, once the output is complete."""
        try:
            clear(self.folder)
            self.lock.release()
        except OSError as error:
            raise Stopped(
                f"{self.path} is complete, but its blocks could not be removed ({error.strerror}: {error.filename}); "
                "fix this and run the command again"
            ) from None

    def _reaches_folder(self):
        """Does this process see the same folder as the run's parent?"""
        return unfinished.table(self.folder / "holder.json") == self.holder

    def _file(self, number):
        return self.folder / f"{number:08d}.block"

    def _label(self, name):
        """The label of a file in the folder: its survey and its part."""
        return f"{self.identity} {name}"

    def _read(self, number):
        return unpack(self._file(number).read_bytes(), self._label(number))

    def _is_intact(self, number):
        try:
            self._read(number)
        except (OSError, ValueError):
            self._file(number).unlink(missing_ok=True)
            return False
        return True

    def _acquire(self):
        """Acquire the lock."""
        try:
            self.lock.acquire()
        except lock.Held as held:
            raise BadInput(
                f"{self.path}: another run is writing it ({held}); wait, or use -o"
            ) from None

    def _prepare(self):
        if self.fresh:
            clear(self.folder)
        files = [file for file in self.folder.glob("*") if file.suffix in (".block", ".extra")]
        self._refuse_other_survey(files)
        if not self.fresh and self._complete(bool(files) or self.replaces):
            return
        if not files:  # then nothing is lost
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
            f"{manifest} is missing or damaged, and the blocks beside it belong to another survey; "
            "--fresh deletes them and starts again, -o writes to another file"
        )

    def _is_foreign(self, file):
        """Is the file intact and of another survey? (A damaged one is of no use to any.)"""
        try:
            if label_of(file).startswith(f"{self.identity} "):
                return False
            checked(file.read_bytes())
        except (OSError, ValueError):
            return False
        return True

    def _complete(self, begun):
        """Is the output complete and of the same workflow? If so, set `published`, and keep one
        digest beside it.

        Raises BadInput if it is complete and of another workflow, and no run that replaces it has
        `begun`.
        """
        found = {} if self.text is None else finished.attributes(self.path)
        if not found or finished.lost(found):
            return False
        if found.get("fingerprint") != self.of_output or finished.changes(found, self.text):
            if not begun:
                code, own = self.about.get("code", {}), self.fingerprint.get("scene_hash", "")
                processor = other_processor(self.fingerprint, found)
                finished.refuse(self.path, found, self.text, code, own, processor)
            return False
        digest = digest_of(self.path)
        # the run ended between file and digest
        if digest.exists() and digest.read_bytes().count(b"\n") > 1:
            self.folder.mkdir(exist_ok=True)
            with open(self.path, "rb") as file:
                line = f"{hashlib.file_digest(file, 'sha256').hexdigest()}  {self.path.name}\n".encode()
            write_atomically(digest, line, self.folder)
        self.published = found
        return True


def of_output(fingerprint):
    """Hash of what decides the values of an output, which does not depend on the format of its blocks, or on how
    it was cut into them.
    """
    apart = ("format", "block_geometry")
    return _hash({key: value for key, value in fingerprint.items() if key not in apart})


def other_processor(fingerprint, attributes):
    """`from a processor ...` where a file of these attributes differs from an output of this fingerprint in that
    alone; else "".
    """
    fused = not fingerprint.get(FUSED)
    alone = attributes.get("fingerprint") == of_output(fingerprint | {FUSED: fused})
    return from_processor(fused) if alone else ""


def _hash(table):
    """Hash (16 hex digits) of a table."""
    return hashlib.sha256(json.dumps(table, sort_keys=True).encode()).hexdigest()[:16]


def clear(folder):
    """Remove a run's folder, its manifest last, so that what an interruption leaves can be identified."""
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
    """Write the arrays to a binary file: a line with the label and their names, their bytes padded
    to multiples of 8, and a checksum."""
    names = {name: (array.dtype.str, array.shape) for name, array in arrays.items()}
    parts = [json.dumps([label, names]).encode() + b"\n"] + [
        np.ascontiguousarray(array) for array in arrays.values()
    ]
    check = 0
    for part in parts:
        for piece in (part, bytes(-memoryview(part).nbytes % 8)):
            file.write(piece)
            check = isal_zlib.crc32(piece, check)
    file.write(check.to_bytes(8, "little"))


def unpack(content, label=None):
    """The arrays that `pack` wrote; raises ValueError if a bit has changed, or if the label differs."""
    body = checked(content)
    offset = content.index(b"\n") + 1
    own, names = json.loads(content[:offset])
    if label not in (None, own):
        raise ValueError("it belongs to another survey")
    arrays = {}
    for name, (kind, shape) in names.items():
        offset += -offset % 8
        arrays[name] = np.frombuffer(body, kind, prod(shape), offset).reshape(shape)
        offset += arrays[name].nbytes
    return arrays


def checked(content):
    """What a block of any format contains before its checksum; raises ValueError if a bit has changed."""
    body, check = memoryview(content)[:-8], content[-8:]
    if len(content) < 16 or isal_zlib.crc32(body).to_bytes(8, "little") != check:
        raise ValueError("its checksum is wrong")
    return body


def label_of(file):
    """The label that `pack` wrote, not verified; empty if there is none."""
    with open(file, "rb") as opened:
        head = json.loads(opened.readline())
    return head[0] if isinstance(head, list) and head and isinstance(head[0], str) else ""
