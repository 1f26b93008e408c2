"""masrel joint fit: from files to a table, figures, and a model file for a protocol."""

import csv
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.elbow.identification import Movement
from masrel.lab.protocol import joint_model, read_protocol
from tests.cli.process import Caller
from tests.lab.elbow.identification.synthesis import study
from tests.lab.elbow.identification.test_friction import backdriven
from tests.lab.protocol.documents import VALID, write


def put(movement: Movement, folder: Path) -> Path:
    path = folder / f"{movement.name.replace(' ', '_')}.csv"
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write("# simulated: true\n")
        writer = csv.writer(file)
        writer.writerow(["time_s", "angle_deg", "torque_nm"])
        columns = movement.time, np.degrees(movement.angle), movement.torque
        writer.writerows(zip(*(c.tolist() for c in columns), strict=True))
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("recordings")
    made = study(STANDARD_MODELS["HM3"], seed=21, n_slow=3, n_fast=6)
    return [put(movement, folder) for movement in made]


def test_a_fit_goes_into_a_protocol(
    masrel: Caller, files: list[Path], tmp_path: Path
) -> None:
    done = masrel(
        "joint",
        "fit",
        *files,
        "-o",
        tmp_path / "s3.toml",
        "--json",
        tmp_path / "fit.json",
    )
    assert done.code == 0, done.err
    assert "SIMULATED DATA" in done.out
    assert "3 slow and 6 fast trials" in done.out
    model = tomllib.loads((tmp_path / "s3.toml").read_text(encoding="utf-8"))
    assert model["simulated"] is True
    assert len(model["recordings"]) == 9
    document = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    fitted = {e["key"]: e["value"] for e in document["estimates"]}
    protocol = dict(VALID)
    entry = {"id": "S3", "file": "s3.toml"}
    protocol["models"] = [entry, *VALID["models"][1:]]
    joint = joint_model(read_protocol(write(protocol, tmp_path)), "S3")
    assert joint.damping == fitted["damping_nms_rad"]
    assert joint.residual_ratio == fitted["residual_ratio"]
    assert joint.catch_slope == pytest.approx(0.35, rel=0.1)


def test_laws_are_compared_where_the_elbows_own_is_refused(
    masrel: Caller, files: list[Path]
) -> None:
    fast = [file for file in files if "fast" in file.name]
    done = masrel("joint", "fit", *fast, "--laws", "spring-damper", "--json", "-")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    elbow, spring = document["laws"]
    assert "b and k need a slow stretch" in elbow["reason"]
    assert (spring["chosen"], spring["n_parameters"]) == (True, 2)
    keys = [estimate["key"] for estimate in spring["estimates"]]
    assert keys == ["stiffness_nm_rad", "damping_nms_rad"]
    assert document["laws_sentence"].startswith("spring-damper predicts left-out")
    both = masrel("joint", "fit", *fast, "--laws", "all", "--compare")
    assert both.code == 2
    assert "--compare, --laws: the first compares terms of the arm" in both.err


def test_slow_trials_alone_are_shown_and_make_no_model_file(
    masrel: Caller, files: list[Path], tmp_path: Path
) -> None:
    done = masrel("joint", "fit", *files[:3], "--json", "-")
    document = json.loads(done.out)
    missing = {e["key"]: e for e in document["estimates"]}["catch_slope_s"]
    assert missing["value"] is None
    assert "only slow stretches" in missing["reason"]
    assert [trial["pace"] for trial in document["trials"]] == ["slow"] * 3
    assert document["simulated"] is True
    done = masrel("joint", "fit", *files[:3], "-o", tmp_path / "s3.toml")
    assert done.code == 2
    assert "Parameters of the joint" in done.out  # what there is, is shown
    assert "catch_angle_constant: there are only slow stretches" in done.err
    assert not (tmp_path / "s3.toml").exists()


def test_figures_are_drawn(masrel: Caller, files: list[Path], tmp_path: Path) -> None:
    folder = tmp_path / "new"  # where JSON may lie, too
    more = ("--json", folder / "a.json", "--quiet")
    done = masrel("joint", "fit", *files, "--figures", folder, *more)
    assert done.code == 0, done.err
    names = ("fit_catches", "fit_residuals", "fit_slow", "fit_trials")
    drawn = [f"{name}.{form}" for name in names for form in ("png", "svg")]
    assert sorted(path.name for path in folder.iterdir()) == ["a.json", *drawn]


def test_friction_is_fitted_and_drawn(masrel: Caller, tmp_path: Path) -> None:
    path = put(backdriven(1), tmp_path)
    more = ("--figures", tmp_path / "out", "--json", tmp_path / "out/friction.json")
    done = masrel("joint", "friction", path, *more)
    assert done.code == 0, done.err
    assert re.findall(r"^[IBβ](?= )", done.out, re.M) == ["I", "B", "β"]
    document = json.loads((tmp_path / "out/friction.json").read_text("utf-8"))
    values = {e["key"]: e["value"] for e in document["estimates"]}
    assert values["viscous_nms_rad"] == pytest.approx(0.168, rel=0.02)
    assert (tmp_path / "out" / "fit_friction.png").stat().st_size > 10_000


def test_only_fast_stretches_are_refused_with_the_option(
    masrel: Caller, files: list[Path]
) -> None:
    done = masrel("joint", "fit", *(file for file in files if "fast" in file.name))
    assert done.code == 2
    assert done.err.startswith("masrel: recordings: b and k need a slow stretch")
    assert done.err.endswith(" deg/s. --slow-below raises the limit\n")
