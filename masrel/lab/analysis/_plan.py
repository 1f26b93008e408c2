"""Compute what a study's plan asks for, line by line, and nothing else."""

import hashlib
import random
import warnings
from collections.abc import Sequence
from dataclasses import replace

import msgspec

import masrel
from masrel.agreement import coefficient, cohen_kappa
from masrel.errors import (
    CountsError,
    MasrelWarning,
    ParameterError,
    ProtocolError,
    RatingsError,
)
from masrel.estimates import Estimate
from masrel.lab.analysis._descriptions import (
    in_person_agreement,
    intended_agreement,
    presentations,
    question_summaries,
    stretching_speeds,
)
from masrel.lab.analysis._results import (
    Analysis,
    PlannedEstimate,
    PlannedJudge,
    RaterEstimate,
)
from masrel.lab.conduct import PlanChange
from masrel.lab.protocol import (
    EstimatePlan,
    JudgeKeys,
    Protocol,
    protocol_hash,
    report_sections,
    scale_of,
)
from masrel.lab.ratings import (
    GivenAnswer,
    InPerson,
    Rating,
    Ratings,
    answers_csv,
    rating_matrix,
    ratings_csv,
    retest_pairs,
)

_SEALED_STILL = "the models presented are sealed"


def analyze(
    protocol: Protocol,
    ratings: Ratings,
    *,
    in_person: InPerson | None = None,
    answers: Sequence[GivenAnswer] = (),
    excluded: Sequence[str] = (),
    changes: Sequence[PlanChange] = (),
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
    answers : sequence of GivenAnswer, optional
        Answers to the study's questionnaires.
    excluded : sequence of str, optional
        Raters who are left out of every number
        (`masrel.lab.conduct.excluded_raters`). The hashes of the inputs are of all
        ratings.
    changes : sequence of PlanChange, optional
        What has changed in the plan since it was drawn
        (`masrel.lab.conduct.plan_changes`), which is shown with the numbers.

    Returns
    -------
    Analysis
        One entry per line of the plan; a line whose data are absent has a reason
        instead of an estimate, of sealed ratings each. Parts no section asks for are
        None.

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
    inputs = _inputs(protocol, ratings, in_person, answers)
    is_sealed, sections = ratings.is_sealed, set(report_sections(protocol))
    if is_sealed:  # nothing of them could be said without a model
        ratings, answers, sections = replace(ratings, rows=()), (), set()
    _check_known(protocol, ratings)
    if excluded:
        ratings = ratings.without(excluded)
        if in_person is not None:
            rows = tuple(row for row in in_person.rows if row.rater not in excluded)
            in_person = replace(in_person, rows=rows)
        answers = [each for each in answers if each.rater not in excluded]
    # descriptions of grades speak of the first session that has ratings
    present = {row.session for row in ratings.rows}
    session = next((s.id for s in protocol.sessions if s.id in present), None)
    return Analysis(
        study=protocol.study.id,
        level=protocol.analysis.level,
        estimates=tuple(
            PlannedEstimate(line=line, reason=_SEALED_STILL)
            if is_sealed
            else _estimate(line, protocol, ratings)
            for line in protocol.analysis.estimates
        ),
        judges=tuple(
            PlannedJudge(line=line, reason=_SEALED_STILL)
            if is_sealed
            else _judge(line, ratings)
            for line in protocol.analysis.judges
        ),
        intended=(
            intended_agreement(protocol, ratings, session)
            if "intended" in sections
            else None
        ),
        in_person=(
            in_person_agreement(ratings, in_person, session)
            if "in-person" in sections
            else None
        ),
        speeds=(
            stretching_speeds(protocol, ratings)
            if sections & {"speeds", "traces"}
            else None
        ),
        presentations=presentations(ratings),
        questionnaires=question_summaries(protocol, answers),
        simulated=ratings.simulated,
        excluded=tuple(excluded),
        plan_changes=tuple(  # who changed it, and why, is not for everybody
            {
                "key": change.key,
                "before": change.before,
                "after": change.after,
                "time_utc": change.time_utc,
            }
            for change in changes
        ),
        inputs=inputs,
        masrel_version=masrel.__version__,
    )


def _check_known(protocol: Protocol, ratings: Ratings) -> None:
    # refuses ratings of sessions, raters or models the protocol does not have
    known = {
        "session": [session.id for session in protocol.sessions],
        "rater": [rater.id for rater in protocol.raters],
        "model": [model.id for model in protocol.models],
    }
    where = "the ratings" if ratings.source_path is None else str(ratings.source_path)
    problems = [
        f"{where}: column {column!r}: needed one of the protocol's, {', '.join(ids)}, "
        f"got {got!r}"
        for column, ids in known.items()
        for got in dict.fromkeys(getattr(row, column) for row in ratings.rows)
        if got not in ids
    ]
    if problems:
        raise RatingsError("\n".join(problems))


def _inputs(
    protocol: Protocol,
    ratings: Ratings,
    in_person: InPerson | None,
    answers: Sequence[GivenAnswer],
) -> dict[str, str]:
    # SHA-256 by name; of the file that is there, or that `masrel ratings` writes
    path = ratings.source_path
    text = ratings_csv(ratings).encode() if path is None else path.read_bytes()
    files = {"ratings": text}
    if in_person is not None:
        files["in_person"] = in_person.source_path.read_bytes()
    if answers:
        files["answers"] = answers_csv(tuple(answers)).encode()
    return {
        "protocol_sha256": protocol_hash(protocol),
        **{
            f"{of}_sha256": hashlib.sha256(data).hexdigest()
            for of, data in files.items()
        },
    }


def _estimate(
    line: EstimatePlan, protocol: Protocol, ratings: Ratings
) -> PlannedEstimate:
    try:
        return _planned(line, protocol, ratings)
    except (ParameterError, CountsError, RatingsError) as error:
        if unanswered(line, protocol) is not None:
            raise ProtocolError(f"analysis.estimates {line.id!r}: {error}") from error
        reason = f"not with the ratings that are there: {error}"
        return PlannedEstimate(line=line, reason=reason)


def _judge(line: JudgeKeys, ratings: Ratings) -> PlannedJudge:
    """Hold a rater beside the others of a session, presentation by presentation."""
    from masrel.judges import alternative_annotator_test

    grades: dict[str, dict[tuple[str, int], str | None]] = {line.judge: {}}
    for row in ratings.rows:
        is_asked = row.rater in (line.judge, *line.humans) or not line.humans
        if row.session == line.session and is_asked:
            grades.setdefault(row.rater, {})[row.model, row.repeat] = row.grade
    judge = grades.pop(line.judge)
    try:
        result = alternative_annotator_test(
            grades, judge, epsilon=line.epsilon, min_items=line.min_items
        )
    except (ParameterError, RatingsError) as error:
        return PlannedJudge(
            line=line, reason=f"not with the ratings that are there: {error}"
        )
    return PlannedJudge(line=line, result=result)


def _planned(
    line: EstimatePlan, protocol: Protocol, ratings: Ratings
) -> PlannedEstimate:
    compute = _inter_rater if line.kind == "inter-rater" else _retest
    models, reason = _rated_models(line, protocol, ratings)
    if reason is not None:
        return PlannedEstimate(line=line, reason=reason)
    return compute(line, protocol, ratings, models)


def with_level(
    planned: PlannedEstimate, protocol: Protocol, ratings: Ratings, level: float
) -> PlannedEstimate:
    """Return a line of the plan once more, its intervals of another level."""
    analysis = msgspec.structs.replace(protocol.analysis, level=level)
    protocol = msgspec.structs.replace(protocol, analysis=analysis)
    with warnings.catch_warnings(action="ignore", category=MasrelWarning):
        return _planned(planned.line, protocol, ratings)


def unanswered(line: EstimatePlan, protocol: Protocol) -> str | None:
    """Return why there is no estimate even once every rating is there, or None."""
    # whatever the grades; they are random ones here
    grades, rng = protocol.scale.grades, random.Random(line.id)
    rows = tuple(
        Rating(session.id, rater, model.id, repeat, rng.choice(grades))
        for session in protocol.sessions
        for rater in session.raters
        for model in protocol.models
        for repeat in range(1, protocol.schedule.repeats + 1)
    )
    scale = scale_of(protocol)
    whole = Ratings(rows=rows, scale=scale, source_path=None, simulated=False)
    with warnings.catch_warnings(action="ignore", category=MasrelWarning):
        try:
            return _planned(line, protocol, whole).reason
        except (ParameterError, CountsError, RatingsError) as error:
            return str(error)


def _rated_models(
    line: EstimatePlan, protocol: Protocol, ratings: Ratings
) -> tuple[tuple[str, ...], str | None]:
    # the models a line uses, rated in each of its sessions; or why there are none
    present = {row.session for row in ratings.rows}
    lost = [session for session in line.sessions if session not in present]
    if lost:
        return (), f"there are no ratings of session {' or '.join(lost)}"
    planned = [m for m in protocol.models if line.models in ("all", m.role)]
    if not planned:
        return (), f"the study has no {line.models} models"
    graded = {(row.session, row.model) for row in ratings.rows if row.grade is not None}
    rated = set.intersection(
        *({model for of, model in graded if of == s} for s in line.sessions)
    )
    # A role without any rating was not part of these data: an estimate over the
    # rest would carry the name of more than it holds.
    for role in ("standard", "dummy"):
        of_role = [model.id for model in planned if model.role == role]
        if of_role and not rated.intersection(of_role):
            sessions = " and ".join(line.sessions)
            return (), f"no {role} model has ratings in session {sessions}"
    return tuple(model.id for model in planned if model.id in rated), None


def _inter_rater(
    line: EstimatePlan, protocol: Protocol, ratings: Ratings, models: tuple[str, ...]
) -> PlannedEstimate:
    # agreement between the raters of one session
    session, scale = line.sessions[0], scale_of(protocol)
    matrix = rating_matrix(ratings, session=session, models=models)
    if len(matrix.raters) < 2:
        reason = f"session {session} has one rater; agreement needs two"
        return PlannedEstimate(line=line, reason=reason)
    grades = scale.weigh(matrix.grades)
    return PlannedEstimate(
        line=line,
        items=matrix.items,
        raters=matrix.raters,
        n_missing=matrix.n_missing,
        estimate=_compute(line, protocol, grades, line.id),
    )


def _retest(
    line: EstimatePlan, protocol: Protocol, ratings: Ratings, models: tuple[str, ...]
) -> PlannedEstimate:
    # Agreement of every rater with him- or herself. ``stratified_kappa`` gives one
    # estimate over all raters, each a stratum, and ``pooled_kappa`` one of all their
    # pairs in one table, both with every rater's Cohen's kappa beside it; any other
    # coefficient is computed for every rater alone.
    first, second = line.sessions
    pairs = retest_pairs(ratings, first=first, second=second, models=models)
    if not pairs.raters:
        reason = f"no rater has ratings in both {first} and {second}"
        return PlannedEstimate(line=line, reason=reason)
    scale, estimate = scale_of(protocol), None
    weighed = [scale.weigh(of_rater) for of_rater in pairs.pairs]
    if coefficient(line.coefficient).shape == "pairs":
        estimate = _compute(line, protocol, weighed, line.id)
        by_rater = [
            cohen_kappa(of_rater, categories=scale.values, weights=line.weights)
            for of_rater in weighed
        ]
    else:
        by_rater = [
            _compute(line, protocol, of_rater, f"{line.id}/{rater}")
            for rater, of_rater in zip(pairs.raters, weighed, strict=True)
        ]
    return PlannedEstimate(
        line=line,
        items=pairs.items,
        raters=pairs.raters,
        n_missing=pairs.n_missing,
        estimate=estimate,
        by_rater=tuple(
            RaterEstimate(rater=rater, estimate=of_rater)
            for rater, of_rater in zip(pairs.raters, by_rater, strict=True)
        ),
    )


def _compute(
    line: EstimatePlan, protocol: Protocol, ratings: object, purpose: str
) -> Estimate:
    # the coefficient of a line, with the interval it asks for
    categories, level = scale_of(protocol).values, protocol.analysis.level
    if line.interval == "none":
        return coefficient(line.coefficient)(
            ratings, categories=categories, weights=line.weights, level=level
        )
    # Imported here: a coefficient alone loads no interval.
    from masrel import intervals

    # The seed is the purpose's own, derived from the study's: a line more in a plan
    # moves no other line's numbers. It fits a signed integer of 64 bits, as other
    # readers of the JSON have them.
    root = f"{protocol.analysis.seed}/{purpose}"
    digest = hashlib.sha256(root.encode()).digest()
    return intervals.estimate(
        line.coefficient,
        ratings,
        target=line.target,
        method=line.interval,
        categories=categories,
        weights=line.weights,
        level=level,
        n_resamples=protocol.analysis.n_resamples,
        rng=int.from_bytes(digest[:8], "big") >> 1,
    )
