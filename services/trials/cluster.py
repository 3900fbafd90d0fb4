"""Trials on a Dask cluster: our own on this machine, or any other by its address."""

from __future__ import annotations

import itertools
import logging
import signal
import tempfile
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import dask
from distributed import Client, Future, LocalCluster, Worker, WorkerPlugin, as_completed
from distributed.scheduler import KilledWorker

from services.trials.code import Code, differences
from services.trials.work import ONE_THREAD, Probe, Record, probe, run_trial

PATIENCE = 20.0
"""How long a cluster may take to answer [s]."""
RETRIES = 1
"""How often a trial is tried again after the worker that ran it died."""


class BadCluster(RuntimeError):
    """A cluster cannot be used, or was lost; the text says why."""


@contextmanager
def connected(workers: int, address: str | None) -> Iterator[Client]:
    """A client of the cluster at an address, or of one of our own with so many workers.

    Raises:
        BadCluster: nobody answers there, or it has no worker.
    """
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # deaths are told by the records
    with dask.config.set({"distributed.scheduler.allowed-failures": RETRIES}):
        if address is None:
            with (
                tempfile.TemporaryDirectory(prefix="steadyhand-trials-") as scratch,
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    host="127.0.0.1",
                    dashboard_address="127.0.0.1:0",  # any: a port that is taken is warned of
                    memory_limit=0,  # else a worker pauses by what others on the machine use
                    local_directory=scratch,
                    env=ONE_THREAD,
                    silence_logs=logging.CRITICAL,
                ) as cluster,
                Client(cluster, set_as_default=False) as client,
            ):
                client.register_plugin(_Deaf())
                yield client
            return
        try:
            client = Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            raise BadCluster(
                f"no Dask scheduler answers at {address!r} ({error or type(error).__name__}). "
                "An address is like tcp://10.0.0.1:8786; without --cluster this machine is used"
            ) from None
        with client:
            try:
                client.wait_for_workers(1, timeout=PATIENCE)
            except TimeoutError:
                raise BadCluster(
                    f"the cluster at {address} has no workers; start some: "
                    f"dask worker {address} --nthreads 1"
                ) from None
            yield client


class _Deaf(WorkerPlugin):
    """Ctrl-C is for the campaign, which ends its workers; they would each print a traceback."""

    def setup(self, worker: Worker) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def examine(client: Client, source: str, code: Code) -> int:
    """Check that every worker can give the same bits; returns how many there are.

    Args:
        client: of the cluster.
        source: of the experiment.
        code: of the campaign.

    Raises:
        BadCluster: with every finding.
    """
    answers: dict[str, Probe | Exception] = client.run(probe, source, on_error="return")
    threads = client.nthreads()
    findings = []
    for address, answer in sorted(answers.items()):
        if isinstance(answer, Exception):
            findings.append(f"{address} cannot load it: {type(answer).__name__}: {answer}")
            continue
        if changed := differences(code, answer["code"]):
            findings.append(f"{address} has other code: {', '.join(changed)}")
        if threads.get(address, 1) != 1:
            findings.append(f"{address} runs several trials at once: start it with --nthreads 1")
        if answer["threads"] != "1":
            findings.append(
                f"{address} computes in several threads (OMP_NUM_THREADS {answer['threads']}): "
                f"start it with {' '.join(f'{k}={v}' for k, v in ONE_THREAD.items())}"
            )
    if findings:
        raise BadCluster("the cluster would not give the same results: " + "; ".join(findings))
    return len(answers)


def run(
    client: Client,
    source: str,
    options: dict[str, Any],
    seeds: Iterable[int],
    code: Code,
    width: int,
) -> Iterator[Record]:
    """Run a trial for each seed; records come in the order in which they end.

    Args:
        client: of the cluster.
        source: of the experiment.
        options: all of them, as plain data.
        seeds: of the trials.
        code: of the campaign.
        width: trials at once. No more are handed out, because those that wait at a worker that
            dies would be blamed for its death.

    Raises:
        BadCluster: it was lost, or got a worker with other code.
    """
    campaign, waiting = uuid.uuid4().hex, iter(seeds)
    running: dict[str, int] = {}

    def submit(seed: int) -> Future:
        key = f"trial-{campaign}-{seed}"
        running[key] = seed
        return client.submit(run_trial, source, options, seed, code, key=key, pure=False)

    done = as_completed(
        [submit(seed) for seed in itertools.islice(waiting, width)],
        loop=client.loop,
    )
    try:
        for future in done:
            record = _record(future, running.pop(future.key))
            # before the next trial, which may kill the worker that holds this record: what is
            # still wanted then is computed again
            future.release()
            following = next(waiting, None)
            if following is not None:
                done.add(submit(following))
            yield record
    finally:
        for key in running:
            Future(key, client).cancel(force=True)


def _record(future: Future, seed: int) -> Record:
    if future.status == "finished":
        record: Record = future.result()
        return record
    if future.status == "cancelled":
        raise BadCluster("the cluster was lost. --resume goes on when it is back")
    error = future.exception()
    if isinstance(error, KilledWorker):
        text = "the worker that ran it died, and so did the one that tried it again"
        return Record(
            seed=seed, status="lost", row=None, error=text, traceback=str(error), seconds=0.0
        )
    raise BadCluster(str(error))
