"""Tasks through dask: on threads of this machine, on processes of it, or on a cluster. The only place that knows dask.

A task is called once for each number (or what else can be hashed and sorted); `finished(done, result)` hears of each as
it ends, and of (0, None) before. `died(number)` is called instead where it kills its worker, and DEATHS times again.
"""

import contextlib
import itertools
import logging
import multiprocessing.context
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import resource_tracker

import dask
import dask.multiprocessing
import dask.threaded
from dask.callbacks import Callback

from survey.errors import BadInput, Stopped, SurveyError

DEATHS = 3
SCHEDULER_SECONDS = 10
WORKERLESS_SECONDS = 60


def cpus():
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_threads(task, numbers, finished=lambda done, result=None: None, threads=None):
    """Call the task for every number on threads of this process."""
    done = itertools.count(1)
    finished(0)
    # the function itself: by its name, dask imports all of distributed before
    _compute(task, numbers, lambda number, result: finished(next(done), result), dask.threaded.get, threads or cpus())


def on_processes(task, numbers, finished, died, workers):
    """Call the task for every number on worker processes, which may die: what they were at is done again.

    Which task killed its worker is told apart by calling those that were under way again, one by one.
    """
    done, ended = itertools.count(1), set()
    finished(0)

    def end(number, result):
        ended.add(number)
        finished(next(done), result)

    def attempt(some, workers):
        """The numbers that were under way when a worker died."""
        begun = set()
        try:
            with _pool(workers) as pool:
                _compute(task, some, end, dask.multiprocessing.get, workers, begun.add, pool=pool)
        except BrokenProcessPool:
            return sorted(begun - ended)
        return []

    suspects = attempt(numbers, workers)
    while suspects:
        for number in suspects:
            if all(attempt([number], 1) for _ in range(DEATHS)):
                end(number, died(number))
        suspects = attempt([number for number in numbers if number not in ended], workers)


def on_cluster(task, numbers, finished, died, client):
    """Call the task for every number on the workers of a dask cluster."""
    from dask.distributed import KilledWorker, as_completed

    address = client.scheduler.address
    done = itertools.count(1)
    finished(0)
    futures = dict(zip(client.map(task, numbers, pure=False, allow_other_workers=False), numbers, strict=True))
    with _watched(client):
        for future in as_completed(list(futures), loop=client.loop):
            try:
                result = future.result()
            except KilledWorker:
                result = died(futures[future])
            except SurveyError:
                raise
            except Exception as error:
                told = f"the dask cluster at {address} failed ({_brief(error)})"
                raise Stopped(f"{told}; start one and run the command again to go on") from None
            del futures[future]
            future.release()
            finished(next(done), result)


@contextlib.contextmanager
def _watched(client):
    """Say so now and then where the cluster has no workers: dask waits, as a batch queue may yet start some."""
    ended = threading.Event()

    def watch():
        while not ended.wait(WORKERLESS_SECONDS):
            with contextlib.suppress(OSError, TimeoutError, ValueError):
                if not client.nthreads():
                    where = client.scheduler.address
                    words = "the dask cluster at %s has no workers; waiting for some (dask worker %s starts one)"
                    logging.getLogger("survey").warning(words, where, where)

    threading.Thread(target=watch, daemon=True).start()
    try:
        yield
    finally:
        ended.set()


def client_of(address):
    """A client of the dask cluster at `address` (or in a scheduler file). Raises BadInput or Stopped."""
    try:
        from dask.distributed import Client
    except ImportError:
        raise BadInput("--scheduler needs dask.distributed: pip install distributed") from None
    try:
        where = {"scheduler_file": address} if os.path.exists(address) else {"address": address}
        client = Client(**where, timeout=SCHEDULER_SECONDS, set_as_default=False)
        for name in [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]:
            logging.getLogger(name).setLevel(logging.CRITICAL)  # what they would log is told in one line
        return client
    except (OSError, ValueError) as error:
        raise Stopped(f"no dask scheduler answers at {address!r} ({error}); start one with dask scheduler") from None


@contextlib.contextmanager
def _pool(workers):
    """Worker processes; an error or an interruption kills them: nobody waits for what they are at."""
    resource_tracker.ensure_running()  # else the first worker's start would, and unblock the signal
    with ProcessPoolExecutor(workers, _Spawning(), _serve) as pool:
        try:
            yield pool
        except BaseException:
            for worker in multiprocessing.active_children():
                if isinstance(worker, _Worker) and worker.starter == threading.get_ident():
                    worker.kill()
            raise


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


def _brief(error):
    """The first line of an error; of a lost connection not where it was lost."""
    name = type(error).__name__
    return name if name in ("CommClosedError", "CancelledError", "FutureCancelledError") else str(error).split("\n")[0]
