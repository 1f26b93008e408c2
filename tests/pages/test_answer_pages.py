"""Pages of answers: what stands on them, of which ratings, and that nothing leaves."""

import html
import re
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import masrel
from masrel import Estimating, Reading
from masrel.errors import ParameterError
from tests.cli.process import Caller
from tests.conftest import masrel as masrel_command

__all__ = ["masrel_command"]


def ratings(n_raters: int = 4, n_items: int = 12) -> pd.DataFrame:
    """Whole numbers from 1 to 5; items far apart are named "far"."""
    rng = np.random.default_rng(5)
    true = rng.integers(2, 5, n_items)
    grades = true[:, None] + rng.integers(-1, 2, (n_items, n_raters))
    grades[3, :2] = 1, 5
    names = [f"far {row}" if row == 3 else f"i{row}" for row in range(n_items)]
    return pd.DataFrame(
        grades,
        index=pd.Index(names, name="item"),
        columns=list("ABCDEFGHIJ"[:n_raters]),
    )


@dataclass(frozen=True)
class Page:
    """What a page says, section by section."""

    text: str

    @property
    def words(self) -> str:
        """Everything that is read, without tags, styles and pictures."""
        bare = re.sub(r"<(style|svg).*?</\1>", " ", self.text, flags=re.S)
        return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", bare)).split())

    @property
    def sections(self) -> list[str]:
        return re.findall(r'<section id="(\w+)"', self.text)

    @property
    def pictures(self) -> list[str]:
        """The beginnings of the captions of pictures."""
        captions = re.findall(r"Figure \d+\.</strong>(.*?)</figcaption>", self.text)
        bare = [html.unescape(re.sub(r"<[^>]+>", "", text)) for text in captions]
        return [" ".join(text.split()) for text in bare]

    def heads(self, table: int) -> list[str]:
        found = re.findall(r"<thead>(.*?)</thead>", self.text, re.S)[table]
        cells = re.findall(r"<th[^>]*>([^<]*)", found)
        return [html.unescape(cell).replace("\xa0", " ") for cell in cells]

    def rows(self, table: int) -> list[list[str]]:
        body = re.findall(r"<tbody>(.*?)</tbody>", self.text, re.S)[table]
        return [
            [html.unescape(cell) for cell in re.findall(r"<t[hd][^>]*>([^<]*)<", row)]
            for row in re.findall(r"<tr>(.*?)</tr>", body, re.S)
        ]


def page_of(data: object, **options: object) -> Page:
    return Page(masrel.agree(data, **options).to_html())  # type: ignore[arg-type]


def test_the_result_comes_first_with_value_and_interval() -> None:
    result = masrel.agree(ratings(), target="items")
    page = Page(result.to_html())
    assert page.words.index("allows for chance, is") < page.words.index("Table 1.")
    assert page.heads(0)[:3] == ["Coefficient", "Value", "95 % interval"]
    kappa, interval = result.estimates[1], result.estimates[1].interval
    assert interval is not None
    shown = [f"{kappa.value:.3f}", f"[{interval.low:.3f}, {interval.high:.3f}]"]
    assert [cell.replace("−", "-") for cell in page.rows(0)[1][1:3]] == shown


def test_nothing_leaves_the_page_and_it_is_the_same_twice() -> None:
    result = masrel.agree(ratings(), target="items")
    page = result.to_html()
    assert page == result.to_html()
    assert not re.search(r"<script|<link rel=.stylesheet|(src|url\()=?.?https?:", page)
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


MEASURED = {"coefficients": "icc_a1"}
OF_GRADES = ["Use of each grade", "Agreement on each grade", "Ratings of "]


@pytest.mark.parametrize(
    ("data", "options", "captions"),
    [
        (ratings(4), {}, ["Fleiss' κ of every two raters", *OF_GRADES]),
        (ratings(2), {}, ["Grades of B by those of A", *OF_GRADES]),
        (
            ratings(3) * 1.37 + np.arange(36).reshape(12, 3) / 100.0,
            MEASURED,
            [
                "ICC(A,1) of every two raters",
                "Ratings of ",
                "Shares of the variance of a rating",
            ],
        ),
        (
            ratings(2) * 1.37 + np.arange(24).reshape(12, 2) / 100.0,
            MEASURED,
            [
                "Difference between A and B",
                "Ratings of ",
                "Shares of the variance of a rating",
            ],
        ),
        (
            pd.DataFrame({"item": list("abcdef"), "A": ["x"] * 6, "B": ["x"] * 6}),
            {},
            [],
        ),
        (
            pd.DataFrame({"item": list("abcdef"), "A": [7] * 6, "B": [7] * 6}),
            {},
            [],
        ),
    ],
    ids=[
        "raters",
        "two raters",
        "measured",
        "two who measured",
        "one grade",
        "one number",
    ],
)
def test_pictures_are_those_that_the_ratings_have(
    data: pd.DataFrame, options: dict[str, object], captions: list[str]
) -> None:
    first, *pictures = page_of(data, **options).pictures
    assert first.startswith("Estimates (dots)")
    assert len(pictures) == len(captions)
    assert all(map(str.startswith, pictures, captions))


def test_items_to_discuss_begin_with_those_furthest_apart() -> None:
    page = page_of(ratings(4))
    table = next(at for at in range(5) if page.heads(at)[0] == "Item")
    first = page.rows(table)[0]
    assert first[0] == "far 3"
    assert first[2] == "1, 5, 3, 5"
    disagreements = [float(row[1]) for row in page.rows(table)]
    assert disagreements == sorted(disagreements, reverse=True)


@pytest.mark.parametrize(
    ("options", "cited", "not_cited"),
    [
        ({}, ["Fleiss, 1971"], ["Cohen, 1968", "intervals"]),
        (
            {"estimating": Estimating(weights="linear")},
            ["Fleiss' κ with linear weights (Fleiss, 1971; Cohen, 1968)"],
            [],
        ),
        ({"target": "items"}, ["The 95 % confidence intervals", "Stein, 1981"], []),
        (
            {"coefficients": "kendall_w,icc_a1"},
            ["Kendall's W (Kendall & Babington Smith, 1939)"],
            ["Cohen"],
        ),
        ({"coefficients": "gwet_ac"}, ["(Gwet, 2008)"], ["Fleiss, 1971"]),
    ],
)
def test_methods_say_and_cite_what_was_computed(
    options: dict[str, object], cited: list[str], not_cited: list[str]
) -> None:
    words = page_of(ratings(4), **options).words
    methods = words[words.rindex("Methods, to paste") :]
    assert "4 raters rated 12 items with 5 ordered grades (1, 2, 3, 4, 5)." in methods
    assert all(text in methods for text in cited)
    assert not any(text in methods for text in not_cited)
    # every reference of the text is listed, and none besides
    brackets = " ".join(re.findall(r"\(([^()]*, \d{4}[^()]*)\)", methods))
    listed = re.findall(r" \((\d{4})\)\. ", methods)
    assert {*re.findall(r"\d{4}", brackets)} == {*listed}


def test_the_page_of_a_command_has_its_call_and_the_hash(
    tmp_path: Path, masrel_command: Caller
) -> None:
    file, written = tmp_path / "wide ratings.csv", tmp_path / "page.html"
    ratings(4).to_csv(file)
    done = masrel_command("agree", file, "--target", "items", "--html", written)
    assert (done.code, done.err.splitlines()[-1]) == (0, f"page: {written}")
    words = Page(written.read_text("utf-8")).words
    assert f"masrel agree '{file}' --target items --html {written}" in words
    assert sha256(file.read_bytes()).hexdigest() in words


GROUPS = "site,patient,Kim,Lee\n" + "".join(
    f"{site},{site}{row},{row % 3},{(row + row % 2) % 3}\n"
    for site in ("north", "south", "west")
    for row in range(12)
)


@pytest.mark.parametrize(
    ("command", "first", "methods"),
    [
        (("compare", "--by", "site"), "Differences in agreement", "(Holm, 1979)"),
        (
            ("diagnose", "--ignore", "site", "--target", "items"),
            "Fleiss' κ with and without each rater",
            "(Korn & Graubard, 1998)",
        ),
        (("limits", "--ignore", "site"), "Limits of agreement", "Carkeet, 2015)"),
        (
            ("agree", "--ignore", "site", "--symmetry"),
            "Agreement of the raters",
            "tested by Bowker, Stuart-Maxwell and Bhapkar (Bowker, 1948; Maxwell,",
        ),
    ],
)
def test_other_commands_have_pages_that_begin_with_their_tables(
    tmp_path: Path,
    masrel_command: Caller,
    command: tuple[str, ...],
    first: str,
    methods: str,
) -> None:
    file, written = tmp_path / "groups.csv", tmp_path / "page.html"
    file.write_text(GROUPS)
    name, *options = command
    done = masrel_command(name, file, *options, "--html", written)
    assert done.code == 0, done.err
    words = Page(written.read_text("utf-8")).words
    assert words[words.index("Table 1.") + 9 :].startswith(first)
    assert methods in words[words.rindex("Methods, to paste") :]


def test_clusters_leave_intervals_of_single_items_out() -> None:
    frame = ratings(3).assign(patient=[f"p{row // 3}" for row in range(12)])
    reading = Reading(clusters="patient")
    pictures = page_of(frame, reading=reading).pictures
    assert not any("with 95 % confidence intervals" in text for text in pictures)
    assert any("with 95 %" in of for of in page_of(ratings(3), target="items").pictures)


@pytest.mark.parametrize("name", ["-", "page.txt", "page"])
def test_a_page_needs_a_name_that_says_what_it_is(
    tmp_path: Path, masrel_command: Caller, name: str
) -> None:
    file = tmp_path / "wide.csv"
    ratings(3).to_csv(file)
    done = masrel_command("agree", file, "--html", name)
    assert (done.code, done.out) == (2, "")
    assert done.err == f"masrel: --html: needs a name that ends in .html, got {name}\n"
    assert not Path(name).exists()


def test_simulated_ratings_are_labelled_everywhere() -> None:
    frame = ratings(3).reset_index().melt("item", var_name="rater", value_name="grade")
    page = page_of(frame.assign(source="simulated"))
    assert 'class="banner"' in page.text
    figures = page.text.split("<figure")[1:]
    assert all("Simulated data." in figure for figure in figures)
    assert all(">SIMULATED DATA<" in of for of in figures if "<svg" in of)


@pytest.mark.parametrize(
    ("name", "group", "message"),
    [
        ("scatter", "", "picture: needs one of forest, pairs"),
        (
            "components",
            "",
            "picture: 'components' is not available for these ratings; it needs",
        ),
        ("pairs", "east", "group: needs one of "),
    ],
)
def test_what_the_ratings_have_not_is_refused(
    name: str, group: str, message: str
) -> None:
    with pytest.raises(ParameterError, match=re.escape(message)):
        masrel.agree(ratings(4)).plot(name, group=group)
