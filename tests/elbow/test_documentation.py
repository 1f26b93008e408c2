"""The examples of docs/model.md and docs/elbow.md print what the pages say."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = {
    name: (ROOT / f"docs/{name}.md").read_text(encoding="utf-8")
    for name in ("model", "elbow")
}

COMMANDS = [
    found
    for page in PAGES.values()
    for found in re.findall(r"```\n\$ masrel ([^\n]+)\n(.*?)```", page, flags=re.DOTALL)
]
EXAMPLES = [
    example
    for page in PAGES.values()
    for example in re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
]
FIGURES = re.findall(r"`masrel (trace [^`]*--figure \S+\.png)`", PAGES["elbow"])


def output(*arguments: str, cwd: Path = ROOT) -> str:
    done = subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        check=True,
        encoding="utf-8",
        cwd=cwd,
    )
    return done.stdout


def test_there_are_examples_to_check() -> None:
    assert (len(COMMANDS), len(EXAMPLES), len(FIGURES)) == (4, 4, 4)


@pytest.mark.parametrize(("command", "said"), COMMANDS)
def test_the_commands_print_what_the_page_says(command: str, said: str) -> None:
    assert output("-m", "masrel", *shlex.split(command)) == said


@pytest.mark.parametrize("example", EXAMPLES)
def test_the_python_examples_print_what_the_page_says(example: str) -> None:
    said = re.findall(r"# prints (.*)", example)
    assert said
    assert output("-W", "error", "-c", example).splitlines() == said


@pytest.mark.parametrize("command", FIGURES)
def test_the_figures_are_drawn_by_the_commands_below_them(
    command: str, tmp_path: Path
) -> None:
    output("-m", "masrel", *shlex.split(command), cwd=tmp_path)
    (drawn,) = tmp_path.iterdir()
    assert (ROOT / "docs/figures" / drawn.name).exists()
    assert drawn.stat().st_size > 10_000


@pytest.mark.parametrize("name", PAGES)
def test_every_file_the_page_points_to_is_there(name: str) -> None:
    targets = re.findall(r"\]\((?!https?://)([^)#]+)", PAGES[name])
    assert targets
    assert [name for name in targets if not (ROOT / "docs" / name).exists()] == []


@pytest.mark.parametrize("name", PAGES)
def test_every_heading_the_page_points_to_is_there(name: str) -> None:
    for page, anchor in re.findall(r"\]\((\w+\.md)#([^)]+)\)", PAGES[name]):
        text = (ROOT / "docs" / page).read_text(encoding="utf-8")
        headings = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
        assert anchor in {heading.lower().replace(" ", "-") for heading in headings}
