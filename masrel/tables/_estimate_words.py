"""Estimates, intervals and notes in words: what they are, and what they promise."""

import math
import re
from collections.abc import Callable
from functools import partial
from typing import Literal

from masrel.agreement import COEFFICIENTS
from masrel.estimates import Estimate, Interval
from masrel.plots._drawn_values import ForestRow
from masrel.tables._tables import (
    counted,
    interval_text,
    number,
    percent,
)

Noun = Literal["model", "item"]
"""What is rated: a haptic model in a study, any item elsewhere."""

_POPULATIONS = {  # of studies that are repeated, and of one value
    "raters": (
        "with other raters like these and the same {}",
        "all raters like these on these {}",
    ),
    "items": (
        "with the same raters and other {} like these",
        "these raters on all {} like these",
    ),
    "both": (
        "with other raters and other {} like these",
        "all raters and {} like these",
    ),
}


def forest_row(
    label: str, estimate: Estimate, *, detail: str = "", group: str = ""
) -> ForestRow:
    """Return the row of an estimate in a forest."""
    value, interval = estimate.value, estimate.interval
    text = number(value, 3)
    low, high = (0.0, math.inf) if interval is None else (interval.low, interval.high)
    if interval is not None and not math.isnan(value):
        text += f" {interval_text(low, high)}"
    return ForestRow(
        label=label,
        detail=detail,
        value=None if math.isnan(value) else value,
        interval=interval if math.isfinite(high - low) else None,
        text=text,
        # 0 is what chance gives of an ICC and a κ; not of a share, nor of an order
        has_zero=estimate.coefficient not in COEFFICIENTS  # of a category
        or COEFFICIENTS[estimate.coefficient].chance_corrected,
        group=group,
    )


def promise(interval: Interval, noun: Noun) -> str:
    """Return what an interval means, and for which population."""
    level = f"{percent(interval.level)} %"
    # clusters are drawn anew with the items in them
    plural = f"clusters of {noun}s" if interval.unit == "clusters" else f"{noun}s"
    studies, whole = (of.format(plural) for of in _POPULATIONS[interval.target])
    if interval.kind == "confidence":
        return (
            f"if the study were repeated many times {studies}, about {level} of "
            "intervals computed this way would contain the value that all these "
            "studies together would give"
        )
    # A probability rests on the prior, and of other raters on how they differ.
    premises = "these ratings, the prior and the model of how raters differ"
    if interval.target == "items":
        premises = "these ratings and the prior"
    elif not interval.raters_differ:
        premises = (
            "these ratings, the prior and the assumption that raters differ by chance "
            "alone"
        )
    where = "above the lower end" if interval.is_one_sided else "in this interval"
    return (
        f"given {premises}, there is a {level} probability that the value for "
        f"{whole} lies {where}"
    )


def origin(interval: Interval, noun: Noun) -> str:
    """Return, in brackets, what was drawn or left out to compute an interval."""
    if interval.unit is None or interval.units_are is None:
        return ""
    one, many = {
        "items": (f"one {noun}", f"{noun}s"),
        "raters": ("one rater", "raters"),
        "both": (f"{noun}s and raters, one", f"{noun}s and raters"),
        "clusters": (f"one cluster of {noun}s", f"clusters of {noun}s"),
    }[interval.unit]
    if interval.units_are == "drawn":
        return f" (from {many} drawn with replacement)"
    return f" (from leaving out {one} at a time)"


def pair_words(estimate: Estimate) -> str:
    """Return what an item needs to count among those with a pair of ratings."""
    entry = COEFFICIENTS.get(estimate.coefficient)  # none of kappa of a category
    is_retest = entry is not None and entry.shape == "pairs"
    return "both ratings of a rater" if is_retest else "two ratings or more"


def sentence(estimate: Estimate, *, items: str = "items", word: str = "") -> str:
    """Return an estimate of items as a sentence for a paper, in the style of APA."""
    # items: what they are called; word: the one that it earns, and whose it is
    entry = COEFFICIENTS[estimate.coefficient]
    has_weights = entry.weighted and estimate.weights != "identity"
    name = entry.title + f" ({estimate.weights} weights)" * has_weights
    fewer = f" ({estimate.n_items_paired} with {pair_words(estimate)})"
    rated = counted(estimate.n_items, "item", items)
    rated += fewer * (estimate.n_items_paired < estimate.n_items)
    sizes = (rated, counted(estimate.n_raters, "rater"))
    if estimate.reason is not None:
        return f"{name} is undefined ({estimate.reason}), {', '.join(sizes)}."
    shown = partial(number, digits=2, in_units=True) if entry.in_units else _apa
    uncertainty = _uncertainty(estimate, shown)
    parts = (f"{name} = {shown(estimate.value)}", *uncertainty, word, *sizes)
    return f"{', '.join(filter(None, parts))}."


def _uncertainty(estimate: Estimate, shown: Callable[[float], str]) -> list[str]:
    # the interval, or why there is none and the standard error in its place
    interval, error = estimate.interval, estimate.standard_error
    errors = [] if math.isnan(error) else [f"SE = {shown(error)}"]
    if interval is None:
        return errors
    level, method = percent(interval.level), interval.method.split(",")[0]
    name = f"{level} % {_SHORT_KINDS[interval.kind]}"
    if interval.reason is not None:
        return [*errors, f"no {name} ({interval.reason})"]
    low, high = shown(interval.low), shown(interval.high)
    if interval.is_one_sided:
        return [f"{level} % {interval.kind} lower bound {low} ({method})"]
    return [f"{name} [{low}, {high}] ({method})"]


_SHORT_KINDS = {"confidence": "CI", "credible": "credible interval"}


def _apa(value: float) -> str:
    # two decimals, no 0 before the point: none of the coefficients can exceed 1
    return re.sub(r"^(−?)0\.", r"\1.", number(value, 2))
