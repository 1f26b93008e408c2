"""Grids: every cell is a plan, and who makes it changes no number."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from masrel.planning import Study, plan_grid, precision, sample_size

STUDY = Study(
    "fleiss_kappa",
    prevalences=[0.5, 0.3, 0.2],
    model="dirichlet-multinomial",
    target="items",
    half_width=0.2,
    interval="t",
    rng=5,
)
RANGES: dict[str, Any] = {"value": [0.4, 0.6], "n_items": [20, 30], "n_raters": [2, 4]}
SOLVED = replace(STUDY, prevalences=[0.7, 0.3])


def test_a_grid_has_the_plan_of_every_cell_once() -> None:
    plans = plan_grid(STUDY, **RANGES)
    assert plans == tuple(
        precision(replace(STUDY, value=value, n_items=n_items, n_raters=n_raters))
        for value in (0.4, 0.6)
        for n_items in (20, 30)
        for n_raters in (2, 4)
    )


def test_one_size_can_be_solved_for_in_every_cell() -> None:
    plans = plan_grid(SOLVED, value=[0.6, 0.8], n_raters=[2, 3])
    assert plans[-1] == sample_size(replace(SOLVED, value=0.8, n_raters=3))
    (unreached,) = plan_grid(replace(SOLVED, value=0.6, n_items=10))
    assert (unreached.reaches_aim, unreached.n_raters) == (False, 60)


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and two workers, each a process."""
    pytest.importorskip("distributed")
    port = 20_000 + os.getpid() % 20_000
    address = f"tcp://127.0.0.1:{port}"
    at = ["--host", "127.0.0.1", "--port", str(port)]
    worker = ["worker", address, "--nthreads", "1", "--no-nanny"]
    processes = [
        subprocess.Popen(
            [sys.executable, "-m", "dask", *command, "--no-dashboard"],
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for command in (["scheduler", *at], worker, worker)
    ]
    yield address, processes
    for process in processes:
        process.kill()
        process.wait()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_worker_that_is_killed_midway_loses_nothing(
    cluster: tuple[str, list[subprocess.Popen[bytes]]],
) -> None:
    address, processes = cluster
    from distributed import Client

    with Client(address, set_as_default=False, timeout="30s") as client:
        client.wait_for_workers(2, timeout=60)

    def kill(done: int, _of: int) -> None:
        if done == 3:
            processes[2].send_signal(signal.SIGKILL)

    plans = plan_grid(
        STUDY, **RANGES, executor="dask", scheduler=address, progress=kill
    )
    assert processes[2].wait(timeout=10) == -signal.SIGKILL
    assert processes[1].poll() is None
    # as text: nan that comes from another process is equal to none
    assert repr(plans) == repr(plan_grid(STUDY, **RANGES))
    solved: Any = {"value": [0.6, 0.8], "n_raters": [2, 3]}
    far = plan_grid(SOLVED, **solved, executor="dask", scheduler=address)
    assert repr(far) == repr(plan_grid(SOLVED, **solved))
