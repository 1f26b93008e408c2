"""What an interval means, in one plain sentence."""

from typing import Literal

from masrel.estimates import Interval
from masrel.report._tables import percent

__all__ = ["Noun", "aside", "meaning", "origin", "promise"]

Noun = Literal["model", "item"]
"""What is rated: a haptic model in a study, any item elsewhere."""

_POPULATIONS = {
    "raters": "the same {}s were put to other raters like these",
    "items": "these raters graded other {}s like these",
    "both": "other raters graded other {}s, both like these",
}


_WIDER = "and the spread of raters"


def meaning(interval: Interval, noun: Noun) -> str:
    """Say what an interval promises, of whom, and what it was made from."""
    kind = "bound" if _is_bound(interval) else "interval"
    name = f"{interval.kind.capitalize()} {kind}"
    return f"{name}{origin(interval, noun)}: {promise(interval, noun)}."


def promise(interval: Interval, noun: Noun) -> str:
    """Say what an interval promises, and of whom."""
    level = f"{percent(interval.level)} %"
    population = _POPULATIONS[interval.target].replace("{}", noun)
    if interval.kind == "confidence":
        return (
            f"if {population}, again and again, about {level} of the intervals made "
            "this way would hold the value that all such studies together would give"
        )
    where = "above the lower end" if _is_bound(interval) else "inside"
    return (
        f"given {_given(interval)}, the value that would be found if {population}, "
        f"without end, lies {where} with probability {level}"
    )


def _given(interval: Interval) -> str:
    # what a probability rests on; of other raters a model must say how they differ
    if interval.target == "items":
        return "these ratings and the prior"
    if interval.method.startswith("Dirichlet-multinomial"):  # it knows of no rater
        return "these ratings, the prior and raters who differ by chance alone"
    return "these ratings, the prior and the model of how raters differ"


def _is_bound(interval: Interval) -> bool:
    return interval.method.endswith("one-sided")


def aside(interval: Interval) -> str:
    """Say in few words how the ends differ from quantiles of the distribution."""
    if _is_bound(interval):
        return "one-sided"
    if interval.method.endswith(_WIDER):
        return "posterior, wider by the spread of raters"
    return ""


def origin(interval: Interval, noun: Noun) -> str:
    """Say in brackets what the ends of an interval came from."""
    units = {"items": f"{noun}s", "raters": "raters", "both": f"{noun}s and raters"}
    if interval.method.endswith(_WIDER):
        return " (a posterior, made wider by what raters differ by)"
    if interval.unit is None:
        return ""
    if "bootstrap" in interval.method:
        return f" (from {units[interval.unit]} drawn with replacement)"
    if interval.unit == "both":
        return f" (from leaving out {noun}s and raters, one at a time)"
    one = units[interval.unit].removesuffix("s")
    return f" (from leaving out one {one} at a time)"
