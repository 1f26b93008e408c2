"""In a sealed study nothing says who met which model until every session is over."""

import json
from pathlib import Path

import pytest

from masrel.errors import (
    ParameterError,
    RatingsError,
    ScheduleError,
    SessionStoppedError,
)
from masrel.lab.conduct import (
    allot_schedules,
    read_conduct,
    record_standing,
    record_unblinding,
)
from masrel.lab.protocol import Protocol, StudyPaths, copy_template, read_protocol
from masrel.lab.ratings import ratings_from_logs, read_study_data
from masrel.lab.run import ScriptGrades, run_session
from masrel.lab.schedule import read_schedule
from masrel.lab.sealing import is_sealed, unseal_study
from masrel.lab.verification import verify_study
from tests.files import edit

Sealed = tuple[StudyPaths, Protocol]
BY = {"who": "MK", "why": "all is done"}
SAYS_MODELS = ("protocol.toml", "presented_", "README.md")  # not who met them


def new_study(root: Path, *, sealed: bool) -> Sealed:
    copy_template("small", root)
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


def named_in(study: StudyPaths) -> list[str]:
    """Files that name a model, of those that are made by draws and sessions."""
    models = [m.id.encode() for m in read_protocol(study.protocol).models]
    return [
        path.name
        for path in sorted(study.root.rglob("*"))
        if path.is_file()
        and path.suffix in (".csv", ".json", ".jsonl", ".toml", ".md")
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
    codes = [
        s.code for s in read_schedule(study.schedule_file("R1", "test")).presentations
    ]
    assert [row.code for row in ratings.rows][:4] == codes
    with pytest.raises(RatingsError, match="sealed until every session is over"):
        read_study_data(study, protocol)
    assert unseal_study(study, protocol, **BY) == 2
    assert not is_sealed(study, protocol)
    assert verify_study(study).is_whole
    data = read_study_data(study, protocol)
    shown = read_schedule(study.schedule_file("R1", "test")).presentations
    models = {each.code: each.model for each in shown}
    assert [models[str(row.code)] for row in data.ratings.rows[:4]] == [
        row.model for row in data.ratings.rows[:4]
    ]
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


def test_a_session_that_was_stopped_goes_on(sealed: Sealed) -> None:
    study, _ = sealed

    class Stopping(ScriptGrades):
        def make_ready(self, request) -> None:
            if request.presentation.position == 3:
                raise SessionStoppedError("enough")

    with pytest.raises(SessionStoppedError):
        run_session(
            *sealed, "R1", "test", grades=Stopping(["0", "1"]), clock="simulated"
        )
    run(sealed, "R1", ["0", "1", "2", "3"])
    assert named_in(study) == []
    assert verify_study(study).is_whole


def test_without_its_secret_nobody_runs_or_opens_it(sealed: Sealed) -> None:
    study, protocol = sealed
    study.secret_file.unlink()
    with pytest.raises(
        ScheduleError, match=r"is sealed: needed the secret .* got none"
    ):
        run(sealed, "R1", ["0"])
    with pytest.raises(ScheduleError, match="is sealed: needed the secret"):
        record_unblinding(study, protocol, None, **BY)


def test_other_models_than_were_sealed_are_found(sealed: Sealed) -> None:
    study, protocol = sealed
    for rater in ("R1", "R2"):
        run(sealed, rater, ["0", "1", "2", "3"])
    unseal_study(study, protocol, **BY)
    file = study.opened_file("R1", "test")
    first, second, *_ = read_schedule(file).presentations
    text = file.read_text(encoding="utf-8")
    for one, other in ((first, second), (second, first)):
        before = f"{one.position},{one.code},{one.model},"
        assert before in text
        text = text.replace(before, f"{one.position},{one.code},{other.model},")
    file.write_text(text, encoding="utf-8")
    broken = [f.message for f in verify_study(study).findings if f.weight == "broken"]
    assert any("that the study's secret draws, got others" in each for each in broken)
    edit(file, f",{first.code},", ",99X,")
    broken = [f.message for f in verify_study(study).findings if f.weight == "broken"]
    assert any("needed what is sealed in test_R1.csv" in each for each in broken)
