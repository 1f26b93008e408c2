"""What a section of the report is made from, and what it is made of."""

from dataclasses import dataclass
from pathlib import Path

from masrel.audit import Claim
from masrel.lab.analysis import Analysis
from masrel.lab.protocol import Protocol, report_sections
from masrel.lab.ratings import InPerson, Ratings
from masrel.tables._tables import SIMULATED, SIMULATED_DEVICE

SIMULATED_GRADES = (
    "SIMULATED DATA – no person gave these grades",
    "The grades and speeds in this report are simulated. They show that the study "
    "runs; they say nothing about people or about the models.",
)
_SIMULATED_IN_PART = (
    "SIMULATED DATA – no person gave some of these grades",
    "Some of the grades in this report are simulated; the table of sessions says of "
    "which. Together they say nothing about people or about the models.",
)
"""Banner and sentence of a report, by who gave the grades."""


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
    recordings: Path | None = None  # the folder of the sessions' recordings, if known
    claims: tuple[Claim, ...] = ()  # what a paper printed


def gather(
    protocol: Protocol,
    ratings: Ratings,
    analysis: Analysis,
    in_person: InPerson | None = None,
    recordings: Path | None = None,
    claims: tuple[Claim, ...] = (),
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
            how_many = "none" if sources == ["simulated"] else "not all"
            banner, provenance = _on_simulated_device(how_many)
            stamp = trace_stamp = SIMULATED_DEVICE
        elif ratings.n_from_persons:
            banner, provenance = _SIMULATED_IN_PART
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
        claims=claims,
    )


def has_order(material: Material) -> bool:
    """Say whether the grades have an order, as far as a protocol tells."""
    protocol = material.protocol
    return (
        "order" in report_sections(protocol)
        or any(line.weights != "identity" for line in protocol.analysis.estimates)
        or any(grade[0].isdecimal() for grade in material.ratings.scale.grades)
    )


def _on_simulated_device(how_many: str) -> tuple[str, str]:
    # banner and sentence where persons gave all grades; how many of them on hardware
    return (
        f"SIMULATED DEVICE – persons gave these grades, {how_many} of them on hardware",
        f"Persons gave the grades in this report, {how_many} of them on hardware: on "
        "the simulated device nobody felt a model, and the speeds are those of a "
        "simulated hand. Such grades say nothing about the models.",
    )
