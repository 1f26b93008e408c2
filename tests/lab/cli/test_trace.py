"""masrel joint trace: phases, peak and samples of one stretch."""

import csv
import json
import subprocess
import sys
from math import radians
from pathlib import Path

import pytest

from masrel.lab.elbow import STANDARD_MODELS, MinimumJerk, events, peak_torque

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


def test_minimum_jerk_is_that_of_the_library() -> None:
    document = stretch("HM2", 80, "--motion", "minimum-jerk")
    motion = MinimumJerk(
        start=radians(30.0), end=radians(146.0), mean_speed=radians(80.0)
    )
    found = events(STANDARD_MODELS["HM2"], motion)
    assert document["motion"] == "minimum-jerk"
    assert [phase["name"] for phase in document["phases"]] == [
        "pre-catch",
        "catch",
        "post-catch",
        "pre-catch",
    ]
    assert [phase["start_s"] for phase in document["phases"]] == [
        0.0,
        found.catch,
        found.catch_end,
        found.post_catch_end,
    ]
    assert document["peak_torque_nm"] == peak_torque(STANDARD_MODELS["HM2"], motion)


def test_a_slow_stretch_has_no_catch_to_show() -> None:
    document = stretch("HM4", 10)
    assert document["catch_angle_deg"] is None
    assert document["mean_speed_deg_s"] is None
    assert [phase["name"] for phase in document["phases"]] == ["pre-catch"]
    # b · 10 + k · 116 deg = 12.6 + 365.4
    assert document["peak_torque_nm"] == pytest.approx(radians(378.0))


def test_a_stretch_ends_at_the_end_of_range() -> None:
    document = stretch("HM1", 100, "--from-deg", "46", "--to-deg", "170")
    assert document["to_deg"] == 170.0
    assert document["phases"][-1]["end_s"] == pytest.approx(1.0)
    assert document["phases"][-1]["end_deg"] == pytest.approx(146.0)


def test_the_table_shows_phases_and_peak() -> None:
    done = trace("--model", "HM3", "--speed-deg-s", "92")
    assert done.returncode == 0
    lines = done.stdout.splitlines()
    assert lines[0] == "HM3, constant 92 deg/s"
    assert lines[3].split() == ["catch", "0.574", "0.900", "82.80", "112.80"]
    assert lines[-1] == "peak torque 10.984 N·m"


def test_a_json_file_holds_the_same_and_the_table_stays(tmp_path: Path) -> None:
    path = tmp_path / "trace.json"
    done = trace("--model", "HM3", "--speed-deg-s", "92", "--json", path)
    assert json.loads(path.read_text(encoding="utf-8")) == stretch("HM3", 92)
    assert done.stdout == trace("--model", "HM3", "--speed-deg-s", "92").stdout


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


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("--model HM9 --speed-deg-s 92", "needs one of HM1, HM2, HM3, HM4"),
        (f"{HM3} 0", "speed: needs more than 0 and finite, got 0 deg/s"),
        (f"{HM3} -92", "speed: needs more than 0 and finite, got -92 deg/s"),
        (f"{HM3} nan", "speed: needs more than 0 and finite, got nan deg/s"),
        (f"{HM3} 0 --motion minimum-jerk", "mean_speed: needs more than 0"),
        (f"{HM3} 92 --from-deg 50 --to-deg 40", "got 50 and 40 degrees"),
        (f"{HM3} 92 --from-deg 150 --to-deg 160", "end of range, 146 degrees, got 150"),
        ("--model HM3", "--speed-deg-s: needs a speed for --motion constant"),
        (f"{HM3} 92 --study no/such", "no/such/protocol.toml"),
        ("--model HM9 --speed-deg-s 92 --study small", "got 'HM9'"),
        (f"{HM3} 92 --json no/such/file.json", "no/such/file.json"),
        (f"{HM3} 92 --csv no/such/file.csv", "no/such/file.csv"),
    ],
)
def test_a_wrong_call_is_one_sentence_and_code_2(arguments: str, said: str) -> None:
    done = trace(*arguments.split())
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("masrel: ")
    assert done.stderr.count("\n") == 1
    assert said in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        "--speed-deg-s 92",
        f"{HM3} fast",
        f"{HM3} 92 --motion sudden",
        f"{HM3} 92 --rate-hz 0",
    ],
)
def test_a_call_that_cannot_be_read_shows_its_usage(arguments: str) -> None:
    done = trace(*arguments.split())
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Error: " in done.stderr
    assert "Traceback" not in done.stderr


def test_a_refused_call_leaves_no_file(tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    done = trace("--model", "HM3", "--speed-deg-s", "0", "--csv", path)
    assert done.returncode == 2
    assert not path.exists()
