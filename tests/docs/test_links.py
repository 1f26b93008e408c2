"""Every link of a page leads somewhere, and every page is found."""

import re
from pathlib import Path

import pytest

from docs.make.pages import ROOT, pages
from masrel import plots
from masrel.cli import GROUPS

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


def test_every_page_is_two_clicks_from_the_start() -> None:
    near = {ROOT / "docs" / "index.md"}
    for _ in range(2):
        near |= {
            (p.parent / file).resolve() for p in near for file, _ in links(p) if file
        }
        near = {page for page in near if page.suffix == ".md"}
    site = {page for page in PAGES.values() if page.parent != ROOT}
    assert [str(page) for page in sorted(site - near)] == []


def test_every_command_is_on_a_page() -> None:
    folder = ROOT / "docs" / "reference" / "commands"
    text = "".join(
        (folder / f"{n}.md").read_text() for n in ("ratings", "study", "joint")
    )
    commands = [command for group in GROUPS.values() for command in group]
    assert re.findall(r":prog: masrel (\w+)$", text, re.M) == commands


def test_every_picture_is_in_the_gallery() -> None:
    files = {file for file, _ in links(PAGES["docs/howto/gallery.md"])}
    names = {f"../figures/gallery_{name}.png" for name in plots.__all__}
    assert names - files == {"../figures/gallery_draw.png"}
