"""Scales, results and errors: the words everything else speaks."""

import dataclasses
import math
import warnings
from xml.etree import ElementTree

import masrel
from masrel import errors
from masrel.errors import MasrelError, MasrelWarning
from masrel.estimates import Estimate, Interval, as_document
from masrel.scales import MODIFIED_ASHWORTH, Scale


def estimate(**changes: object) -> Estimate:
    plain = Estimate(
        coefficient="fleiss_kappa",
        weights="identity",
        value=0.5,
        standard_error=0.1,
        observed=0.75,
        chance=0.5,
        n_items=4,
        n_items_paired=4,
        n_raters=8,
        n_categories=6,
    )
    return dataclasses.replace(plain, **changes)  # type: ignore[arg-type]


INTERVAL_KEYS = [
    "low", "high", "median", "level", "kind", "method", "target", "unit",
    "n_resamples", "n_undefined", "monte_carlo_error", "seed", "notes", "reason",
]  # fmt: skip


def test_a_document_has_every_field_and_no_nan() -> None:
    interval = Interval(
        low=0.1,
        high=math.inf,
        level=0.95,
        kind="confidence",
        method="m",
        target="items",
        monte_carlo_error=(0.01, math.nan),
        is_one_sided=True,
    )
    document = as_document(estimate(value=math.nan, interval=interval, reason="0/0"))
    assert list(document) == [f.name for f in dataclasses.fields(Estimate)]
    assert document["value"] is None
    assert document["interval"]["high"] is None  # type: ignore[index]
    # keys of JSON stay: what the method says in words is not among them
    assert list(document["interval"]) == INTERVAL_KEYS  # type: ignore[call-overload]
    assert document["interval"]["monte_carlo_error"] == [0.01, None]  # type: ignore[index]


def test_an_undefined_estimate_says_so_in_its_line() -> None:
    assert str(estimate()) == "fleiss_kappa: 0.5 (SE 0.1)"
    assert "undefined (0/0)" in str(estimate(value=math.nan, reason="0/0"))


def interval(**changes: object) -> Interval:
    plain = Interval(
        low=0.21,
        high=0.79,
        level=0.9,
        kind="confidence",
        method="item jackknife, t(3)",
        target="both",
        notes=("few <items>",),
    )
    return dataclasses.replace(plain, **changes)  # type: ignore[arg-type]


def test_a_result_shows_its_interval_and_what_it_generalises_to() -> None:
    assert str(estimate(weights="linear", interval=interval())).splitlines() == [
        "fleiss_kappa (linear): 0.5 (SE 0.1)",
        "  90 % confidence interval: 0.21 to 0.79",
        "  generalises to: other items and raters",
        "  method: item jackknife, t(3)",
        "  note: few <items>",
    ]
    shown = str(interval(target="items", kind="credible", level=0.999))
    assert shown.startswith("99.9 % credible interval: 0.21 to 0.79\n")
    assert "generalises to: other items\n" in shown
    # what has no such error shows none, rather than "nan"
    assert str(estimate(standard_error=math.nan)) == "fleiss_kappa: 0.5"


def test_a_notebook_shows_the_lines_that_are_printed() -> None:
    for result in (estimate(interval=interval()), interval(), estimate()):
        page = ElementTree.fromstring(result._repr_html_())
        rows = [[cell.text for cell in row] for row in page]
        printed = [line.strip().split(": ", 1) for line in str(result).splitlines()]
        assert rows == printed
        assert page.tag == "table"


def test_everything_raised_on_purpose_has_one_root() -> None:
    for name in errors.__all__:
        kind = getattr(errors, name)
        assert issubclass(kind, MasrelError | MasrelWarning), name
        assert name in (errors.__doc__ or "") or kind in (MasrelError, MasrelWarning)


def test_every_sub_package_is_reachable_and_warns_of_nothing() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in masrel.__all__:
            assert getattr(masrel, name).__doc__


def test_grades_become_their_values_and_missing_ones_stay() -> None:
    pain = Scale(name="pain", grades=("0", "1", "10"))
    assert pain.weigh([["10", None], ["0", "1"]]) == [[10.0, None], [0.0, 1.0]]
    assert MODIFIED_ASHWORTH.weigh([["1+", "4"]]) == [[3.0, 6.0]]
