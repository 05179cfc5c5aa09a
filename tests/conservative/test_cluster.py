"""A Dask cluster of two workers, one of them killed, gives the same numbers; a missing scheduler is reported."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack

import numpy as np
import pytest

import conservative as cv
from conservative.integration import blocks, cluster
from conservative.integration.cluster import open_client, require_versions

from ..environments import PATIENCE

distributed = pytest.importorskip("distributed")

N, KILLED = 24, 9
"""Number of bodies (one per block), and number of results when a worker is killed."""
RETRIES = {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "3s"}
"""Time limit of a scheduler to reach a dead worker: 30 s by default."""


def start(stack, folder, program, *arguments):
    """Start a program of Dask that ends with the stack."""
    command = [sys.executable, "-m", f"distributed.cli.dask_{program}", "--no-dashboard", *arguments]
    log = stack.enter_context((folder / program).open("ab"))
    process = subprocess.Popen(command, stdout=log, stderr=log, cwd=folder, env=os.environ | RETRIES)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


def start_scheduler(stack, folder):
    """Start a scheduler and return its address."""
    file, end = folder / "scheduler.json", time.monotonic() + PATIENCE
    start(stack, folder, "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
    while not file.exists() and time.monotonic() < end:
        time.sleep(0.05)
    return json.loads(file.read_text())["address"]


def run(**options):
    """Run tops, one per block; the fourth fails."""
    w = np.random.default_rng(14).normal(size=(N, 3)) * 3
    w[3] = 1e9
    weight = {"weight": np.linspace(1.0, 2.0, N)}
    given = {"parameters": weight, "dt": 1e-3, "t_end": 2.0, "sample_every": 500, "method": "convected", "threads": 1}
    return cv.integrate_many(cv.scenes.lagrange_top(), w_WB_B0=w, **given, **options)


@pytest.mark.slow
def test_a_worker_that_is_killed_loses_nothing_and_nothing_comes_twice(tmp_path, monkeypatch):
    monkeypatch.setattr(blocks, "MOST_BODIES", 1)
    alone, done = run(), []
    with ExitStack() as stack:
        address = start_scheduler(stack, tmp_path)
        client = stack.enter_context(open_client(address, PATIENCE))
        with pytest.raises(cv.BadInput, match=r"client: got a scheduler at tcp.* without workers"):
            run(client=client)
        options = "--nthreads", "1", "--no-nanny", "--host", "127.0.0.1"
        workers = [start(stack, tmp_path, "worker", address, *options) for _ in range(2)]
        client.wait_for_workers(2, timeout=PATIENCE)

        def kill_one(progress):
            done.append(progress.done)
            if progress.done == KILLED:
                workers[0].send_signal(signal.SIGKILL)

        found = run(client=client, progress=kill_one, path=tmp_path / "a.zarr")
        assert workers[0].wait() == -signal.SIGKILL
        assert done == list(range(1, N + 1))
        assert np.array_equal(found.R_WB[:], alone.R_WB, equal_nan=True)
        assert np.array_equal(found.w_WB_B[:], alone.w_WB_B, equal_nan=True)
        assert {i: str(each) for i, each in found.failures.items()} == {i: str(each) for i, each in alone.failures.items()}
        assert list(found.failures) == [3]

        monkeypatch.setattr(cluster, "VERSION", "0.0.1")
        with pytest.raises(cv.BadInput, match=rf"{cv.VERSION} on tcp://.*; expected 0\.0\.1, as here, on all of them"):
            require_versions(client)
        with pytest.raises(cv.BadInput, match=rf"a worker of version {cv.VERSION}; expected 0\.0\.1"):
            cluster.ClusterExecutor(client).submit(sum, ()).result()


def test_a_missing_scheduler_is_reported_in_one_line(capfd):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        nowhere = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    for address in (nowhere, "nowhere", ""):
        with (
            pytest.raises(cv.BadInput, match=r"scheduler: got '.*', where no scheduler answers") as refused,
            open_client(address, 0.5),
        ):
            pass
        assert "\n" not in str(refused.value)
    assert capfd.readouterr() == ("", "")


def test_other_values_for_a_client_are_refused():
    for wrong in ("tcp://127.0.0.1:8786", 3):
        with pytest.raises(cv.BadInput, match=r"client: got .*; expected a dask\.distributed\.Client"):
            cv.integrate_many(cv.scenes.brick_flip(), client=wrong)
