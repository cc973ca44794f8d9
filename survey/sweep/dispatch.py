"""Tasks through dask: on threads of this machine or on processes of it (on a cluster: `cluster`).

A task is called once for each number (or what else can be hashed and sorted); `finished(done, result)` hears of each as
it ends, and of (0, None) before. `died(number)` is called instead where it kills its worker, and DEATHS times again.
"""

import contextlib
import itertools
import multiprocessing.context
import os
import signal
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import resource_tracker

import dask
import dask.multiprocessing
import dask.threaded
from dask.callbacks import Callback

from survey.errors import Stopped, SurveyError

DEATHS = 3
# A worker is stuck, and replaced, once a block takes so many times the longest one so far, and so many seconds at
# least; in its first block it may compile, which takes up to a minute where nothing else is at work.
PATIENCE, PATIENCE_SECONDS, COMPILE_SECONDS = 20, 300.0, 300.0
LEAVE_SECONDS = 10.0  # in which worker processes end that have nothing left to do


def cpus():
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Patience:
    """How long a worker may take for a block: `seconds`, or by how long others took, whose times `took` tells."""

    def __init__(self, seconds=None):
        self.seconds, self.longest = seconds, 0.0

    def took(self, seconds):
        """A block has taken so many seconds; None: it tells nothing."""
        self.longest = max(self.longest, seconds or 0.0)

    @property
    def limit(self):
        return self.seconds or max(PATIENCE_SECONDS, PATIENCE * self.longest)

    @property
    def first(self):
        """The same for a worker's first block, before which it compiles."""
        return self.limit + COMPILE_SECONDS


def on_threads(task, numbers, finished=lambda done, result=None: None, threads=None):
    """Call the task for every number on threads of this process."""
    done = itertools.count(1)
    finished(0)
    # the function itself: by its name, dask imports all of distributed before
    _compute(task, numbers, lambda number, result: finished(next(done), result), dask.threaded.get, threads or cpus())


def on_processes(task, numbers, finished, died, workers, patience=None):
    """Call the task for every number on worker processes, which may die or freeze: what they were at is done again.

    Which task killed its worker is told apart by calling those that were under way again, one by one. Raises Stopped
    for a task that takes longer than the patience then, too.
    """
    done, ended, patience = itertools.count(1), set(), patience or Patience()
    finished(0)

    def end(number, result):
        ended.add(number)
        finished(next(done), result)

    def attempt(some, workers, alone=False):
        """The numbers that were under way when a worker died."""
        watch = _Watch(patience, workers)
        try:
            with _pool(workers) as pool, watch:
                _compute(
                    _Signed(task), some, watch.ended(end), dask.multiprocessing.get, workers, watch.began, pool=pool
                )
        except BrokenProcessPool:
            if watch.stuck and alone:
                raise Stopped(
                    f"a block took more than {patience.limit:.0f} s, twice; run the command again to go on, with a "
                    "longer --block-timeout if blocks take long"
                ) from None
            return sorted(set(watch.begun) - ended)
        return []

    suspects = attempt(numbers, workers)
    while suspects:
        for number in suspects:
            if all(attempt([number], 1, alone=True) for _ in range(DEATHS)):
                end(number, died(number))
        suspects = attempt([number for number in numbers if number not in ended], workers)


class _Signed:
    """The task; its result comes with the process that did it."""

    def __init__(self, task):
        self.task = task

    def __call__(self, number):
        return os.getpid(), self.task(number)


class _Watch:
    """Kills the worker processes of this thread once one of them is stuck with a task, so that they count as dead."""

    def __init__(self, patience, workers):
        self.patience, self.workers = patience, workers
        self.begun, self.proven, self.stuck = {}, set(), False
        self.starter, self.over = threading.get_ident(), threading.Event()

    def __enter__(self):
        threading.Thread(target=self._look, daemon=True).start()
        return self

    def __exit__(self, *_):
        self.over.set()

    def began(self, number):
        self.begun[number] = time.monotonic()

    def ended(self, end):
        """What is called as a task ends."""

        def call(number, signed):
            process, result = signed
            self.begun.pop(number, None)
            self.proven.add(process)
            end(number, result)

        return call

    def _look(self):
        while not self.over.wait(min(max(self.patience.limit / 10, 0.1), 5.0)):
            # each has compiled what it needs, or else one of them may be at that
            limit = self.patience.limit if len(self.proven) >= self.workers else self.patience.first
            if time.monotonic() - min(self.begun.copy().values(), default=time.monotonic()) > limit:
                self.stuck = True
                _kill(self.starter)
                return


def _kill(starter):
    """Kill the worker processes that the thread `starter` has started."""
    for worker in multiprocessing.active_children():
        if isinstance(worker, _Worker) and worker.starter == starter:
            worker.kill()


@contextlib.contextmanager
def _pool(workers):
    """Worker processes; an error or an interruption kills them: nobody waits for what they are at."""
    resource_tracker.ensure_running()  # else the first worker's start would, and unblock the signal
    leave = threading.Timer(LEAVE_SECONDS, _kill, [threading.get_ident()])  # one that is frozen does not go by itself
    leave.daemon = True
    try:
        with ProcessPoolExecutor(workers, _Spawning(), _serve) as pool:
            try:
                yield pool
            except BaseException:
                _kill(threading.get_ident())
                raise
            leave.start()
    finally:
        leave.cancel()


class _Worker(multiprocessing.context.SpawnProcess):
    """A process that is started as a whole, and never hears the terminal's interrupt: either would print tracebacks."""

    def start(self):
        self.starter = threading.get_ident()
        with _deferred(signal.SIGINT, signal.SIGTERM):
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # the process inherits it
            try:
                super().start()
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _deferred(*signals):
    """What these signals do is done at the end of the block. (Python hears them on the main thread alone.)"""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard = []
    before = {number: signal.signal(number, lambda number, _: heard.append(number)) for number in signals}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)
        for number in heard[:1]:
            signal.raise_signal(number)


class _Spawning(multiprocessing.context.SpawnContext):
    Process = _Worker


def _serve():
    """A worker process goes when its parent is gone."""
    threading.Thread(target=_follow, args=(multiprocessing.parent_process(),), daemon=True).start()


def _follow(parent):
    parent.join()
    os._exit(1)


def _compute(task, numbers, ended, get, workers, begun=lambda number: None, **more):
    """dask's own loop; it takes equals in the order of their names, the last first."""
    keys = {f"task-{-place % 10**9:09d}": number for place, number in enumerate(numbers, 1)}
    call = dask.delayed(task, pure=False, traverse=False)
    callback = Callback(
        pretask=lambda key, *_: begun(keys[key]), posttask=lambda key, result, *_: ended(keys[key], result)
    )
    try:
        with callback:
            calls = [call(number, dask_key_name=key) for key, number in keys.items()]
            dask.compute(*calls, scheduler=get, num_workers=workers, chunksize=1, optimize_graph=False, **more)
    except OSError as error:
        raise Stopped(f"the run stopped ({error}); run the command again to go on") from None
    except Exception as error:
        if isinstance(error, SurveyError):
            raise getattr(error, "exception", error) from None  # dask adds a worker's traceback to the message
        raise
