"""What ``masrel verify`` finds of trainings: their logs, and recordings."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from masrel.lab.protocol import StudyPaths
from masrel.lab.verification import (
    anchor_findings,
    anchors_of,
    verify_study,
    write_anchors,
)
from tests.lab.cli.test_train import trained, trained_once
from tests.lab.flow.conftest import run
from tests.lab.flow.test_verify import chained_anew, edited, events

__all__ = ["trained", "trained_once"]  # fixtures of a short training

Forgery = Callable[[StudyPaths], Path]


def test_a_training_is_listed_and_whole(trained: Path) -> None:
    verification = verify_study(StudyPaths(trained))
    (training,) = verification.trainings
    log = events(StudyPaths(trained).training_log_file("R1"))
    assert training.n_graded == sum(e["event"] == "grade" for e in log) > 0
    assert training.n_recordings == sum(e["event"] == "presented" for e in log)
    assert training.stage in ("passed", "not passed")
    assert verification.findings == ()
    assert f"training R1: {training.stage}, " in run("verify", str(trained))


def log_of(study: StudyPaths) -> Path:
    return study.training_log_file("R1")


def changed(study: StudyPaths, kind: str, **fields: object) -> Path:
    documents = events(log_of(study))
    document = next(d for d in documents if d["event"] == kind)
    document["fields"] |= fields
    return chained_anew(log_of(study), documents)


def a_grade(study: StudyPaths) -> Path:
    grade = next(e for e in events(log_of(study)) if e["event"] == "grade")
    old = f'"grade": "{grade["fields"]["grade"]}"'.encode()
    return edited(log_of(study), old, b'"grade": "4"')


def a_grade_that_is_none(study: StudyPaths) -> Path:
    return changed(study, "grade", grade="7")


def another_intended_grade(study: StudyPaths) -> Path:
    return changed(study, "grade", intended="4")


def another_model(study: StudyPaths) -> Path:
    return changed(study, "presented", model="HM9")


def another_attempt(study: StudyPaths) -> Path:
    return changed(study, "presented", attempt=2)


def a_position_that_is_none(study: StudyPaths) -> Path:
    return changed(study, "presented", position=[])


def another_end(study: StudyPaths) -> Path:
    return changed(study, "complete", n_presentations=1)


def another_rater(study: StudyPaths) -> Path:
    return log_of(study).rename(study.training_log_file("R2"))


def a_later_format(study: StudyPaths) -> Path:
    return changed(study, "training", format=99)


def a_recording(study: StudyPaths) -> Path:
    path = sorted(study.training.glob("*/*.npz"))[0]
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    return path


def a_recording_taken_away(study: StudyPaths) -> Path:
    path = sorted(study.training.glob("*/*.npz"))[-1]
    path.unlink()
    return path


def a_recording_nobody_logged(study: StudyPaths) -> Path:
    path = log_of(study).with_suffix("") / "999.npz"
    path.write_bytes(b"")
    return path


def a_log_of_nobody(study: StudyPaths) -> Path:
    path = study.training / "R9.jsonl"
    path.write_bytes(log_of(study).read_bytes())
    return path


FORGERIES: list[Forgery] = [
    a_grade,
    a_grade_that_is_none,
    another_intended_grade,
    another_model,
    another_attempt,
    a_position_that_is_none,
    another_end,
    another_rater,
    a_later_format,
    a_recording,
    a_recording_taken_away,
    a_recording_nobody_logged,
    a_log_of_nobody,
]


@pytest.mark.parametrize("forge", FORGERIES, ids=lambda forge: forge.__name__)
def test_what_was_changed_of_a_training_is_found(trained: Path, forge: Forgery) -> None:
    study = StudyPaths(trained)
    place = forge(study)
    broken = [f.path for f in verify_study(study).findings if f.weight == "broken"]
    assert place in broken


def test_a_training_of_other_models_is_in_doubt(trained: Path) -> None:
    study = StudyPaths(trained)
    changed(study, "training", presented_sha256="0" * 64)
    verification = verify_study(study)
    assert verification.is_whole
    assert "before a change" in verification.findings[0].message


def test_an_anchor_holds_trainings_too(trained: Path, tmp_path: Path) -> None:
    study = StudyPaths(trained)
    anchors = anchors_of(study)
    assert [anchor.log for anchor in anchors] == ["training/R1.jsonl"]
    write_anchors(anchors, tmp_path / "anchors.txt")
    documents = events(log_of(study))
    documents[-1]["fields"]["passed"] = not documents[-1]["fields"]["passed"]
    chained_anew(log_of(study), documents)
    assert verify_study(study).is_whole  # without the anchor it cannot be seen
    assert [f.path for f in anchor_findings(study, anchors)] == [log_of(study)]


def test_the_document_has_trainings(trained: Path) -> None:
    document = json.loads(run("verify", str(trained), "--json", "-"))
    assert [training["rater"] for training in document["trainings"]] == ["R1"]
