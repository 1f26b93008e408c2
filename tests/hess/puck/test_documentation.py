"""What docs/hardware.md prints is what its commands and its example print."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.process import Caller

PAGE = (Path(__file__).parents[3] / "docs" / "hardware.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"<!-- masrel (.*?) -->\n```text\n(.*?)```", PAGE, re.DOTALL)


def test_the_page_says_first_that_it_has_not_been_tested() -> None:
    first = PAGE.split("\n\n")[1]
    assert first.startswith("**Nothing on this page has been tested on physical hard")


@pytest.mark.parametrize(("command", "output"), COMMANDS, ids=[c for c, _ in COMMANDS])
def test_the_commands_print_what_the_page_says(
    command: str,
    output: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    done = Caller(monkeypatch, capsys)(*command.split())
    assert done.code == 0
    assert done.out == output


def test_there_are_three_of_them() -> None:
    assert [command.split()[1] for command, _ in COMMANDS] == [
        "probe",
        "check",
        "friction",
    ]


EXAMPLES = re.findall(
    r"```python\n(.*?)```\n\nprints\n\n```text\n(.*?)```", PAGE, re.DOTALL
)


@pytest.mark.parametrize(("example", "output"), EXAMPLES, ids=["present", "check"])
def test_the_examples_print_what_the_page_says(example: str, output: str) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", example],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == output
