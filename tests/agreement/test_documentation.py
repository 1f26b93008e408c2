"""The pages on agreement print what they say, and leave no public name out."""

import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from masrel import agreement

DOCS = Path(__file__).parents[2] / "docs"
INDEX = DOCS / "agreement.md"
INTERVALS = DOCS / "intervals.md"
PAGES = sorted((DOCS / "agreement").glob("*.md"))
WITH_COMMANDS = [DOCS / "tutorial.md", DOCS / "agreement" / "command_line.md"]

EXAMPLES = [
    pytest.param(code, id=f"{page.stem}-{number}")
    for page in [INDEX, INTERVALS, *PAGES]
    for number, code in enumerate(
        re.findall(r"```python\n(.*?)```", page.read_text("utf-8"), flags=re.DOTALL)
    )
]


def printed(code: str) -> list[str]:
    output = io.StringIO()
    with contextlib.redirect_stdout(output), warnings.catch_warnings():
        warnings.simplefilter("error")
        exec(compile(code, "example", "exec"), {"__name__": "example"})
    return output.getvalue().splitlines()


COMMANDS = [
    pytest.param(page, block, id=f"{page.stem}-{number}")
    for page in WITH_COMMANDS
    for number, block in enumerate(
        re.findall(
            r"```\n(\$ masrel agree .*?)```", page.read_text("utf-8"), flags=re.DOTALL
        )
    )
]


def shown(block: str, page: Path, folder: Path) -> str:
    """Run the command of a block beside the files of its page."""
    files = r"`([\w.]+\.csv)`:\n\n```\n(.*?)```"
    for name, text in re.findall(files, page.read_text("utf-8"), flags=re.DOTALL):
        (folder / name).write_text(text, encoding="utf-8")
    command = block.splitlines()[0].removeprefix("$ masrel ")
    done = subprocess.run(
        [sys.executable, "-m", "masrel", *shlex.split(command)],
        capture_output=True,
        encoding="utf-8",
        check=False,
        cwd=folder,
        env={**os.environ, "PYTHONIOENCODING": "utf-8"},
    )
    return f"$ masrel {command}\n{done.stdout}{done.stderr}"


def prose(page: Path) -> str:
    return re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)


def targets(page: Path) -> list[str]:
    return re.findall(r"\]\((?!https?://)([^)#]+)", prose(page))


def anchors(page: Path) -> set[str]:
    """Return what the headings of a page are called in links, as GitHub has it."""
    headings = re.findall(r"^#+ (.*)$", prose(page), flags=re.MULTILINE)
    plain = [re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings]
    return {heading.replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("code", EXAMPLES)
def test_an_example_prints_what_the_page_says(code: str) -> None:
    said = re.findall(r"# prints (.*)", code)
    assert said
    assert printed(code) == said


def test_the_check_sees_a_wrong_number() -> None:
    assert printed("print(1 / 4)") != ["0.26"]


@pytest.mark.parametrize(("page", "block"), COMMANDS)
def test_a_command_prints_what_the_page_says(
    page: Path, block: str, tmp_path: Path
) -> None:
    assert shown(block, page, tmp_path) == block


def test_every_page_of_commands_shows_some() -> None:
    assert {param.values[0] for param in COMMANDS} == set(WITH_COMMANDS)


@pytest.mark.parametrize("page", [INDEX, INTERVALS, *PAGES], ids=lambda page: page.stem)
def test_a_page_has_an_example_and_good_links(page: Path) -> None:
    text = page.read_text("utf-8")
    assert "```python\n" in text
    broken = [name for name in targets(page) if not (page.parent / name).exists()]
    assert broken == []


@pytest.mark.parametrize("page", [INDEX, *PAGES], ids=lambda page: page.stem)
def test_a_link_into_a_page_meets_a_heading(page: Path) -> None:
    links = re.findall(r"\]\((?!https?://)([^)#]*)#([^)]+)\)", page.read_text("utf-8"))
    broken = [
        f"{name}#{heading}"
        for name, heading in links
        if heading not in anchors((page.parent / name).resolve() if name else page)
    ]
    assert broken == []


def test_the_index_points_to_every_page() -> None:
    linked = {(DOCS / name).resolve() for name in targets(INDEX)}
    assert [page.name for page in PAGES if page.resolve() not in linked] == []


def test_every_public_name_is_on_a_page() -> None:
    text = "".join(page.read_text("utf-8") for page in [INDEX, *PAGES])
    assert [name for name in agreement.__all__ if f"`{name}`" not in text] == []
