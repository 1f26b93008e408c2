"""masrel agree: what it prints of its estimates, form by form."""

import csv
import io
import json
import re
import shlex
from pathlib import Path

import pytest

from tests.cli.process import Caller, Done

WIDE = "patient,Kim,Lee,Ann\nA,1,1+,1\nB,2,NA,2\nC,1,1,2\nD,3,3,3\n"
SESSIONS = "session,item,rater,grade,source\n" + "".join(
    f"{session},{item},{rater},{(item * rater) % 3},simulated\n"
    for session in ("first", "second")
    for item in range(4)
    for rater in range(3)
)


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    return written(tmp_path, WIDE)


def written(folder: Path, text: str, name: str = "ratings.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def document(done: Done) -> dict:
    assert done.code == 0, done.err
    return json.loads(done.out)


def table(done: Done) -> list[dict[str, str]]:
    assert done.code == 0, done.err
    return list(csv.DictReader(io.StringIO(done.out)))


# A table as CSV and LaTeX.


# The first screen.


def test_warnings_are_lines_on_stderr_alone(masrel: Caller, tmp_path: Path) -> None:
    rows = [f"{k},{20 + 1.37 * k:.2f},{20.5 + 1.31 * k:.2f}\n" for k in range(30)]
    path = written(tmp_path, "item,Kim,Lee\n" + "".join(rows), "r.csv")
    (warned,) = document(masrel("agree", path, "--json", "-"))["notes"]
    assert warned.startswith("warning: ")
    for form in ((), ("--csv",), ("--latex",), ("--sentence",), ("--json", "-")):
        done = masrel("agree", path, *form)
        assert done.err.splitlines().count(warned) == 1
        assert "warning: " not in done.out or form == ("--json", "-")
    assert warned in masrel("diagnose", path).err.splitlines()


# Notes below a table.


# Words.


# The offer of an interval.


def offer(done: Done) -> tuple[str, list[str]]:
    """Return what the last line offers, and the command."""
    line = done.err.splitlines()[-1]
    words, command = line.split(": masrel ")
    return words, shlex.split(command)


def test_the_command_that_is_offered_gives_an_interval(
    masrel: Caller, tmp_path: Path
) -> None:
    path = written(tmp_path, SESSIONS, "Ann's ratings.csv")
    call = ("agree", str(path), "--by", "session", "--categories", "0, 1,2", "--csv")
    words, command = offer(masrel(*call))
    assert words == "no interval; for other items like these"
    assert command == [*call, "--target", "items"]
    done = masrel(*command)
    assert all(row["low"] for row in table(done))
    assert "no interval" not in done.err


# The register, and what was probably meant.


def test_verbs_and_options_are_guessed(masrel: Caller, wide: Path) -> None:
    assert "Did you mean 'agree'?" in masrel("agre", wide).err
    said = masrel("agree", wide, "--weigths", "x").err
    assert re.search(r"Did you mean .*--weights", said)
    done = masrel("qqq")
    assert (done.code, done.out) == (2, "")
    assert "No such command 'qqq'." in done.err
