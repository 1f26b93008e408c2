"""Descriptions of ratings: grades as intended and in person, speeds and torque."""

import math
import statistics
from collections.abc import Sequence

from masrel.analysis._results import (
    InPersonAgreement,
    InPersonPair,
    IntendedAgreement,
    ModelAgreement,
    Speed,
    Speeds,
    SpeedSummary,
)
from masrel.elbow import ConstantSpeed, ElbowParameters, Trace, peak_torque, trace
from masrel.errors import RatingsError
from masrel.protocol import Protocol, elbow_parameters
from masrel.ratings import InPerson, InPersonRow, Ratings


def intended_agreement(protocol: Protocol, ratings: Ratings) -> IntendedAgreement:
    """Return how many raters gave each standard model its intended grade."""
    # The session is the first of the protocol that has ratings.
    # [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). Development of a Haptic Elbow
    # Spasticity Simulator (HESS). IEEE TNSRE, 20(3), 361-370, section IV.B.
    # https://doi.org/10.1109/TNSRE.2012.2195330
    session = _first_session(protocol, ratings)
    models = () if session is None else _by_model(protocol, ratings, session)
    percents = [row.percent for row in models if row.n_ratings]
    reason = None
    if session is None:
        reason = "no session of the protocol has ratings"
    elif not models:
        reason = "no standard model has an intended grade"
    elif not percents:
        reason = "no standard model has a rating"
    elif len(percents) == 1:
        reason = "one model has no standard deviation over models"
    return IntendedAgreement(
        session=session if models else None,
        models=models,
        mean=statistics.fmean(percents) if percents else math.nan,
        sd=statistics.stdev(percents) if len(percents) > 1 else math.nan,
        reason=reason,
    )


def _by_model(
    protocol: Protocol, ratings: Ratings, session: str
) -> tuple[ModelAgreement, ...]:
    table = ratings.table
    models = []
    for model in protocol.models:
        if model.role != "standard" or model.intended_grade is None:
            continue
        rows = (table["session"] == session) & (table["model"] == model.id)
        grades = table.loc[rows & table["grade"].notna(), "grade"].tolist()
        n_agree = grades.count(model.intended_grade)
        models.append(
            ModelAgreement(
                model=model.id,
                intended_grade=model.intended_grade,
                n_ratings=len(grades),
                n_agree=n_agree,
                percent=100.0 * n_agree / len(grades) if grades else math.nan,
            )
        )
    return tuple(models)


def _first_session(protocol: Protocol, ratings: Ratings) -> str | None:
    present = set(ratings.table["session"])
    return next((s.id for s in protocol.sessions if s.id in present), None)


def in_person_agreement(
    protocol: Protocol, ratings: Ratings, in_person: InPerson | None
) -> InPersonAgreement:
    """Return pairs of grades given in person and the same rater's haptic grades."""
    session, reason = _first_session(protocol, ratings), None
    entries: list[tuple[InPersonRow, str | None]] = []
    if in_person is None:
        reason = "no grades given in person belong to these ratings"
    else:
        entries = _entries(in_person, _haptic_grades(ratings, session))
    pairs = tuple(
        InPersonPair(
            rater=row.rater,
            model=row.model,
            in_person=row.in_person_grade,
            haptic=grade,
        )
        for row, grade in entries
        if row.in_person_grade is not None and grade is not None
    )
    if in_person is not None and not pairs:
        reason = "no rater has a grade both in person and haptic"
    return InPersonAgreement(
        session=session,
        pairs=pairs,
        n_pairs=len(pairs),
        n_equal=sum(pair.in_person == pair.haptic for pair in pairs),
        n_unpaired=len(entries) - len(pairs),
        reason=reason,
    )


def _haptic_grades(ratings: Ratings, session: str | None) -> dict[tuple[str, str], str]:
    # by rater and model, in one session
    table = ratings.table
    graded = table[(table["session"] == session) & table["grade"].notna()]
    # Last to first: of repeated presentations the first one counts.
    graded = graded.sort_values("repeat", ascending=False, kind="stable")
    keys = zip(graded["rater"], graded["model"], strict=True)
    return dict(zip(keys, graded["grade"], strict=True))


def _entries(
    in_person: InPerson, haptic: dict[tuple[str, str], str]
) -> list[tuple[InPersonRow, str | None]]:
    # Every in-person entry with its haptic grade: the one printed beside it in the
    # same file, or, where the file has none, the one in the ratings.
    rows = in_person.rows
    printed = {row.source_table for row in rows if row.haptic_grade is not None}
    if not printed:
        return [(row, haptic.get((row.rater, row.model))) for row in rows]
    for row in rows:
        rated = haptic.get((row.rater, row.model))
        if None not in (row.haptic_grade, rated) and row.haptic_grade != rated:
            raise RatingsError(
                f"{in_person.source_path}: line {row.line}, column 'haptic_grade': "
                f"the ratings hold {rated!r} for rater {row.rater}, model {row.model}, "
                f"got {row.haptic_grade!r}"
            )
    # A table without any haptic grade repeats the in-person grades of another.
    return [(row, row.haptic_grade) for row in rows if row.source_table in printed]


def stretching_speeds(protocol: Protocol, ratings: Ratings) -> Speeds:
    """Return the mean speeds of the stretches, and summaries of them."""
    known = ratings.table[ratings.table["mean_speed_deg_s"].notna()]
    columns = (known[c] for c in ("session", "rater", "model", "mean_speed_deg_s"))
    values = tuple(
        Speed(session=s, rater=r, model=m, mean_speed_deg_s=float(speed))
        for s, r, m, speed in zip(*columns, strict=True)
    )
    by_model: dict[tuple[str, str], list[float]] = {}
    by_rater: dict[tuple[str, str], list[float]] = {}
    for value in values:
        for groups, name in ((by_model, value.model), (by_rater, value.rater)):
            key = (value.session, name)
            groups.setdefault(key, []).append(value.mean_speed_deg_s)
    sessions = [session.id for session in protocol.sessions]
    models = [model.id for model in protocol.models]
    raters = [rater.id for rater in protocol.raters]
    return Speeds(
        values=values,
        by_model=_summaries(by_model, sessions, models),
        by_rater=_summaries(by_rater, sessions, raters),
        n_missing=len(ratings.table) - len(values),
        reason=None if values else "no rating comes with a stretching speed",
    )


def _summaries(
    groups: dict[tuple[str, str], list[float]],
    sessions: Sequence[str],
    names: Sequence[str],
) -> tuple[SpeedSummary, ...]:
    # in the protocol's order
    present = [(s, n) for s in sessions for n in names if (s, n) in groups]
    return tuple(
        SpeedSummary(
            session=session,
            name=name,
            n=len(speeds),
            mean=statistics.fmean(speeds),
            sd=statistics.stdev(speeds) if len(speeds) > 1 else math.nan,
            least=min(speeds),
            most=max(speeds),
        )
        for session, name in present
        for speeds in [groups[session, name]]
    )


def stretch_end_deg(protocol: Protocol) -> float:
    """Return where a stretch ends at the latest, deg."""
    return min(protocol.stretch.end_deg, protocol.elbow.range_end_deg)


def peak_torques(
    protocol: Protocol, speeds: Sequence[Speed]
) -> dict[tuple[str, str], float]:
    """Return by model and rater the largest peak of the exact law, N·m."""
    peaks: dict[tuple[str, str], float] = {}
    for speed, joint, motion in _stretches(protocol, speeds):
        key = (speed.model, speed.rater)
        peak = peak_torque(joint, motion)
        peaks[key] = max(peak, peaks.get(key, peak))
    return peaks


def commanded_traces(protocol: Protocol, speeds: Sequence[Speed]) -> list[Trace]:
    """Return what the controller commands in each stretch, at the device's rate."""
    rate_hz = protocol.device.rate_hz
    return [
        trace(joint, motion, rate_hz=rate_hz)
        for _, joint, motion in _stretches(protocol, speeds)
    ]


def _stretches(
    protocol: Protocol, speeds: Sequence[Speed]
) -> list[tuple[Speed, ElbowParameters, ConstantSpeed]]:
    # each at constant speed from the start to the end of the range
    start = math.radians(protocol.stretch.start_deg)
    end = math.radians(stretch_end_deg(protocol))
    models = dict.fromkeys(speed.model for speed in speeds)
    joints = {model: elbow_parameters(protocol, model) for model in models}
    return [
        (
            speed,
            joints[speed.model],
            ConstantSpeed(
                start=start, end=end, speed=math.radians(speed.mean_speed_deg_s)
            ),
        )
        for speed in speeds
    ]
