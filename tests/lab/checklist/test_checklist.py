"""Checklists hold what the record says, and leave the rest to the authors."""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import docx
import pytest
from markupsafe import escape

from masrel.lab.checklist import (
    checklist_markdown,
    fill_checklist,
    write_checklist,
)
from masrel.lab.conduct import record_standing
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.run._corrections import record_correction
from masrel.lab.run.session import run_session
from masrel.lab.schedule.presentation import read_schedule
from tests.lab.run.conftest import new_study, small
from tests.lab.script import ScriptGrades

__all__ = ["new_study", "small"]

Small = tuple[StudyPaths, Protocol]
PUBLISHED = StudyPaths(Path("studies/hess2012"))
OLD_RATERS = '[[raters]]\nid = "R1"\n\n[[raters]]\nid = "R2"\n'
THREE = f'{OLD_RATERS}\n[[raters]]\nid = "R3"\n'
OLD_TEST = 'raters = ["R1", "R2"]'
NEW_TEST = 'raters = ["R1", "R2", "R3"]'
SEED = "[simulated_raters]\nseed = 5\n"
PLAN = """

[[analysis.estimates]]
id = "percent"
kind = "inter-rater"
coefficient = "percent_agreement"
models = "all"
sessions = ["test"]
target = "items"
"""
FIELDS = """
[rater_fields.years]
type = "whole"
unit = "a"
title = "Years of practice"
public = true

[rater_fields.illness]
type = "text"

"""
NEW_RATERS = (
    '[[raters]]\nid = "R1"\nfields = { years = 3, illness = "influenza" }\n\n'
    '[[raters]]\nid = "R2"\nfields = { years = 8 }\n'
)
FIRST = datetime(2026, 3, 1, 9, tzinfo=UTC)


def rate(small: Small, rater: str, session: str, day: int) -> None:
    study, protocol = small
    schedule = read_schedule(study.schedule_file(rater, session))
    grades = {shown.code: "1" for shown in schedule.presentations}
    run_session(
        study,
        protocol,
        rater,
        session,
        grades=ScriptGrades(grades),
        clock="simulated",
        now=lambda: FIRST + timedelta(days=day),
    )


@pytest.fixture
def rated(small: Small) -> Small:
    """Three sessions, the retest nine days after the test, one correction."""
    for rater, session, day in (("R1", "test", 0), ("R2", "test", 2)):
        rate(small, rater, session, day)
    rate(small, "R1", "retest", 9)
    study, protocol = small
    code = read_schedule(study.schedule_file("R2", "test")).presentations[0].code
    record_correction(
        study, protocol, "R2", "test", code=code, grade="2", who="MK", why="slip"
    )
    return small


def facts(checklist: Any, number: str) -> str:
    (item,) = (item for item in checklist.items if item.number == number)
    return " ".join(item.facts)


def grras(study: StudyPaths) -> Any:
    return fill_checklist(study, read_protocol(study.protocol), "grras")


def test_of_grras_seven_are_filled_four_in_part_and_four_the_authors(
    rated: Small,
) -> None:
    study, _ = rated
    checklist = grras(study)
    states = {
        state: {item.number for item in checklist.items if item.state == state}
        for state in ("filled", "in part", "authors")
    }
    assert states["filled"] == {"6", "8", "9", "10", "11", "13", "15"}
    assert states["in part"] == {"2", "4", "7", "12"}
    assert states["authors"] == {"1", "3", "5", "14"}
    # days and corrections come from the logs
    assert "between 2026-03-01 and 2026-03-10 (UTC)" in facts(checklist, "8")
    assert "9 to 9, median 9" in facts(checklist, "8")
    assert "1 grade correction" in facts(checklist, "9")
    numbers = "Session test: 2 raters, 3 models, 6 ratings, 0 missing."
    assert numbers in facts(checklist, "11")
    # every file that is named has its hash
    named = {file.as_posix() for item in checklist.items for file in item.files}
    assert {"protocol.toml", "sessions/retest_R1.jsonl"} < named
    assert checklist.files == {
        name: hashlib.sha256((study.root / name).read_bytes()).hexdigest()
        for name in sorted(named)
    }


def test_what_nobody_knows_before_the_first_session_is_asked(small: Small) -> None:
    checklist = grras(small[0])
    asked = {item.number for item in checklist.items if item.state == "authors"}
    assert asked == {"1", "3", "5", "11", "13", "14", "15"}
    assert checklist.notes == ("No session has begun yet; this is the plan.",)


def test_raters_who_left_are_said_and_not_by_whom(rated: Small) -> None:
    study, protocol = rated
    record_standing(
        study, protocol, "R2", "withdrawn", who="Somebody", why="moved away"
    )
    said = facts(grras(study), "11")
    assert "2 raters planned: 1 complete, 1 withdrawn." in said
    assert "Rater R2 was withdrawn on" in said
    assert "moved away" not in said
    assert "Somebody" not in checklist_markdown(grras(study))


def test_who_is_excluded_enters_no_estimate(new_study: Callable[..., Small]) -> None:
    study, protocol = new_study(
        (OLD_RATERS, THREE), (OLD_TEST, NEW_TEST), (SEED, f"{SEED}{PLAN}")
    )
    for rater, dummy in (("R1", "1"), ("R2", "1"), ("R3", "3")):
        schedule = read_schedule(study.schedule_file(rater, "test"))
        grades = {"HM1": "1", "HM3": "2", "D1": dummy}
        of_code = {shown.code: grades[shown.model] for shown in schedule.presentations}
        source = ScriptGrades(of_code)
        run_session(study, protocol, rater, "test", grades=source, clock="simulated")
    assert "Percent agreement = .78," in facts(grras(study), "13")  # (1 + 1 + 1/3) / 3
    record_standing(study, protocol, "R3", "excluded", who="MK", why="was not trained")
    # R1 and R2 agree on all three
    assert "Percent agreement = 1.00," in facts(grras(study), "13")


def test_public_fields_of_raters_are_told(new_study: Callable[..., Small]) -> None:
    study, _ = new_study((OLD_RATERS, f"{FIELDS}{NEW_RATERS}"))
    for number in ("4", "12"):
        said = facts(grras(study), number)
        assert "Years of practice: 3 to 8 a, median 5.5." in said
        assert "Recorded but not public: illness." in said
        assert "influenza" not in said


def test_cosmin_has_its_six_standards_and_no_grade(rated: Small) -> None:
    study, protocol = rated
    checklist = fill_checklist(study, protocol, "cosmin")
    assert [item.number for item in checklist.items] == list("123456")
    assert Counter(item.state for item in checklist.items) == {"in part": 6}
    said = " ".join(fact for item in checklist.items for fact in item.facts)
    assert not re.search("very good|adequate|doubtful", said.lower())
    assert "9 to 9, median 9" in facts(checklist, "2")
    assert "Device: simulated in all sessions." in facts(checklist, "3")
    assert "0 of 9 grades are missing." in facts(checklist, "6")
    # what differs is said: the log of another version, its chain forged anew
    log = study.log_file("R1", "retest")
    head, *later = map(json.loads, log.read_text().splitlines())
    version, head["fields"]["masrel_version"] = head["fields"]["masrel_version"], "9.9"
    lines, previous = [], "0" * 64
    for document in (head, *later):
        lines.append(json.dumps(document | {"previous": previous}, ensure_ascii=False))
        previous = hashlib.sha256(lines[-1].encode()).hexdigest()
    log.write_text("\n".join(lines) + "\n")
    needed = f"Version of masrel differs: {version} in 2; 9.9 in 1."
    assert needed in facts(fill_checklist(study, protocol, "cosmin"), "3")


def test_a_study_without_logs_does_not_say_how_it_was_run() -> None:
    # Table V of the paper: 4 models by 8 raters, kappa 0.63
    checklist = grras(PUBLISHED)
    states = {item.number: item.state for item in checklist.items}
    assert states["8"] == states["9"] == "in part"
    assert checklist.notes == ()
    assert "8 raters, 4 models, 32 ratings, 0 missing" in facts(checklist, "11")
    assert "kappa-standard: Fleiss' κ = .63" in facts(checklist, "13")


def test_each_form_has_every_fact(rated: Small, tmp_path: Path) -> None:
    checklist = grras(rated[0])
    assert "SIMULATED" in " ".join(checklist.notes)
    paths = [tmp_path / f"checklist{form}" for form in (".html", ".md", ".docx")]
    for path in paths:
        write_checklist(checklist, path)
        first = path.read_bytes()
        write_checklist(checklist, path)
        assert path.read_bytes() == first
    page, markdown = (path.read_text(encoding="utf-8") for path in paths[:2])
    assert markdown == checklist_markdown(checklist)
    assert "http" not in page
    document = docx.Document(str(paths[2]))
    said = "\n".join(paragraph.text for paragraph in document.paragraphs)
    assert said.startswith(f"{checklist.study}\n")
    for item in checklist.items:
        for text in (item.topic, *item.facts):
            assert text in said
            assert str(escape(text)) in page
