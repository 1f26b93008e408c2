"""masrel joint trace: any motion, many scenes, other laws, more outputs, figures."""

import csv
import json
import re
from math import radians
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from masrel.cli import cli
from masrel.errors import MasrelError
from masrel.lab.elbow import (
    STANDARD_MODELS,
    Trapezoid,
    evaluate,
    events,
    impulse,
    residual_torque,
    torque,
    work,
)
from masrel.lab.elbow.identification import as_toml, model_document
from masrel.lab.recording import RECORDING_COLUMNS, Recording, write_recording
from tests.lab.elbow.stretches import constant, minimum_jerk

HM3 = STANDARD_MODELS["HM3"]


def run(*arguments: object) -> Result:
    return CliRunner().invoke(
        cli, ["joint", "trace", *map(str, arguments)], catch_exceptions=True
    )


def scene(*arguments: object) -> dict:
    done = run(*arguments, "--json", "-")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def names(document: dict) -> list[str]:
    return [phase["name"] for phase in document["phases"]]


STRETCH = ("--model", "HM3", "--speed-deg-s", 92)


# Motions


def test_a_trapezoid_is_that_of_the_library() -> None:
    made = scene(*STRETCH, "--motion", "trapezoid", "--acceleration-deg-s2", 400)
    motion = Trapezoid(
        start=radians(30),
        end=radians(146),
        speed=radians(92),
        acceleration_rate=radians(400),
    )
    found = events(HM3, motion)
    assert made["phases"][1]["start_s"] == found.catch
    assert made["motion"] == "trapezoid"


def test_a_recording_is_traced_from_its_own_samples(tmp_path: Path) -> None:
    samples = tmp_path / "samples.csv"
    run(*STRETCH, "--motion", "minimum-jerk", "--csv", samples)
    made = scene("--model", "HM3", "--motion", "recording", "--recording", samples)
    expected = events(HM3, minimum_jerk(92.0))
    assert made["speed_deg_s"] is None
    assert made["from_deg"] == pytest.approx(30.0)
    # cubics through samples 1 ms apart follow the quintic to 1e-9 rad or so
    assert made["phases"][1]["start_s"] == pytest.approx(expected.catch, abs=1e-6)
    assert "HM3, recording\n" in run(
        "--model", "HM3", "--motion", "recording", "--recording", samples
    ).stdout  # fmt: skip


def test_a_recording_of_the_loop_is_traced_by_either_of_its_files(
    tmp_path: Path,
) -> None:
    columns = {name: np.zeros(5) for name in RECORDING_COLUMNS}
    columns["time_s"] = np.arange(5) / 10.0
    columns["angle_deg"] = np.linspace(30.0, 70.0, 5)
    write_recording(Recording(columns=columns, facts={}), tmp_path / "one.npz")
    motion = ("--model", "HM3", "--motion", "recording", "--recording")
    for name in ("one.npz", "one.json"):
        made = scene(*motion, tmp_path / name, "--interpolation", "linear")
        (phase,) = made["phases"]
        assert (phase["end_s"], phase["end_deg"]) == (0.4, pytest.approx(70.0))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "motion.csv: needs a line of column names, got none"),
        ("time_s,angle\n0,30\n", "column angle has no unit: name it angle_deg or"),
        ("# a\ntime_s,angle_deg\n0,30\n1,x\n", "line 4, column angle_deg"),
        ("time_s,angle_deg\n0,30\n", "motion.csv: time, angle: need two or more"),
        ("time_s,angle_deg\n0,30\n0,31\n", "motion.csv: time: needs to grow"),
        ("time_s,angle_deg\n0,30\n1,\n", "finite numbers, got nan in sample 2"),
    ],
)
def test_a_file_that_is_no_motion_is_refused_with_its_name(
    tmp_path: Path, text: str, said: str
) -> None:
    path = tmp_path / "motion.csv"
    path.write_text(text, encoding="utf-8")
    done = run("--model", "HM3", "--motion", "recording", "--recording", path)
    assert isinstance(done.exception, MasrelError)
    assert said in str(done.exception)


def test_a_stopped_stretch_goes_on_in_its_catch() -> None:
    # 82.8 deg are reached at 0.574 s; stopped at 0.7 s, the catch lasts 2 s longer
    made = scene(*STRETCH, "--stop-at-s", 0.7, "--pause-s", 2)
    assert names(made) == ["pre-catch", "catch", "post-catch"]
    catch = made["phases"][1]
    assert catch["end_s"] == pytest.approx(0.9 + 2.0)


def test_a_repeated_stretch_catches_again() -> None:
    made = scene(*STRETCH, "--repeat", 2)
    assert names(made) == [
        "pre-catch", "catch", "post-catch", "pre-catch", "catch", "post-catch",
    ]  # fmt: skip
    # flexed for as long as it was stretched, 116/92 s
    first, second = (made["phases"][i]["start_s"] for i in (1, 4))
    assert second - first == pytest.approx(2 * 116 / 92)


# Laws and outputs


def test_the_laws_have_names() -> None:
    plain = scene(*STRETCH)["peak_torque_nm"]
    # test_torque.py: 828.44 N·m·deg/rad at 146 deg
    additive = scene(*STRETCH, "--post-catch", "additive")["peak_torque_nm"]
    assert additive == pytest.approx(radians(828.44))
    residual = scene(*STRETCH, "--q-reading", "decrease", "--output", "residual-torque")
    assert residual["residual_torque_nm"] == pytest.approx(
        radians(282.24 + 0.4 * 257.6)
    )
    moved = scene(*STRETCH, "--rest-deg", 20)["peak_torque_nm"]
    assert moved - plain == pytest.approx(radians(3.15 * 10))
    early = scene(*STRETCH, "--catch-rise-s", 0.02, "--at-s", 0.5740)
    assert early["torque_at_s"][0]["torque_nm"] < radians(300.0)
    heavy = ("--motion", "minimum-jerk", "--inertia-kg-m2", 0.1, "--at-s", 0.2)
    light = ("--motion", "minimum-jerk", "--at-s", 0.2)
    assert (
        scene(*STRETCH, *heavy)["torque_at_s"][0]["torque_nm"]
        > scene(*STRETCH, *light)["torque_at_s"][0]["torque_nm"] + 0.1
    )


def test_outputs_are_those_of_the_library_and_only_those_asked_for() -> None:
    asked = ("--output", "work", "--output", "impulse", "--at-s", 0.5, "--at-deg", 90)
    made = scene(*STRETCH, *asked)
    motion = constant(92.0)
    assert made["work_j"] == work(HM3, motion)
    assert made["impulse_nms"] == impulse(HM3, motion)
    assert made["torque_at_s"] == [
        {"time_s": 0.5, "torque_nm": float(torque(HM3, motion, [0.5])[0])}
    ]
    at_90 = made["torque_at_deg"][0]["torque_nm"]
    assert at_90 == pytest.approx(radians(539.84))  # in the peak
    assert "residual_torque_nm" not in made
    shown = run(*STRETCH, *asked).stdout.splitlines()
    assert shown[-3].startswith("impulse ")
    assert shown[-1] == f"torque at 90 deg {at_90:.3f} N·m"


def test_a_slow_stretch_has_no_residual_to_show() -> None:
    slow = ("--model", "HM3", "--speed-deg-s", 10, "--output", "residual-torque")
    assert scene(*slow)["residual_torque_nm"] is None
    shown = run(*slow).stdout.splitlines()
    assert shown[-1] == "residual torque none: the stretch has no catch"
    assert residual_torque(HM3, constant(10.0)) != residual_torque(HM3, constant(92.0))


# Many scenes


def test_models_times_speeds_make_a_table_and_a_list(tmp_path: Path) -> None:
    asked = ("--model", "HM2", "--model", "HM3", "--speeds-deg-s", 70, 90, 3)
    made = scene(*asked)["scenes"]
    assert [(one["model"], one["speed_deg_s"]) for one in made] == [
        (model, speed) for model in ("HM2", "HM3") for speed in (70.0, 80.0, 90.0)
    ]
    peaks = [one["peak_torque_nm"] for one in made]
    joints = [STANDARD_MODELS[one["model"]] for one in made]
    motions = [constant(one["speed_deg_s"]) for one in made]
    table = evaluate(joints, motions, ["peak_torque"])
    assert table.column("peak_torque") == pytest.approx(peaks, rel=1e-14)
    shown = run(*asked).stdout.splitlines()
    assert len(shown) == 7
    assert shown[0].split() == [
        "model", "speed_deg_s", "catch_angle_deg", "mean_speed_deg_s", "peak_torque_nm",
    ]  # fmt: skip
    path = tmp_path / "all.csv"
    run(*asked, "--csv", path, "--rate-hz", 50)
    with path.open(encoding="utf-8", newline="") as file:
        assert file.readline() == "# simulated: true\n"
        rows = list(csv.DictReader(file))
    assert list(rows[0])[:3] == ["model", "speed_deg_s", "time_s"]
    assert {(row["model"], row["speed_deg_s"]) for row in rows} == {
        (one["model"], str(one["speed_deg_s"])) for one in made
    }


# Figures


@pytest.mark.parametrize(
    ("view", "file"), [("angle", "one.png"), ("time", "one.svg"), ("catch", "one.pdf")]
)
def test_a_figure_is_the_same_bytes_every_time(
    view: str, file: str, tmp_path: Path
) -> None:
    asked = ("--model", "HM1", "--model", "HM3", "--speeds-deg-s", 30, 120, 4)
    drawn = []
    for folder in ("a", "b"):
        path = tmp_path / folder / file
        path.parent.mkdir()
        done = run(*asked, "--figure", path, "--view", view)
        assert done.exit_code == 0, done.output
        drawn.append(path.read_bytes())
    assert drawn[0] == drawn[1]
    assert len(drawn[0]) > 5000


@pytest.mark.parametrize(
    "more", [[], ["--q-reading", "decrease"], ["--to-deg", 90, "--catch-rise-s", 0.03]]
)
def test_a_schematic_names_the_parts_of_a_catch(
    more: list[object], tmp_path: Path
) -> None:
    path = tmp_path / "one.svg"
    done = run(*STRETCH, *more, "--figure", path, "--view", "schematic")
    assert done.exit_code == 0, done.output
    assert path.stat().st_size > 10_000


def test_phases_are_shaded_of_the_first_speed_that_catches(tmp_path: Path) -> None:
    path = tmp_path / "one.svg"
    for speeds, shaded in ((("10", "60", "90"), "60"), (("10", "12"), None)):
        asked = [part for speed in speeds for part in ("--speed-deg-s", speed)]
        assert run("--model", "HM3", *asked, "--figure", path).exit_code == 0
        # text of an SVG is kept beside its shapes, as a comment
        said = re.findall(r"<!-- (catch, \d+ deg/s) -->", path.read_text("utf-8"))
        assert said == ([] if shaded is None else [f"catch, {shaded} deg/s"])


def test_lines_of_a_figure_have_as_many_points_as_pixels(tmp_path: Path) -> None:
    # 0.001 deg/s: 116 000 s, at 1 kHz 116 million samples
    slow = ("--model", "HM3", "--speed-deg-s", 0.001)
    file = tmp_path / "slow.svg"
    assert run(*slow, "--figure", file).exit_code == 0
    paths = re.findall(r'<path d="([^"]*)"', file.read_text("utf-8"))
    n_points = [len(re.findall("[ML]", path)) for path in paths]
    assert 1 < max(n_points) < 900


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--motion", "trapezoid"], "--acceleration-deg-s2: goes with"),
        (["--acceleration-deg-s2", 3], "--acceleration-deg-s2: goes with"),
        (["--motion", "recording"], "--recording: goes with --motion recording"),
        (["--recording", "x.csv"], "--recording: goes with --motion recording"),
        (["--stop-at-s", 1], "--stop-at-s, --pause-s: each needs the other"),
        (
            ["--stop-at-s", 9, "--pause-s", 1],
            "--stop-at-s: needs a time within the motion, 0 to 1.26087 s, got 9 s",
        ),
        (["--stop-at-s", "nan", "--pause-s", 1], "--stop-at-s: needs a time within"),
        (["--stop-at-s", 1, "--pause-s", "nan"], "--pause-s: needs more than 0 and"),
        (
            ["--interpolation", "linear"],
            "--interpolation: goes with --motion recording",
        ),
        (["--view", "time"], "--view: goes with --figure"),
        (["--rate-hz", "nan"], "--rate-hz: needs a finite rate, got nan"),
        (["--rate-hz", 1e12], "--csv: needs at most 5000000 samples, got 1.261e+12"),
        (["--at-deg", "nan"], "--at-deg: need ones that the motion reaches, got nan"),
        (["--json", "no/such.json"], "--json: needs a folder that exists, got no/such"),
        (["--figure", "no/such.png"], "--figure: needs a folder that exists, got no/"),
        (
            ["--motion", "minimum-jerk", "--inertia-kg-m2", 1e308],
            "peak_torque_nm: needs a number that a float can hold, got inf",
        ),
        (
            ["--model", "HM9"],
            "needs one of HM1, HM2, HM3, HM4, or a model file (.toml)",
        ),
        (["--model", "no.toml"], "needed a model file, got no.toml: No such file"),
        (["--model", "a.toml", "--study", "x"], "needed a protocol file, got"),
        (["--repeat", 0], "--repeat: needs 1 to 1000, got 0"),
        (["--repeat", 1001], "--repeat: needs 1 to 1000, got 1001"),
        (["--catch-rise-s", 1], "catch_rise: needs 0 to peak_duration"),
        (["--inertia-kg-m2", -1], "--inertia-kg-m2: needs 0 or more"),
        (
            ["--speed-deg-s", 120, "--at-s", 1],
            "HM3, constant 120 deg/s: --at-s: need 0 to 0.966667 s, the end of the "
            "stretch, got 1 s",
        ),
        (["--at-deg", 170], "--at-deg: need ones that the motion reaches, got 170"),
        (["--figure", "x.gif"], "--figure: needs a name that ends in .png"),
        (["--figure", "x.png", "--view", "catch"], "needs two or more speeds, got 1"),
        (
            ["--figure", "x.png", "--view", "catch", "--speed-deg-s", 5],
            "needs two or more speeds at which HM3 catches, got 1 of 2",
        ),
        (
            ["--figure", "x.png", "--view", "schematic", "--to-deg", 80],
            "--view schematic: needs a stretch that catches",
        ),
        (
            ["--figure", "x.png", "--view", "schematic", "--model", "HM2"],
            "--view schematic: shows one scene, got 2",
        ),
        (
            ["--figure", "x.png", "--speeds-deg-s", 30, 90, 6],
            "--figure: shows 4 models at 5 speeds at most",
        ),
    ],
)
def test_a_wrong_option_is_refused_before_anything_is_written(
    arguments: list[object], said: str, tmp_path: Path
) -> None:
    left = tmp_path / "left.csv"
    done = run(*STRETCH, *arguments, "--csv", left)
    assert isinstance(done.exception, MasrelError)
    assert said in str(done.exception)
    assert not left.exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--rate-hz", 100], "--rate-hz: goes with --csv"),
        (["--csv", "-"], "--csv: needs the name of a file, got -"),
        (
            ["--csv", "no/such.csv"],
            "--csv: needs a folder that exists, got no/such.csv",
        ),
    ],
)
def test_an_option_of_samples_goes_with_a_file(
    arguments: list[object], said: str
) -> None:
    done = run(*STRETCH, *arguments)
    assert isinstance(done.exception, MasrelError)
    assert said in str(done.exception)


def test_a_recording_has_its_own_ends(tmp_path: Path) -> None:
    path = tmp_path / "motion.csv"
    path.write_text("time_s,angle_deg\n0,30\n1,90\n", encoding="utf-8")
    recording = ("--model", "HM3", "--motion", "recording", "--recording", path)
    done = run(*recording, "--from-deg", 30)
    assert "a recording starts and ends where it does" in str(done.exception)


def test_more_speeds_than_anybody_reads_are_refused() -> None:
    done = run("--model", "HM3", "--speeds-deg-s", 10, 90, 10**9)
    assert done.exit_code == 2
    assert "1000000000 is not in the range 2<=x<=100000" in done.stderr


def test_numbers_that_are_very_long_or_short_stay_apart() -> None:
    # 116 deg at 1e-9 deg/s: 1.16e11 s; at 1e6 deg/s 0.116 ms
    slow = run("--model", "HM3", "--speed-deg-s", 1e-9).stdout.splitlines()
    assert slow[2].split() == ["pre-catch", "0.000", "1.16e+11", "30.00", "146.00"]
    fast = run("--model", "HM3", "--speed-deg-s", 1e6).stdout.splitlines()
    assert fast[-2].split() == ["post-catch", "6e-05", "0.000116", "90.00", "146.00"]
    many = run("--model", "HM3", "--speed-deg-s", 1e9, "--speed-deg-s", 1e-9).stdout
    first, second = many.splitlines()[1:]
    assert first.split()[:3] == ["HM3", "1e+09", "60.000"]
    assert second.split() == ["HM3", "1e-09", "–", "–", "6.377"]


def test_torques_at_places_are_shown_of_many_scenes_too() -> None:
    many = ("--model", "HM2", *STRETCH, "--at-s", 0.5, "--at-deg", 90)
    shown = run(*many).stdout.splitlines()
    assert shown[0].endswith("torque_nm at 0.5 s  torque_nm at 90 deg")
    for line, made in zip(shown[1:], scene(*many)["scenes"], strict=True):
        at_time, at_angle = (
            made[key][0]["torque_nm"] for key in ("torque_at_s", "torque_at_deg")
        )
        assert line.split()[-2:] == [f"{at_time:.3f}", f"{at_angle:.3f}"]


# Model files


def model_file(folder: Path, name: str = "S3.toml", **changes: object) -> Path:
    made = model_document(HM3, simulated=True, made_from="a test")
    made["constants"] = {**made["constants"], **changes}  # type: ignore[dict-item]
    path = folder / name
    path.write_text(as_toml(made), encoding="utf-8")
    return path


def test_a_fitted_model_is_traced_from_its_file(tmp_path: Path) -> None:
    made = scene("--model", model_file(tmp_path), "--speed-deg-s", 92)
    assert made["model"] == "S3"
    assert made["peak_torque_nm"] == pytest.approx(
        scene(*STRETCH)["peak_torque_nm"], rel=1e-14
    )
    variant = model_file(tmp_path, "S4.toml", rest_angle_deg=20.0)
    moved = scene("--model", variant, "--speed-deg-s", 92)["peak_torque_nm"]
    assert moved - made["peak_torque_nm"] == pytest.approx(radians(3.15 * 10))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"catch_slope_s": -1.0}, "S3.toml: constants.catch_slope_s: needed a number"),
        ({"catch_rise_s": 0.2}, "S3.toml: constants.catch_rise_s: needed at most"),
        ({"slope": 1.0}, "needed keys of [constants] among"),
    ],
)
def test_a_wrong_model_file_is_refused_with_its_key(
    tmp_path: Path, changes: dict[str, object], said: str
) -> None:
    done = run("--model", model_file(tmp_path, **changes), "--speed-deg-s", 92)
    assert isinstance(done.exception, MasrelError)
    assert said in str(done.exception)


def test_two_files_of_one_name_are_refused(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    one, two = model_file(tmp_path), model_file(tmp_path / "other")
    done = run("--model", one, "--model", two, "--speed-deg-s", 92)
    assert "--model: needs models whose names differ, got two called S3" in str(
        done.exception
    )


def test_a_study_takes_no_model_file(tmp_path: Path) -> None:
    path = model_file(tmp_path)
    done = run("--model", path, "--speed-deg-s", 92, "--study", tmp_path)
    assert "--model: needs a model of --study, got the file" in str(done.exception)


def test_a_recording_has_its_own_speed(tmp_path: Path) -> None:
    path = tmp_path / "motion.csv"
    path.write_text("time_s,angle_deg\n0,30\n1,90\n", encoding="utf-8")
    done = run(*STRETCH, "--motion", "recording", "--recording", path)
    assert "--speed-deg-s: a recording has its own speed" in str(done.exception)
