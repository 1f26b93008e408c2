"""In a sealed study nothing says who met which model until every session is over."""

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from masrel.errors import (
    MasrelError,
    ParameterError,
    RatingsError,
    ScheduleError,
)
from masrel.lab.conduct import (
    allot_schedules,
    read_conduct,
    record_standing,
    record_unblinding,
)
from masrel.lab.merging import merge_studies
from masrel.lab.progress import unseal_study
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.ratings import ratings_from_logs, read_study_data
from masrel.lab.run.session import run_session
from masrel.lab.schedule._secret import copy_for_site
from masrel.lab.schedule.presentation import is_sealed, read_schedule
from masrel.lab.verification import verify_study
from tests.files import edit, small_study
from tests.lab.flow.conftest import run as masrel
from tests.lab.script import ScriptGrades

Sealed = tuple[StudyPaths, Protocol]
BY = {"who": "MK", "why": "all is done"}
SAYS_MODELS = ("protocol.toml", "presented_", "README.md")  # not who met them


def new_study(root: Path, *, sealed: bool) -> Sealed:
    small_study(root)
    study = StudyPaths(root)
    if sealed:
        with study.protocol.open("a", encoding="utf-8") as file:
            file.write("\n[blinding]\nsealed = true\n")
    protocol = read_protocol(study.protocol)
    allot_schedules(study, protocol)
    return study, protocol


@pytest.fixture
def sealed(tmp_path: Path) -> Sealed:
    return new_study(tmp_path / "study", sealed=True)


def run(small: Sealed, rater: str, grades: list[str]) -> None:
    script = ScriptGrades(grades)
    run_session(*small, rater, "test", grades=script, clock="simulated")


def site(root: Path, name: str, rater: str) -> Sealed:
    """The copy of a study for the site of one rater, who is through."""
    protocol, study = read_protocol(root / "protocol.toml"), StudyPaths(root)
    copy_for_site(protocol, study, name, root.with_name(name))
    copied = StudyPaths(root.with_name(name)), protocol
    allot_schedules(*copied, site=name)
    run(copied, rater, ["0", "1", "2", "3"])
    return copied


def document_of(file: Path) -> dict[str, dict[str, str]]:
    return dict(json.loads(file.read_text(encoding="utf-8")))


def named_in(study: StudyPaths) -> list[str]:
    """Files that name a model, of those that are made by draws and sessions."""
    models = [m.id.encode() for m in read_protocol(study.protocol).models]
    return [
        path.name
        for path in sorted(study.root.rglob("*"))
        if path.is_file()
        and path.suffix in (".csv", ".json", ".jsonl", ".toml", ".md", ".svg")
        and not path.name.startswith(SAYS_MODELS)
        and any(model in without_protocol(path) for model in models)
    ]


def without_protocol(path: Path) -> bytes:
    """What a file says, but for the protocol that the log of the study keeps."""
    if path.name != "conduct.jsonl":
        return path.read_bytes()
    events = map(json.loads, path.read_text(encoding="utf-8").splitlines())
    kept = [e["fields"] for e in events]
    return json.dumps([{**each, "protocol": ""} for each in kept]).encode()


def test_no_file_names_what_was_met_and_what_is_given_is_the_same(
    sealed: Sealed, tmp_path: Path
) -> None:
    study, protocol = sealed
    open_ = new_study(tmp_path / "open", sealed=False)
    assert named_in(open_[0]) == ["test_R1.csv", "test_R2.csv"]  # they are found
    for rater in ("R1", "R2"):
        run(sealed, rater, ["0", "1", "2", "3"])
    assert named_in(study) == []
    assert verify_study(study).is_whole
    ratings = ratings_from_logs(study, protocol)
    assert {row.model for row in ratings.rows} == {"(sealed)"}
    with pytest.raises(RatingsError, match="are sealed: masrel record unblind --all"):
        read_study_data(study, protocol)
    assert unseal_study(study, protocol, **BY) == 2
    assert not is_sealed(study, protocol)
    assert verify_study(study).is_whole
    data = read_study_data(study, protocol)
    assert [row.code for row in ratings.rows] == [row.code for row in data.ratings.rows]
    assert {row.model for row in data.ratings.rows} == {m.id for m in protocol.models}


def test_it_opens_once_every_session_is_complete_or_closed(sealed: Sealed) -> None:
    study, protocol = sealed
    run(sealed, "R1", ["0", "1", "2", "3"])
    with pytest.raises(ParameterError, match="R2 in session test is not"):
        unseal_study(study, protocol, **BY)
    assert read_conduct(study) == ()
    record_standing(study, protocol, "R2", "withdrawn", who="MK", why="moved")
    assert unseal_study(study, protocol, **BY) == 2
    for file in (study.schedules / "opened").glob("*"):  # as after a kill
        file.unlink()
    assert unseal_study(study, protocol, **BY) == 2
    kinds = [event.kind for event in read_conduct(study)]
    assert kinds == ["withdrawn", "unblinded"]


def test_without_its_secret_nobody_runs_or_opens_it(sealed: Sealed) -> None:
    study, protocol = sealed
    study.secret_file.unlink()
    with pytest.raises(
        ScheduleError, match=r"is sealed: needed the secret .* got none"
    ):
        run(sealed, "R1", ["0"])
    code = read_schedule(study.schedule_file("R1", "test")).presentations[0].code
    with pytest.raises(ScheduleError, match="is sealed: needed the secret"):
        record_unblinding(study, protocol, code, rater="R1", **BY)


def test_other_models_than_were_sealed_are_found(sealed: Sealed) -> None:
    study, protocol = sealed
    for rater in ("R1", "R2"):
        run(sealed, rater, ["0", "1", "2", "3"])
    unseal_study(study, protocol, **BY)
    file = study.opened_file("R1", "test")
    first, second, *_ = read_schedule(file).presentations
    for old, new in ((first, "-"), (second, first.model)):
        edit(file, f"{old.code},{old.model}", f"{old.code},{new}")
    edit(file, f"{first.code},-", f"{first.code},{second.model}")
    broken = [f.message for f in verify_study(study).findings if f.weight == "broken"]
    assert any("that the study's secret draws, got others" in each for each in broken)
    edit(file, f",{first.code},", ",99X,")
    broken = [f.message for f in verify_study(study).findings if f.weight == "broken"]
    assert any("needed what is sealed in test_R1.csv" in each for each in broken)


# What a study goes through until it is opened: arguments, with STUDY for its folder
BEFORE = (
    "check STUDY",
    "schedule STUDY",
    "run STUDY --rater R1 --session test --grades simulated",
    "run STUDY --rater R1 --session test --grades simulated --rehearse",
    "paper print STUDY",
    "status STUDY",
    "status STUDY --json -",
    "ratings STUDY",
    "report STUDY --require kappa.value>=0",
    "verify STUDY",
    "record note STUDY tired --who MK",
)
REFUSED = (
    "analyze STUDY",
    "grading STUDY",
    "export STUDY --as bids -o OUT",
    "checklist STUDY --guideline grras",
    "schedule show STUDY",
    "analyze STUDY --ratings STUDY/ratings/ratings.csv",
    "record unblind STUDY --all --who MK --why curious",
    "record unblind STUDY --all --rater R1 --who MK --why curious",
)


@pytest.mark.slow
def test_no_command_says_more_than_codes(sealed: Sealed) -> None:
    study, protocol = sealed
    out, said = study.root.with_name("out"), ""
    for line in BEFORE:
        words = line.replace("STUDY", str(study.root)).split()
        said += masrel(*words, code=int("--require" in words))
    for line in REFUSED:
        words = line.replace("STUDY", str(study.root)).split()
        with pytest.raises(MasrelError) as refused:
            masrel(*(str(out) if word == "OUT" else word for word in words))
        said += str(refused.value)
    models = [model.id for model in protocol.models]
    # check says of the device which models it is too weak for
    text = "".join(said.partition("no problems")[1:])
    assert not any(model in text for model in models), said
    assert not out.exists()
    assert named_in(study) == []


@pytest.mark.slow
def test_a_report_is_out_of_date_once_the_study_is_opened(sealed: Sealed) -> None:
    study, _ = sealed
    root = str(study.root)
    for rater in ("R1", "R2"):
        run(sealed, rater, ["0", "1", "2", "3"])
    for verb in ("ratings", "report"):
        masrel(verb, root)
    manifest = document_of(study.report / "manifest.json")
    digest = hashlib.sha256(study.ratings_file.read_bytes()).hexdigest()
    assert manifest["inputs"]["ratings_sha256"] == digest
    pages = (study.report / "report.md").read_text(encoding="utf-8")
    assert "The models presented are sealed" in pages
    assert "| test | 2 | 2 | 2 |" in pages
    assert not verify_study(study).findings
    assert "next: masrel record unblind" in masrel("status", root)
    again = ("record", "unblind", root, "--all", "--who", "MK", "--why", "done")
    assert masrel(*again) == masrel(*again)
    assert [event.kind for event in read_conduct(study)] == ["unblinded"]
    findings = verify_study(study).findings
    assert {(each.weight, each.path.name) for each in findings} == {
        ("stale", "ratings.csv"),
        ("stale", "manifest.json"),
    }
    edit(study.ratings_file, ",0,", ",1,", 1)
    assert not verify_study(study).is_whole
    masrel("ratings", root)
    assert {each.path.name for each in verify_study(study).findings} == {
        "manifest.json"
    }


def test_one_code_may_be_known_before(sealed: Sealed) -> None:
    study, protocol = sealed
    run(sealed, "R1", ["0", "1", "2", "3"])
    shown = read_schedule(study.schedule_file("R1", "test")).presentations[0]
    look = ("record", "unblind", str(study.root), shown.code, "--rater", "R1")
    said = [masrel(*look, "--who", "MK", "--why", "a fall") for _ in range(2)]
    assert said[0] == said[1]
    assert sum(model.id in said[0] for model in protocol.models) == 1
    events = [(event.kind, event.fields["code"]) for event in read_conduct(study)]
    assert events == [("unblinded", shown.code)] * 2
    assert is_sealed(study, protocol)
    assert named_in(study) == []


def test_what_was_drawn_sealed_stays_so_whatever_the_protocol_says(
    sealed: Sealed,
) -> None:
    study, protocol = sealed
    for rater in ("R1", "R2"):
        run(sealed, rater, ["0", "1", "2", "3"])
    unseal_study(study, protocol, **BY)
    edit(study.protocol, "sealed = true", "sealed = false")
    add = ("record", "rater", "add", str(study.root), "--rater", "R3")
    masrel(*add, "--session", "test", "--who", "MK")
    protocol = read_protocol(study.protocol)
    allot_schedules(study, protocol)
    assert is_sealed(study, protocol)
    run((study, protocol), "R3", ["0", "1", "2", "3"])
    facts = study.sessions.glob("test_R3/*.json")
    assert {document_of(file)["model"] for file in facts} == {"(sealed)"}
    assert unseal_study(study, protocol, **BY) == 3
    assert not is_sealed(study, protocol)
    kinds = [event.kind for event in read_conduct(study)]
    assert kinds == ["unblinded", "rater-added", "unblinded"]


def test_sites_are_opened_alone_or_once_they_are_merged(tmp_path: Path) -> None:
    root = tmp_path / "whole"
    small_study(root)
    edit(root / "protocol.toml", "[schedule]", '[schedule]\nstrata = "site"')
    edit(root / "protocol.toml", 'id = "R1"', 'id = "R1"\nsite = "north"')
    edit(root / "protocol.toml", 'id = "R2"', 'id = "R2"\nsite = "south"')
    with (root / "protocol.toml").open("a", encoding="utf-8") as file:
        file.write("\n[blinding]\nsealed = true\n")
    north, south = site(root, "north", "R1"), site(root, "south", "R2")
    assert unseal_study(*north, **BY) == 1
    merged = merge_studies([north[0], south[0]], tmp_path / "both")
    assert not merged.secret_file.exists()
    assert is_sealed(merged, north[1])  # of the other site
    with pytest.raises(ScheduleError, match="needed the secret"):
        unseal_study(merged, north[1], **BY)
    shutil.copytree(root / ".key", merged.root / ".key")
    assert unseal_study(merged, north[1], **BY) == 2
    assert verify_study(merged).is_whole
    assert len(read_study_data(merged, north[1]).ratings.rows) == 8
