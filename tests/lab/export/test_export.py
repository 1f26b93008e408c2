"""Exports are valid by the validators of their forms, and give the same numbers."""

import csv
import gzip
import hashlib
import json
import re
import shutil
import subprocess
import sys
from datetime import date
from pathlib import Path

import pytest
from rocrate.rocrate import ROCrate

from masrel.lab.analysis import analyze, as_analysis_document
from masrel.lab.conduct import record_standing
from masrel.lab.export import EXPORT_FORMS, export_study
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.ratings import read_study_data
from masrel.lab.report._conduct import study_conduct
from masrel.lab.report._document import write_report
from masrel.lab.run._corrections import record_correction
from masrel.lab.run.session import run_session
from masrel.lab.schedule.presentation import read_schedule
from masrel.lab.schedule.sheets import write_schedules
from tests.lab.run.conftest import PROTOCOL
from tests.lab.schedule.studies import with_secret
from tests.lab.script import ScriptGrades

Study = tuple[StudyPaths, Protocol]

PLAN = """
[[analysis.estimates]]
id = "kappa"
kind = "inter-rater"
coefficient = "fleiss_kappa"
models = "all"
sessions = ["test"]
target = "items"
interval = "jackknife"

[report]
sections = ["agreement", "grades"]
"""
ALL = ("notes", "logs", "illness", "after.secret")
SECRETS = (b"very private", b"private, too", b"Somebody Private", b"a private reason")
FIELDS = """
[rater_fields.years]
type = "whole"
unit = "a"
title = "Years of practice"
public = true

[rater_fields.illness]
type = "text"
"""
ANSWERS = {"after.real": 7, "after.secret": "a private answer\n# on two lines"}
QUESTIONS = """
[[questionnaires]]
id = "after"
title = "After it"
when = "presentation"
[[questionnaires.questions]]
id = "real"
text = "How real?"
type = "whole"
low = 1
high = 10
public = true
[[questionnaires.questions]]
id = "secret"
text = "What else?"
type = "text"
required = false
"""
NOTE = (
    '[[raters]]\nid = "R2"',
    '[[raters]]\nid = "R2"\nnote = "very private"\n'
    'fields = { years = 7, illness = "private, too" }',
)


@pytest.fixture(scope="module")
def rated(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Two sessions with grades, a note on a rater, and a correction; only read."""
    study = StudyPaths(tmp_path_factory.mktemp("export") / "study")
    study.root.mkdir()
    text = f"{PROTOCOL.replace(*NOTE)}\n{FIELDS}\n{QUESTIONS}\n{PLAN}"
    study.protocol.write_text(text, encoding="utf-8")
    protocol = read_protocol(study.protocol)
    with_secret(study)
    write_schedules(protocol, study)
    for rater, of_dummy in (("R1", "1+"), ("R2", "2")):
        grades = {"HM1": "1", "HM3": "2", "D1": of_dummy}
        schedule = read_schedule(study.schedule_file(rater, "test"))
        of_code = {shown.code: grades[shown.model] for shown in schedule.presentations}
        codes = {shown.model: shown.code for shown in schedule.presentations}
        run_session(
            study,
            protocol,
            rater,
            "test",
            grades=ScriptGrades(of_code, answers=ANSWERS),
            clock="simulated",
        )
    record_correction(
        study,
        protocol,
        "R2",
        "test",
        code=codes["D1"],
        grade="3",
        who="Somebody Private",
        why="a private reason",
    )
    return study, protocol


def exported(study: Study, form: str, folder: Path, **options: object) -> Path:
    export_study(*study, form, folder, **options)  # type: ignore[arg-type]
    return folder


@pytest.fixture(scope="module")
def bids(rated: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return exported(rated, "bids", tmp_path_factory.mktemp("bids") / "out")


def contents(folder: Path) -> dict[str, bytes]:
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    data = {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
    return {n: gzip.decompress(d) if n.endswith("gz") else d for n, d in data.items()}


def numbers(study: StudyPaths) -> str:
    protocol = read_protocol(study.protocol)
    data = read_study_data(study, protocol)
    document = as_analysis_document(
        analyze(protocol, data.ratings, in_person=data.in_person)
    )
    text = json.dumps(document)  # nan is nan, every digit counts
    return re.sub('"inputs": {[^}]*}', "", text)  # the hashes of what was read


@pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")
@pytest.mark.parametrize("form", EXPORT_FORMS)
def test_an_export_repeats_and_gives_the_same_numbers(
    rated: Study, form: str, tmp_path: Path
) -> None:
    day = date(2026, 1, 2)
    one = exported(rated, form, tmp_path / "1" / "x", day=day)
    made = contents(one)
    assert contents(exported(rated, form, tmp_path / "2" / "x", day=day)) == made
    assert any(b"SIMULATED DATA" in data for data in made.values())
    root = one / "sourcedata" if form == "bids" else one
    assert numbers(StudyPaths(root)) == numbers(rated[0])


@pytest.mark.parametrize("form", EXPORT_FORMS)
def test_what_is_private_stays_unless_it_is_named(
    rated: Study, form: str, tmp_path: Path
) -> None:
    left_out = export_study(*rated, form, tmp_path / "a")
    assert len(left_out) == 4
    assert all("private" not in text.lower() for text in left_out)
    for name, data in contents(tmp_path / "a").items():
        assert b"rivate" not in data, name
    assert export_study(*rated, form, tmp_path / "b", include=ALL) == ()
    everything = b"".join(contents(tmp_path / "b").values())
    assert [text for text in SECRETS if text not in everything] == []
    paths = [path for path in (tmp_path / "b").rglob("*") if path.is_file()]
    assert {path.stat().st_mode & 0o077 for path in paths} == {0}


@pytest.mark.slow  # the validator is a program of its own: two seconds
def test_bids_is_valid(rated: Study, tmp_path: Path) -> None:
    folder = exported(rated, "bids", tmp_path / "out")
    validator = Path(sys.executable).with_name("bids-validator-deno")
    done = subprocess.run(
        [validator, "--json", folder], capture_output=True, text=True, check=False
    )
    issues = json.loads(done.stdout)["issues"]["issues"]
    assert [issue for issue in issues if issue["severity"] == "error"] == []
    (folder / "participants.tsv").write_text("participant_id\nsub-R9\n")
    assert subprocess.run([validator, folder], capture_output=True).returncode != 0


def test_an_answer_of_two_lines_keeps_both(rated: Study, tmp_path: Path) -> None:
    folder = exported(rated, "bids", tmp_path / "out", include=["after.secret"])
    with (folder / "sourcedata/ratings/answers.csv").open(newline="") as file:
        answers = [row["answer"] for row in csv.DictReader(file)]
    assert answers == ["7", ANSWERS["after.secret"]] * 6


def test_a_crate_loads_with_every_file_and_its_hash(
    rated: Study, tmp_path: Path
) -> None:
    folder = exported(rated, "ro-crate", tmp_path / "out", day=date(2026, 1, 2))
    crate = ROCrate(folder)
    assert crate.root_dataset["datePublished"] == "2026-01-02"
    named = {entity.id: entity["sha256"] for entity in crate.data_entities}
    there = contents(folder)
    del there["ro-crate-metadata.json"]
    assert named == {name: hashlib.sha256(d).hexdigest() for name, d in there.items()}
    assert "schedules/test_R1.csv" in named


@pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")
def test_a_report_that_shows_what_is_private_stays(
    rated: Study, tmp_path: Path
) -> None:
    copy = StudyPaths(tmp_path / "study")
    shutil.copytree(rated[0].root, copy.root)

    def archived(name: str, shown: tuple[str, ...], *include: str) -> tuple[bool, bool]:
        data = read_study_data(copy, rated[1])
        conduct = study_conduct(copy, rated[1], include=shown)
        analysis = analyze(rated[1], data.ratings)
        write_report(rated[1], data.ratings, analysis, copy.report, conduct=conduct)
        folder = tmp_path / name
        left_out = export_study(copy, rated[1], "ro-crate", folder, include=include)
        return (folder / "report/report.md").is_file(), "the report" in str(left_out)

    assert archived("a", ()) == (True, False)
    assert archived("b", ("who",)) == (False, True)
    assert archived("c", ("notes", "illness"), "logs") == (False, True)
    assert archived("d", ("notes", "illness"), "logs", "illness") == (True, False)


def test_who_is_excluded_is_left_out_and_said(rated: Study, tmp_path: Path) -> None:
    copy = StudyPaths(tmp_path / "study")
    shutil.copytree(rated[0].root, copy.root)
    record_standing(
        copy, rated[1], "R2", "excluded", who="Somebody Private", why="rivate"
    )
    study = (copy, rated[1])
    left_out = export_study(*study, "ro-crate", tmp_path / "a")
    assert "ratings of R2, who are excluded (logs)" in left_out
    recorded = (tmp_path / "a" / "sessions").rglob("*.npz")
    assert {path.parent.name for path in recorded} == {"test_R1"}
    ratings = (tmp_path / "a" / "ratings" / "ratings.csv").read_text().splitlines()
    assert [line.split(",")[1] for line in ratings] == ["rater", *["R1"] * 3]
    export_study(*study, "ro-crate", tmp_path / "b", include=("logs", "notes"))
    assert "R2" in (tmp_path / "b/ratings/ratings.csv").read_text()


def test_a_stop_leaves_no_folder(rated: Study, tmp_path: Path) -> None:
    def stop(_: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export_study(*rated, "bids", tmp_path / "x" / "out", progress=stop)
    assert list((tmp_path / "x").iterdir()) == []
