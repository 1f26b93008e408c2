"""Grids: who runs the tasks changes no number, and what is done is not done again."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import masrel.planning._grids as grids
from masrel.errors import ParameterError
from masrel.planning import plan_grid, sample_size

GRID: dict[str, Any] = {
    "coefficient": "fleiss_kappa",
    "value": [0.4, 0.6],
    "prevalences": [0.5, 0.3, 0.2],
    "model": "dirichlet-multinomial",
    "target": "items",
    "n_items": [20, 30],
    "n_raters": [2, 4],
    "half_width": 0.2,
    "interval": "t",
    "rng": 5,
}


def test_a_grid_has_every_cell_once() -> None:
    plans = plan_grid(**GRID)
    sizes = [(plan.value, plan.n_items, plan.n_raters) for plan in plans]
    assert sizes == [(v, n, r) for v in (0.4, 0.6) for n in (20, 30) for r in (2, 4)]
    assert {plan.n_studies for plan in plans} == {20_000}


def test_a_grid_goes_on_where_it_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(done: int, _of: int) -> None:
        if done == 5:
            raise KeyboardInterrupt

    file = tmp_path / "grid.json"
    with pytest.raises(KeyboardInterrupt):
        plan_grid(**GRID, file=file, progress=stop)
    run, drawn = grids.run_task, []
    monkeypatch.setattr(
        grids, "run_task", lambda *args: drawn.append(args[2]) or run(*args)
    )
    assert plan_grid(**GRID, file=file) == plan_grid(**GRID)
    assert len(drawn) == 16 - 5 + 16
    drawn.clear()
    plan_grid(**GRID, file=file)
    assert drawn == []
    file.write_text("{")
    with pytest.raises(ParameterError, match="file: needs what a grid has written"):
        plan_grid(**GRID, file=file)


def test_prevalences_and_exact_cells_can_be_ranges_too() -> None:
    common = {**GRID, "value": 0.5, "n_raters": 2, "interval": "normal"}
    plans = plan_grid(**{**common, "prevalences": [[0.5, 0.5], [0.9, 0.1]]})
    assert [plan.method for plan in plans] == ["exact"] * 4
    assert plans[0].p_undefined < plans[2].p_undefined


def test_a_grid_needs_studies() -> None:
    with pytest.raises(ParameterError, match="n_studies: needs at least 1, got -5"):
        plan_grid(**GRID, n_studies=-5)


SOLVED: dict[str, Any] = {
    **GRID,
    "prevalences": [0.7, 0.3],
    "value": [0.6, 0.8],
    "n_items": None,
    "n_raters": [2, 3],
}


def test_one_size_can_be_solved_for_in_every_cell() -> None:
    plans = plan_grid(**SOLVED)
    common = {**SOLVED, "value": 0.8, "n_raters": 3}
    assert plans[-1] == sample_size(**common)
    assert [plan.n_raters for plan in plans] == [2, 3, 2, 3]
    (unreached,) = plan_grid(
        **{**common, "n_items": 10, "n_raters": None, "value": 0.6}
    )
    assert unreached.reaches_aim is False
    assert (
        "half_width: a half-width of 0.2 needs more than 60 raters"
        in (unreached.notes[0])
    )


def test_grids_aim_at_chances_as_a_single_plan_does() -> None:
    common: dict[str, Any] = {**SOLVED, "value": 0.6, "n_items": [40, 80]}
    plans = plan_grid(**common, assurance=0.8)
    assert [plan.reaches_aim for plan in plans] == [
        plan.assurance >= 0.8 for plan in plans
    ]
    assert {plan.reaches_aim for plan in plans} == {True, False}
    del common["half_width"]
    both = {"lower": 0.3, "upper": 0.9}
    plans = plan_grid(**common, **both, power=0.5)  # equivalence
    inside = plan_grid(**common, **both)
    assert [plan.power for plan in plans] == [plan.assurance for plan in inside]


def test_a_grid_needs_a_size_and_an_aim_for_the_other(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="n_raters: a grid needs one of them"):
        plan_grid(**{**SOLVED, "n_raters": None})
    with pytest.raises(ParameterError, match="half_width: needs an aim, where"):
        plan_grid(**{**SOLVED, "half_width": None})
    with pytest.raises(ParameterError, match="file: is of grids"):
        plan_grid(**SOLVED, file=tmp_path / "grid.json")


def test_an_executor_is_one_of_two() -> None:
    with pytest.raises(ParameterError, match="executor: needs one of processes, dask"):
        plan_grid(**{**GRID, "executor": "slurm"})


def test_a_scheduler_has_an_address_and_is_of_dask() -> None:
    with pytest.raises(ParameterError, match='scheduler: is of executor "dask" alone'):
        plan_grid(**GRID, scheduler="tcp://127.0.0.1:1")
    pytest.importorskip("distributed")
    with pytest.raises(ParameterError, match="scheduler: needs an address as tcp"):
        plan_grid(**GRID, executor="dask", scheduler="nowhere")


def test_a_missing_dask_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ParameterError, match=r'pip install "masrel\[dask\]"'):
        plan_grid(**GRID, executor="dask")


@pytest.mark.slow
def test_processes_give_the_same_numbers() -> None:
    assert plan_grid(**GRID, executor="processes") == plan_grid(**GRID)
    # as text: nan that comes from another process is equal to none
    assert repr(plan_grid(**SOLVED, executor="processes")) == repr(plan_grid(**SOLVED))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_on_this_machine_gives_the_same_numbers() -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0"
    ) as cluster:
        plans = plan_grid(**GRID, executor="dask", scheduler=cluster.scheduler_address)
    assert plans == plan_grid(**GRID)


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and two workers, each a process."""
    pytest.importorskip("distributed")
    port = 20_000 + os.getpid() % 20_000
    address = f"tcp://127.0.0.1:{port}"
    dask = [sys.executable, "-m", "dask"]
    local = ["--no-dashboard"]
    where = {
        "cwd": tmp_path,
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.DEVNULL,
    }
    at = ["--host", "127.0.0.1", "--port", str(port)]
    processes = [subprocess.Popen([*dask, "scheduler", *at, *local], **where)]  # type: ignore[call-overload]
    for _ in range(2):
        worker = [*dask, "worker", address, "--nthreads", "1", "--no-nanny", *local]
        processes.append(subprocess.Popen(worker, **where))  # type: ignore[call-overload]
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

    plans = plan_grid(**GRID, executor="dask", scheduler=address, progress=kill)
    assert processes[2].wait(timeout=10) == -signal.SIGKILL
    assert processes[1].poll() is None
    assert plans == plan_grid(**GRID)
