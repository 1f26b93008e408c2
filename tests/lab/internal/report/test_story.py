"""Sections of the story: each grade, grades by intended grade, order, methods."""

import math
import re
from importlib.metadata import version
from pathlib import Path

import pytest

import masrel
from masrel.agreement import COEFFICIENTS
from masrel.intervals import diagnose
from masrel.lab.analysis import analyze
from masrel.lab.analysis._category_agreement import category_agreement
from masrel.lab.analysis._given_grades import GivenGrades, given_grades
from masrel.lab.protocol import Protocol, scale_of
from masrel.lab.ratings import Ratings, rating_matrix, ratings_from_rows
from masrel.lab.report._document import SECTIONS
from masrel.lab.report._material import gather
from masrel.pages._references import (
    bibtex,
    cited,
    coefficient_references,
    scale_references,
)
from masrel.pages._sections import Listing, Paragraph, Section
from masrel.plots._style import ALARM, GREY
from masrel.scales import PUBLISHED_SCALES
from masrel.tables._tables import Table
from tests.lab.analysis.studies import of_session, plan, protocol_with, ratings, table_v

BIB = Path(masrel.__file__).parent / "pages/templates/references.bib"
AUTHOR = re.compile(r"\((?:[^()]*, \d{4}(?:; )?)+\)")


def section(name: str, protocol: Protocol, rows: Ratings, **options: object) -> Section:
    analysis = analyze(protocol, rows, **options)  # type: ignore[arg-type]
    return SECTIONS[name](gather(protocol, rows, analysis))


def table_of(made: Section) -> Table:
    (table,) = (block for block in made.blocks if isinstance(block, Table))
    return table


def text_of(made: Section) -> str:
    return " ".join(b.text for b in made.blocks if isinstance(b, Paragraph))


def test_agreement_on_each_grade_is_that_of_the_diagnosis() -> None:
    rows, protocol = table_v(), protocol_with(plan())
    (entry,) = analyze(protocol, rows).estimates
    grades = rows.scale.grades
    found = category_agreement(entry, rows, 0.9)
    matrix = rating_matrix(rows, session="test", models=entry.models)
    with pytest.warns(masrel.errors.SmallSampleWarning):
        expected = diagnose(matrix.grades, categories=grades, target="items", level=0.9)
    assert [row.n_ratings for row in found] == expected.category_counts.tolist()
    for name in ("low", "high"):
        own = [getattr(row, name) for row in found]
        assert own == pytest.approx(getattr(expected, f"category_{name}"), nan_ok=True)
    # kappa is the mean of those of the grades, weighed by p (1 - p)
    shares = [row.n_ratings / 32 for row in found]
    weighed = [p * (1 - p) for p in shares]
    kappas = [0.0 if math.isnan(row.kappa) else row.kappa for row in found]
    assert entry.estimate is not None
    total = sum(weight * kappa for weight, kappa in zip(weighed, kappas, strict=True))
    assert entry.estimate.value == pytest.approx(total / sum(weighed))


def test_a_grade_that_nobody_gave_has_no_agreement() -> None:
    table = table_of(section("categories", protocol_with(plan()), table_v()))
    assert table.rows[0] == ("0", 0, None, None, None, None)
    assert "The intervals are wide, as they rest on 4 models." in table.notes


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        ((), "the plan asks for no estimate of agreement between raters"),
        ((plan(models="dummy"),), "no dummy model has ratings in session test"),
    ],
)
def test_without_an_estimate_no_grade_has_agreement(lines: tuple, why: str) -> None:
    made = section("categories", protocol_with(*lines), table_v())
    assert text_of(made) == f"Not in these data: {why}."


def test_grades_are_counted_by_the_intended_one() -> None:
    rows = ratings(
        *of_session("test", R1=("0", "1+", "2", "3"), R2=("1", "1+", "3", "4")),
        *of_session("retest", R1=("4", "4", "4", "4")),
    )
    made = section("confusion", protocol_with(plan()), rows)
    # intended: 1, 1+, 2, 3; of the first session alone
    rows_shown = table_of(made).rows
    assert [row[:-2] for row in rows_shown] == [
        ("1", 1, 1, 0, 0, 0, 0, 2, 50.0),
        ("1+", 0, 0, 2, 0, 0, 0, 2, 100.0),
        ("2", 0, 0, 0, 1, 1, 0, 2, 50.0),
        ("3", 0, 0, 0, 0, 1, 1, 2, 50.0),
    ]
    # Clopper and Pearson's of 1 and of 2 of 2: at the ends √α/2, α being 0.05
    root = 100.0 * math.sqrt(0.025)
    for row, ends in zip(rows_shown, ([1.26, 98.74], [root, 100.0]), strict=False):
        assert row[-2:] == pytest.approx(ends, abs=0.005)
    assert text_of(made) == (
        "Of 8 grades of models with an intended grade, 5 are the intended one."
    )
    without = section("confusion", protocol_with(plan()), rows, excluded=["R2"])
    assert text_of(without).startswith("Of 4 grades")


def given_hm1(cells: list[tuple[str, ...]]) -> GivenGrades:
    """Grades of one model, by rater those of every presentation."""
    rows = [
        {"session": "test", "rater": f"R{rater}", "model": "HM1", "repeat": repeat}
        | {"grade": grade}
        for rater, grades in enumerate(cells, start=1)
        for repeat, grade in enumerate(grades, start=1)
    ]
    made = ratings_from_rows(rows, scale_of(protocol_with()))
    (row,) = given_grades(protocol_with(), made, 0.95)[1]
    return row


def test_grades_of_one_rater_alike_count_for_less() -> None:
    # 8 raters: a grade each, or the same one twice; then halves of each rater's
    once = ["1", "1", "1", "1", "1", "1", "2", "2"]
    alike, mixed = [(g, g) for g in once], [("1", "2")] * 8
    every = {"once": [(g,) for g in once], "alike": alike, "mixed": mixed}
    of = {name: given_hm1(cells) for name, cells in every.items()}
    # 6 of 8: 34.9 to 96.8 % (Clopper & Pearson 1934)
    assert (of["once"].low, of["once"].high) == pytest.approx((0.349, 0.968), abs=5e-4)
    assert of["alike"].share == of["once"].share
    # twice as many grades that say nothing new: hardly narrower
    width = {name: row.high - row.low for name, row in of.items()}
    assert 0.9 * width["once"] < width["alike"] < 1.1 * width["once"]
    assert of["mixed"].share == 0.5
    assert of["mixed"].n_raters == 8


def test_without_intended_grades_there_is_no_such_table() -> None:
    rows = ratings(("test", "R1", "D01", "1"), ("test", "R2", "D01", "1"))
    text = text_of(section("confusion", protocol_with(), rows))
    assert text == ("Not in these data: no model with an intended grade has ratings.")


def test_order_that_nobody_knows_is_absent() -> None:
    text = text_of(section("order", protocol_with(plan()), table_v()))
    assert text.startswith("Not in these data: neither are the places")


def references_in(text: str) -> set[str]:
    """What a text cites, as author and year."""
    return {one for found in AUTHOR.findall(text) for one in found[1:-1].split("; ")}


def test_methods_cite_what_was_used_and_list_just_that() -> None:
    lines = (
        plan(id="kappa", interval="jackknife"),
        plan(id="share", coefficient="percent_agreement"),
        plan(id="lost", coefficient="gwet_ac", models="dummy", interval="bootstrap"),
    )
    protocol = protocol_with(*lines, sections=("methods",))
    made = section("methods", protocol, table_v())
    text = text_of(made)
    (listing,) = (b for b in made.blocks if isinstance(b, Listing))
    keys = set(re.findall(r"@\w+\{(\w+),", listing.text))
    assert keys == {"bohannon1987", "park2012", "fleiss1971", "efron1981", "landis1977"}
    assert references_in(text) == {cited([key])[2:-1] for key in keys}
    assert "Fleiss' κ (Fleiss, 1971) and percent agreement" in text
    assert "(kappa) are by rater jackknife, t(7) (Efron & Stein, 1981)." in text
    for name, number in (("masrel", masrel.__version__), ("numpy", version("numpy"))):
        assert f"{name} {number}" in text
    assert f"scipy {version('scipy')}" in text
    bare = section("methods", protocol_with(sections=("methods",)), table_v())
    assert "scipy" not in text_of(bare)  # nothing was computed with it


def test_methods_say_who_is_excluded_and_what_is_missing() -> None:
    rows = ratings(*of_session("test", R1=("1", None), R2=("1", "2"), R3=("1", "1+")))
    protocol = protocol_with(plan(id="kappa"), sections=("methods", "categories"))
    text = text_of(section("methods", protocol, rows, excluded=["R3"]))
    assert "R3 is excluded from every number." in text
    assert "1 of kappa are missing" in text
    assert "specific agreement (Cicchetti & Feinstein, 1990)" in text


def test_every_coefficient_and_scale_has_references_that_exist() -> None:
    keys = {
        key for scale in PUBLISHED_SCALES.values() for key in scale_references(scale)
    }
    without = [name for name, entry in COEFFICIENTS.items() if not entry.references]
    assert without == ["percent_agreement"], "coefficients without a reference"
    for name in COEFFICIENTS:
        keys.update(coefficient_references(name, "linear"))
    known = set(re.findall(r"^@\w+\{(\w+),$", BIB.read_text("utf-8"), re.M))
    assert keys <= known, f"not in {BIB.name}"
    for key in keys:
        assert bibtex([key]).startswith("@")
        assert re.fullmatch(r" \(.+, \d{4}\)", cited([key]))


def test_the_references_are_bibtex() -> None:
    text = BIB.read_text(encoding="utf-8")
    entries = re.findall(r"@(article|book)\{(\w+),\n((?:  .*\n)+)\}\n", text)
    assert (
        "".join(
            f"@{kind}{{{key},\n{fields}}}\n\n" for kind, key, fields in entries
        ).rstrip()
        == text.rstrip()
    )
    for kind, key, fields in entries:
        names = re.findall(r"^  (\w+) = \{.*\},?$", fields, re.M)
        assert len(names) == fields.count("\n"), key
        assert fields.count("{") == fields.count("}")
        needed = {"article": "journal", "book": "publisher"}
        assert {"author", "title", "year", needed[kind]} <= set(names), key
    keys = [key for _, key, _ in entries]
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize("colour", [ALARM, GREY])
def test_what_a_figure_is_stamped_with_can_be_read_on_white(colour: str) -> None:
    channels = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels
    ]
    light = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    assert 1.05 / (light + 0.05) >= 4.5
