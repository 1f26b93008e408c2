"""Protocol to report on the simulated device, as a user gets it."""

import csv
import json
import re
from pathlib import Path

import pytest

from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.recording import read_recording
from masrel.lab.run import read_log
from masrel.lab.schedule import read_schedule
from masrel.lab.verification import verify_study
from tests.lab.flow.conftest import run

TIMES_OF_DAY = re.compile(rb'"time_utc": ?"[^"]*"|"previous": ?"[^"]*"')


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below a folder; in logs, times of day and the hashes over them cut."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            data = path.read_bytes()
            if path.suffix == ".jsonl":
                data = TIMES_OF_DAY.sub(b"", data)
            found[str(path.relative_to(folder))] = data
    return found


def test_every_stage_left_its_file(small_demo: Path) -> None:
    study = StudyPaths(small_demo / "study")
    protocol = read_protocol(study.protocol)
    for session in protocol.sessions:
        for rater in session.raters:
            schedule = read_schedule(study.schedule_file(rater, session.id))
            assert study.sheet_file(rater, session.id).is_file()
            events = read_log(study.log_file(rater, session.id))
            graded = [e for e in events if e.kind == "grade"]
            assert len(graded) == len(schedule.presentations) == len(protocol.models)
            for shown in schedule.presentations:
                file = study.recording_file(rater, session.id, shown.code)
                assert read_recording(file).facts["simulated"] is True
    assert study.analysis_file.is_file()


def test_the_report_and_every_table_say_simulated(small_demo: Path) -> None:
    report = small_demo / "report-simulated"
    tables = sorted(report.rglob("*.csv"))
    assert tables
    for path in [*report.glob("*.html"), *report.glob("*.md"), *tables]:
        assert "simulated" in path.read_text(encoding="utf-8").lower(), path
    analysis = json.loads((small_demo / "study" / "analysis.json").read_text())
    assert analysis["simulated"] is True


def test_its_report_shows_how_it_was_conducted(small_demo: Path) -> None:
    page = (small_demo / "report-simulated" / "report.md").read_text(encoding="utf-8")
    _, conduct = page.split("## Conduct\n")
    assert "| 2012-01-01 | adverse-event | R1 | test | simulated: sore " in conduct
    assert "**Simulated data.** What happened beside the sessions" in conduct


@pytest.mark.slow
def test_a_study_whose_orders_have_rows_is_run_too(tmp_path: Path) -> None:
    run("demo", str(tmp_path / "out"), "--study", "two-sites", "--quiet")
    assert verify_study(StudyPaths(tmp_path / "out" / "study")).is_whole


def test_the_ratings_are_the_grades_of_the_logs(small_demo: Path) -> None:
    study = StudyPaths(small_demo / "study")
    text = study.ratings_file.read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(line for line in text if not line.startswith("#")))
    table = {(row["session"], row["rater"], row["model"]): row["grade"] for row in rows}
    protocol = read_protocol(study.protocol)
    for session in protocol.sessions:
        for rater in session.raters:
            schedule = read_schedule(study.schedule_file(rater, session.id))
            model = {shown.code: shown.model for shown in schedule.presentations}
            for event in read_log(study.log_file(rater, session.id)):
                if event.kind == "grade":
                    key = (session.id, rater, model[event.fields["code"]])
                    assert table.pop(key) == event.fields["grade"]
    assert table == {}


def test_running_it_again_gives_the_same_bytes(
    small_demo: Path, tmp_path: Path
) -> None:
    run("demo", str(tmp_path / "again"), "--study", "small", "--quiet")
    assert contents(tmp_path / "again") == contents(small_demo)


def test_a_folder_in_use_is_refused(small_demo: Path) -> None:
    from masrel.errors import ParameterError

    with pytest.raises(ParameterError, match="new or empty folder"):
        run("demo", str(small_demo))


# One run of it is held against stored hashes by tests/golden.
@pytest.mark.long
def test_the_whole_published_study_repeats_byte_for_byte(tmp_path: Path) -> None:
    run("demo", str(tmp_path / "a"), "--quiet")
    run("demo", str(tmp_path / "b"), "--quiet")
    first, second = contents(tmp_path / "a"), contents(tmp_path / "b")
    assert first.keys() == second.keys()
    assert [name for name in first if first[name] != second[name]] == []
    assert "report-published/report.html" in first
