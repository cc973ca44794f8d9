"""Tasks on workers of a dask cluster, which may die, freeze or never arrive. Only this file and
`dispatch` use dask.

A block whose workers die repeatedly is set aside and called alone at the end, so that an innocent
block on the same worker is not blamed. A worker that finishes nothing for too long is restarted or
released, its blocks go to others.
"""

import contextlib
import itertools
import json
import logging
import os
import queue
import time
from collections import Counter

from survey.errors import BadInput, Stopped, SurveyError
from survey.sweep.dispatch import Patience
from survey.wording import reason_of, shown

SCHEDULER_SECONDS = 10
WORKERLESS_SECONDS = 60
RESTART_SECONDS = 10
PAUSED_SECONDS = 20  # that a worker short of memory may hold blocks without working on one
TRIES = 3  # workers that may take too long for the same block
# workers that killed a block in a row, with no block finished in between, before the run stops
STRIKES = 3
ENCRYPTED = ("tls", "wss")


def client_of(address):
    """A client of the dask cluster at `address`, in a scheduler file, or of a Client. Raises
    BadInput or Stopped.
    """
    try:
        from dask.distributed import Client
    except ImportError:
        raise BadInput("--scheduler needs dask.distributed: pip install distributed") from None
    if isinstance(address, Client):  # it stays its owner's, and open
        if address.status != "running":
            raise BadInput(
                "scheduler: this dask.distributed Client is closed; give one that is open"
            )
        where, security = address.scheduler.address, address.security
    elif isinstance(address, (str, os.PathLike)):
        where = _address_in(os.fspath(address))
        security = _security(where)
    else:
        raise BadInput(
            f"scheduler = {shown(address)}: give an address, a scheduler file, or a dask.distributed Client"
        )
    try:
        client = Client(
            address=where, security=security, timeout=SCHEDULER_SECONDS, set_as_default=False
        )
    except (OSError, ValueError) as error:
        raise Stopped(_unreachable(where, error)) from None
    for name in [
        name for name in logging.root.manager.loggerDict if name.startswith("distributed")
    ]:
        # what they would log is reported in one line
        logging.getLogger(name).setLevel(logging.CRITICAL)
    return client


def _address_in(address):
    """The scheduler's address, as it is or from its file."""
    if not os.path.exists(address):
        if address.endswith(".json"):
            raise BadInput(
                f"--scheduler {address}: there is no such scheduler file; dask scheduler --scheduler-file writes one"
            )
        return address
    try:
        with open(address, encoding="utf-8") as file:
            return str(json.load(file)["address"])
    except (OSError, ValueError, LookupError, TypeError):
        raise BadInput(
            f"--scheduler {address}: this is not a scheduler file; name one that dask scheduler --scheduler-file wrote"
        ) from None


def _security(address):
    """dask's TLS settings where the scheduler asks for them, else None. Raises BadInput if they are
    not complete.
    """
    if not address.startswith(tuple(f"{scheme}://" for scheme in ENCRYPTED)):
        return None
    from dask.distributed import Security

    keys = "distributed.comm.tls: ca-file, client.cert and client.key"
    try:
        security = Security()
        complete = security.get_connection_args("client")["ssl_context"] is not None
    except (OSError, ValueError) as error:
        raise BadInput(
            f"the TLS certificates for the dask scheduler at {address} cannot be used ({reason_of(error)}); set the "
            f"files of {keys} in dask's configuration"
        ) from None
    if not complete:
        raise BadInput(
            f"the dask scheduler at {address} requires TLS; set {keys} in dask's configuration, or as "
            "DASK_DISTRIBUTED__COMM__TLS__CA_FILE, ...__CLIENT__CERT, ...__CLIENT__KEY"
        )
    return security


def _unreachable(address, error):
    """Why there is no connection to the scheduler, and what to do."""
    cause = " ".join(str(error.__cause__ or error).split())
    closed = address.startswith(
        tuple(f"{scheme}://" for scheme in ENCRYPTED)
    ) and "CommClosedError" in _brief(error)
    if "CERTIFICATE" in cause or "TLSV1_ALERT" in cause or "SSLV3_ALERT" in cause or closed:
        expired = "expired" in cause.lower()
        return (
            f"the dask scheduler at {address} and this program reject each other's TLS certificates "
            f"({cause.partition('] ')[2] or cause}); "
            + (
                "renew the one that has expired"
                if expired
                else "use certificates from one CA, and its ca-file, on both sides"
            )
        )
    return (
        f"no dask scheduler answers at {address!r} ({_brief(error)}); start one with dask scheduler"
    )


def on_cluster(task, numbers, finished, died, client, patience=None):
    """Call the task for every number on the cluster's workers (see `dispatch`). Raises Stopped if
    they fail.
    """
    done = itertools.count(1)
    watch = _Watch(client, patience or Patience())
    finished(0)
    aside = []
    for number, result, killed in _results(task, numbers, client, watch):
        if killed:
            aside.append(number)
            watch.struck(killed)
        else:
            finished(next(done), result)
    for number in aside:
        for _, result, killed in _results(task, [number], client, watch):
            finished(next(done), died(number) if killed else result)


def _results(task, numbers, client, watch):
    """Yield (number, result, None) as results arrive; or (number, None, address of the last worker
    that it killed).
    """
    from dask.distributed import KilledWorker

    task = _Signed(task)
    ready = queue.SimpleQueue()

    async def fetch(future):
        try:
            ready.put((future.key, await future.result(), None))
        except Exception as error:
            ready.put((future.key, None, error))

    futures = client.map(task, numbers, key="survey-block", pure=False, allow_other_workers=False)
    waiting = {
        future.key: (future, number) for future, number in zip(futures, numbers, strict=True)
    }
    for future in futures:
        # so only the fetch of a result on a stuck worker waits
        client.loop.add_callback(fetch, future)
    del futures, future
    while waiting:
        with contextlib.suppress(queue.Empty):
            key, result, error = ready.get(timeout=watch.pause)
            future, number = waiting.pop(key)
            future.release()
            killed = error.last_worker.address if isinstance(error, KilledWorker) else None
            if isinstance(error, SurveyError):
                raise error
            if error and not killed:
                raise Stopped(
                    f"the dask cluster at {client.scheduler.address} failed ({_brief(error)}); start one and run the "
                    "command again to resume"
                )
            if not killed:
                worker, result = result
                watch.finished(worker)
            yield number, result, killed
        watch.check(waiting)


class _Signed:
    """The task; its result comes with the address of the worker that computed it."""

    def __init__(self, task):
        self.task = task

    def __call__(self, number):
        from dask.distributed import get_worker

        return get_worker().address, self.task(number)


class _Watch:
    """Checks from time to time what the workers are doing: stuck ones are replaced, and a lost
    cluster is reported.
    """

    def __init__(self, client, patience):
        self.client, self.patience, self.address = client, patience, client.scheduler.address
        now = time.monotonic()
        self.checked, self.busy, self.staffed, self.warned = now, now, now, now
        self.held = {}
        self.proven = set()
        self.missed = Counter()
        self.struck_by = set()
        self.had_some = False

    @property
    def pause(self):
        """Seconds between two checks."""
        return min(max(self.patience.limit / 10, 0.1), 5.0)

    def finished(self, worker):
        """This worker has finished a block: it has compiled what it needs, and the workers are able
        to work.
        """
        self.struck_by.clear()
        self.proven.add(worker)

    def struck(self, worker):
        """A block has killed this worker as the last of several, or left it without memory."""
        self.struck_by.add(worker)
        if len(self.struck_by) >= STRIKES:
            raise Stopped(
                f"the workers of the dask cluster at {self.address} keep dying, or pausing for lack of memory, without "
                "finishing a block; give them more memory (see their logs) and run the command again to resume"
            )

    def check(self, waiting):
        """Check what the workers hold of the blocks that are `waiting` ({key: (future, number)})."""
        now = time.monotonic()
        if not waiting or now - self.checked < self.pause:
            return
        self.checked = now
        try:
            at_work, finished = self._ask("processing"), self._ask("has_what")
        except (OSError, TimeoutError, ValueError):
            return  # a lost scheduler shows in the futures
        # also what is finished but not yet fetched: its worker may be stuck by now
        held = {
            worker: frozenset(key for key in (*keys, *finished.get(worker, ())) if key in waiting)
            for worker, keys in at_work.items()
        }
        self.held = {worker: self._since(worker, keys, now) for worker, keys in held.items()}
        self._check_staff(held, now)
        long = {worker: now - since for worker, (keys, since) in self.held.items() if keys}
        starved = self._starved(
            [worker for worker, seconds in long.items() if seconds > PAUSED_SECONDS]
        )
        if starved:
            self._feed(starved)
        stuck = [
            worker
            for worker, seconds in long.items()
            if seconds > self._limit(worker) and worker not in starved
        ]
        if stuck:
            self._replace(stuck, waiting)

    def _ask(self, what):
        """Call this method of the scheduler."""
        return self.client.sync(
            getattr(self.client.scheduler, what), callback_timeout=SCHEDULER_SECONDS
        )

    def _limit(self, worker):
        """Seconds that the worker may hold the same blocks."""
        return self.patience.limit if worker in self.proven else self.patience.first

    def _since(self, worker, keys, now):
        """The keys that a worker holds, and since when it has held just these."""
        before, since = self.held.get(worker, (keys, now))
        return keys, since if keys == before else now

    def _check_staff(self, held, now):
        """Raise Stopped where no worker takes a block; only warn where none has arrived yet: a
        queue may start some.
        """
        patience = max(self.patience.limit, WORKERLESS_SECONDS)
        if any(held.values()) or not held:
            self.busy = now
        if held:
            self.staffed = self.warned = now
            self.had_some = True
            if now - self.busy > patience:
                raise Stopped(
                    f"the workers of the dask cluster at {self.address} have taken no block for {now - self.busy:.0f} "
                    "s; see their logs (a worker short of memory pauses) and run the command again to resume"
                )
            return
        # a nanny does not always start another worker
        if self.had_some and now - self.staffed > patience:
            raise Stopped(
                f"the dask cluster at {self.address} lost its last worker {now - self.staffed:.0f} s ago; "
                f"start some (dask worker {self.address}; see the logs) and run the command again to resume"
            )
        if now - self.warned > WORKERLESS_SECONDS:
            self.warned = now
            message = "the dask cluster at %s has no workers; waiting for some (dask worker %s starts one)"
            logging.getLogger("survey").warning(message, self.address, self.address)

    def _replace(self, stuck, waiting):
        """Restart stuck workers (those without a nanny are released): their blocks go to others."""
        limit = self.patience.limit
        for key in {key for worker in stuck for key in self.held[worker][0]}:
            number = waiting[key][1]
            self.missed[number] += 1
            if self.missed[number] >= TRIES:
                raise Stopped(
                    f"{TRIES} workers of the dask cluster at {self.address} worked on one block for over {limit:.0f} s "
                    "without finishing it; run the command again to resume, with a longer --block-timeout if needed"
                )
        message = "%d of the workers of %s finished no block for more than %.0f s; their blocks go to others"
        logging.getLogger("survey").warning(message, len(stuck), self.address, limit)
        self._restart(stuck)

    def _starved(self, workers):
        """Those of the workers that have paused for lack of memory, with no block in progress."""
        known = {}
        if workers:
            with contextlib.suppress(OSError, TimeoutError, ValueError):
                known = self._ask("identity")["workers"]
        paused = [
            worker for worker in workers if worker in known and known[worker]["status"] == "paused"
        ]
        return [
            worker
            for worker in paused
            if not known[worker]["metrics"]["task_counts"].get("executing")
        ]

    def _feed(self, starved):
        """Restart workers that wait for memory, which a process seldom gives back."""
        for worker in starved:
            self.struck(worker)
        message = "%d of the workers of %s paused for lack of memory; they are restarted"
        logging.getLogger("survey").warning(message, len(starved), self.address)
        self._restart(starved)

    def _restart(self, workers):
        with contextlib.suppress(OSError, TimeoutError, ValueError):
            self.client.sync(
                self.client.scheduler.restart_workers,
                workers=workers,
                timeout=RESTART_SECONDS,
                wait_for_workers=False,
                on_error="return",
                stimulus_id=f"survey-block-timeout-{time.time()}",
                callback_timeout=2 * RESTART_SECONDS,
            )


def _brief(error):
    """The first line of an error, but for a lost connection only its kind."""
    name = type(error).__name__
    return (
        name
        if name in ("CommClosedError", "CancelledError", "FutureCancelledError")
        else str(error).split("\n")[0]
    )
