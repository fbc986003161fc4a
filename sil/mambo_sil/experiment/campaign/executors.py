"""Executors that run batches of flights: processes of this machine, or the workers of a Dask cluster.

Both have the interface of `concurrent.futures.Executor`; the rest of the campaign does not distinguish them.
"""

import asyncio
import contextlib
import gc
import logging
import os
import shlex
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import islice
from multiprocessing import active_children, get_context, parent_process
from typing import Any, Final

from mambo_codegen import __version__
from mambo_codegen.errors import MamboNmpcError, echo
from mambo_sil.errors import WorkerError

TIME_LIMIT_S: Final = 5.0
"""Time within which a scheduler must answer."""

_TASKS_PER_WORKER: Final = 4
"""Tasks that wait or run at a time: enough that no worker waits for the next one."""

_PERIOD_S: Final = 0.25
"""Time from one look at the running tasks to the next."""


@dataclass(frozen=True)
class Pool:
    """An executor, its number of workers, and a function that explains the failure of a worker."""

    executor: Executor
    workers: int
    trouble: Callable[[BaseException], str | None]
    """Returns the reason if an exception means that a worker or scheduler failed, else None."""
    shares: Callable[[], float] = lambda: 0.0
    """Returns the sum of the finished shares of all running tasks, as far as they are known."""

    def run(
        self,
        function: Callable[..., Any],
        tasks: Iterable[tuple[Any, ...]],
        running: Callable[[float], None] = lambda _: None,
    ) -> Iterator[tuple[int, Any]]:
        """Yield number and result of each task as it finishes, in any order; take a task when it is due.

        Meanwhile calls `running` with the sum of the finished shares of all running tasks. Raises
        WorkerError if a worker fails, and passes on a `MamboNmpcError` that a task raises.
        """
        left, asked = enumerate(tasks), dict[Future[Any], int]()
        while True:
            due = list(islice(left, _TASKS_PER_WORKER * self.workers - len(asked)))
            with self._explained(), _interrupts_blocked():  # worker processes inherit the mask
                asked |= {self.executor.submit(function, *task): number for number, task in due}
            if not asked:
                return
            finished, _ = wait(asked, _PERIOD_S, FIRST_COMPLETED)
            running(self.shares())
            for future in finished:
                with self._explained():
                    result = future.result()
                yield asked.pop(future), result

    @contextlib.contextmanager
    def _explained(self) -> Iterator[None]:
        """Raise WorkerError for an exception which means that a worker failed."""
        try:
            yield
        except MamboNmpcError:
            raise
        except (CancelledError, Exception) as error:
            reason = self.trouble(error)
            if reason is None:
                raise
            raise WorkerError(
                f"{reason}; the finished flights are kept, and the same command continues from there"
            ) from error


@contextlib.contextmanager
def processes(count: int) -> Iterator[Pool]:
    """Start `count` worker processes on this machine; they end when this process ends, even if killed."""

    def trouble(error: BaseException) -> str | None:
        return "a worker process has died" if isinstance(error, BrokenProcessPool) else None

    spawn = get_context("spawn")
    shares, started = spawn.Array("d", count), spawn.Value("i", 0)
    with ProcessPoolExecutor(count, spawn, _start_worker, (shares, started, gc.get_threshold())) as executor:
        try:
            yield Pool(executor, count, trouble, lambda: sum(shares[:]))
        except BaseException:
            for child in active_children():
                child.terminate()
            raise  # leaving the `with` cancels the tasks of the broken executor and waits for it


def report_share(share: float) -> None:
    """Tell the finished share of this process's task, 0 to 1, to its pool if it has one."""
    if _slot is not None:
        shares, number = _slot
        shares[number] = share


_slot: tuple[Any, int] | None = None
"""In a worker process of this machine: the shares of all workers, and the number of this one."""


def _start_worker(shares: Any, started: Any, collection: tuple[int, int, int]) -> None:
    """Take the next place in `shares`, an array in the memory of all workers, and follow the parent.

    Look for garbage as often as the parent does.
    """
    gc.set_threshold(*collection)
    global _slot  # noqa: PLW0603 - set once in a process
    with started.get_lock():
        _slot = shares, started.value
        started.value += 1
    _follow_parent()


def _follow_parent() -> None:
    """End this process as soon as its parent has ended, even if the parent was killed."""
    parent = parent_process()
    assert parent is not None  # a worker has one

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


@contextlib.contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block SIGINT in this process; processes started meanwhile inherit the mask and keep it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def cluster(address: str) -> Iterator[Pool]:
    """Connect to the Dask scheduler at `address`; raises WorkerError if none answers or it has no workers."""
    try:
        from distributed import Client  # noqa: PLC0415 - an optional extra
    except ImportError:
        install = shlex.join([sys.executable, "-m", "pip", "install", "distributed"])
        raise WorkerError(f"--scheduler needs Dask; install it: {install}") from None
    option = f"--scheduler {echo(address)}"
    for name in ("distributed", "distributed.client"):  # errors arrive as exceptions
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        asyncio.run(asyncio.wait_for(_knock(address), TIME_LIMIT_S))
        client = Client(address, timeout=TIME_LIMIT_S, set_as_default=False)
    except (TypeError, ImportError, RuntimeError) as error:
        raise WorkerError(
            f"{option}: Dask cannot use this address ({echo(str(error))}); tls:// and wss:// need "
            "certificates in Dask's configuration (distributed.comm.tls), ucx:// needs the package for it; "
            "tcp://host:8786 needs neither"
        ) from None
    except (OSError, ValueError) as error:
        reason = str(error) or f"no answer within {TIME_LIMIT_S:g} s"
        raise WorkerError(
            f"{option}: no Dask scheduler answers there ({echo(reason)}); "
            "start one with `dask scheduler`, and give its address as in tcp://host:8786"
        ) from None

    def trouble(error: BaseException) -> str:
        if isinstance(error, CancelledError):
            return f"{option}: the connection to the scheduler is lost"
        return (
            f"{option}: a worker has failed, {type(error).__name__}: {echo(str(error))}; mambo-nmpc "
            f"{__version__} must be installed where scheduler and workers run"
        )

    with client:
        workers = sum(client.nthreads().values())
        if workers == 0:
            raise WorkerError(f"{option}: has no workers; start some with `dask worker {echo(address)}`")
        executor = client.get_executor(pure=False)
        try:
            yield Pool(executor, workers, trouble)
        finally:
            with contextlib.suppress(Exception):  # a lost scheduler has nothing left to cancel
                executor.shutdown(wait=False)


async def _knock(address: str) -> None:
    """Connect to a scheduler and disconnect; unlike Client, this gives up if nothing answers."""
    from distributed import Security  # noqa: PLC0415 - an optional extra
    from distributed.core import connect  # noqa: PLC0415 - likewise

    certificates = Security().get_connection_args("client")
    connection = await connect(address, timeout=TIME_LIMIT_S, **certificates)
    await connection.close()
