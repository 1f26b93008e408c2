"""Recordings are read in the unit they say, or refused with the place of the fault."""

import math
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import ParameterError, RecordingError, RecordingWarning
from masrel.lab.elbow.identification import Movement, read_movement
from masrel.lab.recording import Recording, write_recording

TIME = np.arange(400) * 2.5e-3  # s
ANGLE = 30.0 + 100.0 * (TIME / TIME[-1]) ** 2  # deg
TORQUE = 0.02 * ANGLE + 0.1 * np.sin(40.0 * TIME)  # N·m


def table(**columns: np.ndarray) -> str:
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    return "\n".join(lines) + "\n"


def put(folder: Path, text: str, name: str = "trial.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def good(**changes: np.ndarray) -> dict[str, np.ndarray]:
    made = {"time_s": TIME, "angle_deg": ANGLE, "torque_nm": TORQUE}
    return {key: changes.get(key, value) for key, value in made.items()}


@pytest.mark.parametrize(
    "columns",
    [
        {"time_s": TIME, "angle_deg": ANGLE, "torque_nm": TORQUE},
        {
            "Time_ms": TIME * 1e3,
            "Angle_rad": ANGLE / 180 * math.pi,
            "Torque_Nm": TORQUE,
        },
        {"torque_mnm": TORQUE * 1e3, "time_us": TIME * 1e6, "angle_deg": ANGLE},
        {
            "emg_mv": TIME,
            "torque_ncm": TORQUE * 1e2,
            "time_s": TIME,
            "angle_deg": ANGLE,
        },
    ],
)
def test_a_unit_in_the_name_is_taken(
    tmp_path: Path, columns: dict[str, np.ndarray]
) -> None:
    read = read_movement(put(tmp_path, table(**columns)))
    np.testing.assert_allclose(read.time, TIME, rtol=1e-12)
    np.testing.assert_allclose(np.degrees(read.angle), ANGLE, rtol=1e-12)
    np.testing.assert_allclose(read.torque, TORQUE, rtol=1e-12)
    assert not read.simulated


def test_semicolons_remarks_blank_lines_and_a_byte_order_mark(tmp_path: Path) -> None:
    text = table(**good()).replace(",", ";")
    path = put(tmp_path, f"\ufeff# simulated: true\n# by: nobody\n\n{text}\n\n")
    read = read_movement(path)
    assert read.simulated
    assert read.time.size == TIME.size
    assert read.sha256 is not None


def test_a_recording_of_the_driver_gives_the_torque_of_its_model(
    tmp_path: Path,
) -> None:
    columns = {
        "time_s": TIME,
        "angle_deg": ANGLE,
        "velocity_deg_s": np.gradient(ANGLE, TIME),
        "model_torque_nm": TORQUE,
        "command_torque_nm": TORQUE - 0.3,
        "phase": np.zeros_like(TIME),
    }
    path = tmp_path / "A1.npz"
    write_recording(Recording(columns=columns, facts={"simulated": True}), path)
    read = read_movement(path)
    np.testing.assert_allclose(read.torque, TORQUE)
    assert read.simulated


def test_rows_with_an_empty_cell_are_left_out_and_counted(tmp_path: Path) -> None:
    lines = table(**good()).splitlines()
    for row in (7, 8):
        lines[row] = lines[row].rsplit(",", 1)[0] + ","
    path = put(tmp_path, "\n".join(lines))
    with pytest.warns(
        RecordingWarning,
        match=r"2 rows have an empty cell \(torque_nm 2\) and are left",
    ):
        read = read_movement(path)
    assert read.time.size == TIME.size - 2


def test_names_and_units_can_be_said_beside_the_file(tmp_path: Path) -> None:
    path = put(tmp_path, table(time_s=TIME, goniometer=ANGLE, torque=TORQUE))
    units = {"angle": "deg", "torque": "nm"}
    read = read_movement(path, columns={"angle": "goniometer"}, units=units)
    np.testing.assert_allclose(np.degrees(read.angle), ANGLE, rtol=1e-12)
    good_path = put(tmp_path, table(**good()))
    for wrong, error, said in [
        ({"torque": "lbf"}, ParameterError, "torque needs one of nm, mnm, ncm, got 'l"),
        ({"force": "n"}, ParameterError, "need one of time, angle, torque, velocity"),
        ({"angle": "rad"}, RecordingError, "angle_deg says deg, units says rad"),
    ]:
        with pytest.raises(error, match=said):
            read_movement(good_path, units=wrong)


def test_a_sensor_at_the_end_of_its_range_is_said_and_marked() -> None:
    rng = np.random.default_rng(1)
    torque = np.minimum(TORQUE + 0.05 * rng.standard_normal(TIME.size), 2.0)
    columns = {"time": TIME, "angle": np.radians(ANGLE)}
    with pytest.warns(RecordingWarning, match="the torque stays at 2 N·m for"):
        made = Movement(name="cut", torque=torque, **columns)
    np.testing.assert_array_equal(made.saturated, torque == 2.0)
    # one without noise that holds levels is not
    levels = np.repeat([0.0, 3.0, 2.0, 2.5], 100)
    assert not Movement(name="levels", torque=levels, **columns).saturated.any()


HEAD = "time_s,angle_deg,torque_nm\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "needs a line of column names, got none"),
        ("# only: remarks\n", "needs a line of column names, got none"),
        ("time_s,angle_deg\n0,1\n", "needs a column of torque: torque_nm, torque_mnm"),
        ("time_s,angle,torque_nm\n", "column angle has no unit: name it angle_d"),
        ("time_s,time_ms,torque_nm\n", "needs one column of time, got time_s"),
        ("time_s,time_s,torque_nm\n", "column 'time_s' occurs twice"),
        (f"{HEAD}0,1,2\n0.1,1\n", "line 3: needs 3 cells, got 2"),
        (
            f"# x: y\n{HEAD}0,1,2\n0.1,eins,2\n",
            "line 4, column angle_deg: needs a number with a decimal point",
        ),
        (
            "time_s;angle_deg;torque_nm\n0;1;2\n0.1;1,5;2\n",
            "line 3, column angle_deg: needs a number .* got '1,5'",
        ),
        (f"{HEAD}0,1,2\n", "needs at least 50 samples, got 1"),
        *(
            (f"{HEAD}0,1,{cell}\n", f"line 2, column torque_nm.*{cell}")
            for cell in ("inf", "-Infinity", "1_000", "1e999")
        ),
        (f"{HEAD}0,{'1' * 200_000},2\n", "field larger than field limit"),
    ],
)
def test_a_faulty_file_is_named_with_the_place(
    tmp_path: Path, text: str, said: str
) -> None:
    with pytest.raises(RecordingError, match=said) as raised:
        read_movement(put(tmp_path, text))
    assert "trial.csv" in str(raised.value)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"angle_deg": ANGLE[1:]}, "need one length, got time_s 400, angle"),
        ({"torque_nm": TORQUE + 0j}, "column torque_nm needs numbers"),
        (
            {"torque_nm": np.where(TIME == TIME[7], np.inf, TORQUE)},
            r"sample 7 .* column torque_nm",
        ),
        (
            {"time_s": np.where(TIME == TIME[200], TIME[199], TIME)},
            r"time must increase, got .* \(samples 199 and 200",
        ),
        (
            {"time_s": np.where(TIME == TIME[200], TIME[199] - 0.004, TIME)},
            r"time must increase, got .* \(samples 199 and 200",
        ),
        (
            {"angle_deg": np.radians(ANGLE)},
            "travels 15 degrees or more. Is the unit of the angle right",
        ),
        ({"angle_deg": np.degrees(ANGLE)}, "is the unit of the angle right"),
        ({"time_s": TIME * 1e3}, "is the unit of time right"),
        ({"time_s": TIME * 1e-3}, "is the unit of time right"),
        ({"torque_nm": TORQUE * 1e3}, "is the unit of torque right"),
        (
            {"angle_deg": TORQUE, "torque_nm": ANGLE},
            "columns of angle and torque swapped",
        ),
        ({"time_s": ANGLE, "angle_deg": TIME}, "is the unit of time right"),
    ],
)
def test_what_cannot_be_is_refused_with_the_likely_reason(
    tmp_path: Path, changes: dict[str, np.ndarray], said: str
) -> None:
    path = tmp_path / "trial.npz"
    np.savez(path, **good(**changes))
    with pytest.raises(RecordingError, match=said):
        read_movement(path)


def test_archives_are_read_like_tables_and_spoiled_ones_refused(tmp_path: Path) -> None:
    path = tmp_path / "trial.npz"
    np.savez_compressed(path, simulated=True, **good())
    read = read_movement(path)
    np.testing.assert_allclose(read.torque, TORQUE)
    assert read.simulated
    content = bytearray(path.read_bytes())
    content[200:260] = bytes(60)
    path.write_bytes(bytes(content))
    with pytest.raises(RecordingError, match="not an archive of columns"):
        read_movement(path)
    np.save(tmp_path / "lone.npy", ANGLE)
    lone = (tmp_path / "lone.npy").rename(tmp_path / "lone.npz")
    with pytest.raises(RecordingError, match="one array without a name"):
        read_movement(lone)
