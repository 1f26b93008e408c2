"""masrel trace with any motion, many scenes, other laws, more outputs, and figures."""

import csv
import json
from math import radians
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from masrel.cli import trace_figure
from masrel.cli.trace import command
from masrel.elbow import (
    STANDARD_MODELS,
    Trapezoid,
    evaluate,
    events,
    impulse,
    residual_torque,
    torque,
    work,
)
from masrel.errors import MasrelError
from tests.elbow.stretches import constant, minimum_jerk

HM3 = STANDARD_MODELS["HM3"]


def run(*arguments: object) -> Result:
    return CliRunner().invoke(
        command, [str(a) for a in arguments], catch_exceptions=True
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
    assert run(*slow).stdout.splitlines()[-1] == "residual torque nan N·m"
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


def test_lines_of_a_figure_have_as_many_points_as_pixels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes = []
    panel = trace_figure._panel

    def seen(*arguments):
        made = panel(*arguments)
        sizes.extend(line.time.size for line in made.lines)
        return made

    monkeypatch.setattr(trace_figure, "_panel", seen)
    # 0.001 deg/s: 116 000 s, at 1 kHz 116 million samples
    slow = ("--model", "HM3", "--speed-deg-s", 0.001)
    assert run(*slow, "--figure", tmp_path / "slow.png").exit_code == 0
    assert sizes
    assert max(sizes) < 900


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--motion", "trapezoid"], "--acceleration-deg-s2: goes with"),
        (["--acceleration-deg-s2", 3], "--acceleration-deg-s2: goes with"),
        (["--motion", "recording"], "--recording: goes with --motion recording"),
        (["--recording", "x.csv"], "--recording: goes with --motion recording"),
        (["--stop-at-s", 1], "--stop-at-s, --pause-s: each needs the other"),
        (["--stop-at-s", 9, "--pause-s", 1], "begin, finish: need"),
        (["--repeat", 0], "--repeat: needs 1 or more, got 0"),
        (["--catch-rise-s", 1], "catch_rise: needs 0 to peak_duration"),
        (["--inertia-kg-m2", -1], "inertia: needs 0 or more"),
        (["--at-s", 9], "times: need 0 to 1.26087 s"),
        (["--at-deg", 170], "angles: need ones that the motion reaches, got 170"),
        (["--figure", "x.gif"], "--figure: needs a name that ends in .png"),
        (["--figure", "x.png", "--view", "catch"], "needs two or more speeds, got 1"),
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


def test_a_recording_has_its_own_speed(tmp_path: Path) -> None:
    path = tmp_path / "motion.csv"
    path.write_text("time_s,angle_deg\n0,30\n1,90\n", encoding="utf-8")
    done = run(*STRETCH, "--motion", "recording", "--recording", path)
    assert "--speed-deg-s: a recording has its own speed" in str(done.exception)
