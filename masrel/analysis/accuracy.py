"""Grades against what they should equal: the intended grade, and in person."""

import math
import statistics
from collections.abc import Sequence

from masrel.analysis.results import (
    InPersonAgreement,
    InPersonPair,
    IntendedAgreement,
    ModelAgreement,
)
from masrel.errors import RatingsError
from masrel.protocol import Protocol
from masrel.ratings import InPerson, InPersonRow, Ratings

__all__ = ["in_person_agreement", "intended_agreement"]


def intended_agreement(protocol: Protocol, ratings: Ratings) -> IntendedAgreement:
    """Count how many raters gave each standard model its intended grade."""
    # The session is the first of the protocol that has ratings.
    # [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). Development of a Haptic Elbow
    # Spasticity Simulator (HESS). IEEE TNSRE, 20(3), 361-370, section IV.B.
    # https://doi.org/10.1109/TNSRE.2012.2195330
    session = first_session(protocol, ratings)
    if session is None:
        return _nothing("no session of the protocol has ratings")
    table = ratings.table
    given = table[(table["session"] == session) & table["grade"].notna()]
    models = [
        _model_agreement(
            model.id,
            model.intended_grade,
            given.loc[given["model"] == model.id, "grade"].tolist(),
        )
        for model in protocol.models
        if model.role == "standard" and model.intended_grade is not None
    ]
    if not models:
        return _nothing("no standard model has an intended grade")
    percents = [row.percent for row in models if math.isfinite(row.percent)]
    return IntendedAgreement(
        session=session,
        models=tuple(models),
        mean=statistics.fmean(percents) if percents else math.nan,
        sd=statistics.stdev(percents) if len(percents) > 1 else math.nan,
        reason=_few(len(percents)),
    )


def first_session(protocol: Protocol, ratings: Ratings) -> str | None:
    """Return the first session of the protocol that has ratings."""
    present = set(ratings.table["session"])
    return next((s.id for s in protocol.sessions if s.id in present), None)


def _nothing(reason: str) -> IntendedAgreement:
    return IntendedAgreement(
        session=None, models=(), mean=math.nan, sd=math.nan, reason=reason
    )


def _few(n_models: int) -> str | None:
    if n_models > 1:
        return None
    if n_models == 1:
        return "one model has no standard deviation over models"
    return "no standard model has a rating"


def _model_agreement(
    model: str, intended: str, grades: Sequence[str]
) -> ModelAgreement:
    n_agree = sum(grade == intended for grade in grades)
    return ModelAgreement(
        model=model,
        intended_grade=intended,
        n_ratings=len(grades),
        n_agree=n_agree,
        percent=100.0 * n_agree / len(grades) if grades else math.nan,
    )


def in_person_agreement(
    protocol: Protocol, ratings: Ratings, in_person: InPerson | None
) -> InPersonAgreement:
    """Pair grades given in person with the same rater's haptic grades."""
    # A file of in-person grades that holds haptic grades too is paired row by row; one
    # that holds none is paired with the first session of the ratings.
    session = first_session(protocol, ratings)
    if in_person is None:
        return _unpaired(session, "no grades given in person belong to these ratings")
    found = _entries(in_person, _grades_of(ratings, session))
    pairs = tuple(
        InPersonPair(
            rater=row.rater,
            model=row.model,
            in_person=row.in_person_grade,
            haptic=grade,
        )
        for row, grade in found
        if row.in_person_grade is not None and grade is not None
    )
    return InPersonAgreement(
        session=session,
        pairs=pairs,
        n_pairs=len(pairs),
        n_equal=sum(pair.in_person == pair.haptic for pair in pairs),
        n_unpaired=len(found) - len(pairs),
        reason=None if pairs else "no rater has a grade both in person and haptic",
    )


def _unpaired(session: str | None, reason: str) -> InPersonAgreement:
    return InPersonAgreement(
        session=session, pairs=(), n_pairs=0, n_equal=0, n_unpaired=0, reason=reason
    )


def _grades_of(ratings: Ratings, session: str | None) -> dict[tuple[str, str], str]:
    table = ratings.table
    given = table[(table["session"] == session) & table["grade"].notna()]
    # Last to first: of repeated presentations the first one counts.
    given = given.sort_values("repeat", ascending=False, kind="stable")
    keys = zip(given["rater"], given["model"], strict=True)
    return dict(zip(keys, given["grade"], strict=True))


def _entries(
    in_person: InPerson, haptic: dict[tuple[str, str], str]
) -> list[tuple[InPersonRow, str | None]]:
    # Every in-person entry with its haptic grade: the one printed beside, or the rated.
    rows = in_person.rows
    printed = {row.source_table for row in rows if row.haptic_grade is not None}
    if not printed:
        return [(row, haptic.get((row.rater, row.model))) for row in rows]
    _check_haptic(in_person, haptic)
    # A table without any haptic grade repeats the in-person grades of another.
    return [(row, row.haptic_grade) for row in rows if row.source_table in printed]


def _check_haptic(in_person: InPerson, haptic: dict[tuple[str, str], str]) -> None:
    for row in in_person.rows:
        rated = haptic.get((row.rater, row.model))
        if None not in (row.haptic_grade, rated) and row.haptic_grade != rated:
            raise RatingsError(
                f"{in_person.source_path}: line {row.line}, column 'haptic_grade': "
                f"the ratings hold {rated!r} for rater {row.rater}, model {row.model}, "
                f"got {row.haptic_grade!r}"
            )
