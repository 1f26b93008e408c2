"""The report as a whole: one page that stands alone, and the same in other forms."""

import csv
import re
from pathlib import Path

import pytest

from masrel.lab.report._document import ReportFiles
from tests.lab.report.pages import (
    HOSTILE,
    Page,
    markdown_tables,
    page_of,
)


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def csv_rows(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


@pytest.mark.parametrize("report", ["published", "simulated"])
def test_the_page_needs_no_other_file(
    report: str, request: pytest.FixtureRequest
) -> None:
    files: ReportFiles = request.getfixturevalue(report)
    text, page = files.html.read_text(encoding="utf-8"), page_of(files)
    assert "url(" not in text.replace("url(#", "")
    assert "@import" not in text
    assert page.tags.isdisjoint({"script", "iframe", "object", "base"})
    assert len(page.images) == len(files.figures) // 2 > 0
    # cells of a grid are an image that the figure holds itself; there is no icon
    held = ("#", "data:image/png;base64,", "data:,")
    assert all(link.startswith(held) for link in page.links)


def test_pictures_are_told_in_words_and_the_figures_need_nothing_either(
    published: ReportFiles,
) -> None:
    svgs = [path.read_bytes() for path in published.figures if path.suffix == ".svg"]
    images = page_of(published).images
    assert all(len(image["aria-label"]) > 30 for image in images)
    for svg in svgs:
        links = re.findall(rb'(?:href|src)="([^"]*)"', svg)
        # cells of a grid are an image that the figure holds itself
        held = (b"#", b"data:image/png;base64,")
        assert all(link.startswith(held) for link in links)


def test_the_contents_leave_out_what_is_not_in_the_data(published: ReportFiles) -> None:
    text = published.html.read_text(encoding="utf-8")
    nav = text.partition("<nav")[2].partition("</nav>")[0]
    assert 'href="#agreement"' in nav
    assert 'id="test-retest' not in text
    # where it says why
    assert "Not in these data: " in text
    assert "there are no ratings of session retest." in text


def test_a_main_part_comes_before_a_folded_supplement(published: ReportFiles) -> None:
    text = published.html.read_text(encoding="utf-8")
    main, folded, supplement = text.partition("<details>")
    assert folded
    names = ["agreement", "grades", "confusion", "traces", "methods"]
    assert re.findall(r'<section id="([\w-]+)"', main) == names
    assert "supplement" in re.findall(r'href="#([\w-]+)"', main)
    for name in ("design", "agreement-more", "speeds", "methods-more"):
        assert f'<section id="{name}"' in supplement
    numbers = [re.findall(r"Table (S?\d+)\.<", part) for part in (main, supplement)]
    assert numbers == [["1"], [f"S{n}" for n in range(1, len(numbers[1]) + 1)]]
    markdown = published.markdown.read_text(encoding="utf-8")
    assert re.findall("^## (.*)$", markdown, re.M)[-3:] == [
        "Methods", "Supplement", "Provenance",
    ]  # fmt: skip


def n_further_parts(page: Page) -> int:
    """How many captions are of what is not the first part of its table."""
    return sum(bool(re.search(r"\(part [2-9] of", text)) for text in page.captions)


def test_simulated_data_say_so_on_every_page_table_and_figure(
    simulated: ReportFiles,
) -> None:
    page = page_of(simulated)
    text = simulated.html.read_text(encoding="utf-8")
    markdown = simulated.markdown.read_text(encoding="utf-8")
    assert 'class="banner"' in text
    assert "SIMULATED DATA" in markdown.split("\n##")[0]
    # the estimates are there twice
    n_tables = 1 + len(simulated.tables) + n_further_parts(page)
    assert len(page.captions) == n_tables + len(page.images)
    for caption in page.captions:
        assert re.match(r"(Table|Figure) S?\d+\. Simulated data\. ", caption), caption
    captions = re.findall(r"^\*\*(?:Table|Figure) S?\d+\.\*\*.*$", markdown, re.M)
    assert len(captions) == len(page.captions)
    assert all("**Simulated data.**" in caption for caption in captions)
    for path in simulated.tables:
        head, *rows = csv_rows(path)
        assert head[-1] == "data"
        assert {row[-1] for row in rows} == {"simulated"}, path.name


def test_published_data_are_not_called_simulated(published: ReportFiles) -> None:
    for path in (published.html, published.markdown):
        text = path.read_text(encoding="utf-8")
        assert "simulated data" not in text.lower()
        assert "Park, Kim and Damiano (2012)" in text.split("Agreement")[0]
    assert {row[-1] for path in published.tables for row in csv_rows(path)[1:]} == {
        "published"
    }


def test_text_of_a_study_is_text_and_no_markup(simulated: ReportFiles) -> None:
    page = page_of(simulated)
    text = simulated.html.read_text(encoding="utf-8")
    assert page.headings[0] == HOSTILE
    assert "script" not in page.tags
    assert "<script" not in text
    assert text.count("</style>") == 1 + len(page.images)
    markdown = simulated.markdown.read_text(encoding="utf-8")
    assert "<script" not in re.sub(r"\\<", "", markdown)
    assert HOSTILE not in markdown
    # A cell with a "|" is still one cell.
    rows = [row for table in markdown_tables(markdown) for row in table]
    notes = [row[-1] for row in rows if row[0] in ("test", "retest")]
    assert notes == [HOSTILE, HOSTILE]


@pytest.mark.parametrize("report", ["published", "simulated"])
def test_html_and_markdown_hold_the_same_tables(
    report: str, request: pytest.FixtureRequest
) -> None:
    files: ReportFiles = request.getfixturevalue(report)
    in_html = [
        [[" ".join(cell.split()) for cell in row] for row in table]
        for table in page_of(files).tables
    ]
    in_markdown = markdown_tables(files.markdown.read_text(encoding="utf-8"))

    def plain(tables: list[list[list[str]]]) -> list[list[list[str]]]:
        # an index is set low in HTML, and written with "_" in Markdown
        return [[[c.replace("_", "") for c in row] for row in t] for t in tables]

    assert plain(in_html) == plain(in_markdown)
    n_further = n_further_parts(page_of(files))
    assert len(in_html) == len(files.tables) + 1 + n_further  # estimates: twice


def test_the_inputs_are_named_and_symbols_have_their_index_set_low(
    published: ReportFiles,
) -> None:
    for path in (published.html, published.markdown):
        text = path.read_text(encoding="utf-8")
        for name in ("protocol", "ratings", "grades given in person"):
            assert re.search(rf"SHA-256 of the {name}\W+.*[0-9a-f]{{64}}", text)
    text = published.html.read_text(encoding="utf-8")
    assert ("ν<sub>L</sub>" in text, "ν_L" in text) == (True, False)


def test_no_file_holds_a_time_of_day(published: ReportFiles) -> None:
    folder = published.html.parent
    for name, data in contents(folder).items():
        if not name.endswith(".png"):
            assert not re.search(rb"\b20\d\d-\d\d-\d\d\b|\b\d\d:\d\d:\d\d\b", data), (
                name
            )
        assert b"dc:date" not in data
        assert b"tIME" not in data
