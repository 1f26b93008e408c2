"""The workflows of the page on continuous integration do what the page says."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "ci.md"
TEXT = PAGE.read_text(encoding="utf-8")


def block(heading: str, language: str) -> str:
    """The code of a section."""
    section = TEXT.partition(f"\n## {heading}\n")[2]
    return section.partition(f"```{language}\n")[2].partition("```")[0]


def commands(heading: str) -> list[list[str]]:
    """The lines that a runner runs, but for what it installs."""
    lines = re.findall(
        r"^ +- (?:run: )?((?:masrel|pip) .*)$", block(heading, "yaml"), re.M
    )
    assert lines[0].startswith("pip install ")
    return [shlex.split(line) for line in lines[1:]]


def call(command: list[str], folder: Path, **variables: str) -> int:
    """Run one as a runner does, and return its exit code."""
    assert command[0] == "masrel"
    done = subprocess.run(
        [sys.executable, "-m", *command],
        cwd=folder,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "Traceback" not in done.stderr
    return done.returncode


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clone with a study, its committed report and the report of a release."""
    root = tmp_path_factory.mktemp("clone")
    for line in (
        "masrel init study --study hess2012",
        "masrel report study --quiet",
    ):
        assert call(shlex.split(line), root) == 0
    shutil.copytree(root / "study" / "report", root / "released")
    return root


def regrade(clone: Path) -> None:
    """Have two raters disagree who agreed."""
    table = clone / "study" / "ratings" / "published.csv"
    text = table.read_text(encoding="utf-8")
    assert "test,R8,HM4,3," in text
    table.write_text(text.replace("test,R8,HM4,3,", "test,R8,HM4,0,"))


@pytest.fixture
def copy(clone: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(clone, tmp_path / "clone"))


@pytest.mark.slow
def test_a_workflow_passes(copy: Path, tmp_path: Path) -> None:
    summary = tmp_path / "summary.md"
    for command in commands("GitHub"):
        assert call(command, copy, GITHUB_STEP_SUMMARY=str(summary)) == 0, command
    assert (copy / "junit.xml").stat().st_size > 0
    assert "kappa-standard" in summary.read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_workflow_stops_at_another_grade(copy: Path) -> None:
    regrade(copy)
    failing = [command for command in commands("GitLab") if call(command, copy) != 0]
    stale = {"verify"}  # it says of which ratings the report is
    assert {c[1] for c in failing if c[1] != "report"} <= stale
    (report,) = (command for command in failing if command[1] == "report")
    assert "--no-change" in report
