"""Words of a report: its sentences in one file, and what estimates are called."""

import tomllib
from functools import cache
from pathlib import Path

from masrel.agreement import COEFFICIENTS
from masrel.estimates import Interval
from masrel.tables._estimate_words import Noun, origin, promise
from masrel.tables._tables import percent

_FILE = Path(__file__).with_name("templates") / "sentences.toml"


@cache
def sentences() -> dict[str, dict[str, str]]:
    """Return every sentence by its group and name, with its words in braces."""
    return tomllib.loads(_FILE.read_text(encoding="utf-8"))


def sentence(group: str, name: str, **words: object) -> str:
    """Return a sentence with its words in braces replaced."""
    return sentences()[group][name].format_map(words)


TARGETS = {
    "raters": "other raters",
    "items": "other models",
    "both": "other raters and models",
}
"""Target of an interval to what it generalises to."""

NOT_THERE = "not in these data"
"""What is shown where a plan's estimate is not."""


def coefficient_name(coefficient: str, weights: str = "identity") -> str:
    """Return a coefficient's name for a reader."""
    title = COEFFICIENTS[coefficient].title
    if weights != "identity":
        title = f"{title}, {weights} weights"
    # A share as all others are: 1 is all, not 100.
    return f"{title} (0–1)" if coefficient == "percent_agreement" else title


def interval_name(interval: Interval) -> str:
    """Return level, kind and method of an interval."""
    return f"{percent(interval.level)} % {interval.kind}, {interval.method}"


def meaning(interval: Interval, noun: Noun = "model") -> str:
    """Return in one sentence what an interval promises and what it was made from."""
    kind = "bound" if interval.is_one_sided else "interval"
    name = f"{interval.kind.capitalize()} {kind}"
    return f"{name}{origin(interval, noun)}: {promise(interval, noun)}."
