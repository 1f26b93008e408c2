"""Samples in a file are there for whoever comes after the process that took them."""

import errno
import json
import mmap
from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import RecordingError
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    SimulatedClock,
    SimulatedHand,
    cut_off,
    open_device,
    run_presentation,
)
from masrel.lab.hess._recorder import Samples, read_spool
from masrel.lab.recording import RECORDING_COLUMNS
from tests.lab.hess.rig import END, START

FACTS = {"device": "none", "rate_hz": 2000, "speed_threshold_deg_s": 17.0}


def written(path: Path, n: int, capacity: int = 10) -> None:
    samples = Samples(capacity, file=path, facts=FACTS)
    for tick in range(n):
        samples.add((tick * 1e-3, 0.5 + tick, 1.0, 2.0, 3.0 + tick, 1, 0, 1))
    samples.close()


def presented(spool: Path | None):
    clock = SimulatedClock()
    hand = SimulatedHand(start=START, end=END, mean_speed=radians(92.0))
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with open_device("simulated", clock=clock, hand=hand) as device:
        return run_presentation(
            device, controller, clock=clock, limits=DeviceLimits(), spool=spool
        )


def test_what_was_added_is_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "sub" / "a.partial"
    written(path, 3)
    left = read_spool(path)
    assert left is not None
    assert left.facts == FACTS
    assert left.columns.shape == (8, 3)
    assert left.columns[0].tolist() == [0.0, 1e-3, 2e-3]
    assert left.columns[1].tolist() == [0.5, 1.5, 2.5]
    assert left.columns[4].tolist() == [3.0, 4.0, 5.0]


def test_the_whole_file_is_there_before_the_first_sample(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    samples = Samples(1000, file=path, facts=FACTS)
    size = path.stat().st_size
    assert size == 4096 + 8 * (1 + 8 * 1000)
    assert path.stat().st_blocks * 512 >= size  # not sparse: the disk has given it
    samples.close()
    assert read_spool(path) is None  # and nothing was sampled


def test_a_spooled_presentation_is_the_same_to_the_last_bit(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    spooled, kept = presented(path), presented(None)
    for name in RECORDING_COLUMNS:
        column = spooled.recording.columns[name]
        assert column.tobytes() == kept.recording.columns[name].tobytes()
    left = cut_off(path)  # whoever did not remove it can read it all again
    assert left is not None
    assert left.recording.facts["fault_kind"] == "process"
    for name in RECORDING_COLUMNS:
        column = left.recording.columns[name]
        assert column.tobytes() == kept.recording.columns[name].tobytes()
    for name in (
        "phases",
        "catch_angle_deg",
        "mean_speed_deg_s",
        "device",
        "simulated",
    ):
        assert left.recording.facts[name] == kept.recording.facts[name]


def test_what_was_cut_off_says_where(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    written(path, 3)
    left = cut_off(path)
    assert left is not None
    assert left.fault is not None
    assert (left.fault.kind, left.fault.time_s, left.fault.torque_nm) == (
        "process",
        2e-3,
        5.0,
    )
    assert left.recording.columns["angle_deg"][-1] == degrees(2.5)
    assert left.recording.facts["ended"] == "fault"
    assert left.n_missed_ticks == 2  # 2 ms at 2 kHz are five ticks, three are there


def test_a_ramp_between_two_ticks_is_no_tick_that_was_missed(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    samples = Samples(10, file=path, facts={**FACTS, "rate_hz": 1000})
    for time_s in (0.0, 0.001, 0.0013, 0.0016, 0.002):  # two rows between two ticks
        samples.add((time_s, 0.5, 1.0, 2.0, 3.0, 1, 0, 1))
    samples.close()
    left = cut_off(path)
    assert left is not None
    assert left.n_missed_ticks == 0


def test_a_disk_that_fills_while_it_is_laid_down_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "a.partial"
    monkeypatch.setattr(mmap, "mmap", full)  # the last thing that asks the disk
    with pytest.raises(OSError, match="No space left") as caught:
        Samples(10, file=path, facts=FACTS)
    assert caught.value.filename == str(path)
    assert not path.exists()


def test_a_link_in_its_place_is_not_followed(tmp_path: Path) -> None:
    other, link = tmp_path / "other", tmp_path / "a.partial"
    other.write_text("of somebody else")
    link.symlink_to(other)
    with pytest.raises(OSError, match="is a link"):
        Samples(10, file=link, facts=FACTS)
    assert other.read_text() == "of somebody else"


@pytest.mark.parametrize("n_bytes", [0, 100, 4096, 4100, 4104, 4105, 4200])
def test_a_file_that_was_never_laid_down_is_nothing(tmp_path, n_bytes: int) -> None:
    path = tmp_path / "a.partial"
    written(path, 0)
    path.write_bytes(path.read_bytes()[:n_bytes])
    assert cut_off(path) is None


@pytest.mark.parametrize(
    "content",
    [
        b"x" * 5000,
        json.dumps({"device": "none"}).encode().ljust(5000),
        json.dumps({"capacity": 7}).encode().ljust(4096) + np.ones(9).tobytes(),
        json.dumps({"capacity": None}).encode().ljust(4096) + np.ones(9).tobytes(),
        json.dumps({"capacity": 1}).encode().ljust(4096) + np.ones(7).tobytes(),
        json.dumps({**FACTS, "capacity": 1}).encode().ljust(4096)
        + np.full(7, np.inf).tobytes(),
        json.dumps({**FACTS, "capacity": -1}).encode().ljust(4096)
        + np.ones(9).tobytes(),
        json.dumps({**FACTS, "capacity": 1}).encode().ljust(4096)
        + np.full(7, 5.0).tobytes(),
        json.dumps({**FACTS, "rate_hz": "x", "capacity": 1}).encode().ljust(4096)
        + np.ones(7).tobytes(),
        b"5".ljust(4096) + np.ones(9).tobytes(),
        b"[]".ljust(4096) + np.ones(9).tobytes(),
    ],
)
def test_anything_else_is_refused_with_a_way_out(tmp_path, content: bytes) -> None:
    path = tmp_path / "a.partial"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"a\.partial: needs .* move it away"):
        cut_off(path)


# What the loop writes has the units and names of a recording


def test_the_columns_have_the_units_in_their_names() -> None:
    samples = Samples(3)
    assert samples.last_time_s == -np.inf
    samples.add((0.0, 0.5, 1.0, 2.0, 3.0, 0, 0, 0))
    samples.add((0.1, 0.6, 1.1, 2.1, 3.1, 1, 0, 1))
    assert samples.last_time_s == 0.1
    written = samples.columns()
    assert set(written) == set(RECORDING_COLUMNS)
    assert written["angle_deg"].tolist() == [degrees(0.5), degrees(0.6)]
    assert written["velocity_deg_s"].tolist() == [degrees(1.0), degrees(1.1)]
    assert written["model_torque_nm"].tolist() == [2.0, 2.1]
    assert written["command_torque_nm"].tolist() == [3.0, 3.1]
    assert written["phase"].tolist() == [0.0, 1.0]


def test_samples_of_a_process_that_died_before_there_were_ramps_are_read(
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.partial"
    facts = {"rate_hz": 1000, "speed_threshold": 0.35, "capacity": 2}
    values = np.array([1.0, *np.arange(12.0)])  # one of two samples, six columns
    path.write_bytes(json.dumps(facts).encode().ljust(4096) + values.tobytes())
    left = read_spool(path)
    assert left is not None
    assert left.columns.tolist() == [
        [0.0],
        [2.0],
        [4.0],
        [6.0],
        [8.0],
        [10.0],
        [0.0],
        [1.0],
    ]
