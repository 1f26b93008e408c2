"""Small studies: the published one, and hand-made ratings under its protocol."""

from functools import cache
from pathlib import Path
from typing import Any

import msgspec

from masrel.lab.protocol import EstimatePlan, Protocol, read_protocol, scale_of
from masrel.lab.ratings import InPerson, Ratings, ratings_from_rows, read_in_person
from masrel.lab.ratings import read_study_ratings as read

STUDY = Path(__file__).parents[3] / "studies/hess2012"
PUBLISHED = STUDY / "ratings/published.csv"
IN_PERSON = STUDY / "ratings/in_person.csv"

Row = tuple[str, str, str, str | None]
"""Session, rater, model, grade."""


@cache
def hess2012() -> Protocol:
    return read_protocol(STUDY / "protocol.toml")


def table_v() -> Ratings:
    return read(PUBLISHED, scale_of(hess2012()))


def in_person() -> InPerson:
    return read_in_person(IN_PERSON)


def plan(**changes: Any) -> EstimatePlan:
    """A line of the plan: Fleiss' kappa of the standard models, no interval."""
    line = {
        "id": "line",
        "kind": "inter-rater",
        "coefficient": "fleiss_kappa",
        "models": "standard",
        "sessions": ["test"],
        "target": "raters",
        "interval": "none",
    }
    return msgspec.convert({**line, **changes}, EstimatePlan)


def protocol_with(*lines: EstimatePlan, sections: tuple[str, ...] = ()) -> Protocol:
    """The protocol of 2012 with another plan and other sections of the report."""
    protocol = hess2012()
    return msgspec.structs.replace(
        protocol,
        analysis=msgspec.structs.replace(protocol.analysis, estimates=lines),
        report=msgspec.structs.replace(protocol.report, sections=sections),
    )


def ratings(*rows: Row, **shared: Any) -> Ratings:
    """Ratings by hand, on the scale of 2012."""
    names = ("session", "rater", "model", "grade")
    return ratings_from_rows(
        [dict(zip(names, row, strict=True), **shared) for row in rows],
        scale_of(hess2012()),
    )


def of_session(session: str, **grades: tuple[str | None, ...]) -> list[Row]:
    """Rows of one session: by rater, grades of HM1, HM2, ... in this order."""
    return [
        (session, rater, f"HM{number}", grade)
        for rater, own in grades.items()
        for number, grade in enumerate(own, start=1)
    ]
