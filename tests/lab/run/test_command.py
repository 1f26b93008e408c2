"""``masrel run`` and ``masrel ratings`` as they are typed."""

import subprocess
import sys
from collections.abc import Callable

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.run import read_log
from masrel.lab.schedule import read_schedule
from tests.cli.process import Caller

Small = tuple[StudyPaths, Protocol]


def typed(*arguments: object, answers: str = "", code: int = 0) -> tuple[str, str]:
    """What the command line says on stdout and stderr, when it ends with `code`."""
    result = CliRunner().invoke(
        cli, [str(a) for a in arguments], input=answers, catch_exceptions=False
    )
    assert result.exit_code == code, result.output
    return result.stdout, result.stderr


def started(*arguments: object, answers: str = "") -> subprocess.CompletedProcess[str]:
    """A process of its own, because the exit code of an error is `main`'s."""
    command = [sys.executable, "-c", "from masrel.cli import main; main()"]
    command += [str(argument) for argument in arguments]
    return subprocess.run(command, input=answers, capture_output=True, text=True)


def test_simulated_sessions_become_a_table(small: Small) -> None:
    study, _ = small
    who = ("--rater", "R1", "--session", "test")
    out, err = typed("run", study.root, *who, "--grades", "simulated")
    assert out.startswith("session test of R1 is complete: 3 grades (simulated) in ")
    assert err == ""  # no terminal, no bar
    header = read_log(study.log_file("R1", "test"))[0].fields
    assert (header["grades"], header["clock"]) == ("simulated", "simulated")
    out, _ = typed("ratings", study.root)
    assert out == f"3 ratings (simulated), 0 missing: {study.ratings_file}\n"
    first = study.ratings_file.read_bytes()
    assert first.startswith(b"# SIMULATED")
    other = study.root / "elsewhere" / "again.csv"
    typed("ratings", study.root, "-o", other)
    assert other.read_bytes() == first


def test_a_person_is_asked_and_may_be_corrected(small: Small) -> None:
    study, _ = small
    who = ("--rater", "R1", "--session", "test")
    run = ("run", study.root, *who)
    out, _ = typed(*run, "--clock", "simulated", answers="\n1\n\n1+\n\n3\n")
    assert "Presentation 3 of 3" in out
    shown = read_schedule(study.schedule_file("R1", "test")).presentations[1]
    correct = ("record", "correct", study.root, *who, "--code", shown.code)
    correct += ("--grade", "2", "--who", "Kim", "--why", "misheard")
    for _ in range(2):
        said, _ = typed(*correct)
        assert f"{shown.code} of R1, session test, is now 2" in said
    typed("ratings", study.root)
    rows = study.ratings_file.read_text(encoding="utf-8").splitlines()
    (row,) = [row for row in rows if f",{shown.model}," in row]
    assert row.split(",")[4] == "2"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--correct", "X"], "run --correct is now masrel record correct"),
        (["--grades", "oracle"], "oracle"),
    ],
)
def test_a_call_that_makes_no_sense_is_refused(
    small: Small, options: list[str], message: str
) -> None:
    who = ("--rater", "R1", "--session", "test")
    _, err = typed("run", small[0].root, *who, *options, code=2)
    assert message in err


def test_a_session_that_was_stopped_failed_and_says_how_to_go_on(
    small: Small,
) -> None:
    run = ("run", small[0].root, "--rater", "R1", "--session", "test")
    done = started(*run, "--clock", "simulated", answers="\n1\n")
    assert done.returncode == 1
    assert "the same command goes on there" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_fault_failed_and_a_wrong_rater_is_a_wrong_call(
    new_study: Callable[..., Small],
) -> None:
    limit = "[device]\nspeed_limit_deg_s = 30.0\n\n[schedule]"
    root = new_study(("[schedule]", limit))[0].root
    options = ("--session", "test", "--grades", "simulated", "--quiet")
    faulty = started("run", root, "--rater", "R1", *options)
    assert (faulty.returncode, faulty.stdout) == (1, "")
    assert "was stopped by a fault: speed" in faulty.stderr
    wrong = started("run", root, "--rater", "R9", *options)
    assert wrong.returncode == 2
    assert "Traceback" not in faulty.stderr + wrong.stderr


def test_a_terminal_sees_the_presentations_counted(
    small: Small, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    who = ("--rater", "R1", "--session", "test", "--grades", "simulated")
    done = Caller(monkeypatch, capsys).at_a_terminal("run", small[0].root, *who)
    assert "3/3" in done.err


def test_quiet_says_nothing(
    small: Small, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    who = ("--rater", "R1", "--session", "test", "--grades", "simulated")
    run = ("run", small[0].root, *who, "--quiet")
    done = Caller(monkeypatch, capsys).at_a_terminal(*run)
    assert (done.code, done.out, done.err) == (0, "", "")
