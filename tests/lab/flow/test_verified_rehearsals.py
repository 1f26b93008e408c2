"""What ``masrel verify`` finds of rehearsals: their logs, and recordings."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from masrel.lab.protocol import StudyPaths, copy_template
from masrel.lab.verification import anchor_findings, anchors_of, verify_study
from tests.lab.flow.conftest import run
from tests.lab.flow.test_verify import chained_anew, edited, events

Forgery = Callable[[StudyPaths], Path]


@pytest.fixture(scope="module")
def rehearsed_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("rehearsed") / "study"
    copy_template("small", root)
    of_rater = ("--rater", "R1", "--session", "test", "--rehearse")
    run("run", str(root), *of_rater, "--grades", "simulated", "--quiet")
    return root


@pytest.fixture
def study(rehearsed_once: Path, tmp_path: Path) -> StudyPaths:
    shutil.copytree(rehearsed_once, tmp_path / "study")
    return StudyPaths(tmp_path / "study")


def log_of(study: StudyPaths) -> Path:
    return study.rehearsals / "1" / "rehearsal_test_R1.jsonl"


def recording_of(study: StudyPaths) -> Path:
    return sorted(study.rehearsals.glob("1/*/*.npz"))[0]


def test_a_rehearsal_is_listed_and_whole(study: StudyPaths) -> None:
    verification = verify_study(study)
    (rehearsal,) = verification.rehearsals
    assert (rehearsal.rehearsal, rehearsal.stage) == (1, "complete")
    assert rehearsal.n_graded == rehearsal.n_recordings == 4
    assert verification.findings == ()
    assert "rehearsal 1 of test R1: complete" in run("verify", str(study.root))
    document = json.loads(run("verify", str(study.root), "--json", "-"))
    assert [each["rater"] for each in document["rehearsals"]] == ["R1"]


def changed(study: StudyPaths, kind: str, **fields: object) -> Path:
    documents = events(log_of(study))
    document = next(d for d in documents if d["event"] == kind)
    document["fields"] |= fields
    return chained_anew(log_of(study), documents)


def a_grade(study: StudyPaths) -> Path:
    return edited(log_of(study), b'"event": "grade"', b'"event": "Grade"')


def a_grade_that_is_none(study: StudyPaths) -> Path:
    return changed(study, "grade", grade="7")


def another_position(study: StudyPaths) -> Path:
    return changed(study, "presented", position=3)


def a_session_instead(study: StudyPaths) -> Path:
    return changed(study, "session", rehearsal=False)


def another_rater(study: StudyPaths) -> Path:
    return log_of(study).rename(log_of(study).with_stem("rehearsal_test_R2"))


def another_number(study: StudyPaths) -> Path:
    (study.rehearsals / "1").rename(study.rehearsals / "two")
    return study.rehearsals / "two" / log_of(study).name


def a_recording(study: StudyPaths) -> Path:
    path = recording_of(study)
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    return path


def facts_beside_it(study: StudyPaths) -> Path:
    return edited(recording_of(study).with_suffix(".json"), b"HM", b"HX")


def a_recording_nobody_logged(study: StudyPaths) -> Path:
    path = recording_of(study).with_stem("00A")
    path.write_bytes(b"")
    return path


FORGERIES: list[Forgery] = [
    a_grade,
    a_grade_that_is_none,
    another_position,
    a_session_instead,
    another_rater,
    another_number,
    a_recording,
    facts_beside_it,
    a_recording_nobody_logged,
]


@pytest.mark.parametrize("forge", FORGERIES, ids=lambda forge: forge.__name__)
def test_what_was_changed_of_a_rehearsal_is_found(
    study: StudyPaths, forge: Forgery
) -> None:
    place = forge(study)
    broken = [f.path for f in verify_study(study).findings if f.weight == "broken"]
    assert place in broken


def test_a_recording_that_is_gone_is_found(study: StudyPaths) -> None:
    path = recording_of(study)
    path.unlink()
    assert path in [finding.path for finding in verify_study(study).findings]


def test_a_rehearsal_of_another_secret_is_in_doubt(study: StudyPaths) -> None:
    shutil.rmtree(study.secret_file.parent)
    (finding,) = verify_study(study).findings
    assert (finding.weight, finding.path) == ("doubt", log_of(study))
    a_recording(study)  # whose hash the log has all the same
    assert not verify_study(study).is_whole


def test_an_anchor_holds_rehearsals_too(study: StudyPaths) -> None:
    anchors = anchors_of(study)
    assert [anchor.log for anchor in anchors] == [
        "rehearsals/1/rehearsal_test_R1.jsonl"
    ]
    changed(study, "grade", stretch=1)
    assert [f.path for f in anchor_findings(study, anchors)] == [log_of(study)]
