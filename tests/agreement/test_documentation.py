"""The pages on agreement print what they say, and leave no public name out."""

import contextlib
import inspect
import io
import re
import warnings
from pathlib import Path

import pytest

from masrel import agreement

DOCS = Path(__file__).parents[2] / "docs"
INDEX = DOCS / "agreement.md"
PAGES = sorted((DOCS / "agreement").glob("*.md"))

EXAMPLES = [
    pytest.param(code, id=f"{page.stem}-{number}")
    for page in [INDEX, *PAGES]
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


def targets(page: Path) -> list[str]:
    return re.findall(r"\]\((?!https?://)([^)#]+)", page.read_text("utf-8"))


@pytest.mark.parametrize("code", EXAMPLES)
def test_an_example_prints_what_the_page_says(code: str) -> None:
    said = re.findall(r"# prints (.*)", code)
    assert said
    assert printed(code) == said


def test_the_check_sees_a_wrong_number() -> None:
    assert printed("print(1 / 4)") != ["0.26"]


@pytest.mark.parametrize("page", [INDEX, *PAGES], ids=lambda page: page.stem)
def test_a_page_has_an_example_and_good_links(page: Path) -> None:
    text = page.read_text("utf-8")
    assert "```python\n" in text
    broken = [name for name in targets(page) if not (page.parent / name).exists()]
    assert broken == []


def test_the_index_points_to_every_page() -> None:
    linked = {(DOCS / name).resolve() for name in targets(INDEX)}
    assert [page.name for page in PAGES if page.resolve() not in linked] == []


def test_every_public_function_is_on_a_page() -> None:
    text = "".join(page.read_text("utf-8") for page in [INDEX, *PAGES])
    functions = [
        name
        for name in agreement.__all__
        if inspect.isfunction(getattr(agreement, name))
    ]
    assert functions
    assert [name for name in functions if f"`{name}`" not in text] == []
