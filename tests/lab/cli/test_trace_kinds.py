"""masrel joint trace of other kinds of joints, and the angles of the Tardieu scale."""

import csv
import json
from math import degrees, radians
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from masrel.cli import cli
from masrel.lab.elbow import MODELS, ConstantSpeed
from masrel.lab.elbow.tone import ClaspKnife, Contracture, ToneModel

KINDS = [kind for kind, law in MODELS.items() if issubclass(law, ToneModel)]


def run(*arguments: object, command: str = "trace") -> Result:
    return CliRunner().invoke(
        cli, ["joint", command, *map(str, arguments)], catch_exceptions=True
    )


def document(*arguments: object, command: str = "trace") -> dict:
    done = run(*arguments, "--json", "-", command=command)
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_its_events_and_its_exact_torque(kind: str) -> None:
    scene = document("--kind", kind, "--speed-deg-s", 90, "--at-s", 0.5, "--at-s", 0.9)
    joint = MODELS[kind]()
    assert isinstance(joint, ToneModel)
    stretch = ConstantSpeed(start=radians(30), end=joint.range_end, speed=radians(90))
    assert scene["model"] == scene["kind"] == kind
    assert scene["to_deg"] == pytest.approx(degrees(joint.range_end))
    assert [
        (e["name"], e["time_s"], radians(e["angle_deg"])) for e in scene["events"]
    ] == [
        (event.name, event.time, pytest.approx(event.angle))
        for event in joint.events(stretch)
    ]
    assert [row["torque_nm"] for row in scene["torque_at_s"]] == joint.torque(
        stretch, [0.5, 0.9]
    ).tolist()
    bound = joint.largest_torque(start_angle=stretch.start, speed=radians(90))
    assert 0.0 < scene["peak_torque_nm"] <= bound * (1.0 + 1e-12)
    assert scene["phases"][-1]["end_s"] == pytest.approx(stretch.duration)


def test_its_numbers_are_those_of_a_protocol() -> None:
    options = ("--kind", "contracture", "--parameter", "end_angle_deg=100")
    more = ("--parameter", "range_end_deg=110", "--at-deg", 105, "--speed-deg-s", 60)
    scene = document(*options, *more)
    joint = Contracture(end_angle=radians(100), range_end=radians(110))
    stretch = ConstantSpeed(start=radians(30), end=radians(110), speed=radians(60))
    (row,) = scene["torque_at_deg"]
    assert row["angle_deg"] == 105
    assert row["torque_nm"] == pytest.approx(float(joint.torque(stretch, [1.25])[0]))


def test_kinds_and_models_are_scenes_beside_each_other(tmp_path: Path) -> None:
    names = ("--model", "HM3", "--kind", "clonus", "--kind", "lead-pipe-rigidity")
    figure, samples = tmp_path / "figure.png", tmp_path / "samples.csv"
    files = ("--csv", samples, "--figure", figure, "--view", "time")
    made = document(*names, "--speed-deg-s", 90, *files)
    models = ["HM3", "clonus", "lead-pipe-rigidity"]
    assert [scene["model"] for scene in made["scenes"]] == models
    assert figure.read_bytes().startswith(b"\x89PNG")
    with samples.open(encoding="utf-8") as file:
        assert file.readline() == "# simulated: true\n"
        rows = list(csv.DictReader(file))
    assert list(dict.fromkeys(row["model"] for row in rows)) == models
    phases = {row["phase"] for row in rows if row["model"] == "clonus"}
    assert phases == {"pre-catch", "catch"}


def test_a_model_of_a_study_may_be_of_another_kind() -> None:
    study = Path(__file__).parents[3] / "studies" / "tone"
    scene = document("--study", study, "--model", "L3", "--speed-deg-s", 90)
    assert (scene["model"], scene["kind"]) == ("L3", "lead-pipe-rigidity")
    stretched = document("--kind", "lead-pipe-rigidity", "--speed-deg-s", 90)
    assert scene["peak_torque_nm"] == stretched["peak_torque_nm"]


# Tardieu


def test_tardieu_of_hm1_by_hand() -> None:
    # (2): L - α·v = 130 - 0.35 · 100 and · 150 deg; at 10 deg/s nothing catches.
    made = document("--model", "HM1", command="tardieu")
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
    assert [catch["name"] for catch in made["catches"]] == ["V1", "V2", "V3"]
    speeds = [catch["speed_deg_s"] for catch in made["catches"]]
    assert speeds == pytest.approx([10.0, 100.0, 150.0])
    slow, *fast = [catch["catch_angle_deg"] for catch in made["catches"]]
    assert slow is None
    assert fast == pytest.approx([95.0, 77.5])


def test_a_contracture_has_no_difference_and_speeds_can_be_chosen() -> None:
    made = document(
        "--kind", "contracture", "--kind", "clasp-knife",
        "--speed-deg-s", 5, 90, 120, command="tardieu",
    )["tardieu"]  # fmt: skip
    assert made[0]["difference_deg"] == 0.0
    assert made[0]["r1_deg"] == made[0]["r2_deg"] == pytest.approx(125.0)
    # 3.32 (θ - 56.27° + 0.25 s · 120°/s) = 3 N·m
    fires = degrees(3.0 / ClaspKnife().reflex_stiffness) + 56.27 - 0.25 * 120
    assert made[1]["r1_deg"] == pytest.approx(fires)
