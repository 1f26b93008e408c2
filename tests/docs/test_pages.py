"""What the pages show is what their code and commands print today.

A page is a test case. ``python -m docs.make.pages PAGE`` writes what it prints now.
"""

import ast
import difflib
import tomllib
from pathlib import Path

import msgspec
import pytest

from docs.make.pages import ROOT, Block, PageError, pages, read, renewed
from masrel.lab.protocol import (
    DeviceSettings,
    Model,
    Questionnaire,
    Rater,
    RaterField,
    Report,
    ScaleDefinition,
)
from tests.architecture.test_names import DIALECT, PREFIXES, bound
from tests.lab.protocol.documents import VALID

PAGES = {str(page.relative_to(ROOT)): page for page in pages()}
TEXTS = {name: page.read_text(encoding="utf-8") for name, page in PAGES.items()}
BLOCKS = [block for name, text in TEXTS.items() for block in read(text, name)]

# They take from three seconds to half a minute.
SLOW = {
    "docs/reference/agree.md",
    "docs/howto/ci.md",
    "docs/howto/laboratory/conduct.md",
    "docs/howto/gallery.md",
    "docs/howto/laboratory/devices_in_python.md",
    "docs/howto/laboratory/hardware.md",
    "docs/howto/laboratory/identification.md",
    "docs/howto/latent_trait.md",
    "docs/howto/planning.md",
    "docs/howto/laboratory/report.md",
    "docs/howto/laboratory/training.md",
}

# Whose files are looked at, too, by tests/lab/flow/test_coordinated_study.py.
RUN_ELSEWHERE = {"docs/howto/laboratory/coordinating.md"}

# Every block that is not run, and why. A new one has to be entered here.
NOT_RUN = [
    ("README.md", "installs masrel"),
    ("README.md", "installs masrel; .ci/run runs it"),
    ("README.md", "installs masrel; .ci/run runs it"),
    ("CONTRIBUTING.md", "installs masrel and runs the tests"),
    ("CONTRIBUTING.md", "installs Sphinx and builds the site"),
    ("docs/development/release.md", "builds in a new folder"),
    ("docs/evidence/accuracy.md", "takes minutes"),
    ("docs/evidence/accuracy.md", "takes minutes"),
    ("docs/evidence/coverage.md", "takes half an hour"),
    ("docs/evidence/training.md", "takes ten minutes"),
    ("docs/howto/audit.md", "it is shown above, and takes some seconds"),
    ("docs/howto/ci.md", "tests/docs/test_ci.py runs it"),
    ("docs/howto/ci.md", "tests/docs/test_ci.py runs it"),
    ("docs/howto/ci.md", "tests/docs/test_ci.py runs it"),
    ("docs/howto/gallery.md", "takes some seconds"),
    ("docs/howto/judges.md", "installs masrel"),
    ("docs/howto/judges.md", "is for GitHub"),
    ("docs/howto/laboratory/calibration.md", "needs a CAN bus"),
    ("docs/howto/laboratory/calibration.md", "real time differs every time"),
    ("docs/howto/laboratory/devices_in_python.md", "needs the amplifier"),
    ("docs/howto/laboratory/hardware.md", "needs a CAN bus"),
    ("docs/howto/laboratory/hardware.md", "needs a CAN bus"),
    ("docs/howto/laboratory/hardware.md", "needs a CAN bus"),
    ("docs/howto/laboratory/hardware.md", "needs a CAN bus"),
    ("docs/howto/laboratory/hardware.md", "needs a CAN bus"),
    ("docs/howto/laboratory/moteus.md", "needs a CAN bus"),
    ("docs/howto/laboratory/moteus.md", "serves until it is stopped"),
    ("docs/howto/laboratory/report.md", "needs Chromium"),
    ("docs/howto/laboratory/report.md", "needs other interpreters"),
    ("docs/howto/laboratory/serving.md", "serves until it is stopped"),
    ("docs/howto/laboratory/serving.md", "serves until it is stopped"),
    ("docs/index.md", "installs masrel"),
]

# What a piece of a protocol may be, and what it leaves out.
PIECES = {
    "device": (DeviceSettings, {}),
    "models": (Model, VALID["models"][0]),
    "questionnaires": (Questionnaire, {}),
    "rater_fields": (dict[str, RaterField], {}),
    "raters": (Rater, {}),
    "report": (Report, {}),
    "scale": (ScaleDefinition, {}),
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else [])
        for name in PAGES
        if name not in RUN_ELSEWHERE
    ],
)
def test_a_page_shows_what_it_prints(name: str) -> None:
    hold_page(name)


def hold_page(name: str, folder: Path | None = None) -> None:
    """Hold a page against what it prints now, and keep its files in a folder."""
    page, now = TEXTS[name], renewed(TEXTS[name], name, folder)
    if page != now:
        changes = difflib.unified_diff(
            page.splitlines(), now.splitlines(), name, "printed now", lineterm=""
        )
        hint = f"If that is right: python -m docs.make.pages {name}"
        pytest.fail("\n".join([*changes, "", hint]), pytrace=False)


def test_blocks_that_are_not_run_are_those_of_the_list() -> None:
    assert [(block.page, block.exempt) for block in BLOCKS if block.exempt] == NOT_RUN


def test_names_in_examples_are_the_words_of_the_field() -> None:
    names = [
        f"{block.page}:{block.number + line}: {name}"
        for block in BLOCKS
        if block.language == "python"
        for name, line in bound(ast.parse("\n".join(block.lines)))
        if name in DIALECT or name.startswith(PREFIXES)
    ]
    assert names == []


@pytest.mark.parametrize(
    "block",
    [block for block in BLOCKS if block.language == "toml"],
    ids=lambda block: f"{block.page}-{block.number}",
)
def test_a_piece_of_a_protocol_has_keys_and_values_that_it_may(block: Block) -> None:
    for table, content in tomllib.loads("\n".join(block.lines)).items():
        kind, rest = PIECES[table]
        for entry in content if isinstance(content, list) else [content]:
            if table == "device":  # a device's own table is that device's matter
                entry = {k: v for k, v in entry.items() if not isinstance(v, dict)}
            msgspec.convert(rest | entry, kind)


def test_the_readme_begins_with_the_two_commands_that_ci_takes_from_it() -> None:
    of_shell = (b for b in BLOCKS if b.page == "README.md" and b.language == "sh")
    (main_job,), (tests,), *_ = [block.lines for block in of_shell]
    assert main_job.endswith("masrel demo out")
    assert tests.endswith("python -m pytest -n auto")


# The reader sees what it has to see


def page(*blocks: str) -> str:
    return "\n\n".join(["# A page", *blocks]) + "\n"


def python(*lines: str) -> str:
    return "\n".join(["```python", *lines, "```"])


def console(*lines: str) -> str:
    return "\n".join(["```", *lines, "```"])


@pytest.mark.parametrize(
    ("stale", "right"),
    [
        (["print(1 / 4)  # prints 0.26"], ["print(1 / 4)  # prints 0.25"]),
        (["print(1)"], ["print(1)", "# prints 1"]),
        (["print(1)", "# prints 1", "# prints 2"], ["print(1)", "# prints 1"]),
        (["x = 1  # prints 1"], ["x = 1"]),
        (["print()", "# prints 1"], ["print()", "# prints"]),
    ],
)
def test_a_comment_of_what_is_printed_is_renewed(
    stale: list[str], right: list[str]
) -> None:
    assert renewed(page(python(*stale))) == page(python(*right))
    assert renewed(page(python(*right))) == page(python(*right))


def test_a_command_reads_the_file_that_the_page_shows() -> None:
    text = page("In `r.csv`:", console("item,Kim,Lee", "A,1,2"))
    text += "\n" + console("$ masrel agree r.csv --item place", "ratings")
    (line,) = set(renewed(text).splitlines()) - set(text.splitlines())
    assert line.startswith("masrel: r.csv: ")


@pytest.mark.parametrize(
    ("shown", "right"),
    [
        (["a", "..."], ["a", "..."]),
        (["...", "c"], ["...", "c"]),
        (["a", "b", "...", "c"], ["a", "b", "...", "c"]),
        (["x", "...", "c"], ["a", "...", "c"]),
        (["a", "...", "x"], ["a", "...", "c"]),
        (["..."], ["..."]),
        ([], ["a", "b", "c"]),
        (["a", "c"], ["a", "b", "c"]),
        (["a", "…", "…c"], ["a", "…", "…c"]),
        (["…", "b"], ["a", "b", "c"]),
    ],
)
def test_three_dots_stand_for_lines_of_output(
    shown: list[str], right: list[str]
) -> None:
    command = "$ python -c \"print('a', 'b', 'c', sep='\\n')\""
    assert renewed(page(console(command, *shown))) == page(console(command, *right))


def test_a_module_takes_the_place_of_a_block() -> None:
    marker = "<!-- instead: zipfile -c a.txt studies -->\n"
    shown = marker + console("$ masrel serve nowhere", "...")
    assert renewed(text := page(shown, console("$ ls a.txt", "a.txt"))) == text


def test_what_is_typed_is_seen_at_the_prompt() -> None:
    commands = "$ masrel init pilot", "$ masrel schedule pilot"
    run = "$ masrel run pilot --rater R1 --session test --clock simulated"
    text = page(console(*commands), "<!-- typed: stop -->\n" + console(run))
    assert "or type stop: stop\nmasrel: session test of R1 was stopped" in renewed(text)


@pytest.mark.parametrize(
    "block",
    [
        "```sh\nmasrel device probe\n```",
        "```\nmasrel device probe\n```",
        "```\npython -m docs.make.pages\n```",
        "```text\n.venv/bin/python -m pytest\n```",
        "```\nfirst\n$ masrel check pilot\n```",
        "```py\nprint(1)\n```",
        "```python slow\nprint(1)\n```",
        "```\n>>> 1 + 1\n```",
        "- a list\n  ```python\n  print(1)\n  ```",
        "~~~python\nprint(1)\n~~~",
        "```python\nprint(1)",
        "<!-- not run: -->\n```sh\nmasrel device probe\n```",
        "<!-- a remark -->\n```sh\nmasrel device probe\n```",
    ],
)
def test_what_is_neither_run_nor_marked_is_refused(block: str) -> None:
    with pytest.raises(PageError, match="needs"):
        read(page(block))
