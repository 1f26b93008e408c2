"""masrel joint trace and tardieu: motions, models, kinds, outputs, figures."""

import json
import re
from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from masrel.cli import cli
from masrel.errors import MasrelError
from masrel.lab.elbow import (
    MODELS,
    STANDARD_MODELS,
    ConstantSpeed,
    events,
)
from masrel.lab.elbow.tone import ClaspKnife, Contracture, ToneModel
from masrel.lab.recording import RECORDING_COLUMNS, Recording, write_recording
from tests.files import table_of
from tests.lab.elbow.stretches import minimum_jerk

HM3 = STANDARD_MODELS["HM3"]


def run(*arguments: object, command: str = "trace") -> Result:
    return CliRunner().invoke(
        cli, ["joint", command, *map(str, arguments)], catch_exceptions=True
    )


def scene(*arguments: object, command: str = "trace") -> dict:
    done = run(*arguments, "--json", "-", command=command)
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


STRETCH = ("--model", "HM3", "--speed-deg-s", 92)


# Motions


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


# Many scenes


# Figures


TWO = ("--model", "HM1", "--model", "HM3", "--speeds-deg-s", 30, 120, 4)


@pytest.mark.parametrize(
    ("asked", "view", "file"),
    [
        (TWO, "angle", "one.png"),
        (TWO, "time", "one.svg"),
        (TWO, "catch", "one.pdf"),
        (STRETCH, "schematic", "one.svg"),
        ((*STRETCH, "--q-reading", "decrease"), "schematic", "one.svg"),
        (
            (*STRETCH, "--to-deg", 90, "--catch-rise-s", 0.03),
            "schematic",
            "one.svg",
        ),
    ],
)
def test_a_figure_is_the_same_bytes_every_time(
    asked: tuple[object, ...], view: str, file: str, tmp_path: Path
) -> None:
    drawn = []
    for folder in ("a", "b"):
        path = tmp_path / folder / file
        path.parent.mkdir()
        done = run(*asked, "--figure", path, "--view", view)
        assert done.exit_code == 0, done.output
        drawn.append(path.read_bytes())
    assert drawn[0] == drawn[1]
    assert len(drawn[0]) > 5000


def test_a_figure_explains_its_phases_where_one_catches(tmp_path: Path) -> None:
    path = tmp_path / "one.svg"
    phases = ["pre-catch", "catch", "post-catch"]
    for speeds, explained in ((("10", "60", "90"), phases), (("10", "12"), [])):
        asked = [part for speed in speeds for part in ("--speed-deg-s", speed)]
        assert run("--model", "HM3", *asked, "--figure", path).exit_code == 0
        # text of an SVG is kept beside its shapes, as a comment
        texts = re.findall(r"<!-- (.*?) -->", path.read_text("utf-8"))
        assert [text for text in texts if text in phases] == explained
        assert [f"{speed} deg/s" in texts for speed in speeds] == [True] * len(speeds)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--motion", "trapezoid"], "--acceleration-deg-s2: is for"),
        (["--acceleration-deg-s2", 3], "--acceleration-deg-s2: is for"),
        (["--motion", "recording"], "--recording: is for --motion recording"),
        (["--recording", "x.csv"], "--recording: is for --motion recording"),
        (["--stop-at-s", 1], "--stop-at-s, --pause-s: each needs the other"),
        (
            ["--stop-at-s", 9, "--pause-s", 1],
            "--stop-at-s: needs a time within the motion, 0 to 1.26087 s, got 9 s",
        ),
        (["--stop-at-s", "nan", "--pause-s", 1], "--stop-at-s: needs a time within"),
        (["--stop-at-s", 1, "--pause-s", "nan"], "--pause-s: needs more than 0 and"),
        (
            ["--interpolation", "linear"],
            "--interpolation: is for --motion recording",
        ),
        (["--view", "time"], "--view: needs --figure"),
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


# Model files


# Other kinds of joints


KINDS = [kind for kind, law in MODELS.items() if issubclass(law, ToneModel)]


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_its_events_and_its_exact_torque(kind: str) -> None:
    made = scene("--kind", kind, "--speed-deg-s", 90, "--at-s", 0.5, "--at-s", 0.9)
    joint = MODELS[kind]()
    assert isinstance(joint, ToneModel)
    stretch = ConstantSpeed(start=radians(30), end=joint.range_end, speed=radians(90))
    assert made["model"] == made["kind"] == kind
    assert made["to_deg"] == pytest.approx(degrees(joint.range_end))
    assert [
        (e["name"], e["time_s"], radians(e["angle_deg"])) for e in made["events"]
    ] == [
        (event.name, event.time, pytest.approx(event.angle))
        for event in joint.events(stretch)
    ]
    assert [row["torque_nm"] for row in made["torque_at_s"]] == joint.torque(
        stretch, [0.5, 0.9]
    ).tolist()
    bound = joint.largest_torque(start_angle=stretch.start, speed=radians(90))
    assert 0.0 < made["peak_torque_nm"] <= bound * (1.0 + 1e-12)
    assert made["phases"][-1]["end_s"] == pytest.approx(stretch.duration)


def test_its_numbers_are_those_of_a_protocol() -> None:
    options = ("--kind", "contracture", "--parameter", "end_angle_deg=100")
    more = ("--parameter", "range_end_deg=110", "--at-deg", 105, "--speed-deg-s", 60)
    made = scene(*options, *more)
    joint = Contracture(end_angle=radians(100), range_end=radians(110))
    stretch = ConstantSpeed(start=radians(30), end=radians(110), speed=radians(60))
    (row,) = made["torque_at_deg"]
    assert row["angle_deg"] == 105
    assert row["torque_nm"] == pytest.approx(float(joint.torque(stretch, [1.25])[0]))


def test_kinds_and_models_are_scenes_beside_each_other(tmp_path: Path) -> None:
    names = ("--model", "HM3", "--kind", "clonus", "--kind", "lead-pipe-rigidity")
    figure, samples = tmp_path / "figure.png", tmp_path / "samples.csv"
    files = ("--csv", samples, "--figure", figure, "--view", "time")
    made = scene(*names, "--speeds-deg-s", 70, 90, 2, *files)["scenes"]
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert samples.read_text(encoding="utf-8").startswith("# simulated: true\n")
    rows = table_of(samples)
    assert list(rows[0])[:3] == ["model", "speed_deg_s", "time_s"]
    assert (
        [*dict.fromkeys((row["model"], row["speed_deg_s"]) for row in rows)]
        == [
            (name, speed)
            for name in ("HM3", "clonus", "lead-pipe-rigidity")
            for speed in ("70.0", "90.0")
        ]
        == [(one["model"], str(one["speed_deg_s"])) for one in made]
    )
    phases = {row["phase"] for row in rows if row["model"] == "clonus"}
    assert phases == {"pre-catch", "catch"}


def test_a_model_of_a_study_may_be_of_another_kind() -> None:
    study = Path(__file__).parents[3] / "studies" / "tone"
    made = scene("--study", study, "--model", "L3", "--speed-deg-s", 90)
    assert (made["model"], made["kind"]) == ("L3", "lead-pipe-rigidity")
    stretched = scene("--kind", "lead-pipe-rigidity", "--speed-deg-s", 90)
    assert made["peak_torque_nm"] == stretched["peak_torque_nm"]


# Tardieu


def test_tardieu_of_hm1_by_hand() -> None:
    # (2): L - α·v = 130 - 0.35 · 100 and · 150 deg; at 10 deg/s nothing catches.
    made = scene("--model", "HM1", command="tardieu")
    assert list(made) == [
        "format",
        "model",
        "kind",
        "from_deg",
        "r2_deg",
        "r1_deg",
        "difference_deg",
        "catches",
    ]
    assert made["kind"] == "spastic-elbow"
    angles = [made[key] for key in ("r2_deg", "r1_deg", "difference_deg")]
    assert angles == pytest.approx([146.0, 77.5, 68.5])
    assert [tuple(catch.values()) for catch in made["catches"]] == [
        (name, pytest.approx(speed), angle and pytest.approx(angle))
        for name, speed, angle in (
            ("V1", 10.0, None),
            ("V2", 100.0, 95.0),
            ("V3", 150.0, 77.5),
        )
    ]


def test_a_contracture_has_no_difference_and_speeds_can_be_chosen() -> None:
    made = scene(
        "--kind", "contracture", "--kind", "clasp-knife",
        "--speed-deg-s", 5, 90, 120, command="tardieu",
    )["tardieu"]  # fmt: skip
    assert made[0]["difference_deg"] == 0.0
    assert made[0]["r1_deg"] == made[0]["r2_deg"] == pytest.approx(125.0)
    # 3.32 (θ - 56.27° + 0.25 s · 120°/s) = 3 N·m
    fires = degrees(3.0 / ClaspKnife().reflex_stiffness) + 56.27 - 0.25 * 120
    assert made[1]["r1_deg"] == pytest.approx(fires)


def test_lines_of_a_figure_have_as_many_points_as_pixels(tmp_path: Path) -> None:
    # 0.001 deg/s: 116 000 s, at 1 kHz 116 million samples
    slow = ("--model", "HM3", "--speed-deg-s", 0.001)
    file = tmp_path / "slow.svg"
    assert run(*slow, "--figure", file).exit_code == 0
    paths = re.findall(r'<path d="([^"]*)"', file.read_text("utf-8"))
    n_points = [len(re.findall("[ML]", path)) for path in paths]
    assert 1 < max(n_points) < 900
