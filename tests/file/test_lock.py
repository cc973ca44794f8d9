"""One run at a time on an output: its lock names it, is taken from a run that is gone, and goes
with the run.
"""

import json
import multiprocessing
import os
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import filelock
import pytest

from survey.file import lock

HERE = {"host": socket.gethostname(), "pid": os.getpid(), "run": "this"}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "o.nc.lock"


@pytest.fixture
def quick(monkeypatch):
    """Seconds are shortened."""
    monkeypatch.setattr(lock, "BEAT_SECONDS", 0.05)
    monkeypatch.setattr(lock, "GONE_SECONDS", 0.5)


def test_the_lock_names_its_holder_and_goes_with_it(path):
    held = lock.Lock(path, HERE)
    assert held.acquire() == {} and held.owned()
    assert json.loads(path.read_text()) == HERE == lock.holder(path)
    with pytest.raises(lock.Held, match=f"host {HERE['host']}, pid {HERE['pid']}"):
        lock.Lock(path, HERE | {"run": "other"}).acquire()
    held.release()
    held.release()
    assert not path.exists() and lock.holder(path) is None


def _end_without_release(path):
    lock.Lock(path, HERE | {"pid": os.getpid()}).acquire()
    os._exit(1)


def test_a_lock_whose_holder_is_gone_says_whose_it_was_and_is_taken(path):
    process = multiprocessing.get_context("spawn").Process(
        target=_end_without_release, args=(path,)
    )
    process.start()
    process.join()
    assert path.exists() and lock.holder(path) is None
    held = lock.Lock(path, HERE)
    assert held.acquire()["pid"] == process.pid and json.loads(path.read_text()) == HERE
    held.release()
    assert not path.exists()


def test_whose_a_lock_is_can_be_read_where_its_first_byte_cannot(path, monkeypatch):
    """Windows lets nobody else read what is locked: the byte at 0."""
    held, read = lock.Lock(path, HERE), os.read
    held.acquire()

    def refused(descriptor, count):
        if os.lseek(descriptor, 0, os.SEEK_CUR) == 0:
            raise PermissionError(13, "Permission denied")
        return read(descriptor, count)

    monkeypatch.setattr(os, "read", refused)
    assert lock.holder(path) == HERE
    with pytest.raises(lock.Held, match=f"pid {HERE['pid']}"):
        lock.Lock(path, HERE | {"run": "other"}).acquire()
    held.release()


def test_many_may_look_at_a_lock_that_is_gone_at_once(path):
    """Each looks by locking it for a moment: none takes another for a run that is active."""
    path.write_text(json.dumps(HERE))
    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(lock.holder, [path] * 200)) == {None}


@pytest.mark.parametrize("content", [b"", b'{"host": "a', b"[1, 2]", b"\xff\xfe", b"null"])
def test_a_torn_lock_is_taken(path, content):
    path.write_bytes(content)
    held = lock.Lock(path, HERE)
    assert held.acquire() == {} and held.owned()
    held.release()


def test_a_run_of_another_host_is_seen_by_its_beats_though_flock_says_nothing(path, quick):
    path.write_text(json.dumps({"host": "elsewhere", "pid": 7}))
    ended = threading.Event()

    def beat():
        while not ended.wait(0.02):
            os.utime(path)

    heart = threading.Thread(target=beat)
    heart.start()
    try:
        with pytest.raises(lock.Held, match="host elsewhere, pid 7"):
            lock.Lock(path, HERE).acquire()
        assert lock.holder(path) == {"host": "elsewhere", "pid": 7} == json.loads(path.read_text())
    finally:
        ended.set()
        heart.join()
    time.sleep(0.6)
    assert lock.holder(path) is None
    held = lock.Lock(path, HERE)
    assert held.acquire() == {"host": "elsewhere", "pid": 7} and held.owned()
    held.release()


def test_without_flock_the_beats_alone_tell(path, quick, monkeypatch):
    def unknown(*_, **__):
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr(filelock, "lock_descriptor", unknown)
    held = lock.Lock(path, HERE)
    held.acquire()
    with pytest.raises(lock.Held):
        lock.Lock(path, HERE | {"run": "other"}).acquire()
    assert held.owned()
    held.release()


def test_a_halted_run_that_has_lost_its_lock_knows(path, quick):
    held = lock.Lock(path, HERE)
    held.acquire()
    path.unlink()
    other = lock.Lock(path, HERE | {"run": "other"})
    other.acquire()
    assert not held.owned() and other.owned()
    held.release()
    assert other.owned() and path.exists(), "it removes no other run's lock"
    other.release()


def test_a_lock_that_cannot_be_written_leaves_no_file(path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(OSError, match="No space"):
        lock.Lock(path, HERE).acquire()
    assert not path.exists()
