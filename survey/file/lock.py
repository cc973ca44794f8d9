"""The lock of an output, `OUT.nc.lock`: a file that names the run at work on it, gone when the run has ended.

flock tells at once whether a process of this host holds it. Other hosts are told apart by the name in the file, since
not every network file system shares flock between them: a run there is at work as long as the file's time moves.
"""

import contextlib
import fcntl
import json
import logging
import os
import socket
import threading
import time

BEAT_SECONDS = 2.0  # so often the holder gives the file a new time
GONE_SECONDS = 10.0  # a holder on another host that gives it none for so long has ended
LOOK_SECONDS = 0.2  # a look of `holder` takes less


class Held(Exception):
    """Another run holds the lock: `holder` is what its file says."""

    def __init__(self, holder):
        super().__init__(f"host {holder.get('host', 'unknown')}, pid {holder.get('pid', 'unknown')}")
        self.holder = holder


class Lock:
    """The lock of one output; `name` is written to the file: a mapping with the host, the pid and what is one's own."""

    def __init__(self, path, name):
        self.path, self.name = str(path), name
        self.descriptor, self.ended, self.heart = None, threading.Event(), None

    def acquire(self):
        """Hold the lock; returns the name that a run which did not end well has left in it, else {}.

        Raises Held at once where a run of this host holds it, and after BEAT_SECONDS where one of another host does.
        """
        self.descriptor, known = self._opened()
        before = {}
        try:
            before = _name_in(self.descriptor)
            if before and not (known and before.get("host") == socket.gethostname()) and self._beats(before):
                raise Held(before)
            content = json.dumps(self.name).encode()
            os.pwrite(self.descriptor, content, 0)
            os.ftruncate(self.descriptor, len(content))
        except BaseException as error:
            if isinstance(error, Held) or before:  # it is not ours to remove
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
        """Remove the file and let go of it, if it is held. Raises OSError where it cannot be removed."""
        if self.descriptor is None:
            return
        self.ended.set()
        if self.heart:
            self.heart.join()
        descriptor, self.descriptor = self.descriptor, None
        try:
            if self._is_file(descriptor):
                os.unlink(self.path)  # while it is held: nobody else holds a lock of that name
        finally:
            os.close(descriptor)

    def _opened(self):
        """(the open file, which no other process of this host holds; is flock known here?)"""
        deadline = time.monotonic() + LOOK_SECONDS
        while True:
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                known = _flocked(descriptor, fcntl.LOCK_EX)
                if self._is_file(descriptor):  # and not one that its holder has removed meanwhile
                    return descriptor, known
            except BlockingIOError:
                if time.monotonic() > deadline:
                    held = Held(_name_in(descriptor))
                    os.close(descriptor)
                    raise held from None
                time.sleep(LOOK_SECONDS / 10)
            os.close(descriptor)

    def _is_file(self, descriptor):
        """Is the open file the one that bears the lock's name?"""
        with contextlib.suppress(FileNotFoundError):
            return os.path.samestat(os.fstat(descriptor), os.stat(self.path))
        return False

    def _beats(self, before):
        """Does the file's time move? It is waited for."""
        words = "%s names host %s, pid %s; waiting up to %d s to see whether it is still at work"
        told = before.get("host"), before.get("pid"), GONE_SECONDS
        logging.getLogger("survey").warning(words, self.path, *told)
        first, deadline = _beat_of(self.path), time.monotonic() + GONE_SECONDS
        while time.monotonic() < deadline:
            time.sleep(BEAT_SECONDS / 8)
            if _beat_of(self.path) != first:
                return True
        return False

    def _beat(self):
        while not self.ended.wait(BEAT_SECONDS):
            with contextlib.suppress(OSError):
                os.utime(self.descriptor)


def holder(path):
    """What the lock at `path` says of the run that is at work; None if nobody is. It is not kept from a run."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        name = _name_in(descriptor)
        if _flocked(descriptor, fcntl.LOCK_SH) and name.get("host") == socket.gethostname():
            return None
        return name if name and time.time() - os.fstat(descriptor).st_mtime < GONE_SECONDS else None
    except BlockingIOError:
        return name
    finally:
        os.close(descriptor)


def _flocked(descriptor, how):
    """Is the file locked now, or does this file system know no locks? Raises BlockingIOError if another holds it."""
    try:
        fcntl.flock(descriptor, how | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        return False
    return True


def _beat_of(path):
    """The time that the holder last gave the file; opened anew, as network file systems keep what is open."""
    with contextlib.suppress(OSError), open(path, "rb") as file:
        return os.fstat(file.fileno()).st_mtime_ns
    return None


def _name_in(descriptor):
    """The mapping in the open file; {} if there is none."""
    try:
        name = json.loads(os.pread(descriptor, 2**16, 0))
    except ValueError:
        return {}
    return name if isinstance(name, dict) else {}
