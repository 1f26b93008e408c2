"""Motions from files: what is read, and what is said of a wrong file."""

from math import radians
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import ParameterError, RecordingError
from masrel.lab.elbow.motions.file import read_motion
from masrel.lab.recording import RECORDING_COLUMNS, Recording, write_recording


def written(folder: Path, text: str) -> Path:
    path = folder / "motion.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_table_is_read_by_its_names(tmp_path: Path) -> None:
    path = written(
        tmp_path, "torque_nm, angle_deg ,time_s\n1,30,0.5\n2,60,1.0\n3,90,2.5\n"
    )
    motion = read_motion(path)
    assert motion.duration == 2.0
    assert (motion.start, motion.end) == (radians(30.0), radians(90.0))
    assert read_motion(path, interpolation="linear").interpolation == "linear"


def test_a_recording_of_the_loop_is_a_motion(tmp_path: Path) -> None:
    n = 5
    columns = {name: np.zeros(n) for name in RECORDING_COLUMNS}
    columns["time_s"] = np.arange(n) / 10.0
    columns["angle_deg"] = np.linspace(30.0, 70.0, n)
    write_recording(Recording(columns=columns, facts={}), tmp_path / "one.npz")
    for name in ("one.npz", "one.json"):
        motion = read_motion(tmp_path / name, interpolation="linear")
        assert motion.duration == 0.4
        assert np.degrees(motion.velocity(0.1)) == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", r"motion\.csv: needs a line of column names, got none"),
        ("t,angle_deg\n", "needs a column of time: time_s, .*; got t, angle_deg"),
        ("time_s,angle\n0,30\n", "column angle has no unit: name it angle_deg or"),
        ("time_s,angle_deg\n0,30\n1,x\n", r"line 3, column angle_deg: .* got 'x'"),
        ("# a\n# b\ntime_s,angle_deg\n0,30\n1,x\n", r"line 5, .* got 'x'"),
        ("# a\n", "needs a line of column names, got none"),
        ("time_s,angle_deg\n0,30\n1\n", r"line 3: needs 2 cells, got 1"),
        ("time_s,angle_deg\n0,30\ninf,90\n", r"line 3, column time_s: .* got 'inf'"),
        ("time_s,angle_deg\n0,3_0\n1,90\n", r"line 2, column angle_deg: .* '3_0'"),
        ("time_s,angle_deg,angle_deg\n0,1,2\n", "column 'angle_deg' is there twice"),
        ("time_s,angle_deg,angle_rad\n0,1,2\n", "needs one column of angle, got"),
        ('time_s,angle_deg\n"' + "x" * 200_000 + '"\n', "needs cells of numbers"),
    ],
)
def test_a_wrong_table_is_refused_with_its_place(
    tmp_path: Path, text: str, said: str
) -> None:
    with pytest.raises(RecordingError, match=said):
        read_motion(written(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time_s,angle_deg\n0,30\n", r"motion\.csv: time, angle: need two or more"),
        ("time_s,angle_deg\n0,30\n0,31\n", r"motion\.csv: time: needs to grow"),
        ("time_s,angle_deg\n0,30\n1,\n", "angle: needs finite .*, got nan in sample 2"),
    ],
)
def test_samples_that_are_no_motion_are_refused_with_the_file(
    tmp_path: Path, text: str, said: str
) -> None:
    with pytest.raises(ParameterError, match=said):
        read_motion(written(tmp_path, text))


def test_no_file_is_said_to_be_none(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"no\.csv: no such file"):
        read_motion(tmp_path / "no.csv")


@pytest.mark.parametrize("name", ["half.npz", "half.json"])
def test_half_a_recording_is_none(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"")
    with pytest.raises(RecordingError, match=r"half\.npz: (not an arch|no such file)"):
        read_motion(tmp_path / name)


def test_what_a_fit_reads_is_a_motion_too(tmp_path: Path) -> None:
    table = written(tmp_path, "Time_ms;angle_rad;emg\n0;0.5;x\n500;1.5;y\n")
    np.savez(tmp_path / "two.npz", time_s=[0.0, 0.5], angle_rad=[0.5, 1.5])
    for path in (table, tmp_path / "two.npz"):
        motion = read_motion(path)
        assert (motion.start, motion.end, motion.duration) == (0.5, 1.5, 0.5)


def test_remarks_before_the_names_are_passed_over(tmp_path: Path) -> None:
    rows = "time_s,angle_deg\n0,30\n1,90\n"
    plain = read_motion(written(tmp_path, rows))
    remarked = read_motion(written(tmp_path, "# simulated: true\n" + rows))
    assert (remarked.start, remarked.end) == (plain.start, plain.end)
    assert remarked.duration == plain.duration
