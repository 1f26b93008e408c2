"""Sites of one study become one, byte for byte, or are refused by name."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import MasrelError, ParameterError, ScheduleError
from masrel.lab.conduct import (
    Note,
    excluded_raters,
    read_conduct,
    record_note,
    record_standing,
)
from masrel.lab.conduct._calibrations import write_calibration
from masrel.lab.merging import merge_studies
from masrel.lab.paper._printing import write_sheets
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.ratings import ratings_from_logs
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from masrel.lab.training._trainer import SimulatedTrainee, train_rater
from masrel.lab.verification import anchors_of, verify_study
from tests.files import contents, edit
from tests.lab.cli.test_train import RULES
from tests.lab.run.test_calibrations import calibration
from tests.lab.script import ScriptGrades

NewStudy = Callable[..., tuple[StudyPaths, Protocol]]
Sites = tuple[StudyPaths, StudyPaths]
RATERS = '[[raters]]\nid = "R1"\n\n[[raters]]\nid = "R2"\n'
FIELDS = """
[rater_fields.since]
type = "date"
[rater_fields.place]
type = "text"
"""
SESSIONS = '[[sessions]]\nid = "retest"\nraters = ["R1"]\n\n'


def run(study: StudyPaths, *raters: str) -> None:
    protocol = read_protocol(study.protocol)
    for rater in raters:
        grades = ScriptGrades(["1", "2", "3"])
        run_session(study, protocol, rater, "test", grades=grades, clock="simulated")


def site(new_study: NewStudy, name: str, raters: str, *more: tuple[str, str]) -> Path:
    ids = raters.split()
    entries = "".join(f'[[raters]]\nid = "{rater}"\n\n' for rater in ids)
    listed = ", ".join(f'"{rater}"' for rater in ids)
    study, _ = new_study(
        (RATERS, entries),
        ('raters = ["R1", "R2"]', f"raters = [{listed}]"),
        (SESSIONS, ""),
        *more,
        name=name,
    )
    return study.root


@pytest.fixture
def sites(new_study: NewStudy) -> Sites:
    north = StudyPaths(site(new_study, "north", "R1 R2"))
    south = StudyPaths(site(new_study, "south", "R2 R3 R4"))  # R2 never comes to it
    run(north, "R2")
    run(south, "R3")
    return north, south


def test_all_raters_logs_and_recordings_come_over(sites: Sites, tmp_path: Path) -> None:
    before = [contents(study.root) for study in sites]
    unused = {"schedules/test_R2.csv"}  # of another draw than R2 followed
    merged = merge_studies(sites, tmp_path / "both")
    assert [contents(study.root) for study in sites] == before  # nothing is changed
    after = contents(tmp_path / "both")
    for of_site, others in zip(before, (set(), unused), strict=True):
        for name, data in of_site.items():
            is_copied = name.startswith(("schedules/", "sessions/"))
            assert (after.get(name) == data) == (is_copied and name not in others), name
    protocol = read_protocol(merged.protocol)
    assert [rater.id for rater in protocol.raters] == ["R1", "R2", "R3", "R4"]
    assert verify_study(merged).is_whole
    ratings = ratings_from_logs(merged, protocol)
    assert ratings.table["rater"].unique().tolist() == ["R2", "R3"]
    assert not [name for name in after if "secret" in name or name.startswith(".")]
    run(merged, "R4")  # the study goes on in the new folder
    assert merged.sessions.stat().st_mode & 0o077 == 0


@pytest.mark.slow
def test_what_is_no_rating_comes_over_too(sites: Sites, tmp_path: Path) -> None:
    for study, rater in zip(sites, ("R2", "R3"), strict=True):
        with study.protocol.open("a", encoding="utf-8") as file:
            file.write(RULES)
        write_calibration(study, calibration(days=1 if rater == "R2" else 2))
        protocol = read_protocol(study.protocol)
        grades = SimulatedGrades(protocol)
        for rehearsing in (rater, "R2"):
            place = (study, protocol, rehearsing, "test")
            run_session(*place, grades=grades, clock="simulated", rehearsal=True)
        write_sheets(study, protocol)
    trainee = SimulatedTrainee(protocol)
    train_rater(study, protocol, rater, grades=trainee, clock="simulated")
    filled_in = sites[0].typed_file("R1", "test")
    edit(filled_in, ",\n", ",2\n")
    study.published_answers_file.parent.mkdir()
    study.published_answers_file.write_text("as it was", encoding="utf-8")
    before = [contents(study.root) for study in sites]
    merged = merge_studies(sites, tmp_path / "both")
    after = contents(merged.root)
    # R2 rehearsed at both sites: the second one has the next number
    logs = [n for n in after if n.startswith("rehearsals/") and n.endswith(".jsonl")]
    names = "1/rehearsal_test_R2", "2/rehearsal_test_R2"
    moved = "3/rehearsal_test_R2", "3/rehearsal_test_R3"
    assert sorted(logs) == [f"rehearsals/{name}.jsonl" for name in (*names, *moved)]
    for of_site, number in zip(before, ("1", "3"), strict=True):
        for name, content in of_site.items():
            if name.startswith(("training/", "rehearsals/1")):
                assert after[name.replace("s/1/", f"s/{number}/")] == content
    assert after["ratings/published_answers.csv"] == b"as it was"
    # without them the recordings of rehearsals and of the training were not whole
    assert sum(name.startswith("calibrations/") for name in after) == 2
    # a sheet in which nothing was typed is made again
    assert [n for n in after if n.startswith("sheets/")] == ["sheets/test_R1.csv"]
    verification = verify_study(merged)
    assert verification.is_whole
    assert [each.rater for each in verification.trainings] == ["R3"]
    private = (merged.training, merged.rehearsals)
    assert {path.stat().st_mode & 0o077 for path in private} == {0}


def test_both_chains_of_conduct_stay_whole(sites: Sites, tmp_path: Path) -> None:
    north, south = sites
    record_note(north, read_protocol(north.protocol), Note(text="power cut", who="MK"))
    record_standing(
        south, read_protocol(south.protocol), "R3", "excluded", who="AB", why="ill"
    )
    merged = merge_studies(sites, tmp_path / "both")
    for study in sites:
        copied = merged.merged_conduct / f"{study.root.name}.jsonl"
        assert copied.read_bytes() == study.conduct_file.read_bytes()
    assert excluded_raters(merged) == ("R3",)
    kinds = [event.kind for event in read_conduct(merged)]
    assert kinds == ["noted", "excluded", "merged", "merged"]
    anchored = [anchor.log.removeprefix("conduct") for anchor in anchors_of(merged)]
    assert anchored[:3] == ["/north.jsonl", "/south.jsonl", ".jsonl"]
    # an event changed at the end of a merged log, or taken off, leaves its chain whole
    log = merged.merged_conduct / "south.jsonl"
    changed = log.read_bytes().replace(b'"ill"', b'"fit"')
    for content in (changed, b"".join(changed.splitlines(keepends=True)[:-1])):
        log.write_bytes(content)
        assert "south.jsonl: needed 2 lines" in findings(merged)
    log.unlink()
    assert "needed the log of a merged study" in findings(merged)


def findings(study: StudyPaths) -> str:
    return " ".join(finding.message for finding in verify_study(study).findings)


@pytest.mark.slow
def test_a_merged_study_is_merged_with_a_third(
    sites: Sites, new_study: NewStudy, tmp_path: Path
) -> None:
    protocol = read_protocol(sites[0].protocol)
    record_note(sites[0], protocol, Note(text="power cut", who="MK"))
    both = merge_studies(sites, tmp_path / "both")
    west = StudyPaths(site(new_study, "west", "R5"))
    run(west, "R5")
    merged = merge_studies([both, west], tmp_path / "all")
    assert verify_study(merged).is_whole
    names = sorted(path.name for path in merged.merged_conduct.iterdir())
    assert names == ["both.jsonl", "north.jsonl"]
    # one protocol at both sites is kept as it is
    east = StudyPaths(site(new_study, "east", "R5"))
    merged = merge_studies([west, east], tmp_path / "same")
    assert merged.protocol.read_bytes() == west.protocol.read_bytes()
    assert len(merged.logs()) == 1


def test_every_kind_of_value_in_a_protocol_comes_through(
    new_study: NewStudy, tmp_path: Path
) -> None:
    both = (
        (
            "catch_travel_deg = 40.0",
            "catch_travel_deg = 40.0\nconstants = {damping_nms_rad = 1e-3}",
        ),
        (
            "[schedule]",
            f'{FIELDS}[presentation]\nstretches = ["slow", "fast"]\n[schedule]',
        ),
    )
    values = '[raters.fields]\nsince = 2001-02-03\nplace = "a \\"b\\" \\u00e9\\n"\n'
    north = StudyPaths(site(new_study, "north", "R1 R2", *both))
    south = StudyPaths(
        site(new_study, "south", "R3", *both, ('id = "R3"\n', f'id = "R3"\n{values}'))
    )
    merged = read_protocol(merge_studies([north, south], tmp_path / "both").protocol)
    first, second = (read_protocol(study.protocol) for study in (north, south))
    assert merged.raters == first.raters + second.raters
    assert (merged.models, merged.presentation) == (first.models, first.presentation)


def refusal(sites: Sites, out: Path, kind: type[MasrelError]) -> str:
    with pytest.raises(kind) as caught:
        merge_studies(sites, out)
    assert not [p for p in out.parent.iterdir() if p.name.startswith(".masrel")]
    assert not out.exists()
    return str(caught.value)


def test_another_secret_is_refused(
    sites: Sites, new_study: NewStudy, tmp_path: Path
) -> None:
    from masrel.lab.schedule.sheets import write_schedules

    east = StudyPaths(site(new_study, "east", "R5"))
    for file in (*east.schedules.glob("*.csv"), east.secret_file):
        file.unlink(missing_ok=True)
    east.published_secret_file.unlink(missing_ok=True)
    write_schedules(read_protocol(east.protocol), east)
    message = refusal((sites[0], east), tmp_path / "both", ScheduleError)
    assert "test_R5.csv: commitment: needed that of " in message


@pytest.mark.slow
def test_a_record_that_is_broken_is_refused(sites: Sites, tmp_path: Path) -> None:
    log = sites[1].log_file("R3", "test")
    log.write_bytes(log.read_bytes().replace(b'"attempt": 1', b'"attempt": 2'))
    message = refusal(sites, tmp_path / "both", ParameterError)
    assert message.startswith(f"{sites[1].root}: needed a record that is whole")


@pytest.mark.slow
def test_another_place_and_other_studies_are_refused(
    sites: Sites, tmp_path: Path
) -> None:
    north, both = sites[0], tmp_path / "both"
    run(sites[1], "R2")
    for studies, place, message in (
        (sites, north.root, "needed a new or empty folder"),
        (sites, north.root / "both", "needed a folder outside"),
        (sites[:1], both, "needed two or more, got 1"),
        ([north, north], both, "got one twice"),
        (sites, both, "^rater R2: needed sessions in one of the studies, got "),
    ):
        with pytest.raises(ParameterError, match=message):
            merge_studies(studies, place)
    assert not both.exists()


@pytest.mark.slow
def test_a_full_disk_leaves_nothing(
    sites: Sites, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_space(_: int) -> None:
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(OSError, match="No space left"):
        merge_studies(sites, tmp_path / "both")
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".masrel")]


def test_what_is_merged_is_its_owners_alone(
    sites: Sites, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for study in sites:
        note = Note(text="ill", who="MK", rater="R2")
        record_note(study, read_protocol(study.protocol), note)
    for path in sites[0].root.rglob("*"):  # as after a copy from elsewhere
        path.chmod(0o777 if path.is_dir() else 0o666)
    ever_open, original = [], os.write

    def write(descriptor: int, data: bytes | memoryview) -> int:
        ever_open.append(os.fstat(descriptor).st_mode & 0o077)
        return original(descriptor, data)

    monkeypatch.setattr(os, "write", write)
    umask = os.umask(0)
    try:
        merged = merge_studies(sites, tmp_path / "both")
    finally:
        os.umask(umask)
    modes = {path: path.stat().st_mode & 0o777 for path in merged.root.rglob("*")}
    assert set(modes.values()) == {0o600, 0o700}
    assert {modes[path] for path in merged.conduct_logs()} == {0o600}
    assert modes[merged.merged_conduct] == 0o700
    assert set(ever_open) == {0}  # nor while they are written
    log = merged.merged_conduct / "north.jsonl"
    said = []
    for mode in (0o600, 0o644):
        log.chmod(mode)
        shown = CliRunner().invoke(cli, ["check", str(merged.root)]).output
        said.append([line for line in shown.splitlines() if "chmod" in line])
    assert said[0] == []
    (note,) = said[1]
    assert f"{log}: " in note
    assert f"chmod 600 {log}" in note
