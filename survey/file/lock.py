"""The lock of an output, `OUT.nc.lock`: a file that names the run writing it, removed when the run
ends.

The system's lock (flock, LockFileEx) shows at once whether a process on this host holds it. Not
every network file system shares it between hosts, so a run on another host, which the file names,
is active as long as the file's modification time advances.
"""

import contextlib
import json
import logging
import os
import socket
import threading
import time

BEAT_SECONDS = 2.0  # interval at which the holder updates the file's modification time
GONE_SECONDS = 10.0  # a holder on another host that has not updated it for so long has ended
PEEK_SECONDS = 0.2  # more than `holder` takes, which locks the file briefly
PEEKS = 5


class Held(Exception):
    """Another run holds the lock: `holder` is what its file contains."""

    def __init__(self, holder):
        super().__init__(
            f"host {holder.get('host', 'unknown')}, pid {holder.get('pid', 'unknown')}"
        )
        self.holder = holder


class Lock:
    """The lock of one output; `name`, written to the file, is a mapping with the host, the pid and
    a unique entry.
    """

    def __init__(self, path, name):
        self.path, self.name = str(path), name
        self.descriptor = None
        self.ended = threading.Event()
        self.heart = None

    def acquire(self):
        """Acquire the lock; returns the name that an interrupted run has left in it, else {}.

        Raises Held at once if a run on this host holds it, and after BEAT_SECONDS if one on another
        host does.
        """
        self.descriptor, known = self._opened()
        before = {}
        try:
            before = _name_in(self.descriptor)
            if (
                before
                and not (known and before.get("host") == socket.gethostname())
                and self._beats(before)
            ):
                raise Held(before)
            content = json.dumps(self.name).encode()
            os.lseek(self.descriptor, 0, os.SEEK_SET)
            os.write(self.descriptor, content)
            os.ftruncate(self.descriptor, len(content))
        except BaseException as error:
            if isinstance(error, Held) or before:  # not ours to remove
                os.close(self.descriptor)
                self.descriptor = None
            else:
                with contextlib.suppress(OSError):
                    self.release()
            raise
        self.heart = threading.Thread(target=self._beat, daemon=True)
        self.heart.start()
        return before

    def owned(self):
        """Does the file still name this run?"""
        with contextlib.suppress(OSError):
            return self._is_file(self.descriptor) and _name_in(self.descriptor) == self.name
        return False

    def release(self):
        """Remove the file and unlock it, if it is held. Raises OSError where it cannot be removed."""
        if self.descriptor is None:
            return
        self.ended.set()
        if self.heart:
            self.heart.join()
        descriptor, self.descriptor = self.descriptor, None
        try:
            if self._is_file(descriptor):
                # while it is held, so that nobody else can hold a lock of that name
                os.unlink(self.path)
        # Windows removes no file that is open: this one, or once another run has it
        except PermissionError:
            os.close(descriptor)
            descriptor = None
            os.unlink(self.path)
        finally:
            if descriptor is not None:
                os.close(descriptor)

    def _opened(self):
        """(the open file, which no other process on this host has locked; are locks supported here?)"""
        deadline = time.monotonic() + PEEK_SECONDS
        while True:
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                known = _locked(descriptor)
                if self._is_file(descriptor):  # and its holder has not removed it meanwhile
                    return descriptor, known
            except BlockingIOError:
                if time.monotonic() > deadline:
                    held = Held(_name_in(descriptor))
                    os.close(descriptor)
                    raise held from None
                time.sleep(PEEK_SECONDS / 10)
            os.close(descriptor)

    def _is_file(self, descriptor):
        """Is the open file still the one at the lock's path?"""
        with contextlib.suppress(FileNotFoundError):
            return os.path.samestat(os.fstat(descriptor), os.stat(self.path))
        return False

    def _beats(self, before):
        """Does the file's modification time advance? Waits up to GONE_SECONDS."""
        message = "%s names host %s, pid %s; waiting up to %d s to see whether it is still running"
        details = before.get("host"), before.get("pid"), GONE_SECONDS
        logging.getLogger("survey").warning(message, self.path, *details)
        first = _beat_of(self.path)
        deadline = time.monotonic() + GONE_SECONDS
        while time.monotonic() < deadline:
            time.sleep(BEAT_SECONDS / 8)
            if _beat_of(self.path) != first:
                return True
        return False

    def _beat(self):
        while not self.ended.wait(BEAT_SECONDS):
            with contextlib.suppress(OSError):
                os.utime(self.descriptor if os.utime in os.supports_fd else self.path)


def holder(path):
    """What the lock at `path` says of the active run; None if there is none. A run can still acquire it."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return None
    try:
        for _ in range(PEEKS):  # another process may be looking, too
            name = _name_in(descriptor)
            with contextlib.suppress(BlockingIOError):
                if _locked(descriptor) and name.get("host") == socket.gethostname():
                    return None
                return (
                    name
                    if name and time.time() - os.fstat(descriptor).st_mtime < GONE_SECONDS
                    else None
                )
            time.sleep(PEEK_SECONDS / PEEKS)
        return name
    finally:
        os.close(descriptor)


def _locked(descriptor):
    """Lock the file; False where the file system has no locks. Raises BlockingIOError if another
    process holds it.
    """
    import filelock  # Windows too; closing the file, or the end of its process, unlocks it

    try:
        free = filelock.lock_descriptor(descriptor, blocking=False)
    except OSError:
        return False
    if not free:
        raise BlockingIOError
    return True


def _beat_of(path):
    """The file's modification time; opened again each time, as network file systems cache what is open."""
    with contextlib.suppress(OSError), open(path, "rb") as file:
        return os.fstat(file.fileno()).st_mtime_ns
    return None


def _name_in(descriptor):
    """The mapping in the open file; {} if there is none. Its first byte is what Windows locks,
    unreadable by others.
    """
    try:
        os.lseek(descriptor, 1, os.SEEK_SET)
        name = json.loads(b"{" + os.read(descriptor, 2**16))
    except ValueError:
        return {}
    return name if isinstance(name, dict) else {}
