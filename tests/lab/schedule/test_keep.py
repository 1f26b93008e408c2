"""Schedules are drawn once: kept byte for byte, refused when stale, never lost."""

import hashlib
from pathlib import Path

import msgspec
import pytest

from masrel.errors import ScheduleError
from masrel.lab.protocol import (
    ElbowConstants,
    Protocol,
    Stretch,
    StudyPaths,
    presented_hash,
)
from masrel.lab.schedule.presentation import draw_schedule, read_schedule
from masrel.lab.schedule.sheets import schedule_problems, write_schedules
from tests.lab.schedule.studies import SECRET, protocol_of, with_secret


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    return with_secret(StudyPaths(tmp_path))


@pytest.fixture
def drawn(study: StudyPaths) -> Protocol:
    """A protocol whose schedules lie in the study."""
    protocol = protocol_of()
    write_schedules(protocol, study)
    return protocol


def contents(study: StudyPaths) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in study.schedules.iterdir()}


def test_each_rater_gets_a_schedule_and_a_sheet(study: StudyPaths) -> None:
    protocol = protocol_of()
    written = write_schedules(protocol, study)
    content, *schedules = sorted(path.name for path in written)
    assert content == f"presented_{presented_hash(protocol)[:12]}.json"
    assert schedules == [
        "test_R1.csv",
        "test_R1_sheet.csv",
        "test_R2.csv",
        "test_R2_sheet.csv",
    ]
    for rater in ("R1", "R2"):
        kept = read_schedule(study.schedule_file(rater, "test"))
        assert kept == draw_schedule(protocol, rater, "test", secret=SECRET)


def test_a_sheet_reveals_neither_model_nor_grade_nor_seed(study: StudyPaths) -> None:
    names = ("HM1", "HM2", "ZEBRA", "D01")
    protocol = protocol_of(models=names, seed=987654321)
    write_schedules(protocol, study)
    shown = read_schedule(study.schedule_file("R1", "test")).presentations
    text = study.sheet_file("R1", "test").read_text(encoding="utf-8")
    expected = [f"{place},{each.code}," for place, each in enumerate(shown, start=1)]
    assert text.splitlines() == ["# format: 1", "position,code,grade", *expected]
    for secret in (*names, "1+", "987654321", "standard"):
        assert secret not in text


def test_drawing_again_writes_nothing(drawn: Protocol, study: StudyPaths) -> None:
    before = contents(study)
    assert write_schedules(drawn, study) == ()
    assert write_schedules(drawn, study, redraw=True) == ()
    assert contents(study) == before


@pytest.mark.usefixtures("drawn")
def test_a_new_rater_gets_files_and_the_others_keep_theirs(
    study: StudyPaths,
) -> None:
    before = contents(study)
    log_of(study, "R1")
    more = protocol_of(raters=("R0", "R1", "R2"))
    written = write_schedules(more, study)
    assert {path.name for path in written} == {"test_R0.csv", "test_R0_sheet.csv"}
    assert {name: contents(study)[name] for name in before} == before


@pytest.mark.usefixtures("drawn")
def test_a_changed_protocol_is_refused_and_nothing_is_written(
    study: StudyPaths,
) -> None:
    before = contents(study)
    with pytest.raises(ScheduleError) as caught:
        write_schedules(protocol_of(seed=2, raters=("R1", "R2", "R3")), study)
    assert str(caught.value) == (
        f"{study.protocol}: schedule.seed was 1 and is 2 since the draw: 2 of 3 "
        "schedules are stale; --redraw draws again those whose sessions have not begun"
    )
    assert contents(study) == before


CHANGED = [
    (protocol_of(seed=2, repeats=3), "schedule.repeats was 1 and is 3, schedule.seed"),
    (
        protocol_of(models=("HM1", "HM2", "HM4")),
        'models was ["HM1", "HM2", "HM3", "HM4"] and is ["HM1", "HM2", "HM4"] since',
    ),
    (
        protocol_of(models=("HM1", "HM2", "HM4", "HM3")),
        'models was ["HM1", "HM2", "HM3", "HM4"] and is ["HM1", "HM2", "HM4", "HM3"] ',
    ),
    (
        msgspec.structs.replace(protocol_of(), stretch=Stretch(largest_speed_deg_s=90)),
        "stretch.largest_speed_deg_s was not set and is 90",
    ),
    (
        msgspec.structs.replace(
            protocol_of(),
            elbow=ElbowConstants(
                damping_nms_rad=1.0,
                stiffness_nm_rad=1.0,
                catch_slope_s=0.1,
                peak_duration_s=0.2,
                range_end_deg=140.0,
                catch_rise_s=0.1,
            ),
        ),
        "elbow.damping_nms_rad was 1.26 and is 1.0, elbow.peak",
    ),
]


@pytest.mark.parametrize(("protocol", "sentence"), CHANGED)
def test_a_change_is_one_sentence_with_key_old_value_and_new_one(
    study: StudyPaths, protocol: Protocol, sentence: str
) -> None:
    write_schedules(protocol_of(), study)
    (problem,) = schedule_problems(protocol, study)
    assert sentence in problem
    assert problem.endswith("since the draw: 2 of 2 schedules are stale")


def test_what_was_presented_is_kept_once_and_by_its_hash(study: StudyPaths) -> None:
    write_schedules(protocol_of(raters=("R1",)), study)
    (file,) = study.schedules.glob("presented_*.json")
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    assert digest == presented_hash(protocol_of())
    written = write_schedules(protocol_of(), study)
    assert [path.name for path in written] == ["test_R2_sheet.csv", "test_R2.csv"]
    file.write_bytes(b"{}")  # another is not believed, one that is gone not needed
    for _ in range(2):
        (problem,) = schedule_problems(protocol_of(seed=2), study)
        assert "a key of the study id, scale, elbow, models" in problem
        file.unlink(missing_ok=True)


def test_a_redraw_follows_the_changed_protocol(
    drawn: Protocol, study: StudyPaths
) -> None:
    changed = protocol_of(seed=2)
    assert len(write_schedules(changed, study, redraw=True)) == 5
    kept = read_schedule(study.schedule_file("R2", "test"))
    assert kept == draw_schedule(changed, "R2", "test", secret=SECRET)
    before = draw_schedule(drawn, "R2", "test", secret=SECRET)
    assert kept.presentations != before.presentations
    assert schedule_problems(changed, study) == ()


def log_of(study: StudyPaths, rater: str) -> Path:
    log = study.log_file(rater, "test")
    log.parent.mkdir(exist_ok=True)
    log.write_text("{}\n")
    return log


@pytest.mark.usefixtures("drawn")
def test_a_session_that_has_begun_is_never_redrawn(study: StudyPaths) -> None:
    before = contents(study)
    log = log_of(study, "R2")
    with pytest.raises(ScheduleError, match="session has begun") as caught:
        write_schedules(protocol_of(seed=2), study, redraw=True)
    assert str(log) in str(caught.value)
    assert contents(study) == before  # R1's, too: all or nothing


def test_a_lost_schedule_of_a_begun_session_is_not_made_up(
    drawn: Protocol, study: StudyPaths
) -> None:
    log_of(study, "R1")
    study.schedule_file("R1", "test").unlink()
    with pytest.raises(ScheduleError, match=r"got none.*session has begun"):
        write_schedules(drawn, study)


@pytest.mark.usefixtures("drawn")
def test_grades_on_a_sheet_are_not_overwritten(study: StudyPaths) -> None:
    sheet = study.sheet_file("R1", "test")
    text = sheet.read_text(encoding="utf-8").replace(",\n", ",1+\n", 1)
    sheet.write_text(text, encoding="utf-8")
    with pytest.raises(ScheduleError, match="has grades on it"):
        write_schedules(protocol_of(seed=2), study, redraw=True)
    assert sheet.read_text(encoding="utf-8") == text


def test_a_lost_sheet_is_written_from_the_schedule(
    drawn: Protocol, study: StudyPaths
) -> None:
    before = contents(study)
    sheet = study.sheet_file("R1", "test")
    sheet.unlink()
    assert write_schedules(drawn, study) == (sheet,)
    assert contents(study) == before


def test_a_damaged_schedule_is_refused_until_redrawn(
    drawn: Protocol, study: StudyPaths
) -> None:
    path = study.schedule_file("R1", "test")
    whole = path.read_bytes()
    path.write_bytes(whole[:-20])
    with pytest.raises(ScheduleError, match=f"{path.name}: "):
        write_schedules(drawn, study)
    assert write_schedules(drawn, study, redraw=True) == (
        study.sheet_file("R1", "test"),
        path,
    )
    assert path.read_bytes() == whole


def test_a_schedule_under_another_raters_name_is_found(
    drawn: Protocol, study: StudyPaths
) -> None:
    path = study.schedule_file("R1", "test")
    path.write_bytes(study.schedule_file("R2", "test").read_bytes())
    (problem,) = schedule_problems(drawn, study)
    assert problem == (
        f"{path}: needed the schedule of rater R1 in session test, got that of R2 in "
        "test"
    )


def test_a_sheet_with_other_codes_and_a_file_of_nobody_are_found(
    drawn: Protocol, study: StudyPaths
) -> None:
    sheet = study.sheet_file("R1", "test")
    sheet.write_bytes(study.sheet_file("R2", "test").read_bytes())
    stray = study.schedules / "test_R7.csv"
    stray.write_text("x")
    problems = schedule_problems(drawn, study)
    assert [text.split(": ")[0] for text in problems] == [str(sheet), str(stray)]
