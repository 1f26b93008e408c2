"""Estimates as a report tells them: the first paragraph, a table, their meaning."""

import dataclasses
import math
import re
from pathlib import Path
from typing import Any

import msgspec
import pytest

from masrel.estimates import Estimate, Interval
from masrel.lab.analysis import PlannedEstimate, analyze
from masrel.lab.ratings import Ratings, ratings_from_rows
from masrel.lab.report._document import ReportFiles, write_report
from masrel.scales import MODIFIED_ASHWORTH
from tests.files import table_of
from tests.lab.analysis.studies import of_session, plan, protocol_with, ratings, table_v
from tests.lab.report.pages import AGAIN, rows_of, simulated_ratings, written

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")


def paragraph(files: ReportFiles) -> str:
    """The first paragraph of both pages, which is the same."""
    page = files.html.read_text(encoding="utf-8")
    found = re.search(r'<p class="result">(.*?)</p>', page)
    assert found is not None
    text = re.sub("<.*?>", "", found[1]).replace("&#x27;", "'").replace("&nbsp;", " ")
    plain = files.markdown.read_text(encoding="utf-8").replace("*", "")
    assert text in plain.replace("\\", "")
    return text


def result_of(rows: Ratings, folder: Path, *lines: Any, **of: Any) -> str:
    protocol = protocol_with(*lines, sections=("intended",))
    analysis = analyze(protocol, rows, **of)
    return paragraph(write_report(protocol, rows, analysis, folder))


ONE = ratings(*of_session("test", R1=("1",), R2=("1",)))
ALIKE = ratings(*of_session("test", R1=("1", "1"), R2=("1", "1")))
TWICE = ratings_from_rows(
    [
        {"session": row.session, "rater": row.rater, "model": row.model}
        | {"grade": row.grade, "repeat": repeat}
        for row in simulated_ratings().rows
        if row.session == "test"
        for repeat in (1, 2)
    ],
    MODIFIED_ASHWORTH,
)
FULL = dataclasses.replace(
    simulated_ratings(),
    rows=tuple(
        row._replace(grade=row.grade or "2") for row in simulated_ratings().rows
    ),
)
SHARE = plan(coefficient="percent_agreement")
ALPHA = plan(coefficient="krippendorff_alpha", weights="quadratic")
OF_RATERS = msgspec.structs.replace(AGAIN, coefficient="cohen_kappa")
TOLD: dict[str, tuple[Ratings, tuple[Any, ...], list[str]]] = {
    "one model": (
        ONE, (SHARE,), ["Of the grades of 1 standard model, 100.0 % were as intended."],
    ),
    "again, and missing": (
        simulated_ratings(), (plan(), AGAIN),
        ["In session test, 2 of 8 raters graded 2 standard models (3 grades, 1 missin",
         "In test and again in retest, 2 of 3 raters graded 2 standard models:"],
    ),
    "undefined": (ALIKE, (plan(),), ["Fleiss' κ is undefined because "]),
    "not there": (
        ALIKE, (plan(models="dummy"),),
        ["Fleiss' κ of the dummy models in session test could not be estimated: no "
         "dummy model has ratings in session test."],
    ),
    "not planned": (
        ALIKE, (), ["The plan asks for no estimate of agreement between raters."],
    ),
    "raters alone": (FULL, (plan(), OF_RATERS), ["lay between 0.000 and 0.333."]),
    "a model that came again": (
        TWICE, (plan(),),
        ["2 of 8 raters graded 2 standard models in 4 presentations (6 grades"],
    ),
    "weights": (
        table_v(), (ALPHA,),
        ["none missing): Krippendorff's α with quadratic weights was 0.886."],
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", TOLD)
def test_a_result_is_told_with_what_it_rests_on(what: str, tmp_path: Path) -> None:
    rows, lines, texts = TOLD[what]
    text = result_of(rows, tmp_path, *lines).removeprefix("Simulated data. ")
    for said in texts:
        assert said in text


def interval(**changes: Any) -> Interval:
    made: dict[str, Any] = {"low": 0.31957, "high": 0.93252, "level": 0.95}
    made |= {"kind": "confidence", "method": "jackknife, t(7)", "target": "raters"}
    return Interval(**{**made, **changes})


def one(id_: str = "kappa", **changes: Any) -> PlannedEstimate:
    made: dict[str, Any] = {"coefficient": "fleiss_kappa", "weights": "identity"}
    made |= {"value": 0.626083678854127, "standard_error": 0.1, "observed": 81 / 112}
    made |= {"chance": 266 / 1024, "n_items": 4, "n_items_paired": 4, "n_raters": 8}
    estimate = Estimate(**{**made, "n_categories": 6, **changes})
    line = plan(id=id_, coefficient=estimate.coefficient)
    return PlannedEstimate(line=line, estimate=estimate)


def shown(
    folder: Path, *planned: PlannedEstimate
) -> tuple[list[list[str]], list[dict[str, str]], str]:
    """The table of estimates on a page and as CSV, and the page."""
    protocol, rows = protocol_with(sections=("agreement",)), table_v()
    analysis = dataclasses.replace(analyze(protocol, rows), estimates=planned)
    files = write_report(protocol, rows, analysis, folder)
    text = files.markdown.read_text(encoding="utf-8").replace("\\", "")
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    return cells, table_of(files.tables[0]), text


def test_intervals_made_alike_share_a_meaning_and_wide_ones_are_not_shown(
    tmp_path: Path,
) -> None:
    other = interval(kind="credible", method="posterior", target="both", level=0.999)
    alike = (one(interval=interval()), one(interval=interval(low=0.1)))
    wide = [interval(low=-0.2, target=target) for target in ("items", "raters", "both")]
    # ten models are not few; the last is as wide, but far from full agreement
    lines = (
        *(*alike, one(interval=other), one()),
        *(one(interval=of, n_items=n) for n in (4, 10) for of in wide),
        one(interval=interval(low=-0.6, high=0.5)),
    )
    (_, *rows), cells, text = shown(tmp_path, *lines)
    assert [row[2] for row in rows[:11]] == [
        "[0.320, 0.933]", "[0.100, 0.933]", "[0.320, 0.933]", "–",
        "4 models are too few", "8 raters are too few",
        "8 raters and 4 models are too few",
        "[−0.200, 0.933]", "8 raters are too few", "8 raters are too few",
        "[−0.600, 0.500]",
    ]  # fmt: skip
    assert cells[4]["low"] == "-0.2"  # the file has it
    assert text.count("0.626 [−0.2") == 1  # in the forest
    assert text.count("about 95 % of intervals") == 3
    assert text.count("a 99.9 % probability") == 1


def test_an_estimate_has_a_title_of_its_own_or_one_that_no_other_has(
    tmp_path: Path,
) -> None:
    lines = [
        plan(id="a"), plan(id="b", target="items"), plan(id="c", target="items"),
        plan(id="d", title="My κ"), plan(id="e", models="dummy"), AGAIN,
    ]  # fmt: skip
    protocol = protocol_with(*lines, sections=("agreement", "test-retest"))
    files = written(tmp_path, protocol, table_v())
    kappa = "Fleiss' κ, standard models, other"
    assert [row["title"] for row in rows_of(files, "agreement")] == [
        f"{kappa} raters", f"{kappa} models, b", f"{kappa} models, c", "My κ",
        "Fleiss' κ, dummy models", "Stratified κ, standard models, retest",
    ]  # fmt: skip


def test_what_a_reader_must_know_is_below_the_table(tmp_path: Path) -> None:
    nan = one("nan", value=math.nan, reason="all ratings are in one category")
    lost = PlannedEstimate(line=plan(id="lost"), reason="there are no ratings")
    warned = one(interval=interval(notes=("4 items: below 10",), n_undefined=3))
    share = one("share", coefficient="percent_agreement")
    (_, *rows), cells, text = shown(tmp_path, nan, lost, warned, share)
    assert [row[1] for row in rows[:4]] == ["undefined", "–", "0.626", "0.626"]
    words = [row["strength"] for row in cells]
    assert words == ["", "", "fair", ""]  # of a kappa that has a value
    assert rows[1][2] == "not in these data"
    assert (cells[1]["reason"], cells[1]["value"]) == ("there are no ratings", "")
    assert cells[3]["coefficient"] == "Percent agreement (0–1)"
    for note in (
        "\n\nNot in these data: there are no ratings.\n",
        "\n\nUndefined: all ratings are in one category.\n",
        ": undefined: all ratings are in one category.",
        "lost: there are no ratings.",
        "\n\n4 items: below 10.\n",
        ", kappa: undefined on 3 resamples.",
    ):
        assert note in text


OTHER_ITEMS = "with the same raters and other models like these"
OTHER_RATERS = "with other raters like these and the same models"
BOTH = "with other raters and other models like these"
REPEATED = "if the study were repeated many times"
GIVEN = "given these ratings, the prior and"
PROBABLY = "there is a 95 % probability that the value for"
MEANT: list[tuple[dict[str, Any], str]] = [
    ({"kind": "credible", "target": "items"},
     "95 % credible interval, jackknife, t(7): generalises to other models like these: "
     f"given these ratings and the prior, {PROBABLY} these raters on all models like "
     "these lies in this interval."),
    ({"kind": "credible", "target": "both"},
     f"{GIVEN} the assumption that raters differ by chance alone, {PROBABLY} all "
     "raters and models like these lies in this interval"),
    ({"kind": "credible", "target": "raters", "raters_differ": True},
     f"{GIVEN} the model of how raters differ, {PROBABLY} all raters like these on "
     "these models lies in this interval"),
    ({"kind": "credible", "target": "items", "is_one_sided": True},
     "credible bound, jackknife, t(7): generalises to other models like these: given "
     f"these ratings and the prior, {PROBABLY} these raters on all models like these "
     "lies above the lower end"),
    ({"target": "both"},
     "95 % CI, jackknife, t(7): generalises to other models and raters like these"
     f": {REPEATED} {BOTH}, about 95 % of intervals computed this way would contain "
     "the value that all these studies together would give."),
    ({"unit": "items", "units_are": "left out", "target": "items"},
     "(from leaving out one model at a time): generalises to other models like these: "
     f"{REPEATED} {OTHER_ITEMS},"),
    ({"unit": "both", "units_are": "left out", "target": "both"},
     "(from leaving out models and raters, one at a time): generalises to"),
    ({"unit": "raters", "units_are": "drawn"},
     "(from raters drawn with replacement): generalises to other raters like these: "
     f"{REPEATED} {OTHER_RATERS},"),
    ({"unit": "clusters", "target": "items"},
     f"{REPEATED} with the same raters and other clusters of models like these,"),
]  # fmt: skip


@pytest.mark.parametrize(("made", "meaning"), MEANT)
def test_an_interval_is_told_in_plain_words(
    made: dict[str, Any], meaning: str, tmp_path: Path
) -> None:
    _, _, text = shown(tmp_path, one(interval=interval(**made)))
    assert meaning in text
