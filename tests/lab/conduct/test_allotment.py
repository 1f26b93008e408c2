"""Rows of a design are allotted by the study's log, and by nothing else."""

import hmac
import json
import os
from pathlib import Path

import pytest

from masrel.errors import ScheduleError, SessionLogError
from masrel.lab.conduct import allot_schedules, record_standing
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.schedule._secret import copy_for_site
from masrel.lab.schedule.presentation import draw_schedule, read_schedule
from masrel.lab.schedule.sheets import concealment_notes, schedule_problems
from masrel.lab.verification import verify_sessions
from tests.files import edit
from tests.lab.schedule.studies import SECRET, protocol_of, with_secret

SITES = {"R1": "north", "R2": "south", "R3": "north", "R4": "south"}
RATERS = tuple(SITES)


def williams(**changes: object) -> Protocol:
    return protocol_of(**{"raters": ("R1", "R2"), "scheme": "williams", **changes})


def at_sites(**changes: object) -> Protocol:
    return williams(**{"raters": RATERS, "sites": SITES, "strata": "site", **changes})


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    return with_secret(StudyPaths(tmp_path / "study"))


def allotted(study: StudyPaths) -> list[tuple[object, ...]]:
    lines = study.conduct_file.read_text(encoding="utf-8").splitlines()
    events = [json.loads(line) for line in lines]
    return [tuple(e["fields"].values()) for e in events if e["event"] == "allotted"]


def broken(study: StudyPaths, protocol: Protocol) -> list[str]:
    return [
        *schedule_problems(protocol, study),
        *(finding.message for finding in verify_sessions(study, protocol).findings),
    ]


def test_rows_are_allotted_in_order_for_each_session(study: StudyPaths) -> None:
    protocol = williams(sessions=("test", "retest"))
    allot_schedules(study, protocol)
    assert allotted(study) == [
        ("R1", "test", None, "williams", 1),
        ("R2", "test", None, "williams", 2),
        ("R1", "retest", None, "williams", 1),
        ("R2", "retest", None, "williams", 2),
    ]
    kept = read_schedule(study.schedule_file("R2", "retest"))
    assert (kept.row, kept.site) == (2, None)
    assert kept == draw_schedule(protocol, "R2", "retest", secret=SECRET, row=2)
    assert broken(study, protocol) == []


def test_a_late_rater_gets_the_next_row_wherever_the_protocol_has_the_name(
    study: StudyPaths,
) -> None:
    allot_schedules(study, williams())
    record_standing(study, williams(), "R1", "withdrawn", who="MK", why="moved away")
    later = williams(raters=("R0", "R1", "R2"))
    written = allot_schedules(study, later)
    assert [path.name for path in written] == ["test_R0_sheet.csv", "test_R0.csv"]
    assert allotted(study)[-1] == ("R0", "test", None, "williams", 3)
    assert broken(study, later) == []


def test_asking_again_changes_nothing_and_a_redraw_keeps_the_rows(
    study: StudyPaths,
) -> None:
    allot_schedules(study, williams())
    log = study.conduct_file.read_bytes()
    rows = allotted(study)
    assert allot_schedules(study, williams()) == ()
    study.schedule_file("R2", "test").unlink()
    assert len(allot_schedules(study, williams())) == 2
    assert study.conduct_file.read_bytes() == log
    changed = williams(seed=2)
    with pytest.raises(ScheduleError, match="2 of 2 schedules are stale"):
        allot_schedules(study, changed)
    allot_schedules(study, changed, redraw=True)
    assert allotted(study) == rows
    assert read_schedule(study.schedule_file("R2", "test")).row == 2


def test_nothing_is_allotted_where_the_draw_is_refused(study: StudyPaths) -> None:
    protocol = williams()
    study.sessions.mkdir()
    study.log_file("R1", "test").write_text("{}\n")
    with pytest.raises(ScheduleError, match="session has begun"):
        allot_schedules(study, protocol)
    assert not study.conduct_file.exists()
    assert not study.schedules.exists()


def test_each_site_has_rows_and_a_secret_of_its_own(study: StudyPaths) -> None:
    protocol = at_sites()
    allot_schedules(study, protocol)
    assert allotted(study) == [
        ("R1", "test", "north", "williams", 1),
        ("R2", "test", "south", "williams", 1),
        ("R3", "test", "north", "williams", 2),
        ("R4", "test", "south", "williams", 2),
    ]
    schedules = [read_schedule(study.schedule_file(r, "test")) for r in RATERS]
    assert len({schedule.commitment for schedule in schedules}) == 1
    assert [schedule.site for schedule in schedules] == list(SITES.values())
    assert broken(study, protocol) == []
    # derived by hand: the first 16 bytes of an HMAC-SHA256 of the site's id
    south = hmac.new(SECRET, b'["masrel","site","south"]', "sha256").digest()[:16]
    plain = protocol_of(raters=RATERS, sites=SITES)
    sited = protocol_of(raters=RATERS, sites=SITES, strata="site")
    drawn = draw_schedule(sited, "R2", "test", secret=SECRET)
    of_site = draw_schedule(plain, "R2", "test", secret=south)
    assert drawn.presentations == of_site.presentations
    assert drawn.commitment != of_site.commitment


def test_a_rater_who_changes_site_has_no_schedule_until_it_is_drawn_anew(
    study: StudyPaths,
) -> None:
    allot_schedules(study, at_sites())
    moved = at_sites(sites={**SITES, "R1": "south"})
    (problem, *_) = schedule_problems(moved, study)
    assert problem.endswith("needed one drawn for site south, got one for north")
    allot_schedules(study, moved, redraw=True)
    assert allotted(study)[-1] == ("R1", "test", "south", "williams", 3)
    assert broken(study, moved) == []


def forge(study: StudyPaths, before: str, after: str) -> None:
    """Change the row in a schedule's file."""
    file = study.schedule_file("R1", "test")
    text = file.read_text(encoding="utf-8")
    assert before in text
    file.write_text(text.replace(before, after), encoding="utf-8")


def test_another_row_than_the_log_has_is_found(study: StudyPaths) -> None:
    protocol = williams()
    allot_schedules(study, protocol)
    other = draw_schedule(protocol, "R1", "test", secret=SECRET, row=2)
    mine = draw_schedule(protocol, "R1", "test", secret=SECRET, row=1)
    forge(study, "# row: 1", "# row: 2")
    (first, second) = broken(study, protocol)
    assert "needed the order and codes that the study's secret draws" in first
    assert "test_R1.csv: needed row 1, by" in second
    # ... and with the order of that row, too, when only the log says otherwise
    for shown, instead in zip(mine.presentations, other.presentations, strict=True):
        forge(
            study,
            f"\n{shown.position},{shown.code},{shown.model},",
            f"\n{shown.position},{shown.code},{instead.model},",
        )
    assert schedule_problems(protocol, study) == ()
    (only,) = broken(study, protocol)
    assert only.endswith("got row 2")


def rewritten(study: StudyPaths, change: dict[str, object]) -> None:
    """Write the log anew, its chain whole, with a changed last event."""
    from masrel.lab._event_log import SessionLog, read_log

    events = read_log(study.conduct_file)
    study.conduct_file.unlink()
    with SessionLog.open(study.conduct_file) as log:
        for event in events[:-1]:
            log.append(event.kind, dict(event.fields))
        log.append(events[-1].kind, {**events[-1].fields, **change})


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            {"row": 5},
            "line 4: allotted: rater R2 in session test: needed row 2, the next one, "
            "got 5",
        ),
        (
            {"rater": "R1"},
            "line 4: allotted: rater R1 in session test: needed a rater without a row, "
            "got one with row 1",
        ),
    ],
)
def test_a_log_that_allots_no_next_row_is_found(
    study: StudyPaths, change: dict[str, object], sentence: str
) -> None:
    protocol = williams()
    allot_schedules(study, protocol)
    rewritten(study, change)
    assert f"{study.conduct_file}: {sentence}" in broken(study, protocol)


def test_a_schedule_whose_row_no_event_has_is_found(study: StudyPaths) -> None:
    protocol = williams()
    allot_schedules(study, protocol)
    study.conduct_file.unlink()
    first, second = broken(study, protocol)
    assert "test_R1.csv: needed a row that was allotted, by" in first
    assert "test_R2.csv" in second


def test_a_changed_line_of_the_log_stops_the_draw(study: StudyPaths) -> None:
    allot_schedules(study, williams())
    edit(study.conduct_file, '"row": 1', '"row": 3')
    with pytest.raises(SessionLogError, match="line 4: needed previous"):
        allot_schedules(study, williams(raters=("R1", "R2", "R3")))


def test_a_site_draws_from_its_secret_what_the_study_draws_for_it(
    study: StudyPaths, tmp_path: Path
) -> None:
    protocol, copy = at_sites(), StudyPaths(tmp_path / "south")
    study.protocol.write_text("# ...", encoding="utf-8")
    copy_for_site(protocol, study, "south", copy.root)
    files = {path for path in copy.root.rglob("*") if path.is_file()}
    assert files == {copy.protocol, copy.secret_file}
    if os.name == "posix":  # a protocol may have fields of raters that are not public
        assert {path.stat().st_mode & 0o077 for path in files} == {0}
    assert SECRET.hex() not in copy.secret_file.read_text(encoding="utf-8")
    allot_schedules(copy, protocol, site="south")
    allot_schedules(study, protocol)
    for rater in ("R2", "R4"):
        file = study.schedule_file(rater, "test")
        assert copy.schedule_file(rater, "test").read_bytes() == file.read_bytes()
    assert broken(copy, protocol) == []
    assert concealment_notes(protocol, copy) == ()
    with pytest.raises(ScheduleError, match="needed that of north, got that of site"):
        allot_schedules(copy, protocol)
    assert "R1" not in [fields[0] for fields in allotted(copy)]
    # once the study's secret is published, it is the one of the site's
    copy.published_secret_file.write_bytes(study.published_secret_file.read_bytes())
    assert broken(copy, protocol) == []
    with_secret(copy, bytes(16))
    (problem, *_) = broken(copy, protocol)
    assert "published_secret.txt: needed the secret of" in problem


def test_an_event_that_two_logs_have_allots_once(study: StudyPaths) -> None:
    # a study that was copied after the draw, and merged with its copy
    protocol = williams()
    allot_schedules(study, protocol)
    study.merged_conduct.mkdir()
    (study.merged_conduct / "a.jsonl").write_bytes(study.conduct_file.read_bytes())
    later = williams(raters=("R1", "R2", "R3"))
    allot_schedules(study, later)
    assert allotted(study)[-1] == ("R3", "test", None, "williams", 3)
    assert not [problem for problem in broken(study, later) if "row" in problem]


def test_two_copies_that_dealt_one_row_are_found(
    study: StudyPaths, tmp_path: Path
) -> None:
    copy = with_secret(StudyPaths(tmp_path / "copy"))
    for each, raters in ((study, ("R1", "R2")), (copy, ("R3", "R4"))):
        allot_schedules(each, williams(raters=raters))
    study.merged_conduct.mkdir()
    (study.merged_conduct / "a.jsonl").write_bytes(copy.conduct_file.read_bytes())
    problems = broken(study, williams())
    (second,) = [each for each in problems if "needed row 3, the next one" in each]
    # the log of the copy, not that of the study that it was merged into
    logs = (study.conduct_file, study.merged_conduct / "a.jsonl")
    assert second.startswith(tuple(f"{log}: line 3: allotted: rater" for log in logs))
    allotted_by = {log: log.read_text() for log in logs}
    rater = second.partition("rater ")[2].partition(" ")[0]
    assert f'"{rater}"' in allotted_by[Path(second.partition(": line")[0])]
