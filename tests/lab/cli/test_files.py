"""What a call writes takes the place of nothing that it reads, nor of a record."""

import shutil
from pathlib import Path

import pytest

from masrel.lab.protocol import copy_template
from tests.cli.process import Caller
from tests.files import contents, edit


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """The published study, with a log and a model file."""
    root = tmp_path / "study"
    copy_template("hess2012", root)
    (root / "sessions").mkdir()
    (root / "sessions" / "test_R1.jsonl").write_text("a log")
    return root


@pytest.mark.parametrize(
    ("verb", "option", "target"),
    [
        ("analyze", "--json", "sessions/test_R1.jsonl"),
        ("analyze", "--json", "protocol.toml"),
        ("analyze", "--json", "ratings/published.csv"),
        ("analyze", "--json", "ratings/../protocol.toml"),
        ("ratings", "-o", "protocol.toml"),
        ("ratings", "-o", "sessions/test_R1.jsonl"),
        ("grading", "--json", "schedules/test_R1.csv"),
        ("report", "-o", "sessions"),
    ],
)
def test_no_primary_record_is_written_over(
    verb: str, option: str, target: str, study: Path, masrel: Caller
) -> None:
    before = contents(study)
    done = masrel(verb, study, option, study / target)
    assert done.code == 2
    assert "needed another file, because this is a primary record" in done.err
    assert len(done.err.splitlines()) == 1
    assert contents(study) == before


def test_no_input_is_written_over(study: Path, tmp_path: Path, masrel: Caller) -> None:
    table = tmp_path / "table.csv"
    table.write_text("item,A,B\n1,0,0\n2,1,1\n3,0,1\n")
    (tmp_path / "link.csv").symlink_to(table)
    foreign = tmp_path / "foreign.csv"
    shutil.copyfile(study / "ratings" / "published.csv", foreign)
    (tmp_path / "a.npz").write_bytes(b"")
    (tmp_path / "a.json").write_text("{}")
    calls = [
        ("agree", table, "--target", "items", "--json", table),
        ("agree", "--json", table, tmp_path / "link.csv", "--target", "items"),
        ("latent", table, "--json", tmp_path / ".." / tmp_path.name / "table.csv"),
        ("analyze", study, "--ratings", foreign, "--json", foreign),
        ("joint", "fit", tmp_path / "a.npz", "--json", tmp_path / "a.json"),
        (
            "joint",
            "trace",
            "--model",
            "m.toml",
            "--speed-deg-s",
            "90",
            "--csv",
            "m.toml",
        ),
        ("joint", "between", "HM1", "D/D01.toml", "-n", "1", "-o", "D", "--overwrite"),
    ]
    before = contents(tmp_path)
    for call in calls:
        done = masrel(*call)
        assert done.code == 2, call
        assert "this one is an input" in done.err or "model file" in done.err
        assert len(done.err.splitlines()) == 1, call
    assert contents(tmp_path) == before


def test_a_model_file_of_the_protocol_is_an_input(study: Path, masrel: Caller) -> None:
    assert (
        masrel("joint", "between", "HM1", "HM2", "-n", "1", "-o", study / "models").code
        == 0
    )
    entry = '[[models]]\nid = "E01"\nrole = "dummy"\nfile = "models/D01.toml"\n\n'
    edit(study / "protocol.toml", "[[raters]]", f"{entry}[[raters]]", 1)
    done = masrel("analyze", study, "--json", study / "models" / "D01.toml")
    assert done.code == 2
    assert "this one is an input" in done.err


def test_default_outputs_do_not_leave_the_study(
    study: Path, tmp_path: Path, masrel: Caller
) -> None:
    home = tmp_path / "home"
    home.mkdir()
    shutil.rmtree(study / "sessions")
    (study / "report").symlink_to(home)
    (study / "schedules").symlink_to(home)
    for verb in ("report", "schedule"):
        done = masrel(verb, study)
        assert done.code == 2
        assert f"got a link to {home}" in done.err
    assert not list(home.iterdir())


def test_an_output_that_is_a_link_is_replaced_and_not_followed(
    study: Path, tmp_path: Path, masrel: Caller
) -> None:
    shutil.rmtree(study / "sessions")
    profile = tmp_path / ".profile"
    profile.write_text("umask 077\n")
    (study / "analysis.json").symlink_to(profile)
    assert masrel("analyze", study).code == 0
    assert profile.read_text() == "umask 077\n"
    assert not (study / "analysis.json").is_symlink()


def test_a_session_does_not_leave_the_study(
    study: Path, tmp_path: Path, masrel: Caller
) -> None:
    shutil.rmtree(study / "sessions")
    assert masrel("schedule", study).code == 0
    home = tmp_path / "home"
    home.mkdir()
    (study / "sessions").symlink_to(home)
    names = ("--rater", "R1", "--session", "test", "--grades", "simulated")
    done = masrel("run", study, *names, "--clock", "simulated")
    assert done.code == 2
    assert f"got a link to {home}" in done.err
    assert not list(home.iterdir())
