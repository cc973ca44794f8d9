"""Tasks on threads, on processes that die, on a cluster: each number once, deaths blamed on their task."""

import multiprocessing
import os
import signal
import sys
import threading
import time

import dask
import psutil
import pytest

from survey.errors import BadInput, Stopped
from survey.sweep import cluster as clusters
from survey.sweep import dispatch

NUMBERS = list(range(12))


class Heard:
    """What `finished` and `died` are called with."""

    def __init__(self):
        self.results, self.counts, self.dead = [], [], []

    def finished(self, done, result=None):
        self.counts.append(done)
        self.results += [result] if done else []

    def died(self, number):
        self.dead.append(number)
        return -number


def squares(number):
    return number * number


def test_threads_end_every_number_once_in_their_order_at_first():
    heard = Heard()
    dispatch.on_threads(squares, NUMBERS, heard.finished, threads=1)
    assert heard.results == [n * n for n in NUMBERS] and heard.counts == list(range(13))


def test_a_task_that_fails_stops_all_with_its_own_error():
    def fails(number):
        raise Stopped("the disk is full") if number == 3 else ValueError

    with pytest.raises(Stopped, match=r"^the disk is full$"):
        dispatch.on_threads(fails, [3])
    with pytest.raises(Stopped, match=r"^the disk is full$"):
        dispatch.on_processes(fails, [3], Heard().finished, None, 1)


def test_a_task_that_kills_its_worker_costs_itself_alone(tmp_path):
    def deadly(number):
        (tmp_path / f"{number}-{time.time_ns()}").touch()
        if number == 4:
            os.kill(os.getpid(), signal.SIGKILL)
        return number * number

    heard = Heard()
    dispatch.on_processes(deadly, NUMBERS, heard.finished, heard.died, 2)
    assert heard.dead == [4] and heard.counts == list(range(13))
    assert sorted(heard.results) == sorted(n * n if n != 4 else -4 for n in NUMBERS)
    assert len(list(tmp_path.glob("4-*"))) == 1 + dispatch.DEATHS


def test_a_worker_killed_from_outside_costs_nothing(tmp_path):
    def unlucky(number):
        once = tmp_path / f"killed-{number}"
        if number % 5 == 2 and not once.exists():
            once.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return number * number

    heard = Heard()
    dispatch.on_processes(unlucky, NUMBERS, heard.finished, heard.died, 2)
    assert heard.dead == [] and sorted(heard.results) == [n * n for n in NUMBERS]


def test_an_interruption_waits_for_no_worker(tmp_path, in_time):
    def endless(number):
        (tmp_path / str(number)).touch()
        time.sleep(10_000)

    def interrupt():
        while len(list(tmp_path.iterdir())) < 2:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt, daemon=True).start()
    heard = Heard()
    with pytest.raises(KeyboardInterrupt):
        dispatch.on_processes(endless, NUMBERS, heard.finished, heard.died, 2)
    assert heard.results == [] and not multiprocessing.active_children()


def test_a_worker_that_freezes_is_replaced(tmp_path, in_time, monkeypatch):
    monkeypatch.setattr(dispatch, "COMPILE_SECONDS", 20.0)

    def freezes(number):
        once = tmp_path / "frozen"
        if number == 5 and not once.exists():
            once.touch()
            os.kill(os.getpid(), signal.SIGSTOP)
        return number * number

    heard = Heard()
    dispatch.on_processes(freezes, NUMBERS, heard.finished, heard.died, 2, dispatch.Patience(1.0))
    assert heard.dead == [] and sorted(heard.results) == [n * n for n in NUMBERS]


@pytest.mark.slow
def test_a_task_without_end_stops_the_run_in_one_line(in_time, monkeypatch):
    monkeypatch.setattr(dispatch, "COMPILE_SECONDS", 3.0)

    def endless(number):
        time.sleep(10_000 if number == 5 else 0)
        return number

    heard = Heard()
    with pytest.raises(
        Stopped, match=r"^a block took more than 1 s, twice; run .* --block-timeout"
    ):
        dispatch.on_processes(
            endless, NUMBERS, heard.finished, heard.died, 2, dispatch.Patience(1.0)
        )
    assert heard.dead == [] and len(heard.results) >= 5 and not multiprocessing.active_children()


def test_patience_is_measured_from_other_tasks_and_has_a_floor():
    patience = dispatch.Patience()
    assert patience.limit == dispatch.PATIENCE_SECONDS
    patience.took(100.0)
    patience.took(None)
    patience.took(1.0)
    assert patience.limit == 100.0 * dispatch.PATIENCE
    assert patience.first == patience.limit + dispatch.COMPILE_SECONDS
    assert dispatch.Patience(7.0).limit == 7.0


@pytest.fixture
def cluster():
    """Two workers, new for each test: not every nanny replaces one that dies. A task is set aside
    after two deaths.
    """
    distributed = pytest.importorskip("distributed")
    with dask.config.set({"distributed.scheduler.allowed-failures": 1}):
        with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster:
            yield cluster


@pytest.fixture
def in_time():
    """What waits for ever, as a cluster that loses every worker does, fails instead."""

    def late(*_):
        raise TimeoutError("this has not ended within three minutes")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(180)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def die():
    time.sleep(2)  # a nanny starts no other worker for one that dies at once
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_cluster_ends_every_number_and_survives_deaths(cluster, in_time, tmp_path):
    def deadly(number):
        once = tmp_path / f"killed-{number}"
        if number == 4 or (number == 7 and not once.exists()):
            once.touch()
            die()
        return number * number

    heard = Heard()
    with clusters.client_of(cluster.scheduler_address) as client:
        clusters.on_cluster(deadly, NUMBERS, heard.finished, heard.died, client)
    assert heard.dead == [4] and sorted(heard.counts) == list(range(13))
    assert sorted(heard.results) == sorted(n * n if n != 4 else -4 for n in NUMBERS)


@pytest.mark.slow
def test_a_cluster_replaces_a_worker_that_is_frozen(cluster, in_time, monkeypatch, tmp_path):
    monkeypatch.setattr(dispatch, "COMPILE_SECONDS", 5.0)

    def stuck(number):
        once = tmp_path / "stuck"
        if number == 9 and not once.exists():
            once.touch()
            os.kill(os.getpid(), signal.SIGSTOP)
        return number * number

    heard = Heard()
    with clusters.client_of(cluster.scheduler_address) as client:
        clusters.on_cluster(
            stuck, NUMBERS, heard.finished, heard.died, client, dispatch.Patience(2.0)
        )
    assert heard.dead == [] and sorted(heard.results) == [n * n for n in NUMBERS]


@pytest.mark.slow
def test_a_cluster_stops_for_a_task_without_end(cluster, in_time, monkeypatch, caplog):
    monkeypatch.setattr(dispatch, "COMPILE_SECONDS", 3.0)

    def endless(number):
        time.sleep(10_000 if number == 9 else 0)
        return number

    heard = Heard()
    with clusters.client_of(cluster.scheduler_address) as client:
        words = (
            r"^(3 workers .* one block for over 1 s without finishing it|"
            r".* lost its last worker .*); .*run .* again"
        )
        # the second where dask does not restart a worker it has killed
        with pytest.raises(Stopped, match=words):
            clusters.on_cluster(
                endless, NUMBERS, heard.finished, heard.died, client, dispatch.Patience(1.0)
            )
    # so it was this program that killed the worker
    assert "finished no block for more than 1 s" in caplog.text
    assert heard.dead == [] and len(heard.results) >= 9


@pytest.mark.slow
def test_a_cluster_whose_workers_all_die_stops_and_blames_no_task(cluster, in_time, monkeypatch):
    """Either they keep dying, or, on a busy machine, a nanny gives up."""
    monkeypatch.setattr(clusters, "WORKERLESS_SECONDS", 5)
    heard = Heard()
    with clusters.client_of(cluster.scheduler_address) as client:
        with pytest.raises(Stopped, match=r"keep dying, or pausing .* give|lost its last worker"):
            clusters.on_cluster(
                lambda _: die(),
                NUMBERS,
                heard.finished,
                heard.died,
                client,
                dispatch.Patience(20.0),
            )
    assert heard.dead == [] and heard.results == []


# MB; a worker that holds more than 80 % of it takes no further tasks, its nanny kills it at 95 %
LIMIT = 700


@pytest.fixture
def short_of_memory():
    """The address of a cluster of two workers with little memory."""
    distributed = pytest.importorskip("distributed")
    small = {
        "n_workers": 2,
        "threads_per_worker": 1,
        "memory_limit": f"{LIMIT}MB",
        "dashboard_address": None,
    }
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        distributed.LocalCluster(**small) as cluster,
    ):
        yield cluster.scheduler_address


def fill(share):
    """Let this process hold this share of its worker's memory, for good."""
    missing = share * LIMIT * 10**6 - psutil.Process().memory_info().rss
    sys.modules.setdefault("filled", []).append(b"x" * max(int(missing), 0))


def test_a_task_that_needs_too_much_memory_costs_itself_alone(short_of_memory, in_time):
    def greedy(number):
        if number == 4:
            fill(1.5)
            time.sleep(10_000)  # the nanny looks every 0.1 s
        return number * number

    heard = Heard()
    with clusters.client_of(short_of_memory) as client:
        clusters.on_cluster(greedy, NUMBERS, heard.finished, heard.died, client)
    assert heard.dead == [4] and sorted(heard.results) == sorted(
        n * n if n != 4 else -4 for n in NUMBERS
    )


@pytest.mark.slow
def test_tasks_that_all_need_too_much_memory_stop_the_run(short_of_memory, in_time, monkeypatch):
    monkeypatch.setattr(clusters, "WORKERLESS_SECONDS", 5)

    def greedy(number):
        if number >= 6:
            fill(1.5)
            time.sleep(10_000)
        return number * number

    heard = Heard()
    words = r"keep dying, or pausing for lack of memory, without finishing a block; give .* again|lost its last worker"
    with clusters.client_of(short_of_memory) as client:
        with pytest.raises(Stopped, match=words):
            clusters.on_cluster(
                greedy, range(24), heard.finished, heard.died, client, dispatch.Patience(20.0)
            )
    assert (
        heard.dead == [] and set(heard.results) and set(heard.results) <= {n * n for n in range(6)}
    )


@pytest.mark.slow
def test_a_worker_that_pauses_for_lack_of_memory_is_restarted(
    short_of_memory, in_time, monkeypatch, caplog
):
    monkeypatch.setattr(clusters, "PAUSED_SECONDS", 1)

    def leaky(number):
        fill(0.87)
        return number * number

    heard = Heard()
    with clusters.client_of(short_of_memory) as client:
        clusters.on_cluster(
            leaky, NUMBERS[:6], heard.finished, heard.died, client, dispatch.Patience(10.0)
        )
    assert heard.dead == [] and sorted(heard.results) == [n * n for n in NUMBERS[:6]]
    assert "paused for lack of memory; they are restarted" in caplog.text


class Starving:
    """A cluster as its client sees it, whose one worker, started again and again, pauses before it
    begins a task.
    """

    address, starts = "tcp://starving", 1

    @property
    def scheduler(self):
        return self

    def sync(self, ask, callback_timeout, **given):
        return ask(**given)

    def processing(self):
        return {f"worker-{self.starts}": ["key"]}

    def has_what(self):
        return {}

    def identity(self):
        return {
            "workers": {
                worker: {"status": "paused", "metrics": {"task_counts": {}}}
                for worker in self.processing()
            }
        }

    def restart_workers(self, workers, **_):
        assert workers == list(self.processing())
        self.starts += 1


def test_workers_that_never_have_memory_stop_the_run(in_time, monkeypatch):
    monkeypatch.setattr(clusters, "PAUSED_SECONDS", 0.1)
    starving = Starving()
    watch = clusters._Watch(starving, dispatch.Patience(1.0))
    with pytest.raises(
        Stopped, match=r"keep dying, or pausing for lack of memory, without finishing a block; give"
    ):
        while True:
            watch.check({"key": (None, 0)})
    assert starving.starts == clusters.STRIKES


@pytest.mark.slow
def test_a_cluster_without_workers_is_reported_and_waited_for(in_time, monkeypatch, caplog):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(clusters, "WORKERLESS_SECONDS", 0.2)
    heard = Heard()
    with distributed.LocalCluster(n_workers=0, processes=False, dashboard_address=None) as empty:
        with clusters.client_of(empty.scheduler_address) as client:
            run = threading.Thread(
                target=clusters.on_cluster,
                args=(abs, range(3), heard.finished, heard.died, client),
                daemon=True,
            )
            run.start()
            while "has no workers; waiting for some" not in caplog.text:
                time.sleep(0.05)
            assert empty.scheduler_address in caplog.text and heard.results == []
            empty.scale(1)
            run.join()
    assert sorted(heard.results) == [0, 1, 2]


def test_a_cluster_that_has_lost_its_workers_stops_the_run(in_time, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(clusters, "WORKERLESS_SECONDS", 1)
    heard = Heard()
    with distributed.LocalCluster(1, processes=False, dashboard_address=None) as small:
        with clusters.client_of(small.scheduler_address) as client:
            threading.Timer(1.5, small.scale, [0]).start()
            with pytest.raises(
                Stopped,
                match=r"lost its last worker \d+ s ago; start some .* run the command again",
            ):
                clusters.on_cluster(
                    slow, range(100), heard.finished, heard.died, client, dispatch.Patience(1.0)
                )
    assert 0 < len(heard.results) < 100


def slow(number):
    time.sleep(0.2)
    return number


def test_no_scheduler_is_reported_in_one_line(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(clusters, "SCHEDULER_SECONDS", 1)
    with pytest.raises(Stopped, match=r"no dask scheduler answers at 'tcp://127\.0\.0\.1:9'"):
        clusters.client_of("tcp://127.0.0.1:9")
    with pytest.raises((BadInput, Stopped), match="nonsense"):
        clusters.client_of("nonsense://x")


def test_a_scheduler_file_that_is_none_is_reported_in_one_line(tmp_path):
    pytest.importorskip("distributed")
    with pytest.raises(BadInput, match=r"absent\.json: there is no such scheduler file"):
        clusters.client_of(str(tmp_path / "absent.json"))
    for text in ("", "[]", "{}", "nonsense"):
        (tmp_path / "file").write_text(text)
        with pytest.raises(BadInput, match="file: this is not a scheduler file"):
            clusters.client_of(str(tmp_path / "file"))
