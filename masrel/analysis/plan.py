"""Compute what a study's plan asks for, and nothing else.

In: a protocol, its ratings, and grades given in person. Out: an `Analysis`.
"""

import hashlib
from pathlib import Path

import masrel
from masrel.analysis.accuracy import in_person_agreement, intended_agreement
from masrel.analysis.inter_rater import inter_rater
from masrel.analysis.results import Analysis, PlannedEstimate
from masrel.analysis.retest import retest_agreement
from masrel.analysis.selection import check_known
from masrel.analysis.speeds import stretching_speeds
from masrel.errors import CountsError, ParameterError, ProtocolError, RatingsError
from masrel.protocol import EstimatePlan, Protocol, protocol_hash
from masrel.ratings import InPerson, Ratings, ratings_hash

__all__ = ["analyze"]


def analyze(
    protocol: Protocol, ratings: Ratings, *, in_person: InPerson | None = None
) -> Analysis:
    """Compute what the protocol's plan and report ask for.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol: ``analysis.estimates`` is the plan, and
        ``report.sections`` says which descriptions are needed.
    ratings : Ratings
        The ratings.
    in_person : InPerson, optional
        Grades given to patients in person.

    Returns
    -------
    Analysis
        One entry per line of the plan; a line whose data are absent has a reason
        instead of an estimate. Parts no section asks for are None.

    Raises
    ------
    ProtocolError
        If a coefficient or interval of the plan does not exist or does not fit its
        data; the message names the line.
    RatingsError
        If the ratings have a session, rater or model the protocol has not, or
        contradict the in-person grades.

    Warns
    -----
    UndefinedStatisticWarning
        If an estimate is undefined; its reason says why.
    SmallSampleWarning
        If an interval rests on too little data.
    """
    check_known(protocol, ratings)
    sections = set(protocol.report.sections)
    return Analysis(
        study=protocol.study.id,
        level=protocol.analysis.level,
        estimates=tuple(
            _estimate(line, protocol, ratings) for line in protocol.analysis.estimates
        ),
        intended=(
            intended_agreement(protocol, ratings) if "intended" in sections else None
        ),
        in_person=(
            in_person_agreement(protocol, ratings, in_person)
            if "in-person" in sections
            else None
        ),
        speeds=(
            stretching_speeds(protocol, ratings)
            if sections & {"speeds", "traces"}
            else None
        ),
        simulated=ratings.simulated,
        inputs=_inputs(protocol, ratings, in_person),
        masrel_version=masrel.__version__,
    )


def _estimate(
    line: EstimatePlan, protocol: Protocol, ratings: Ratings
) -> PlannedEstimate:
    compute = inter_rater if line.kind == "inter-rater" else retest_agreement
    try:
        return compute(line, protocol, ratings)
    except (ParameterError, CountsError, RatingsError) as error:
        raise ProtocolError(f"analysis.estimates {line.id!r}: {error}") from error


def _inputs(
    protocol: Protocol, ratings: Ratings, in_person: InPerson | None
) -> dict[str, str]:
    inputs = {
        "protocol_sha256": protocol_hash(protocol),
        "ratings_sha256": _ratings_digest(ratings),
    }
    if in_person is not None:
        inputs["in_person_sha256"] = _digest(in_person.source_path)
    return inputs


def _ratings_digest(ratings: Ratings) -> str:
    # The file when there is one: anybody can check it with sha256sum.
    if ratings.source_path is None:
        return ratings_hash(ratings)
    return _digest(ratings.source_path)


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
