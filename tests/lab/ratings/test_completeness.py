"""Nothing of a study vanishes without a word, on stderr and in the report."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.lab.conduct import record_standing, record_unblinding
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.ratings import ratings_from_logs, study_remarks, write_ratings
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from tests.lab.run.conftest import PROTOCOL
from tests.lab.schedule.studies import with_secret

BY = {"who": "MK", "why": "moved away"}

DOWNSTREAM = ("analyze", "report")

# No figures, which take time
SHORT = '\n[report]\nsections = ["design"]\n'


@pytest.fixture(scope="module")
def graded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study all of whose sessions are complete, with its table of ratings."""
    study = with_secret(StudyPaths(tmp_path_factory.mktemp("graded") / "study"))
    study.protocol.write_text(PROTOCOL + SHORT, encoding="utf-8")
    assert call("schedule", study.root)[0] == 0
    protocol = read_protocol(study.protocol)
    for session in protocol.sessions:
        for rater in session.raters:
            run_session(
                study,
                protocol,
                rater,
                session.id,
                grades=SimulatedGrades(protocol),
                clock="simulated",
            )
    write_ratings(ratings_from_logs(study, protocol), study.ratings_file)
    return study.root


@pytest.fixture
def study(graded: Path, tmp_path: Path) -> StudyPaths:
    shutil.copytree(graded, tmp_path / "study")
    return StudyPaths(tmp_path / "study")


def call(*words: object) -> tuple[int, str]:
    """Exit code of a verb, and what it says on stderr or raises."""
    result = CliRunner().invoke(cli, [str(word) for word in words])
    return result.exit_code, f"{result.stderr}{result.exception}"


def take_off(study: StudyPaths, rater: str) -> Protocol:
    text = study.protocol.read_text(encoding="utf-8")
    text = text.replace(f'raters = ["R1", "{rater}"]', 'raters = ["R1"]')
    study.protocol.write_text(text, encoding="utf-8")
    return read_protocol(study.protocol)


FAULTS: dict[str, tuple[Callable[[StudyPaths], object], str]] = {
    "taken off": (
        lambda s: take_off(s, "R2"),
        "sessions/test_R2.jsonl belongs to no rater",
    ),
    "emptied": (
        lambda s: s.log_file("R2", "test").write_bytes(b""),
        "sessions/test_R2.jsonl is empty",
    ),
    "deleted": (
        lambda s: s.log_file("R2", "test").unlink(),
        "sessions/test_R2 has recordings but no log",
    ),
    "withdrawn": (
        lambda s: record_standing(
            s, read_protocol(s.protocol), "R2", "withdrawn", **BY
        ),
        "by MK: moved away. Grades given before, 3 by the logs, are kept",
    ),
    "unblinded": (
        lambda s: record_unblinding(s, read_protocol(s.protocol), None, **BY),
        "All codes were unblinded on ",
    ),
}


IN_REPORT = {
    "withdrawn": ">withdrawn<",
    "unblinded": ">all codes<",
}


def test_a_study_as_it_should_be_has_no_remarks(study: StudyPaths) -> None:
    assert study_remarks(study, read_protocol(study.protocol)) == ()
    for verb in DOWNSTREAM:
        assert "note:" not in call(verb, study.root)[1]


@pytest.mark.parametrize("name", FAULTS)
def test_every_verb_downstream_and_the_report_say_it(
    study: StudyPaths, name: str
) -> None:
    make, sentence = FAULTS[name]
    make(study)
    # the table is an old one where grades are gone: refused, but not without a word
    for verb in ("check", "analyze", "report", "ratings"):
        assert sentence in call(verb, study.root)[1], verb
    for verb in DOWNSTREAM:
        assert call(verb, study.root)[0] == 0, verb
    page = (study.root / "report" / "report.html").read_text(encoding="utf-8")
    assert ">Conduct</h2>" in page
    assert IN_REPORT.get(name, sentence) in page
    for private in ("MK", "moved away"):  # stays out until --include asks for it
        assert private not in page
    assert str(study.root) not in page


def test_a_table_named_by_hand_is_said_to_be_one(study: StudyPaths) -> None:
    other = study.root / "other.csv"
    study.ratings_file.rename(other)
    assert "note:" not in call("analyze", study.root)[1]
    sentence = "The ratings are from other.csv, a file named by hand"
    assert sentence in call("analyze", study.root, "--ratings", other)[1]
    call("report", study.root, "--ratings", other)
    assert sentence in (study.root / "report" / "report.md").read_text("utf-8")


def test_a_damaged_log_of_conduct_stops_every_verb(study: StudyPaths) -> None:
    study.conduct_file.write_text("{}\n", encoding="utf-8")
    for verb in ("check", "verify", "ratings", *DOWNSTREAM):
        code, errors = call(verb, study.root)
        assert (code != 0, "conduct.jsonl: line 1" in errors) == (True, True), verb


def test_leftover_schedules_say_what_to_do(study: StudyPaths) -> None:
    take_off(study, "R2")
    code, errors = call("check", study.root)
    assert code == 2
    assert "put the rater back into the session (masrel record withdraw keeps" in errors
