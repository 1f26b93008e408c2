"""A page as Chromium shows and prints it: in a dark room, on a telephone, on paper."""

import json
import re
import shutil
import subprocess
import zipfile
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from masrel.cli import cli
from masrel.lab.report._document import ReportFiles
from tests.benchmarks.many_ratings import many_ratings

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
WORDS = shutil.which("pdftotext")
XHTML = "{http://www.w3.org/1999/xhtml}"
OPTIONS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update"),
    *("--disable-sync", "--allow-file-access-from-files", "--enable-logging=stderr"),
)
# Relative luminance and contrast as WCAG 2.2 defines them.
MEASURE = """
const page = document.querySelector("iframe").contentDocument;
const look = page.defaultView.getComputedStyle;
const numbers = c => c.match(/[\\d.]+/g).map(Number);
const channel = v => (v /= 255) <= .04045 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4;
const light = ([r, g, b]) =>
  .2126 * channel(r) + .7152 * channel(g) + .0722 * channel(b);
function ground(e) {
  for (; e; e = e.parentElement) {
    const c = numbers(look(e).backgroundColor);
    if (c.length < 4 || c[3] === 1) return c;
  }
}
function contrast(e) {
  const both = [light(numbers(look(e).color)), light(ground(e))].sort((a, b) => b - a);
  return (both[0] + .05) / (both[1] + .05);
}
page.querySelectorAll("details").forEach(d => d.open = true);
const texts = [...page.body.querySelectorAll("*")].filter(e =>
  [...e.childNodes].some(n => n.nodeType === 3 && n.data.trim()));
const boxes = [...page.querySelectorAll("[role=region]")];
const edge = page.documentElement.clientWidth + 1;
document.title = JSON.stringify({
  dark: light(ground(page.body)) < .1,
  contrast: Math.min(...texts.map(contrast)),
  n_texts: texts.length,
  over: page.documentElement.scrollWidth - page.documentElement.clientWidth,
  wide: [...page.querySelectorAll("p, h1, h2, h3, figcaption, li, dd, [role=region]")]
    .filter(e => e.getBoundingClientRect().right > edge && !e.matches(".skip"))
    .map(e => e.outerHTML.slice(0, 80)),
  scrolling: boxes.filter(b => b.scrollWidth > b.clientWidth).length,
  unreached: boxes.filter(b => {
    b.focus();
    return page.activeElement !== b || b.tabIndex !== 0 || !b.ariaLabel;
  }).length,
  outside: [...page.querySelectorAll("table, figure svg")].filter(
    e => !e.closest("[role=region]")).length,
  shrunk: [...page.querySelectorAll("figure svg")].filter(
    i => i.clientWidth < .69 * i.width.baseVal.value).length,
  skips: page.querySelector("a").hash === "#content",
});
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium to show a page"),
]


def run(*options: str, folder: Path) -> tuple[str, str]:
    """What Chromium prints, and what it complains of."""
    assert CHROMIUM is not None
    call = [CHROMIUM, *OPTIONS, f"--user-data-dir={folder / 'profile'}", *options]
    done = subprocess.run(
        call, check=True, capture_output=True, timeout=120, encoding="utf-8"
    )
    return done.stdout, done.stderr


def measured(page: Path, folder: Path, *options: str) -> dict[str, Any]:
    """What a window of 400 px shows of a page."""
    frame = folder / "frame.html"
    box = (
        f'<iframe src="{page.as_uri()}" style="width: 400px; height: 900px; border: 0">'
    )
    script = f"<script>onload = () => {{{MEASURE}}}</script>"
    frame.write_text(f"<title></title>{box}</iframe>{script}", encoding="utf-8")
    shown, said = run(*options, "--dump-dom", frame.as_uri(), folder=folder)
    assert "CONSOLE" not in said
    title = re.search("<title>(.*?)</title>", shown, re.S)
    assert title is not None
    found: dict[str, Any] = json.loads(
        title[1].replace("&lt;", "<").replace("&gt;", ">")
    )
    return found


@pytest.mark.parametrize("look", ["light", "dark"])
def test_a_telephone_shows_all_of_a_page_with_enough_contrast(
    look: str, simulated: ReportFiles, tmp_path: Path
) -> None:
    scheme = {"light": "1", "dark": "0"}[look]
    option = f"--blink-settings=preferredColorScheme={scheme}"
    page = measured(simulated.html, tmp_path, option)
    assert page["dark"] == (look == "dark")
    assert page["n_texts"] > 100
    assert page["contrast"] >= 4.5
    assert page["over"] == 0  # nothing beside the window
    assert page["wide"] == []
    assert page["scrolling"] > 3  # in boxes of their own
    for count in ("unreached", "outside", "shrunk"):
        assert page[count] == 0, count
    assert page["skips"]


@pytest.mark.parametrize("report", ["published", "simulated"])
def test_a_page_asks_for_nothing_but_itself(
    report: str, request: pytest.FixtureRequest
) -> None:
    files: ReportFiles = request.getfixturevalue(report)
    api = pytest.importorskip("playwright.sync_api")
    asked: list[str] = []
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox"]
        )
        page = browser.new_page()
        page.on("request", lambda each: asked.append(each.url))
        page.goto(files.html.as_uri(), wait_until="networkidle")
        page.locator("a").first.focus()
        page.emulate_media(media="print")
        assert page.locator("figure svg").count() == len(files.figures) // 2
        # the listener hears what a page asks for
        page.evaluate("fetch('http://127.0.0.1:9/').catch(() => 0)")
        browser.close()
    itself, *others, heard = [url for url in asked if not url.startswith("data:")]
    assert itself == files.html.as_uri()
    assert others == []
    assert heard == "http://127.0.0.1:9/"


@dataclass(frozen=True)
class Word:
    """A word of a PDF, and its box in points from the upper left corner."""

    text: str
    left: float
    top: float
    right: float
    bottom: float


def printed(page: Path, folder: Path) -> list[list[Word]]:
    """The words on each sheet of paper."""
    pdf, words = folder / "page.pdf", folder / "words.html"
    run(
        "--no-pdf-header-footer",
        f"--print-to-pdf={pdf}",
        page.as_uri(),
        folder=folder,
    )
    assert WORDS is not None
    subprocess.run([WORDS, "-bbox", str(pdf), str(words)], check=True)
    keys = ("xMin", "yMin", "xMax", "yMax")
    return [
        [
            Word(str(word.text), *(float(word.attrib[key]) for key in keys))
            for word in sheet.iter(f"{XHTML}word")
        ]
        for sheet in ElementTree.parse(words).iter(f"{XHTML}page")
    ]


@pytest.mark.skipif(WORDS is None, reason="there is no pdftotext to read a PDF with")
def test_no_document_loses_a_column_of_thirty_raters(tmp_path: Path) -> None:
    raters = {f"R{number:03d}" for number in range(1, 31)}
    many_ratings(tmp_path, 30, 4, 1)
    call = f"report {tmp_path} --only grades --format latex --format docx --quiet"
    cli(call.split(), standalone_mode=False)
    folder = tmp_path / "report"
    with zipfile.ZipFile(folder / "report.docx") as document:
        text = document.read("word/document.xml").decode()
    words = [
        word for sheet in printed(folder / "report.html", tmp_path) for word in sheet
    ]
    heads = {  # names above the columns of the figure stand upright
        "pdf": [w.text for w in words if w.bottom - w.top < w.right - w.left],
        "docx": re.findall(r">(R\d{3})<", text),
        "latex": re.findall(r"\bR\d{3}\b", (folder / "report.tex").read_text("utf-8")),
    }
    for form, names in heads.items():
        assert raters <= {*names}, form


def only_first_sheet_has(sheets: list[list[Word]], banner: str) -> None:
    """Check that a banner, which hides what is under it, has nothing under it."""
    n_words = len(banner.split())
    for sheet in sheets:
        places = [
            place
            for place in range(len(sheet) - n_words + 1)
            if " ".join(w.text for w in sheet[place : place + n_words]) == banner
        ]
        alone = 0
        for place in places:
            words = sheet[place : place + n_words]
            beside = [w for w in sheet if w.bottom > words[0].top - 2]
            alone += [w for w in beside if w.top < words[0].bottom + 2] == words
        assert alone == (sheet is sheets[0])


@pytest.mark.skipif(WORDS is None, reason="there is no pdftotext to read a PDF with")
@pytest.mark.parametrize("report", ["published", "simulated"])
def test_on_paper_no_text_is_under_the_banner_and_no_caption_is_alone(
    report: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    files: ReportFiles = request.getfixturevalue(report)
    sheets = printed(files.html, tmp_path)
    assert len(sheets) > 4
    top, foot = 18 / 25.4 * 72, (297 - 16) / 25.4 * 72  # of what is not margin
    if report == "simulated":
        only_first_sheet_has(sheets, "SIMULATED DATA: no person gave these grades.")
    captions = []
    for sheet in sheets:
        head = [word.text for word in sheet if word.top < top - 1]
        assert head == (["SIMULATED", "DATA"] if report == "simulated" else [])
        body = [word for word in sheet if top - 1 <= word.top < foot]
        for word in body:
            assert word.bottom <= foot + 1, word
            assert 30 < word.left, word
            assert word.right < 565, word
        for first, second in pairwise(body):
            number = re.fullmatch(r"(S?)(\d+)\.", second.text)
            if first.text not in ("Table", "Figure") or number is None:
                continue
            captions.append((first.text, number[1], int(number[2])))
            if first.text == "Table":  # its head is just below, and rows are below that
                below = sorted({w.top for w in body if w.top > first.bottom})
                assert len(below) >= 3, second
                assert below[0] - first.bottom < 40, second
            else:  # the picture, of letters and lines, is just above
                above = [w for w in body if first.top - 60 < w.bottom < first.top]
                assert len({word.left for word in above}) > 1, second
    for kind in ("Table", "Figure"):
        # parts of a table have one number
        every = [*dict.fromkeys(caption for caption in captions if caption[0] == kind)]
        n_main = sum(prefix == "" for _, prefix, _ in every)
        numbers = [*range(1, n_main + 1), *range(1, len(every) - n_main + 1)]
        assert [number for *_, number in every] == numbers
        files_of = files.tables if kind == "Table" else files.figures[::2]
        assert len(every) >= len(files_of) > 0
