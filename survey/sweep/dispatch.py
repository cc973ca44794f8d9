"""Tasks through dask, on threads or processes of this machine (on a cluster: `cluster`).

A task is called once for each number (or other hashable, sortable value). `finished(done, result)`
is called as each ends, and with (0, None) before. For a task that kills its worker DEATHS times,
`died(number)` provides the result.
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

from survey.errors import Stopped, SurveyError

DEATHS = 3
# A worker is considered stuck, and is replaced, once a block takes this many times as long as the
# longest one so far, and at least this many seconds; during its first block it may compile, which
# takes up to a minute on an idle machine.
PATIENCE, PATIENCE_SECONDS, COMPILE_SECONDS = 20, 300.0, 300.0
LEAVE_SECONDS = 10.0  # that idle worker processes get to end
# not on Windows, where a worker hears of Ctrl-C until it ignores it
MASKS = hasattr(signal, "pthread_sigmask")


def cpus():
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Patience:
    """How long a worker may take for a block: `seconds`, or derived from the times that others `took`."""

    def __init__(self, seconds=None):
        self.seconds, self.longest = seconds, 0.0

    def took(self, seconds):
        """A block has taken this many seconds; None if that is unknown."""
        self.longest = max(self.longest, seconds or 0.0)

    @property
    def limit(self):
        return self.seconds or max(PATIENCE_SECONDS, PATIENCE * self.longest)

    @property
    def first(self):
        """The limit for a worker's first block, for which it compiles."""
        return self.limit + COMPILE_SECONDS


def on_threads(task, numbers, finished=lambda done, result=None: None, threads=None):
    """Call the task for every number on threads of this process."""
    from dask.threaded import get  # loading dask takes longer than most calls from Python

    done = itertools.count(1)
    finished(0)
    # the function itself: given its name, dask would import all of distributed
    _compute(
        task,
        numbers,
        lambda number, result: finished(next(done), result),
        get,
        threads or cpus(),
    )


def on_processes(task, numbers, finished, died, workers, patience=None):
    """Call the task for every number on worker processes; tasks of a worker that dies or freezes
    are called again.

    The tasks that were running when a worker died are repeated one by one, which shows the one that
    killed it. Raises Stopped for a task that exceeds the time limit then, too.
    """
    from dask.multiprocessing import get

    done, ended, patience = itertools.count(1), set(), patience or Patience()
    finished(0)

    def end(number, result):
        ended.add(number)
        finished(next(done), result)

    def attempt(some, workers, alone=False):
        """Call the tasks; returns the numbers that were running when a worker died."""
        watch = _Watch(patience, workers)
        try:
            with _pool(workers) as pool, watch:
                _compute(
                    _Signed(task),
                    some,
                    watch.ended(end),
                    get,
                    workers,
                    watch.began,
                    pool=pool,
                )
        except BrokenProcessPool:
            if watch.stuck and alone:
                raise Stopped(
                    f"a block took more than {patience.limit:.0f} s, twice; run the command again to resume, with a "
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
    """The task; its result comes with the process that computed it."""

    def __init__(self, task):
        self.task = task

    def __call__(self, number):
        return os.getpid(), self.task(number)


class _Watch:
    """Kills the worker processes of this thread once one of them is stuck, so that they count as dead."""

    def __init__(self, patience, workers):
        self.patience, self.workers = patience, workers
        self.begun = {}
        self.proven = set()
        self.stuck = False
        self.starter = threading.get_ident()
        self.over = threading.Event()

    def __enter__(self):
        threading.Thread(target=self._watch, daemon=True).start()
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

    def _watch(self):
        while not self.over.wait(min(max(self.patience.limit / 10, 0.1), 5.0)):
            # unless each has compiled what it needs, one may still be compiling
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
    """Worker processes; an error or an interruption kills them, whatever they are doing."""
    if MASKS:
        # otherwise the first worker's start would, and unblock the signal
        resource_tracker.ensure_running()
    # a frozen one does not end by itself
    leave = threading.Timer(LEAVE_SECONDS, _kill, [threading.get_ident()])
    leave.daemon = True
    try:
        with ProcessPoolExecutor(workers, _Spawning(), _serve) as pool:
            try:
                with _deferred(signal.SIGINT, signal.SIGTERM):
                    # starts the workers and the pool's thread: one half started could not be joined
                    pool.submit(int)
                yield pool
            except BaseException:
                _kill(threading.get_ident())
                raise
            leave.start()
    finally:
        leave.cancel()


class _Worker(multiprocessing.context.SpawnProcess):
    """A process whose start is not interrupted and that ignores Ctrl-C: either would print tracebacks."""

    def start(self):
        self.starter = threading.get_ident()
        with _deferred(signal.SIGINT, signal.SIGTERM):
            if not MASKS:
                super().start()
                return
            # the process inherits it
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                super().start()
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _deferred(*signals):
    """Defer the handling of these signals to the end of the block. (Python handles signals on the
    main thread only.)
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received = []
    before = {
        number: signal.signal(number, lambda number, _: received.append(number))
        for number in signals
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)
        for number in received[:1]:
            signal.raise_signal(number)


class _Spawning(multiprocessing.context.SpawnContext):
    Process = _Worker


def _serve():
    """Ignore Ctrl-C, and end this worker process when its parent has ended."""
    if not MASKS:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow, args=(multiprocessing.parent_process(),), daemon=True).start()


def _follow(parent):
    parent.join()
    os._exit(1)


def _compute(task, numbers, ended, get, workers, begun=lambda number: None, **more):
    """Run the tasks with dask's scheduler, which takes tasks of equal priority in reverse order of
    their names.
    """
    import dask
    from dask.callbacks import Callback

    keys = {f"task-{-position % 10**9:09d}": number for position, number in enumerate(numbers, 1)}
    call = dask.delayed(task, pure=False, traverse=False)
    callback = Callback(
        pretask=lambda key, *_: begun(keys[key]),
        posttask=lambda key, result, *_: ended(keys[key], result),
    )
    try:
        with callback:
            calls = [call(number, dask_key_name=key) for key, number in keys.items()]
            dask.compute(
                *calls,
                scheduler=get,
                num_workers=workers,
                chunksize=1,
                optimize_graph=False,
                **more,
            )
    except OSError as error:
        raise Stopped(f"the run stopped ({error}); run the command again to resume") from None
    except Exception as error:
        if isinstance(error, SurveyError):
            # dask adds a worker's traceback to the message
            raise getattr(error, "exception", error) from None
        raise
