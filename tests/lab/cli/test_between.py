"""``masrel joint between``: its files, what a study makes of them, what is refused."""

import json
from pathlib import Path

import pytest

from masrel.lab.elbow import STANDARD_MODELS, intermediate_models
from masrel.lab.protocol import read_model_file
from tests.cli.process import Caller, Done
from tests.files import edit

STANDARDS = ("HM1", "HM2", "HM3", "HM4")


def refused(done: Done) -> str:
    """The one sentence on stderr of a call that was wrong."""
    assert done.code == 2
    assert done.out == ""
    (line,) = done.err.splitlines()
    assert line.startswith("masrel: ")
    return line.removeprefix("masrel: ")


def simulated(path: Path, *, is_it: str = "true") -> Path:
    """A model file that says whether it is simulated."""
    path.write_text(
        f'format = "masrel joint model 1"\nmade_from = "a test"\nsimulated = {is_it}\n'
        "[model]\ncatch_angle_constant_deg = 125.0\ncatch_torque_nms_rad = 1.7\n"
        "residual_ratio = 0.2\ncatch_travel_deg = 55.0\n",
        encoding="utf-8",
    )
    return path


def test_files_hold_the_models_of_the_rule(masrel: Caller, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "dummies"
    done = masrel("joint", "between", *STANDARDS, "-n", "12", "-o", folder)
    assert done.code == 0
    expected = intermediate_models(STANDARD_MODELS, 12)
    assert sorted(path.stem for path in folder.iterdir()) == list(expected)
    for name, joint in expected.items():
        # degrees in the file: two roundings
        made = read_model_file(folder / f"{name}.toml")
        for field in ("catch_angle_constant", "catch_travel", "residual_ratio"):
            assert getattr(made, field) == pytest.approx(
                getattr(joint, field), rel=1e-15
            )
    text = (folder / "D02.toml").read_text(encoding="utf-8")
    assert "2/5 of the way from HM1 to HM2" in text
    assert "simulated = false" in text
    assert "i/(n + 1) of the way" in done.out
    assert str(folder) in done.err


def test_what_lies_next_to_simulated_is_simulated(
    masrel: Caller, tmp_path: Path
) -> None:
    file = simulated(tmp_path / "käte.toml")
    done = masrel("joint", "between", "HM1", "HM2", file, "-n", "2", "--json", "-")
    document = json.loads(done.out)
    first = document["models"][0]
    assert [first[key] for key in ("name", "from", "to", "way", "file")] == [
        "D01", "HM1", "HM2", "1/2", None,
    ]  # fmt: skip
    assert first["model"]["catch_torque_nms_rad"] == 1.7  # (1.4 + 2.0)/2
    assert [model["simulated"] for model in document["models"]] == [False, True]
    assert document["simulated"] is True
    assert "käte" in document["models"][1]["made_from"]
    assert "sha256" in document["models"][1]["made_from"]
    shown = masrel("joint", "between", "HM1", "HM2", file, "-n", "2")
    assert shown.out.startswith("SIMULATED DATA")


def test_nothing_is_overwritten_unless_asked(masrel: Caller, tmp_path: Path) -> None:
    (tmp_path / "D02.toml").write_text("mine", encoding="utf-8")
    arguments = ("joint", "between", "HM1", "HM2", "-n", "2", "-o", tmp_path)
    said = refused(masrel(*arguments))
    assert said == (
        f"--output: {tmp_path} already holds D02.toml; --overwrite replaces them"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["D02.toml"]
    assert (tmp_path / "D02.toml").read_text(encoding="utf-8") == "mine"
    assert masrel(*arguments, "--overwrite").code == 0
    assert read_model_file(tmp_path / "D02.toml").residual_ratio == 0.25


def test_a_file_that_hides_whether_it_is_simulated_is_refused(
    masrel: Caller, tmp_path: Path
) -> None:
    path = simulated(tmp_path / "a.toml", is_it='"no"')
    said = refused(masrel("joint", "between", "HM1", path, "-n", "1"))
    assert "a.toml: simulated must be true or false" in said
    edit(path, 'simulated = "no"\n', "")
    assert "got nothing" in refused(masrel("joint", "between", "HM1", path, "-n", "1"))
