"""The examples of docs/model.md print what the page says."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/model.md").read_text(encoding="utf-8")

COMMANDS = re.findall(r"```\n\$ masrel ([^\n]+)\n(.*?)```", PAGE, flags=re.DOTALL)


def output(*arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        check=True,
        encoding="utf-8",
        cwd=ROOT,
    )
    return done.stdout


def test_there_are_commands_to_check() -> None:
    assert len(COMMANDS) == 2


@pytest.mark.parametrize(("command", "said"), COMMANDS)
def test_the_commands_print_what_the_page_says(command: str, said: str) -> None:
    assert output("-m", "masrel", *shlex.split(command)) == said


def test_the_python_example_prints_what_the_page_says() -> None:
    (example,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    said = re.findall(r"# prints (.*)", example)
    assert said
    assert output("-W", "error", "-c", example).splitlines() == said


def test_every_file_the_page_points_to_is_there() -> None:
    targets = re.findall(r"\]\((?!https?://)([^)#]+)", PAGE)
    assert targets
    assert [name for name in targets if not (ROOT / "docs" / name).exists()] == []
