"""Jobs in parallel: on this machine (joblib), or by the workers of a Dask scheduler."""

from __future__ import annotations

import atexit
import logging
from collections.abc import Iterator, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from joblib import Parallel, delayed

import agents
import dynslam_env
import slam
from slam.errors import InputError

from .jobs import Done, Job, Trial, failure
from .sources import code_digest
from .worker_process import WorkerProcesses

if TYPE_CHECKING:
    from distributed import Client

CONNECT_TIMEOUT = 10.0  # s, for the scheduler
WORKER_TIMEOUT = 60.0  # s, for its first worker


def check_workers(workers: int) -> None:
    """Raise InputError unless `workers` is a number of parallel jobs, or -1 for one per core."""
    if workers < 1 and workers != -1:
        raise InputError(f"jobs must be at least 1, or -1 for one per core, got {workers}")


def here(jobs: Sequence[Job], workers: int) -> Iterator[Done]:
    """Results as they come; `workers` jobs run at a time (-1: one per core), each in one thread."""
    with WorkerProcesses() as processes:
        yield from results_of(jobs, workers, processes)


def results_of(jobs: Sequence[Job], workers: int, processes: WorkerProcesses) -> Iterator[Done]:
    """The same in `processes`, which may do other jobs afterwards: to start one takes seconds."""
    run = Parallel(n_jobs=workers, backend="threading", return_as="generator_unordered")
    yield from run(delayed(processes.do)(job) for job in jobs)  # pyright: ignore


def on_cluster(jobs: Sequence[Trial], address: str) -> Iterator[Done]:
    """Results as they come from all workers of the scheduler at `address`, such as tcp://host:8786.

    Jobs of a dead worker are done by another; a job that ends several workers counts as failed.
    """
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise InputError(
            "--cluster needs Dask: install dynslam[cluster], here and on every worker"
        ) from None
    logging.disable()  # asyncio, tornado and Dask tell of a scheduler that died, at length
    try:
        client = Client(address, timeout=CONNECT_TIMEOUT)
    except (OSError, ValueError) as error:
        raise InputError(f"no Dask scheduler at {address!r} ({error})") from None
    with client:
        _check_workers(client, address)
        code = own_code()
        waiting = {client.submit(do, job, code, pure=False): job for job in jobs}
        for future in as_completed(list(waiting)):
            job = waiting.pop(future)
            if future.cancelled():
                raise InputError(f"the scheduler at {address} is gone; --resume goes on")
            error = future.exception()
            if isinstance(error, InputError):  # of `do`: a worker that has joined since
                raise error
            yield Done(job.row() | failure(str(error))) if error else future.result()
            future.release()


def own_code() -> str:
    """Digest, on this machine, of our code and of the libraries that results depend on."""
    return _code()


def _code() -> str:
    homes = [Path(str(package.__file__)).parent for package in (slam, dynslam_env, agents)]
    return f"{code_digest(*homes, Path(__file__).parents[1])}, scipy {version('scipy')}"


def _check_workers(client: Client, address: str) -> None:
    """Raise InputError unless the scheduler has workers that run the same code as we do."""
    try:
        client.wait_for_workers(1, timeout=WORKER_TIMEOUT)
    except TimeoutError:
        raise InputError(
            f"the scheduler at {address} has no workers: start some by `dask worker {address}`"
        ) from None
    answers = client.run(_code, on_error="ignore")  # of those that have not died since
    found, own = cast(dict[str, Any], answers), own_code()
    others = [worker for worker, theirs in found.items() if theirs != own]
    if others:
        raise InputError(
            f"worker {others[0]} has another version of dynslam or of its libraries "
            f"({len(others)} of {len(found)} have): install the same everywhere"
        )


def do(job: Trial, code: str) -> Done:
    """Do a job on a worker, in a process of its own. Raises InputError if this worker's code is not
    `code`: it may have joined after `_check_workers`."""
    if _own_code_once() != code:
        raise InputError(
            "a worker that joined has another version of dynslam or of its libraries: install the "
            "same everywhere; --resume goes on"
        )
    return _processes().do(job)


@cache
def _own_code_once() -> str:
    return own_code()


@cache
def _processes() -> WorkerProcesses:
    processes = WorkerProcesses()
    atexit.register(processes.__exit__, None, None, None)
    return processes
