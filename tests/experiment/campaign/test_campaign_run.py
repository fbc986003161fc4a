"""Campaigns give the same bytes for any workers, batches and interruptions; folders are protected."""

import contextlib
import csv
import json
import os
import resource
import shlex
import shutil
import signal
import sqlite3
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from mambo_codegen.errors import INTERRUPTED, TERMINATED, ForeignFilesError, UnwritableError
from mambo_sil.errors import BusyError, FlightError, WorkerError
from mambo_sil.experiment.campaign import campaign_file
from mambo_sil.experiment.campaign.campaign_flights import fly_batch
from mambo_sil.experiment.campaign.campaign_records import campaign_record
from mambo_sil.experiment.campaign.campaign_run import (
    LARGEST_BATCH,
    batch_sizes,
    fly_missing,
    open_campaign,
    table_columns,
)
from mambo_sil.experiment.campaign.executors import Pool, cluster, processes, report_share
from mambo_sil.experiment.campaign.store import DATABASE
from mambo_sil.flight.scenario import read_record
from tests.support.command import command, run
from tests.support.tools import require_module

FLIGHTS = 6
CAMPAIGN = 'seed = 4\ncontrollers = ["pd", "mambo"]\n[flight]\nduration_s = 1.0\n'


@pytest.fixture(scope="module", name="source")
def _source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a campaign of short flights."""
    path = tmp_path_factory.mktemp("source") / "campaign.toml"
    path.write_text(CAMPAIGN)
    return path


@pytest.fixture(scope="module", name="whole")
def _whole(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run that campaign without interruption on one process."""
    folder = tmp_path_factory.mktemp("whole") / "out"
    run("campaign", str(source), "--flights", str(FLIGHTS), "--workers", "1", "-o", str(folder))
    return folder


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    """Return a copy of that campaign's folder."""
    return shutil.copytree(whole, tmp_path / "out")


def contents(folder: Path) -> dict[str, bytes]:
    """Return name and bytes of every file below `folder`; those of the database depend on the batches."""
    files = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
    return files | {DATABASE: b""} if DATABASE in files else files


def finished(folder: Path) -> set[int]:
    """Return the flights in the database in `folder`."""
    with contextlib.closing(sqlite3.connect(folder / DATABASE)) as database:
        return {flight for (flight,) in database.execute("SELECT flight FROM flights")}


def worst_records(folder: Path, name: str) -> set[str]:
    """Return the records of the worst flights of a controller, as the summary names them."""
    return {one["record"] for one in json.loads((folder / "summary.json").read_text())["worst"][name]}


def fly_on_threads(
    source: Path,
    folder: Path,
    flights: int = FLIGHTS,
    *,
    batch: int = 100,
    progress: Callable[[int], None] = lambda _: None,
) -> bytes:
    """Fly on two threads of this process, and return the table."""
    campaign = campaign_file.read(source)
    with open_campaign(campaign, folder) as store, ThreadPoolExecutor(2) as threads:
        fly_missing(campaign, store, flights, Pool(threads, 2, lambda _: None), progress, batch=batch)
        store.export()
    return (folder / "flights.csv").read_bytes()


@pytest.mark.first_is_quick
@pytest.mark.parametrize("batch", [100, 2])
def test_the_table_depends_neither_on_batches_nor_on_workers(
    batch: int, source: Path, whole: Path, tmp_path: Path
) -> None:
    """One process and two threads, with any batch size, give the same bytes."""
    assert fly_on_threads(source, tmp_path, batch=batch) == (whole / "flights.csv").read_bytes()


def test_a_folder_has_table_summary_records_and_pictures(source: Path, whole: Path) -> None:
    """The table has draws and results of each flight; the worst flights have records."""
    names = set(contents(whole))
    records = {*worst_records(whole, "pd"), *worst_records(whole, "mambo")}
    files = {"campaign.json", DATABASE, "flights.csv", "summary.json", "campaign.png", "campaign.svg"}
    assert names == files | records
    rows = list(csv.DictReader((whole / "flights.csv").read_text().splitlines()))
    assert [int(row["flight"]) for row in rows] == list(range(FLIGHTS))
    assert tuple(rows[0])[1:-1] == table_columns(campaign_file.read(source))
    assert 0.063 <= float(rows[0]["mass_kg"]) <= 0.08
    summary = json.loads((whole / "summary.json").read_text())
    assert summary["flights"] == FLIGHTS
    assert summary["controllers"]["mambo"]["crashed"]["count"] == 0
    assert len(summary["worst"]["pd"]) == 5


def test_every_flight_has_a_record(whole: Path, folder: Path) -> None:
    """A file, or made from the database with the same content."""
    rows = list(csv.DictReader((whole / "flights.csv").read_text().splitlines()))
    shutil.rmtree(folder / "flights")
    for flight, row in enumerate(rows):
        for name in ("pd", "mambo"):
            path = Path("flights") / f"{flight:06}-{name}.json"
            record = campaign_record(folder / path)
            assert record is not None
            assert record.controller == ("pd" if name == "pd" else "nmpc")
            assert record.scenario.mass_kg == float(row["mass_kg"])
            assert record.trace_sha256 == row[f"{name}_trace_sha256"]
            if (whole / path).exists():
                assert record == read_record(whole / path)


def test_a_flight_without_a_file_repeats_bit_for_bit(whole: Path, tmp_path: Path) -> None:
    """Its record comes from the database; the Python reference, alone, has the bits of the C in a batch."""
    (left,) = {f"flights/{flight:06}-mambo.json" for flight in range(FLIGHTS)} - worst_records(whole, "mambo")
    options = "--json", "--no-pictures", "-o", str(tmp_path)
    assert json.loads(run("fly", "--repeat", str(whole / left), *options)[0])["same_bits_as_recorded"] is True


@pytest.mark.parametrize(
    "path",
    [
        "flights/000006-pd.json",
        "flights/000001-no.json",
        "flights/1-pd.json",
        "000001-pd.json",
        "a/flights/000001-pd.json",
    ],
)
def test_a_record_of_no_flight_cannot_be_read(path: str, whole: Path, tmp_path: Path) -> None:
    """No such flight, controller, file or campaign."""
    assert campaign_record(whole / path) is None
    said = run("fly", "--repeat", str(whole / path), "-o", str(tmp_path), code=2)[1]
    assert "cannot be read: No such file or directory" in said


def test_a_record_of_another_version_cannot_be_read(folder: Path) -> None:
    """That version flew it."""
    identity = json.loads((folder / "campaign.json").read_text()) | {"generator": "mambo-nmpc 0.0"}
    (folder / "campaign.json").write_text(json.dumps(identity))
    assert campaign_record(folder / "flights" / "000001-pd.json") is None


STOPPED = """
import os, signal
from mambo_nmpc.__main__ import main
from mambo_sil.experiment.campaign.store import FlightStore
add = FlightStore.add
def add_and_stop(self, rows):
    add(self, rows)
    STOP
FlightStore.add = add_and_stop
main()
"""


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize(
    ("stop", "code"),
    [
        ("os.kill(os.getpid(), signal.SIGKILL)", -signal.SIGKILL),
        ("os.killpg(0, signal.SIGINT)", INTERRUPTED),
        ("os.kill(os.getpid(), signal.SIGTERM)", TERMINATED),
    ],
    ids=["killed", "Ctrl-C, which also signals the workers", "terminated"],
)
def test_a_stopped_campaign_resumes_to_the_same_bytes(
    stop: str, code: int, source: Path, whole: Path, tmp_path: Path
) -> None:
    """It keeps finished flights and leaves no worker; resumed on two workers it has the results of one."""
    arguments = ("campaign", source, "--flights", FLIGHTS, "--workers", 2, "-o", tmp_path)
    done = command(*arguments, script=STOPPED.replace("STOP", stop))
    assert (done.returncode, done.stdout) == (code, "")
    if code != -signal.SIGKILL:
        message = f"stopped with 3 of {FLIGHTS} flights finished; the same command continues from there\n"
        assert done.stderr.endswith(message)
        assert done.stderr.count("\n") == 1
    assert len(finished(tmp_path)) == 3
    killed = code == -signal.SIGKILL
    before = [] if killed else (tmp_path / "flights.csv").read_text().splitlines()
    assert len(before) == (0 if killed else 1 + 3)
    assert "improvement on pd: " in run(*map(str, arguments))[0]
    assert contents(tmp_path) == contents(whole)
    assert set(before) <= set((tmp_path / "flights.csv").read_text().splitlines())


def test_a_campaign_resumes_after_a_full_disk(source: Path, whole: Path, tmp_path: Path) -> None:
    """The batch that the disk has no room for is not stored; the next run flies it, and the rest."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)

    def fill(stored: int) -> None:
        if stored == 2:
            resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))

    try:
        with pytest.raises(UnwritableError, match=r"flights\.sqlite: cannot be .*; the finished flights"):
            fly_on_threads(source, tmp_path, batch=1, progress=fill)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert len(finished(tmp_path)) == 2
    assert fly_on_threads(source, tmp_path) == (whole / "flights.csv").read_bytes()


def test_a_finished_campaign_may_be_extended(source: Path, whole: Path, tmp_path: Path) -> None:
    """It flies the missing flights only and equals one of the full size; fewer flights are refused."""
    fly_on_threads(source, tmp_path, 2)
    counts: list[int] = []
    table = fly_on_threads(source, tmp_path, FLIGHTS, batch=1, progress=counts.append)
    assert counts == [2, 3, 4, 5, 6]
    assert table == (whole / "flights.csv").read_bytes()
    with pytest.raises(FlightError, match="already has flight 5; --flights must be 6 or more"):
        fly_on_threads(source, tmp_path, 4)


@pytest.mark.long
def test_a_finished_campaign_needs_no_worker_and_keeps_its_records(
    source: Path, whole: Path, folder: Path
) -> None:
    """With nothing to fly no scheduler is asked, and only a record that is missing or damaged is written."""
    missing, damaged, name, *_ = sorted(worst_records(whole, "pd"))
    (folder / missing).unlink()
    (folder / damaged).write_text("{")
    kept = folder / name
    kept.write_text("{ " + kept.read_text().removeprefix("{"))
    edited = kept.read_bytes()
    options = ("--flights", str(FLIGHTS), "--scheduler", "tcp://127.0.0.1:1", "-o", str(folder), "--json")
    assert run("campaign", str(source), *options)[0] == (folder / "summary.json").read_text()
    assert kept.read_bytes() == edited
    kept.write_bytes((whole / name).read_bytes())
    assert contents(folder) == contents(whole)


@pytest.mark.parametrize(
    ("flights", "workers", "first"), [(1, 8, 20), (6, 2, 20), (1000, 2, 20), (50_000, 64, 20), (7, 2, 1)]
)
def test_batches_grow_and_hold_every_flight(flights: int, workers: int, first: int) -> None:
    """No worker is without one in the beginning, and the last ones are small."""
    sizes = list(batch_sizes(flights, workers, first))
    assert sum(sizes) == flights
    assert min(sizes) > 0
    assert len(sizes) >= min(workers, flights)
    assert max(sizes[: 4 * workers]) <= first
    assert max(sizes[-workers:]) <= max(first, flights // workers)


def test_a_million_flights_are_few_tasks() -> None:
    """Their number is what a scheduler must bear."""
    sizes = list(batch_sizes(1_000_000, 16, 20))
    assert max(sizes) == LARGEST_BATCH
    assert len(sizes) < 4000


def test_unfinished_flights_are_counted(source: Path, tmp_path: Path) -> None:
    """The share of a running batch counts as flights."""
    campaign, amounts = campaign_file.read(source), set[float]()
    with open_campaign(campaign, tmp_path) as store, ThreadPoolExecutor(1) as thread:
        pool = Pool(thread, 2, lambda _: None, shares=lambda: 0.5)
        fly_missing(campaign, store, FLIGHTS, pool, lambda _: None, running=amounts.add)
    assert amounts == {0.5 * FLIGHTS / 2}


def report_half(fifo: str) -> None:
    """Report half of a task, and wait until somebody opens `fifo`."""
    report_share(0.5)
    Path(fifo).read_text()


@pytest.mark.long
def test_a_worker_process_reports_its_share(tmp_path: Path) -> None:
    """The pool sees the share while the task runs."""
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    seen: list[float] = []

    def look(shares: float) -> None:
        seen.append(shares)
        if seen.count(0.5) == 1 and shares == 0.5:
            fifo.write_text("")

    with processes(1) as pool:
        assert list(pool.run(report_half, [(str(fifo),)], look)) == [(0, None)]
    assert 0.5 in seen


def test_another_campaign_is_refused(source: Path, whole: Path, folder: Path, tmp_path: Path) -> None:
    """The message names the first difference, and no file changes."""
    (tmp_path / "other.toml").write_text(CAMPAIGN.replace("seed = 4", "seed = 5"))
    (tmp_path / "third.toml").write_text(CAMPAIGN + "[draws]\nmass_kg = 0.07\n")
    for name, difference in (
        ("other", "seed = 4 instead of 5"),
        ("third", "draws.mass_kg = .* instead of 0.07"),
    ):
        with pytest.raises(ForeignFilesError, match=f"holds another campaign, with {difference}"):
            fly_on_threads(tmp_path / f"{name}.toml", folder)
    assert contents(folder) == contents(whole)
    assert fly_on_threads(source, folder) == (whole / "flights.csv").read_bytes()


@pytest.mark.parametrize("name", ["thesis.tex", "campaign.json", "flights.csv", DATABASE])
def test_a_folder_with_other_files_is_refused(name: str, source: Path, tmp_path: Path) -> None:
    """A foreign file that has the name of a result does not mark a folder of results."""
    (tmp_path / name).write_text("{}")
    with pytest.raises(ForeignFilesError, match="not from a mambo-nmpc campaign"):
        fly_on_threads(source, tmp_path)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(name, "{}")]


def test_an_edited_csv_is_written_anew(source: Path, whole: Path, folder: Path) -> None:
    """The flights are in the database."""
    (folder / "flights.csv").write_text("edited\n")
    assert fly_on_threads(source, folder) == (whole / "flights.csv").read_bytes()


def test_a_campaign_of_another_version_is_refused(source: Path, folder: Path) -> None:
    """The message names the version and what to do, and no file changes."""
    (folder / DATABASE).unlink()
    identity = json.loads((folder / "campaign.json").read_text())
    (folder / "campaign.json").write_text(json.dumps(identity | {"generator": "mambo-nmpc 0.2.0"}))
    before = contents(folder)
    said = run("campaign", str(source), "--flights", str(FLIGHTS), "-o", str(folder), code=2)[1]
    assert said.endswith(
        "out: holds a campaign of mambo-nmpc 0.2.0, which this version does not read; "
        "go on with that version, or name another folder with -o\n"
    )
    assert contents(folder) == before


def test_one_run_at_a_time(source: Path, tmp_path: Path) -> None:
    """A second run in the same folder raises `BusyError`."""
    with open_campaign(campaign_file.read(source), tmp_path), pytest.raises(BusyError, match="another run"):
        fly_on_threads(source, tmp_path)


def test_a_dead_worker_is_reported(source: Path, tmp_path: Path) -> None:
    """A worker process that ends, for instance for lack of memory, raises `WorkerError`."""
    campaign = campaign_file.read(source)
    with (
        open_campaign(campaign, tmp_path) as store,
        pytest.raises(WorkerError, match="a worker process has died; the finished flights are kept"),
        processes(1) as pool,
    ):
        list(pool.run(os._exit, [(1,)]))
    assert store.finished == set()


def test_workers_of_another_version_are_refused() -> None:
    """Another version might give other flights, so it raises `WorkerError`."""
    with pytest.raises(WorkerError, match=r"a worker has mambo-nmpc .*, the campaign 0\.0\.0"):
        fly_batch("0.0.0", [], {}, [])


def test_scheduler_and_workers_exclude_each_other(tmp_path: Path) -> None:
    """With --scheduler the cluster determines the workers, so --workers is an error."""
    options = ("--scheduler", "tcp://127.0.0.1:1", "--workers", "2", "-o", str(tmp_path / "out"))
    assert "leave out --workers" in run("campaign", *options, code=2)[1]
    assert not (tmp_path / "out").exists()


def test_missing_dask_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message says how to install it for the Python that runs; no folder is made."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    line = ("campaign", "--scheduler", "tcp://127.0.0.1:1", "-o", str(tmp_path / "out"))
    install = shlex.join([sys.executable, "-m", "pip", "install", "distributed"])
    assert run(*line, code=2) == ("", f"--scheduler needs Dask; install it: {install}\n")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("scheme", ["tls", "ucx"])
def test_an_address_that_needs_more_is_reported(scheme: str) -> None:
    """Certificates of TLS and the package for UCX are named, with an address that needs neither."""
    require_module("distributed")
    message = (
        rf"^--scheduler {scheme}://127\.0\.0\.1:1: Dask cannot use .*certificates.*tcp://host:8786 needs"
    )
    with pytest.raises(WorkerError, match=message), cluster(f"{scheme}://127.0.0.1:1"):
        pass


def test_a_bad_address_is_reported() -> None:
    """The message shows the form of an address."""
    require_module("distributed")
    with pytest.raises(WorkerError, match=r"missing port number.*as in tcp://host:8786"), cluster("garbage"):
        pass


@pytest.mark.long
def test_an_unreachable_scheduler_is_reported_within_seconds() -> None:
    """An address where nothing listens raises `WorkerError`."""
    require_module("distributed")
    with pytest.raises(WorkerError, match="no Dask scheduler answers there"), cluster("127.0.0.1:1"):
        pass


@pytest.mark.long
@pytest.mark.filterwarnings("default")  # Dask itself warns
def test_a_dask_cluster_gives_the_results_of_one_process(source: Path, whole: Path, tmp_path: Path) -> None:
    """The workers of a cluster give the same bytes."""
    require_module("distributed")
    from distributed import LocalCluster  # noqa: PLC0415 - an optional extra

    campaign = campaign_file.read(source)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as local:
        with open_campaign(campaign, tmp_path) as store, cluster(local.scheduler_address) as pool:
            assert pool.workers == 2
            fly_missing(campaign, store, FLIGHTS, pool, lambda _: None, batch=2)
            store.export()
        assert (tmp_path / "flights.csv").read_bytes() == (whole / "flights.csv").read_bytes()


@pytest.mark.long
@pytest.mark.filterwarnings("default")  # Dask itself warns
def test_a_scheduler_may_die_when_all_has_flown() -> None:
    """The results are there: the pool is left without an error."""
    require_module("distributed")
    from distributed import Client, LocalCluster  # noqa: PLC0415 - an optional extra

    with (
        LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as local,
        cluster(local.scheduler_address) as pool,
    ):
        assert list(pool.run(pow, [(2, 3)])) == [(0, 8)]
        local.close()
        client: Client = pool.executor._client  # type: ignore[attr-defined] # Dask's executor
        client.close()  # as it does after some seconds without a scheduler
