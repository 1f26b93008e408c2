"""docs/hardware.md says first what has not been tested."""

from pathlib import Path

PAGE = (Path(__file__).parents[4] / "docs" / "hardware.md").read_text(encoding="utf-8")


def test_the_page_says_first_that_it_has_not_been_tested() -> None:
    first = PAGE.split("\n\n")[1]
    assert first.startswith("**Nothing on this page has been tested on physical hard")
