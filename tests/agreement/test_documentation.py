"""The pages on agreement leave no public name out, and have an example each."""

import re
from pathlib import Path

import pytest

from masrel import agreement

DOCS = Path(__file__).parents[2] / "docs"
INDEX = DOCS / "reference" / "coefficients" / "index.md"
PAGES = sorted(set(INDEX.parent.glob("*.md")) - {INDEX})
INPUT = DOCS / "reference" / "formats" / "memory.md"


@pytest.mark.parametrize("page", [INDEX, INPUT, *PAGES], ids=lambda page: page.stem)
def test_a_page_has_an_example(page: Path) -> None:
    assert "```python\n" in page.read_text("utf-8")


def test_the_index_points_to_every_page() -> None:
    links = re.findall(r"\]\((\w+)\.md", INDEX.read_text("utf-8"))
    assert [page.name for page in PAGES if page.stem not in links] == []


def test_every_public_name_is_on_a_page() -> None:
    text = "".join(page.read_text("utf-8") for page in [INDEX, INPUT, *PAGES])
    assert [name for name in agreement.__all__ if f"`{name}`" not in text] == []
