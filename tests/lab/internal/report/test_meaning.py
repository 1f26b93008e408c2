"""What an interval means: every method of the package in plain words."""

from typing import Any

import pytest

from masrel.estimates import Interval
from masrel.lab.report._sentences import meaning


def interval(
    kind: str, method: str, target: str, unit: str | None = None, **made: Any
) -> Interval:
    made |= {"kind": kind, "target": target, "unit": unit}
    return Interval(low=0.2, high=0.8, level=0.9, method=method, **made)


POSTERIOR = "Dirichlet-multinomial posterior"
OTHER_ITEMS = "these raters graded other items like these"
OTHER_RATERS = "the same items were put to other raters like these"
BOTH = "other raters graded other items, both like these"

CASES = [
    (
        interval("credible", f"{POSTERIOR}, exact", "items"),
        f"Credible interval: given these ratings and the prior, the value that would "
        f"be found if {OTHER_ITEMS}, without end, lies inside with probability 90 %.",
    ),
    (
        interval("credible", f"{POSTERIOR}, exact", "both"),
        "Credible interval: given these ratings, the prior and raters who differ by "
        f"chance alone, the value that would be found if {BOTH}, without end, lies "
        "inside with probability 90 %.",
    ),
    (
        interval("credible", "latent trait", "raters", raters_differ=True),
        "Credible interval: given these ratings, the prior and the model of how raters "
        f"differ, the value that would be found if {OTHER_RATERS}, without end, lies "
        "inside with probability 90 %.",
    ),
    (
        interval("credible", "latent trait", "both", raters_differ=True),
        "Credible interval: given these ratings, the prior and the model of how raters "
        f"differ, the value that would be found if {BOTH}, without end, lies inside "
        "with probability 90 %.",
    ),
    (
        interval("credible", POSTERIOR, "items", is_one_sided=True),
        "Credible bound: given these ratings and the prior, the value that would be "
        f"found if {OTHER_ITEMS}, without end, lies above the lower end with "
        "probability 90 %.",
    ),
]

LEFT_OUT, DRAWN = {"units_are": "left out"}, {"units_are": "drawn"}
MADE = [
    (
        interval("confidence", "jackknife", "items", "items", **LEFT_OUT),
        f" (from leaving out one item at a time): if {OTHER_ITEMS},",
    ),
    (
        interval("confidence", "jackknife", "raters", "raters", **LEFT_OUT),
        f" (from leaving out one rater at a time): if {OTHER_RATERS},",
    ),
    (
        interval("confidence", "jackknife", "both", "both", **LEFT_OUT),
        f" (from leaving out items and raters, one at a time): if {BOTH},",
    ),
    (
        interval("confidence", "bootstrap", "items", "items", **DRAWN),
        f" (from items drawn with replacement): if {OTHER_ITEMS},",
    ),
    (
        interval("confidence", "bootstrap", "raters", "raters", **DRAWN),
        f" (from raters drawn with replacement): if {OTHER_RATERS},",
    ),
    (interval("confidence", "F distribution", "both"), f": if {BOTH},"),
    (
        interval("confidence", "delta method", "items", "clusters"),
        ": if these raters graded other clusters of items like these,",
    ),
]


@pytest.mark.parametrize(("given", "said"), CASES)
def test_a_credible_interval_says_what_is_probable(given: Interval, said: str) -> None:
    assert meaning(given, "item") == said


@pytest.mark.parametrize(("given", "said"), MADE)
def test_a_confidence_interval_says_how_often_it_holds(
    given: Interval, said: str
) -> None:
    assert meaning(given, "item") == (
        f"Confidence interval{said} again and again, about 90 % of the intervals made "
        "this way would hold the value that all such studies together would give."
    )


@pytest.mark.parametrize("given", [given for given, _ in [*CASES, *MADE]])
def test_a_study_speaks_of_its_models(given: Interval) -> None:
    assert meaning(given, "model") == meaning(given, "item").replace("item", "model")
