"""The table of estimates: narrow on a page, complete in the CSV."""

import csv
import io
import math
from dataclasses import replace
from typing import Any

import pytest

from masrel.estimates import Estimate, Interval
from masrel.lab.analysis import PlannedEstimate, RaterEstimate, analyze
from masrel.lab.report._agreement import (
    estimate_rows,
    estimate_table,
    estimates_section,
)
from masrel.lab.report._material import gather
from masrel.lab.report._sentences import coefficient_name, interval_name
from masrel.pages._sections import Drawing, Paragraph
from masrel.plots import draw
from masrel.tables._estimate_words import forest_row
from masrel.tables._tables import Table, as_csv, as_text, page_cells
from tests.lab.analysis.studies import plan, protocol_with, table_v


def interval(**changes: Any) -> Interval:
    made: dict[str, Any] = {
        "low": 0.31957,
        "high": 0.93252,
        "level": 0.95,
        "kind": "confidence",
        "method": "rater jackknife, t(7)",
        "target": "raters",
    }
    return Interval(**{**made, **changes})


def estimate(**changes: Any) -> Estimate:
    made: dict[str, Any] = {
        "coefficient": "fleiss_kappa",
        "weights": "identity",
        "value": 0.626083678854127,
        "standard_error": 0.1,
        "observed": 81 / 112,
        "chance": 266 / 1024,
        "n_items": 4,
        "n_items_paired": 4,
        "n_raters": 8,
        "n_categories": 6,
    }
    return Estimate(**{**made, **changes})


def made(*planned: PlannedEstimate) -> Table:
    rows = estimate_rows(planned)
    return estimate_table(rows, name="agreement", caption="All", data="published")


def blocks(*planned: PlannedEstimate) -> tuple[Paragraph | Table | Drawing, ...]:
    """What the sections of the report make of estimates."""
    protocol, rows = protocol_with(sections=()), table_v()
    analysis = replace(analyze(protocol, rows), estimates=planned)
    material = gather(protocol, rows, analysis)
    return estimates_section(material, planned[0].line.kind).blocks


def one(**changes: Any) -> PlannedEstimate:
    return PlannedEstimate(line=plan(id="kappa"), estimate=estimate(**changes))


def as_dicts(table: Table) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(as_csv(table))))


def test_the_csv_has_every_number_and_no_mark() -> None:
    (row,) = as_dicts(made(one(interval=interval())))
    assert row["value"] == "0.626083678854127"
    assert (row["low"], row["high"]) == ("0.31957", "0.93252")
    assert row["interval"] == "95 % confidence, rater jackknife, t(7)"
    assert row["target"] == "other raters"
    assert (row["n_items"], row["n_raters"]) == ("4", "8")
    assert (row["models"], row["sessions"]) == ("standard", "test")
    assert row["strength"] == "substantial"
    assert "interval_shown" not in row


def test_the_page_has_the_interval_in_one_column_explained_below() -> None:
    table = made(one(interval=interval()))
    assert [column.heading for column in page_cells(table)[0]] == [
        "Estimate",
        "Coefficient",
        "Models",
        "Session",
        "Raters",
        "Value",
        "Interval",
        "Strength",
        "p_o",
        "p_e",
    ]
    text = as_text(table)
    assert "[0.320, 0.933] ᵃ" in text
    assert (
        "ᵃ 95 % confidence, rater jackknife, t(7); generalises to other raters." in text
    )


def test_intervals_made_alike_share_a_mark() -> None:
    other = interval(kind="credible", method="posterior", target="items")
    table = made(
        one(interval=interval()),
        one(interval=interval(low=0.1)),
        one(interval=other),
        one(),
    )
    shown = [row[6] for row in page_cells(table)[1]]
    assert shown == ["[0.320, 0.933] ᵃ", "[0.100, 0.933] ᵃ", "[0.320, 0.933] ᵇ", "–"]
    assert sum(note.startswith(("ᵃ", "ᵇ")) for note in table.notes) == 2


def test_more_intervals_than_letters_still_have_marks_of_their_own() -> None:
    lines = [one(interval=interval(method=f"way {i}")) for i in range(60)]
    marks = {row[6].split()[-1] for row in page_cells(made(*lines))[1]}
    assert len(marks) == 60


def test_an_estimate_that_is_not_there_says_why_in_both_forms() -> None:
    lost = PlannedEstimate(line=plan(id="lost"), reason="there are no ratings")
    table = made(lost)
    assert "lost: there are no ratings." in table.notes
    (row,) = as_dicts(table)
    assert row["reason"] == "there are no ratings"
    assert row["value"] == ""
    assert "not in these data" in as_text(table)


def test_only_a_kappa_has_a_word() -> None:
    (kappa, percent) = as_dicts(made(one(), one(coefficient="percent_agreement")))
    assert (kappa["strength"], percent["strength"]) == ("substantial", "")


def test_an_undefined_estimate_says_why_and_has_no_word() -> None:
    undefined = one(value=math.nan, reason="all ratings are in one category")
    table = made(undefined)
    assert "kappa: all ratings are in one category." in table.notes
    (row,) = as_dicts(table)
    assert (row["value"], row["strength"]) == ("", "")
    assert row["reason"] == "all ratings are in one category"
    assert "undefined" in as_text(table)
    assert not any("Landis" in note for note in table.notes)


def test_what_an_interval_warns_of_is_below_the_table() -> None:
    warned = interval(notes=("4 items: below 10.",), n_undefined=3)
    notes = made(one(interval=warned)).notes
    assert "kappa: 4 items: below 10." in notes
    assert "kappa: undefined on 3 resamples." in notes


def test_one_raters_own_agreement_counts_one_rater() -> None:
    own = RaterEstimate(
        rater="R1", estimate=estimate(coefficient="cohen_kappa", n_raters=2)
    )
    line = plan(id="again", kind="test-retest", sessions=["test", "retest"])
    planned = PlannedEstimate(line=line, by_rater=(own,))
    (row,) = as_dicts(made(planned))
    assert (row["id"], row["n_raters"]) == ("again: R1", "1")
    assert row["sessions"] == "test and retest"
    (drawing,) = (block for block in blocks(planned) if isinstance(block, Drawing))
    assert b"<!-- 4 models, twice -->" in draw(drawing.content, stamp="")["svg"]


def test_what_is_not_finite_is_not_drawn() -> None:
    nan = math.nan
    assert forest_row("a", estimate(value=nan)).value is None
    assert forest_row("a", estimate(value=nan)).text == "undefined"
    ends = forest_row("a", estimate(interval=interval(low=nan)))
    assert (ends.interval, ends.text) == (None, "0.626 [undefined]")


def test_zero_is_marked_of_what_is_corrected_for_chance() -> None:
    assert forest_row("a", estimate()).has_zero
    assert forest_row("a", estimate(coefficient="icc_a1")).has_zero
    assert not forest_row("a", estimate(coefficient="percent_agreement")).has_zero


def test_percent_agreement_is_said_to_be_a_share() -> None:
    assert coefficient_name("percent_agreement") == "Percent agreement (0–1)"
    assert coefficient_name("fleiss_kappa") == "Fleiss' κ"


@pytest.mark.parametrize(
    ("level", "name"), [(0.95, "95 % confidence, w"), (0.999, "99.9 % confidence, w")]
)
def test_the_level_is_shown_whole(level: float, name: str) -> None:
    assert interval_name(interval(level=level, method="w")) == name


def test_each_kind_of_interval_is_told_once_in_plain_words() -> None:
    texts = blocks(
        one(interval=interval()),
        one(interval=interval(low=0.2)),
        one(interval=interval(kind="credible", target="both")),
        one(),
    )
    confidence, credible = (b.text for b in texts if isinstance(b, Paragraph))
    assert "other raters like these" in confidence
    assert "about 95 % of the intervals" in confidence
    assert "probability 95 %" in credible
