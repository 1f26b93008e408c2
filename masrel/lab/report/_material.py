"""What sections of the report are made from, and the words they share."""

import math
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from masrel.agreement import COEFFICIENTS
from masrel.estimates import Estimate
from masrel.lab.analysis import Analysis, PlannedEstimate
from masrel.lab.protocol import EstimatePlan, Protocol
from masrel.lab.ratings import InPerson, Ratings
from masrel.lab.report._pages import TEMPLATES
from masrel.pages._sections import Paragraph, template_environment
from masrel.tables._tables import (
    INTERIM,
    SIMULATED_DEVICE,
    Column,
    as_entered,
    capital,
    counted,
    joined,
    number,
    percent,
)

if TYPE_CHECKING:
    from jinja2 import Template

    from masrel.lab.report._conduct import StudyConduct

FIGURES = "masrel.lab.report."
"""Where the functions are that draw what no file of ratings has."""

# From more than so many on, a figure shows distributions instead of every one.
MANY_RATERS = 30
MANY_STRETCHES = 12
MANY_MODELS = 12  # and panels are smaller


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """Everything a report is made from."""

    protocol: Protocol
    ratings: Ratings
    analysis: Analysis
    # grades given in person, whose notes are shown below their table
    in_person: InPerson | None
    # where the data come from, in one word; more than one joined by "+"
    origin: str
    data: str  # the same, and whether they are interim
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
    origin = "+".join(sources) or "foreign"
    counts, study = ratings.simulated_counts, protocol.study
    label = counts.partition(":")[0]
    interim = "" if conduct is None else conduct.interim
    file = ratings.source_path
    came = f"{origin} ratings" if file is None else f"ratings from {file.name}"
    stamp, provenance = label, f"Study {study.id}, {came}."
    kind = "published" if origin == "published" else "recorded"
    trace_stamp = f"Model reconstruction at {kind} mean speeds, not a measurement"
    if label == SIMULATED_DEVICE:
        origin = origin.replace("simulated", "simulated device")
    if counts:
        provenance, trace_stamp = sentence("simulated", label), stamp
    elif origin == "published":
        provenance = f"Published grades and speeds: {study.source}".rstrip(": ")
        stamp = f"Published data: {study.source}".rstrip(": ")
        trace_stamp = f"{trace_stamp}: {study.source}".rstrip(": ")
    if interim:
        provenance = f"{provenance} {sentence('interim', 'provenance')}"
        stamp, trace_stamp = (
            ", ".join(filter(None, (text, INTERIM))) for text in (stamp, trace_stamp)
        )
    sessions = {row.session for row in ratings.rows}
    raters = {row.rater for row in ratings.rows}
    return Material(
        protocol=protocol,
        ratings=ratings,
        analysis=analysis,
        in_person=in_person,
        data=f"{origin}+{INTERIM.lower()}" if interim else origin,
        origin=origin,
        banner=" ".join(filter(None, (counts, interim))),
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
    return Paragraph(text=reason or "this was not computed", absent=True)


SUPPLEMENT = Paragraph(text="")
"""After this, what a section shows is in the supplement."""


_FILE = Path(__file__).with_name("templates") / "sentences.toml"
_SENTENCES: dict[str, dict[str, str]] = tomllib.loads(_FILE.read_text("utf-8"))


def macros(name: str, words: Mapping[str, object]) -> Any:
    """Return the macros of a template of texts, which know these words and a few."""
    shared: tuple[Callable[..., str], ...] = (
        *(as_entered, capital, counted, joined, number, percent, too_few),
    )
    known = {word.__name__: word for word in shared}
    return _template(name).make_module({**known, **words})


@cache
def _template(name: str) -> "Template":
    # to compile it takes longer than all that it says
    environment = template_environment(TEMPLATES).overlay(finalize=_in_one_line)
    return environment.get_template(name)


def text_of(name: str, macro: str, *values: object) -> str:
    """Return what a macro of a template of texts says of values, as one paragraph."""
    return " ".join(lines_of(getattr(macros(name, {}), macro)(*values)))


def lines_of(text: object) -> list[str]:
    """Return the lines of what a macro says, without those that are blank."""
    return list(filter(None, (" ".join(of.split()) for of in str(text).split("\n"))))


def _in_one_line(value: object) -> object:
    # a line of a template is a fact, whatever a protocol's texts hold
    return " ".join(value.splitlines()) if isinstance(value, str) else value


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


def estimate_titles(lines: Sequence[EstimatePlan]) -> dict[str, str]:
    """Return what each line of a plan is called, by its id."""
    titles = {
        line.id: line.title
        or f"{coefficient_name(line.coefficient, line.weights)}, {line.models} models"
        + ", retest" * (line.kind == "test-retest")
        for line in lines
    }
    # those that are called the same also by their populations, or else their ids
    for key in ("target", "id"):
        alike = Counter(titles.values())
        for line in lines:
            if alike[titles[line.id]] > 1:
                part = str(getattr(line, key))
                titles[line.id] += f", {TARGETS.get(part, part)}"
    return titles


MODEL = Column(key="model", heading="Model", align="left")

INTERVAL = (
    Column(key="interval", heading="Interval", where="page"),
    Column(key="low", heading="Low", where="csv"),
    Column(key="high", heading="High", where="csv"),
)
"""Columns of an interval: as shown, and its ends."""

_WIDE = 0.9  # of 0 to 1, from which on an interval tells nothing
_FEW = 10  # units, below which it is wide for want of more of them


def few(ends: Sequence[float], **counts: int) -> str:
    """Return that units are too few for an interval; nothing if it is to be shown.

    It shows nothing if it covers nearly all from 0, no agreement or that of chance, to
    1. With ten or more units this happens only if grades hardly differ: then they are
    not too few, and the interval is shown, wide as it is.
    """
    is_wide = min(ends[1], 1.0) - max(ends[0], 0.0) >= _WIDE
    small = [counted(n, unit) for unit, n in counts.items() if n < _FEW and is_wide]
    are = "are" if any(of.endswith("s") for of in small) else "is"
    return f"{joined(small)} {are} too few" * bool(small)


def too_few(estimate: Estimate) -> str:
    """Return that an estimate has too few units for an interval; nothing if not."""
    interval = estimate.interval
    if interval is None or COEFFICIENTS[estimate.coefficient].in_units:
        return ""
    counts = {
        "rater": estimate.n_raters * (interval.target != "items"),
        "model": estimate.n_items * (interval.target != "raters"),
    }
    ends = interval.low, interval.high
    return few(ends, **{unit: n for unit, n in counts.items() if n})


def at_ranks(values: Sequence[float]) -> dict[str, int]:
    """Return which of many values are the least, the quartiles and the most."""
    finite = [at for at, value in enumerate(values) if math.isfinite(value)]
    order = sorted(finite, key=values.__getitem__)
    names = ("lowest", "lower quartile", "median", "upper quartile", "highest")
    last = len(order) - 1
    return {name: order[k * last // 4] for k, name in enumerate(names) if order}
