"""The report says what became of the raters, and what is private only when asked."""

from collections.abc import Callable

import pytest

from masrel.lab.analysis import analyze
from masrel.lab.conduct import (
    Note,
    record_note,
    record_rater_values,
    record_standing,
    record_unblinding,
)
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.ratings import read_study_data, write_ratings
from masrel.lab.report._conduct import study_conduct
from masrel.lab.report._document import write_report
from masrel.lab.run.session import run_session
from masrel.lab.verification import verify_study
from tests.lab.run.conftest import new_study
from tests.lab.script import ScriptGrades

__all__ = ["new_study"]

NewStudy = Callable[..., tuple[StudyPaths, Protocol]]
FIELDS = """
[rater_fields.years]
type = "whole"
title = "Experience"
unit = "years"
public = true
[rater_fields.job]
type = "choice"
choices = ["PT", "MD"]

[report]
sections = ["grades"]

[analysis]
estimates = [{ id = "k", kind = "inter-rater", coefficient = "percent_agreement", \
sessions = ["test"], target = "items", models = "all" }]

[schedule]"""
BY = {"who": "Kim", "why": "knew the models"}


@pytest.fixture
def run_study(new_study: NewStudy) -> tuple[StudyPaths, Protocol]:
    study, protocol = new_study(
        ("[schedule]", FIELDS),
        ('raters = ["R1", "R2"]', 'raters = ["R1", "R2", "R3"]'),
        ('id = "R2"\n', 'id = "R2"\n\n[[raters]]\nid = "R3"\n'),
    )
    for rater, grades in (("R1", "111"), ("R2", "111"), ("R3", "333")):
        script = ScriptGrades([*grades])
        where = (study, protocol, rater, "test")
        run_session(*where, grades=script, clock="simulated")
    return study, protocol


def page(study: StudyPaths, protocol: Protocol, *include: str) -> str:
    data = read_study_data(study, protocol)
    analysis = analyze(protocol, data.ratings, excluded=data.excluded)
    folder = study.root / "report"
    conduct = study_conduct(study, protocol, include=include)
    write_report(protocol, data.ratings, analysis, folder, conduct=conduct)
    return (folder / "report.md").read_text(encoding="utf-8")


def test_an_excluded_rater_is_in_the_data_and_in_no_number(
    run_study: tuple[StudyPaths, Protocol],
) -> None:
    study, protocol = run_study

    def agreement() -> tuple[float, tuple[str, ...], str]:
        data = read_study_data(study, protocol)
        analysis = analyze(protocol, data.ratings, excluded=data.excluded)
        (line,) = analysis.estimates
        assert line.estimate is not None
        return line.estimate.value, line.raters, analysis.inputs["ratings_sha256"]

    before, _, sha256 = agreement()
    assert before == pytest.approx(1 / 3)  # R1 and R2 always agree, R3 with nobody
    record_standing(study, protocol, "R3", "excluded", **BY)
    assert agreement() == (1.0, ("R1", "R2"), sha256)
    text = page(study, protocol)
    assert "| test | 3 | 3 | 3 | 0 | 1 | 0 | 2 |" in text
    assert "Excluded: 1 (R3)" in text
    assert "Excluded from every number of this report: R3." in text
    record_standing(study, protocol, "R3", "included", **BY)
    assert agreement()[0] == before


@pytest.mark.slow
def test_what_is_private_is_shown_when_it_is_asked_for(
    run_study: tuple[StudyPaths, Protocol],
) -> None:
    study, protocol = run_study
    record_rater_values(study, protocol, "R1", {"years": "3", "job": "PT"}, who="Kim")
    record_rater_values(study, protocol, "R2", {"years": "8"}, who="Kim")
    record_note(
        study,
        protocol,
        Note(
            text="bruised thumb",
            who="Kim",
            kind="adverse-event",
            rater="R2",
            severity="mild",
            action="ice",
        ),
    )
    record_unblinding(study, protocol, None, who="Kim", why="an injury")
    record_standing(study, protocol, "R1", "withdrawn", **BY)
    text = page(study, protocol)
    events = [line for line in text.splitlines() if line.startswith("| 20")]
    assert [line.split(" | ")[1] for line in events] == [
        "adverse-event",
        "unblinded",
        "withdrawn",
    ]
    assert "severity: mild |" in events[0]
    assert "| all codes |" in events[1]
    assert "an injury" not in text
    assert "knew the models" not in text
    assert "| Experience (years) | 2 | 5.50 | 3.54 | 5.50 | 3.00 | 8.00 |" in text
    private = {"who": "| Kim |", "notes": "bruised thumb", "job": "| job | PT | 1 |"}
    for name, shown in private.items():
        assert shown not in text
        assert f"({name})" in text
    assert "Kim" not in text
    asked = page(study, protocol, *private)
    for shown in private.values():
        assert shown in asked
    assert "action: ice" in asked
    assert "all codes; an injury" in asked
    assert "knew the models" in asked
    assert "Not shown" not in asked


def test_a_report_of_before_the_last_event_is_found(
    run_study: tuple[StudyPaths, Protocol],
) -> None:
    study, protocol = run_study

    def messages() -> list[str]:
        return [finding.message for finding in verify_study(study).findings]

    write_ratings(read_study_data(study, protocol).ratings, study.ratings_file)
    page(study, protocol, "notes")
    assert messages() == []
    late = "is of an earlier state of the record"
    for standing in ("withdrawn", "excluded", "included"):
        record_standing(study, protocol, "R3", standing, **BY)
        (message,) = messages()
        assert late in message
        page(study, protocol)
        assert messages() == []


def test_a_study_that_was_not_run_has_no_such_section(new_study: NewStudy) -> None:
    study, protocol = new_study(("[schedule]", FIELDS))
    study.ratings_file.parent.mkdir()
    study.ratings_file.write_text("rater,model,grade\nR1,HM1,1\nR2,HM1,1\n")
    assert "Conduct" not in page(study, protocol)
