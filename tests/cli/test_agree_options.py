"""masrel agree by its options: what is estimated, how it is shown, what is refused."""

import csv
import io
import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from masrel.agreement import (
    fleiss_kappa,
)
from tests.cli.process import Caller, Done

# Four patients by three raters, one gap.
WIDE = "patient,Kim,Lee,Ann\nA,1,1+,1\nB,2,NA,2\nC,1,1,2\nD,3,3,3\n"
SCALE = ("1", "1+", "2", "3")
JSON = ("--json", "-")
ROWS = [["1", "1+", "1"], ["2", None, "2"], ["1", "1", "2"], ["3", "3", "3"]]


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    return written(tmp_path, WIDE, "wide.csv")


def estimates(done: Done) -> list[dict[str, Any]]:
    """Read the document on stdout; it must be JSON to the letter, without nan."""

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    assert done.code == 0, done.err
    found: list[dict[str, Any]] = json.loads(done.out, parse_constant=refuse)[
        "estimates"
    ]
    return found


def test_json_in_a_file_leaves_the_table_on_stdout(
    masrel: Caller, wide: Path, tmp_path: Path
) -> None:
    path = tmp_path / "out.json"
    done = masrel("agree", wide, "--json", path, "--csv")
    assert done.out.startswith("coefficient,")
    both = masrel("agree", wide, "--json", "-")
    assert json.loads(path.read_text(encoding="utf-8")) == json.loads(both.out)


@pytest.mark.parametrize(
    "text",
    [
        "1,.75,.25,0\n.75,1,.5,0\n.25,.5,1,.5\n0,0,.5,1\n",
        # in another order, with commas as decimal marks
        "grade;2;1;3;1+\n1;0,25;1;0;0,75\n3;0,5;0;1;0\n1+;0,5;0,75;0;1\n"
        "2;1;0,25;0,5;0,5\n",
    ],
)
def test_weights_of_a_file_are_those_of_a_matrix(
    masrel: Caller, wide: Path, tmp_path: Path, text: str
) -> None:
    (tmp_path / "w.csv").write_text(text, encoding="utf-8")
    options = ("--categories", ",".join(SCALE), "--weights", tmp_path / "w.csv")
    done = masrel("agree", wide, *options, "--json", "-")
    matrix = [
        [1, 0.75, 0.25, 0],
        [0.75, 1, 0.5, 0],
        [0.25, 0.5, 1, 0.5],
        [0, 0, 0.5, 1],
    ]
    kappa = fleiss_kappa(ROWS, categories=SCALE, weights=matrix)
    (_, of_kappa) = estimates(done)
    assert of_kappa["value"] == pytest.approx(kappa.value, abs=1e-14)
    assert of_kappa["standard_error"] == pytest.approx(kappa.standard_error, abs=1e-14)
    assert of_kappa["weights"] == "w.csv"
    assert json.loads(done.out)["options"]["weight_matrix"] == matrix


SESSIONS = "session,item,rater,grade,source\n" + "".join(
    f"{session},{item},{rater},{(item * rater) % 3},simulated\n"
    for session in ("first", "second")
    for item in range(4)
    for rater in range(3)
)


def written(folder: Path, text: str, name: str = "ratings.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_warnings_are_lines_on_stderr_alone(masrel: Caller, tmp_path: Path) -> None:
    rows = [f"{k},{20 + 1.37 * k:.2f},{20.5 + 1.31 * k:.2f}\n" for k in range(30)]
    path = written(tmp_path, "item,Kim,Lee\n" + "".join(rows), "r.csv")
    (warned,) = json.loads(masrel("agree", path, "--json", "-").out)["notes"]
    assert warned.startswith("warning: ")
    for form in ((), ("--csv",), ("--latex",), ("--sentence",), ("--json", "-")):
        done = masrel("agree", path, *form)
        assert done.err.splitlines().count(warned) == 1
        assert "warning: " not in done.out or form == ("--json", "-")
    assert warned in masrel("diagnose", path).err.splitlines()


def test_the_command_that_is_offered_gives_an_interval(
    masrel: Caller, tmp_path: Path
) -> None:
    path = written(tmp_path, SESSIONS, "Ann's ratings.csv")
    call = ("agree", str(path), "--by", "session", "--categories", "0, 1,2", "--csv")
    words, command = masrel(*call).err.splitlines()[-1].split(": masrel ")
    assert words == (
        "No interval was asked for. To generalise to other items, add --target items"
    )
    assert shlex.split(command) == [*call, "--target", "items"]
    done = masrel(*shlex.split(command))
    assert done.code == 0, done.err
    assert all(row["low"] for row in csv.DictReader(io.StringIO(done.out)))
    assert "No interval" not in done.err


def test_verbs_and_options_are_guessed(masrel: Caller, wide: Path) -> None:
    assert "Did you mean 'agree'?" in masrel("agre", wide).err
    said = masrel("agree", wide, "--weigths", "x").err
    assert re.search(r"Did you mean .*--weights", said)
    done = masrel("qqq")
    assert (done.code, done.out) == (2, "")
    assert "No such command 'qqq'." in done.err


def test_estimates_in_small_units_keep_their_digits(
    masrel: Caller, tmp_path: Path
) -> None:
    # differences of 0, 2 and 1 tenths of a millimetre, in metres: SD 0.0001, and
    # SEM = 0.0001 / √2
    file = written(tmp_path, "item,Kim,Lee\na,1,1\nb,2,2.0002\nc,3,3.0001\n")
    call = ("agree", file, "--coefficients", "lin_ccc,sem_consistency")
    out = masrel(*call).out
    row = next(line for line in out.splitlines() if "SEM" in line)
    assert " 7.071e−05 " in row
    assert " 1.000 " in next(line for line in out.splitlines() if "Lin's" in line)
    assert "SEM, consistency = 7.071e−05" in masrel(*call, "--sentence").out
