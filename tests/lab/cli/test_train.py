"""masrel train as a user calls it: taught, killed, gone on with, reported, refused."""

import csv
import json
import os
import shutil
from pathlib import Path

import pytest

from masrel.agreement import cohen_kappa
from masrel.lab._event_log import read_log
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.ratings import ratings_from_logs
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from masrel.lab.schedule.sheets import write_schedules
from masrel.lab.training._lessons import TrainingRecord, read_training
from masrel.lab.training._trainer import SimulatedTrainee, train_rater
from tests.cli.process import Caller
from tests.files import edit, small_study
from tests.lab.run.kill_at import die_at_line

# A test that few presentations decide
RULES = """
[training]
kappa_insufficient = 0.3
kappa_sufficient = 0.95
false_pass = 0.2
window = 24
max_presentations = 32
"""


def new_study(root: Path) -> Path:
    small_study(root)
    with (root / "protocol.toml").open("a", encoding="utf-8") as file:
        file.write(RULES)
    return root


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A new study whose training is short."""
    return new_study(tmp_path / "study")


@pytest.fixture(scope="module")
def trained_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with a simulated training of R1, for tests to copy."""
    root = new_study(tmp_path_factory.mktemp("trained") / "study")
    train_simulated(root)
    return root


@pytest.fixture
def trained(trained_once: Path, tmp_path: Path) -> Path:
    """A study with a training that has ended."""
    return Path(shutil.copytree(trained_once, tmp_path / "trained"))


def train_simulated(root: Path) -> TrainingRecord:
    protocol = read_protocol(root / "protocol.toml")
    trainee = SimulatedTrainee(protocol)
    return train_rater(
        StudyPaths(root), protocol, "R1", grades=trainee, clock="simulated"
    )


def answers(monkeypatch: pytest.MonkeyPatch, *lines: str) -> None:
    import io

    monkeypatch.setattr("sys.stdin", io.StringIO("".join(f"{x}\n" for x in lines)))


def test_a_simulated_trainee_learns_passes_and_is_reported(
    trained: Path, masrel: Caller, tmp_path: Path
) -> None:
    done = masrel("train", trained, "--rater", "R1", "--grades", "simulated")
    assert done.code in (0, None)
    assert "training of R1: passed after" in done.out
    assert "(simulated)" in done.out
    assert "Trainings never enter the ratings" in done.out
    figure, file = tmp_path / "curve.svg", tmp_path / "training.json"
    report = ["train", "show", trained, "--rater", "R1"]
    shown = masrel(*report, "--figure", figure, "--json", file)
    assert shown.out.startswith("SIMULATED DATA. Training of R1: passed after")
    assert "Grades of R1 by intended grade" in shown.out
    assert b"<svg" in figure.read_bytes()
    document = json.loads(file.read_text(encoding="utf-8"))
    assert document["simulated"] is True
    assert document["enters_ratings"] is False
    pairs = [(one["intended"], one["grade"]) for one in document["lessons"]]
    *before, last = document["curve"]
    kappa = cohen_kappa(
        pairs[-last["n_presentations"] :],
        categories=["0", "1", "1+", "2", "3", "4"],
        weights="linear",
    )
    assert last["kappa"] == pytest.approx(kappa.value, abs=1e-12)
    assert last["low"] < last["kappa"] <= last["high"]
    boundary = document["criterion"]["boundary"]
    assert max(p["evidence"] for p in before) < boundary <= last["evidence"]
    page = tmp_path / "training.html"
    masrel(*report, "--html", page)
    text = page.read_text(encoding="utf-8")
    assert "SIMULATED DATA" in text
    assert f"Training of R1: passed after {len(pairs)} presentations." in text
    assert '<svg role="img"' in text
    assert f">{last['kappa']:.3f}</td>" in text
    rows = list(csv.DictReader(masrel(*report, "--csv").out.splitlines()))
    kappas = [point["kappa"] for point in document["curve"]]
    assert [float(row["kappa"]) for row in rows] == kappas
    assert {row["data"] for row in rows} == {"simulated"}


def test_no_rating_of_the_study_comes_from_a_training(trained: Path) -> None:
    paths = StudyPaths(trained)
    protocol = read_protocol(paths.protocol)
    write_schedules(protocol, paths)
    grades = SimulatedGrades(protocol)
    run_session(paths, protocol, "R1", "test", grades=grades, clock="simulated")
    after = ratings_from_logs(paths, protocol)
    assert len(after.table) == 4
    shutil.rmtree(paths.training)
    assert ratings_from_logs(paths, protocol).table.equals(after.table)


def test_a_person_is_told_the_grade_after_each_and_goes_on_after_a_stop(
    study: Path, masrel: Caller, monkeypatch: pytest.MonkeyPatch
) -> None:
    call = ["train", study, "--rater", "R1", "--clock", "simulated"]
    answers(monkeypatch, "", "1", "", "again", "", "2", "stop")
    stopped = masrel(*call)
    assert stopped.code == 1
    assert "presentation 3 of 32; the same command resumes it there" in stopped.err
    record = read_training(
        StudyPaths(study), read_protocol(study / "protocol.toml"), "R1"
    )
    assert [one.grade for one in record.lessons] == ["1", "2"]
    for one in record.lessons:
        if one.grade == one.intended:
            assert f"Right: {one.intended}." in stopped.out
        else:
            assert f"Not {one.grade}: it is {one.intended}." in stopped.out
    assert "HM" not in stopped.out  # no model is named
    answers(monkeypatch, "stop")
    assert "Presentation 3 of 32" in masrel(*call).out
    kinds = [event.kind for event in read_log(study / "training" / "R1.jsonl")]
    assert kinds == [
        *("training", "presented", "grade", "presented", "presented", "grade"),
        *("stopped", "resumed", "stopped"),
    ]


class _Killed(BaseException):
    """The process is gone."""


def killed() -> None:
    raise _Killed


@pytest.mark.slow
def test_killed_at_line_after_line_it_comes_to_the_same_end(
    study: Path, trained: Path
) -> None:
    n_killed = 0
    while n_killed < 500:
        with pytest.MonkeyPatch.context() as patch:
            # lines of a run: recovered if the last one was torn, resumed, then others
            patch.setattr(os, "write", os.write)  # as it is afterwards
            die_at_line(2 + n_killed % 11, 40 * (n_killed % 2), killed)
            try:
                record = train_simulated(study)
            except _Killed:
                n_killed += 1
            else:
                break
    protocol = read_protocol(study / "protocol.toml")
    assert record == read_training(StudyPaths(trained), protocol, "R1")
    assert n_killed > len(record.lessons) / 2
    events = read_log(study / "training" / "R1.jsonl")
    named = {e.fields["recording"] for e in events if e.kind == "presented"}
    there = {f"R1/{file.name}" for file in (study / "training" / "R1").glob("*.npz")}
    assert named == there


def test_a_training_goes_on_with_what_it_was_begun_with(
    trained: Path, masrel: Caller
) -> None:
    call = ["train", trained, "--rater", "R1", "--grades", "simulated"]
    log, protocol = trained / "training" / "R1.jsonl", trained / "protocol.toml"
    edit(protocol, "false_pass = 0.2", "false_pass = 0.1")
    assert "begun with false_pass = 0.2: needed the same" in masrel(*call).err
    edit(protocol, "false_pass = 0.1", "false_pass = 0.2")
    text = log.read_text(encoding="utf-8")
    log.write_text(text.replace('"grade": "1"', '"grade": "3"', 1), encoding="utf-8")
    assert "a line before was changed" in masrel(*call).err
    log.unlink()
    gone = masrel(*call)
    assert gone.code == 2
    assert "is gone, and there are recordings" in gone.err
    edit(
        protocol, "catch_angle_constant_deg = 130.0", "catch_angle_constant_deg = 129.0"
    )
    log.write_text(text, encoding="utf-8")
    changed_models = masrel("train", "show", trained, "--rater", "R1")
    assert "needed the training of the models that the protocol has now" in (
        changed_models.err
    )
