"""Streams that cannot show every letter, and any backend of matplotlib."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.lab.flow.cuts import masrel_command

SLOW = pytest.mark.slow
ENCODINGS = [
    "cp1252",
    *(pytest.param(e, marks=SLOW) for e in ("ascii", "cp437")),
]
TABLE = "item,Łucja,B\n1,0,0\n2,1,1\n3,0,1\n4,1,1\n"


def called(
    environment: dict[str, str], *arguments: object
) -> "subprocess.CompletedProcess[bytes]":
    return subprocess.run(
        masrel_command(*arguments),
        capture_output=True,
        check=True,
        env={**os.environ, **environment},
    )


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "table.csv"
    path.write_text(TABLE, encoding="utf-8")
    return path


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_table_with_kappa_is_printed(encoding: str, table: Path) -> None:
    environment = {"PYTHONIOENCODING": encoding}
    done = called(environment, "agree", table, "--target", "items")
    shown = done.stdout.decode("utf-8" if encoding == "ascii" else encoding)
    assert "Fleiss' " in shown
    assert "kappa" in shown or "κ" in shown


def test_letters_are_spelled_and_names_escaped() -> None:
    code = (
        "import sys, masrel.cli; sys.stdout.reconfigure(errors='masrel');"
        "print('κ = −0.5, Δ, Łucja, m²')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        check=True,
        env={**os.environ, "PYTHONIOENCODING": "cp437:strict"},
    )
    shown = done.stdout.decode("cp437")
    assert shown.strip() == r"kappa = -0.5, Delta, \u0141ucja, m²"


@pytest.mark.parametrize(
    "backend",
    [
        "module://matplotlib_inline.backend_inline",
        pytest.param("nonsense", marks=SLOW),
    ],
)
def test_any_backend_of_matplotlib_draws(
    backend: str, table: Path, tmp_path: Path
) -> None:
    figure = tmp_path / "figure.svg"
    called(
        {"MPLBACKEND": backend}, "agree", table, "--target", "items", "--figure", figure
    )
    assert b"</svg>" in figure.read_bytes()


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_a_closed_stream_takes_nothing_and_stops_nothing(
    closed: str, tmp_path: Path
) -> None:
    (tmp_path / "t.csv").write_text("item,Kim,Lee\nA,1,2\nB,1,1\nC,2,2\n")
    call = f"{shlex.join(masrel_command('agree', tmp_path / 't.csv'))} {closed}"
    done = subprocess.run(["sh", "-c", call], capture_output=True)
    assert done.returncode == 0
    assert b"Traceback" not in done.stderr
    assert (b"0.667" in done.stdout) == (closed == "2>&-")
