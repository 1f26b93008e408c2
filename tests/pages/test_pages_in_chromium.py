"""Pages of answers as Chromium shows and prints them, kind by kind of ratings.

All of them are held against the width of windows, and against paper. axe, which is
slow, looks at one of them in every window, light and dark, and at those with other
tables in a narrow dark one; what has no element of its own it leaves out.
"""

import re
import shutil
import subprocess
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

pytest.importorskip("playwright")

from playwright.sync_api import Page, sync_playwright

from tests.cli.process import Caller
from tests.lab.serve.browser.axe import violations
from tests.lab.serve.browser.conftest import CHROMIUM, FLAGS

WORDS = shutil.which("pdftotext")
WINDOWS: list[tuple[int, Literal["light", "dark"]]] = [
    *((400, "light"), (768, "dark"), (1280, "dark")),
    *((1280, "light"), (768, "light"), (400, "dark")),
]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium to show a page"),
]


def wide(raters: Sequence[str], grades: Sequence[str], n_items: int = 12) -> str:
    """Return grades, a column a rater, at most one step from what an item is."""
    rng = np.random.default_rng(1)
    true = rng.integers(0, len(grades), (n_items, 1))
    codes = true + rng.integers(-1, 2, (n_items, len(raters)))
    rows = [
        [f"item {row}", *(grades[code] for code in of)]
        for row, of in enumerate(codes.clip(0, len(grades) - 1).tolist())
    ]
    return "\n".join(map(",".join, [["item", *raters], *rows]))


def long(text: str) -> str:
    """Return the ratings of a wide table one a row, without the last of each item."""
    (_, *raters), *rows = (line.split(",") for line in text.splitlines())
    listed = [
        ",".join((item, rater, grade))
        for item, *grades in rows
        for rater, grade in list(zip(raters, grades, strict=True))[:-1]
    ]
    return "\n".join(["item,rater,grade", *listed])


ABC = ("Ann", "Bob", "Cy")
TWO = ("Kim", "Lee")
WORDED = ("none", "slight", "mild", "moderate", "severe", "very severe")
MANY = [f"grade {place:02}" for place in range(18)]
KOREAN = ("없음", "경미함", "중등도", "심함")
MEASURES = [f"{angle}.5" for angle in range(20, 80)]
SETS = ("cough", "cough|fever", "fever", "fever|pain", "pain")
SITES = "\n".join(
    f"{'site' if row == 0 else 'north' if row % 2 else 'south'},{line}"
    for row, line in enumerate(wide(ABC, "123", 24).splitlines())
)

TARGET = ("--target", "items")
KINDS: dict[str, tuple[str, tuple[str, ...]]] = {
    "long": (long(wide([*ABC, *TWO], "1234", 16)), ("agree", *TARGET)),
    "thirty raters": (
        wide([f"R{rater:02}" for rater in range(30)], "01234"),
        ("agree", *TARGET, "--coefficients", "fleiss_kappa,icc_a1"),
    ),
    "measured": (
        wide(TWO, MEASURES),
        ("agree", "--target", "both", "--coefficients", "icc_a1"),
    ),
    "sets": (
        wide(TWO, SETS),
        ("agree", *TARGET, "--metric", "jaccard", "--set-separator", "|"),
    ),
    "worded": (
        wide(ABC, WORDED),
        ("agree", *TARGET, "--categories", ",".join(WORDED), "--weights", "linear"),
    ),
    "Korean": (
        wide(("김민지", "이서준", "박하늘"), KOREAN),
        ("agree", *TARGET, "--categories", ",".join(KOREAN)),
    ),
    "one grade": (wide(ABC, ["yes"]), ("agree", *TARGET)),
    "compare": (SITES, ("compare", "--by", "site")),
    "diagnose": (  # with a table that is wider than paper
        wide(ABC, MANY, 30),
        ("diagnose", *TARGET, "--categories", ",".join(MANY)),
    ),
    "limits": (wide(TWO, MEASURES), ("limits", "--unit", "deg")),
}

ALIKE = ("long", "measured", "sets", "Korean")
"""Kinds whose pages have no element that those of others have not."""

MakePage = Callable[[str], Path]


@pytest.fixture
def make_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> MakePage:
    def make(kind: str) -> Path:
        text, (command, *options) = KINDS[kind]
        table, page = tmp_path / "ratings.csv", tmp_path / "page.html"
        table.write_text(text, encoding="utf-8")
        call = Caller(monkeypatch, capsys)
        done = call(command, table, *options, "--html", page)
        assert done.code == 0, done.err
        return page

    return make


@pytest.fixture(scope="module")
def window() -> Iterator[Page]:
    """The one window that shows all pages: a new one costs more than most of them."""
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield chromium.new_page()
        chromium.close()


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_can_be_read_in_every_window_and_on_paper(
    kind: str, make_page: MakePage, window: Page, tmp_path: Path
) -> None:
    page, asked = make_page(kind), list[str]()
    window.on("request", lambda each: asked.append(each.url))
    window.goto(page.as_uri())
    for width, scheme in WINDOWS if kind == "worded" else WINDOWS[-3:]:
        window.set_viewport_size({"width": width, "height": 900})
        window.emulate_media(color_scheme=scheme)
        over = "document.documentElement.scrollWidth - innerWidth"
        assert window.evaluate(over) <= 0, width
        if kind == "worded" or (width == 400 and kind not in ALIKE):
            assert violations(window) == [], (width, scheme)

    heads_and_cells = window.locator("th:visible, td:visible").all_inner_texts()
    window.pdf(path=tmp_path / "page.pdf", prefer_css_page_size=True)
    assert [url for url in asked if not url.startswith("data:")] == [page.as_uri()]
    if WORDS is not None:
        paper = subprocess.run(
            [WORDS, "-layout", tmp_path / "page.pdf", "-"],
            check=True, capture_output=True, encoding="utf-8",
        )  # fmt: skip
        missing = words(" ".join(heads_and_cells)) - words(paper.stdout)
        assert not missing


def words(text: str) -> Counter[str]:
    """Return how often each word is met, however its letters are composed."""
    # a line may end after any syllable of Hangul; without a font that has them
    # Chromium's paper lacks some
    syllables = "[가-힣]|" if has_hangul() else ""
    text = unicodedata.normalize("NFKC", text)
    return Counter(re.findall(rf"{syllables}[^\s가-힣]+", text))


@cache
def has_hangul() -> bool:
    """Return whether a font here has Hangul."""
    call = ["fc-list", ":lang=ko", "family"]
    return bool(shutil.which(call[0]) and subprocess.check_output(call))
