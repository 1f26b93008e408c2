"""What sections of the report are made from, and the words they share."""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from masrel.agreement import COEFFICIENTS
from masrel.estimates import Interval
from masrel.lab.analysis import Analysis, PlannedEstimate
from masrel.lab.protocol import Protocol
from masrel.lab.ratings import InPerson, Ratings
from masrel.pages._sections import Paragraph
from masrel.tables._estimate_words import Noun, origin, promise
from masrel.tables._tables import SIMULATED, SIMULATED_DEVICE, percent

if TYPE_CHECKING:
    from masrel.lab.report._conduct import StudyConduct

FIGURES = "masrel.lab.report."
"""Where the functions are that draw what no file of ratings has."""

# From more than so many on, a figure shows distributions instead of every one.
MANY_RATERS = 30
MANY_STRETCHES = 12
MANY_MODELS = 12  # and panels are smaller

SIMULATED_GRADES = (
    "SIMULATED DATA – no person gave these grades",
    "The grades and speeds in this report are simulated. They show that the study "
    "runs; they say nothing about people or about the models.",
)
# Banner and sentence of a report, by who gave the grades
_SIMULATED_IN_PART = (
    "SIMULATED DATA – no person gave some of these grades",
    "Some of the grades in this report are simulated; the table of sessions says of "
    "which. Together they say nothing about people or about the models.",
)
_ON_SIMULATED_DEVICE = (
    "SIMULATED DEVICE – persons gave these grades, {n} of them on hardware",
    "Persons gave the grades in this report, {n} of them on hardware: on the simulated "
    "device nobody felt a model, and the speeds are those of a simulated hand. Such "
    "grades say nothing about the models.",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """Everything a report is made from."""

    protocol: Protocol
    ratings: Ratings
    analysis: Analysis
    # grades given in person, whose notes are shown below their table
    in_person: InPerson | None
    # where the data come from, in one word; more than one joined by "+"
    data: str
    banner: str  # what every page says in large letters, if anything
    provenance: str  # the sentence at the head of the pages
    stamp: str  # the line every figure carries
    trace_stamp: str  # the line a figure of reconstructed traces carries
    # sessions, raters: those that have ratings, in the protocol's order
    sessions: tuple[str, ...]
    raters: tuple[str, ...]
    recordings: Path | None  # the folder of the sessions' recordings, if known
    conduct: "StudyConduct | None"  # how the study was run, if that is to be said


def gather(
    protocol: Protocol,
    ratings: Ratings,
    analysis: Analysis,
    in_person: InPerson | None = None,
    recordings: Path | None = None,
    conduct: "StudyConduct | None" = None,
) -> Material:
    """Return ratings and their analysis with what every section says of them."""
    sources = sorted({row.source for row in ratings.rows})
    if ratings.simulated and "simulated" not in sources:
        sources.append("simulated")
    data = "+".join(sources) or "foreign"
    study, stamp, banner = protocol.study, "", ""
    provenance = f"Study {study.id}, {data} ratings."
    trace_stamp = "Model reconstruction at recorded mean speeds, not a measurement"
    if ratings.simulated:
        banner, provenance = SIMULATED_GRADES
        stamp = trace_stamp = SIMULATED
        if ratings.n_from_persons == len(ratings.rows):
            data = data.replace("simulated", "simulated device")
            n = "none" if sources == ["simulated"] else "not all"
            banner, provenance = (text.format(n=n) for text in _ON_SIMULATED_DEVICE)
            stamp = trace_stamp = SIMULATED_DEVICE
        elif ratings.n_from_persons:
            banner, provenance = _SIMULATED_IN_PART
            provenance = f"{ratings.simulated_counts} {provenance}"
    elif data == "published":
        provenance = f"Published grades and speeds: {study.source}".rstrip(": ")
        stamp = f"Published data: {study.source}".rstrip(": ")
        trace_stamp = "Model reconstruction at published mean speeds, not a measurement"
        trace_stamp = f"{trace_stamp}: {study.source}".rstrip(": ")
    sessions = {row.session for row in ratings.rows}
    raters = {row.rater for row in ratings.rows}
    return Material(
        protocol=protocol,
        ratings=ratings,
        analysis=analysis,
        in_person=in_person,
        data=data,
        banner=banner,
        provenance=provenance,
        stamp=stamp,
        trace_stamp=trace_stamp,
        sessions=tuple(s.id for s in protocol.sessions if s.id in sessions),
        raters=tuple(r.id for r in protocol.raters if r.id in raters),
        recordings=recordings,
        conduct=conduct,
    )


def main_estimate(analysis: Analysis) -> PlannedEstimate | None:
    """Return the first line between raters that the data hold, or else the first."""
    planned = [p for p in analysis.estimates if p.line.kind == "inter-rater"]
    return next((p for p in planned if p.estimate), planned[0] if planned else None)


def lacking(reason: str | None) -> Paragraph:
    """Return what says why a section is not there."""
    text = f"Not in these data: {reason or 'this was not computed'}."
    return Paragraph(text=text, absent=True)


_FILE = Path(__file__).with_name("templates") / "sentences.toml"
_SENTENCES: dict[str, dict[str, str]] = tomllib.loads(_FILE.read_text("utf-8"))


def sentence(group: str, name: str, **words: object) -> str:
    """Return a sentence with its words in braces replaced."""
    return _SENTENCES[group][name].format_map(words)


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


def at_ranks(values: Sequence[float]) -> dict[str, int]:
    """Return which of many values are the least, the quartiles and the most."""
    finite = [at for at, value in enumerate(values) if math.isfinite(value)]
    order = sorted(finite, key=values.__getitem__)
    names = ("lowest", "lower quartile", "median", "upper quartile", "highest")
    last = len(order) - 1
    return {name: order[k * last // 4] for k, name in enumerate(names) if order}
