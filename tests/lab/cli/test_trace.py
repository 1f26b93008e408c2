"""masrel joint trace: phases, peak and samples of one stretch."""

import csv
import json
import subprocess
import sys
from math import radians
from pathlib import Path

import pytest

STUDIES = Path(__file__).parents[3] / "studies"

KEYS = [
    "format",
    "model",
    "motion",
    "speed_deg_s",
    "from_deg",
    "to_deg",
    "catch_angle_deg",
    "mean_speed_deg_s",
    "peak_torque_nm",
    "phases",
]
PHASE_KEYS = ["name", "start_s", "end_s", "start_deg", "end_deg"]


def trace(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    call = [sys.executable, "-m", "masrel", "joint", "trace", *map(str, arguments)]
    return subprocess.run(
        call,
        capture_output=True,
        text=True,
        check=False,
        encoding="utf-8",
        cwd=STUDIES,
    )


def stretch(model: str, speed: float, *more: str | Path) -> dict:
    done = trace("--model", model, "--speed-deg-s", str(speed), "--json", "-", *more)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return json.loads(done.stdout)  # nothing but one document, or this fails


def test_hm3_at_92_deg_s_by_hand() -> None:
    # tests/lab/elbow/test_events.py and test_torque.py derive the numbers.
    document = stretch("HM3", 92)
    assert list(document) == KEYS
    assert document["model"] == "HM3"
    assert document["motion"] == "constant"
    assert document["catch_angle_deg"] == pytest.approx(82.8)
    assert document["mean_speed_deg_s"] == pytest.approx(92.0)
    assert document["peak_torque_nm"] == pytest.approx(10.984, abs=5e-4)
    assert [list(phase) for phase in document["phases"]] == [PHASE_KEYS] * 3
    rows = [list(phase.values()) for phase in document["phases"]]
    for row, expected in zip(
        rows,
        [
            ("pre-catch", 0.0, 52.8 / 92, 30.0, 82.8),
            ("catch", 52.8 / 92, 0.9, 82.8, 112.8),
            ("post-catch", 0.9, 116 / 92, 112.8, 146.0),
        ],
        strict=True,
    ):
        assert row[0] == expected[0]
        assert row[1:] == pytest.approx(expected[1:], rel=1e-13)


def test_samples_are_those_of_the_sampled_law(tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    stretch("HM3", 92, "--csv", path, "--rate-hz", "100")
    with path.open(encoding="utf-8", newline="") as file:
        assert file.readline() == "# simulated: true\n"
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        "time_s",
        "angle_deg",
        "velocity_deg_s",
        "torque_nm",
        "phase",
    ]
    assert len(rows) == 127  # 0 to 1.26 s
    # Sample 57 is at 82.44 deg, 58 at 83.36 deg, the first beyond 82.8 deg.
    assert [row["phase"] for row in rows[57:59]] == ["pre-catch", "catch"]
    assert float(rows[58]["angle_deg"]) == pytest.approx(83.36)
    assert float(rows[58]["velocity_deg_s"]) == pytest.approx(92.0)
    # 1.26 · 92 + 3.15 · 53.36 + 2.8 · 92 = 115.92 + 168.084 + 257.6
    assert float(rows[58]["torque_nm"]) == pytest.approx(radians(541.604))


def test_a_model_may_come_from_a_study() -> None:
    assert stretch("HM3", 92, "--study", "hess2012") == stretch("HM3", 92)
    dummy = stretch("D01", 92, "--study", "hess2012")
    assert dummy["catch_angle_deg"] not in (None, 82.8)


HM3 = "--model HM3 --speed-deg-s"


def test_a_refused_call_leaves_no_file(tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    done = trace("--model", "HM3", "--speed-deg-s", "0", "--csv", path)
    assert done.returncode == 2
    assert not path.exists()
