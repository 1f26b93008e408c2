"""Every link of a page leads somewhere."""

import re
from pathlib import Path

import pytest

from docs.make.pages import ROOT, pages
from masrel import plots

PAGES = {str(page.relative_to(ROOT)): page for page in pages()}


def prose(page: Path) -> str:
    return re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)


def links(page: Path) -> list[tuple[str, str]]:
    """Return the file and the heading that each link of a page is to."""
    return re.findall(r"\]\((?!https?://)([^)#]*)#?([^)]*)\)", prose(page))


def anchors(page: Path) -> set[str]:
    """Return what the headings of a page are called in links, as GitHub has it."""
    headings = re.findall(r"^#+ (.*)$", prose(page), flags=re.MULTILINE)
    plain = [re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings]
    return {heading.replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("name", PAGES)
def test_every_file_and_heading_that_a_page_points_to_is_there(name: str) -> None:
    page = PAGES[name]
    broken = [
        f"{file}#{heading}"
        for file, heading in links(page)
        if not (target := (page.parent / file if file else page)).exists()
        or (heading and heading not in anchors(target))
    ]
    assert broken == []


def test_every_picture_is_in_the_gallery() -> None:
    files = {file for file, _ in links(PAGES["docs/howto/gallery.md"])}
    names = {f"../figures/gallery_{name}.png" for name in plots.__all__}
    assert names - files == {"../figures/gallery_draw.png"}
