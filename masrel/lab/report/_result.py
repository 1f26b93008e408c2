"""The first paragraph: what the study came to, in sentences.

Every number is one of the analysis; the words are those of `_sentences`.
"""

import math
from collections.abc import Iterator, Sequence

from masrel.estimates import Estimate, Interval
from masrel.lab.analysis import Analysis, IntendedAgreement, PlannedEstimate
from masrel.lab.protocol import EstimatePlan
from masrel.lab.report._sentences import coefficient_name, sentence
from masrel.tables._tables import counted, number, percent


def result_text(analysis: Analysis) -> str:
    """Return the first paragraph of a report."""
    sentences = [*_between(analysis)]
    if analysis.intended is not None:
        sentences.append(_intended(analysis.intended))
    sentences += _within(analysis)
    if analysis.excluded:
        sentences.append(excluded_text("result", analysis.excluded))
    return " ".join(sentences)


def main_estimate(analysis: Analysis) -> PlannedEstimate | None:
    """Return the first line between raters that the data hold, or else the first."""
    planned = [p for p in analysis.estimates if p.line.kind == "inter-rater"]
    return next((p for p in planned if p.estimate), planned[0] if planned else None)


def excluded_text(group: str, raters: Sequence[str]) -> str:
    """Say which raters are excluded."""
    verb = "is" if len(raters) == 1 else "are"
    return sentence(group, "excluded", raters=", ".join(raters), are=verb)


def name_within(line: EstimatePlan) -> str:
    """Return the name of a line's coefficient within a sentence."""
    name = coefficient_name(line.coefficient)
    if line.coefficient in _COMMON:
        name = name[0].lower() + name[1:]
    return name if line.weights == "identity" else f"{name} with {line.weights} weights"


_COMMON = ("percent_agreement", "pooled_kappa", "stratified_kappa")
"""Coefficients that are not called by anybody's name."""


def _between(analysis: Analysis) -> Iterator[str]:
    entry = main_estimate(analysis)
    if entry is None:
        yield sentence("result", "none")
        return
    words = _words(entry)
    session = entry.line.sessions[0]
    if entry.estimate is None:
        yield sentence("result", "absent", **words, session=session)
        return
    name = "undefined" if math.isnan(entry.estimate.value) else "agreement"
    n_grades = len(entry.items) * len(entry.raters) - entry.n_missing
    grades = f"{counted(n_grades, 'grade')}, {entry.n_missing or 'none'} missing"
    yield sentence("result", name, **words, session=session, grades=grades)
    for other in analysis.estimates:
        interval = None if other.estimate is None else other.estimate.interval
        if interval is None or math.isnan(interval.low):
            continue
        if _is_same(other, entry):
            name = "further_lower" if interval.is_one_sided else "further"
            yield _ends(interval, name)


def _is_same(one: PlannedEstimate, other: PlannedEstimate) -> bool:
    # whether they are one number, for two populations
    keys = ("kind", "coefficient", "weights", "models", "sessions")
    is_one = all(getattr(one.line, key) == getattr(other.line, key) for key in keys)
    return is_one and one.line.target != other.line.target


def _intended(result: IntendedAgreement) -> str:
    if math.isnan(result.mean):
        return sentence("result", "intended_undefined", reason=result.reason)
    rated = [model for model in result.models if model.n_ratings]
    return sentence(
        "result",
        "intended_one" if len(rated) == 1 else "intended",
        models=counted(len(rated), "standard model"),
        percent=number(result.mean, 1),
    )


def _within(analysis: Analysis) -> Iterator[str]:
    planned = [p for p in analysis.estimates if p.line.kind == "test-retest"]
    known = (p for p in planned if p.estimate is not None or p.by_rater)
    entry = next(known, planned[0] if planned else None)
    if entry is None:
        return
    words = _words(entry)
    first, second = entry.line.sessions
    if entry.estimate is not None:
        name = "retest_undefined" if math.isnan(entry.estimate.value) else "retest"
        yield sentence("result", name, **words, first=first, second=second)
        return
    values = [rater.estimate.value for rater in entry.by_rater]
    defined = [value for value in values if not math.isnan(value)]
    if defined:
        ends = {"least": number(min(defined), 3), "most": number(max(defined), 3)}
        yield sentence(
            "result", "retest_raters", **words, **ends, first=first, second=second
        )
        return
    reason = entry.reason or entry.by_rater[0].estimate.reason
    yield sentence("result", "retest_absent", reason=reason)


def _words(entry: PlannedEstimate) -> dict[str, object]:
    line, estimate = entry.line, entry.estimate
    models = "all models" if line.models == "all" else f"the {line.models} models"
    if estimate is not None or entry.by_rater:
        kind = "model" if line.models == "all" else f"{line.models} model"
        models = counted(len(entry.models), kind)
        if len(entry.items) > len(entry.models):
            models += f", {len(entry.items)} presentations of them,"
    return {
        "raters": counted(len(entry.raters), "rater"),
        "models": models,
        "coefficient": name_within(line),
        "reason": entry.reason if estimate is None else estimate.reason,
        "value": "" if estimate is None else number(estimate.value, 3),
        "interval": "" if estimate is None else _uncertainty(estimate),
    }


def _uncertainty(estimate: Estimate) -> str:
    interval = estimate.interval
    if interval is None:
        return sentence("interval", "none")
    if math.isnan(interval.low):
        return _ends(interval, "undefined")
    return _ends(interval, "lower_end" if interval.is_one_sided else "both_ends")


def _ends(interval: Interval, name: str) -> str:
    return sentence(
        "interval",
        name,
        level=percent(interval.level),
        kind=interval.kind,
        low=number(interval.low, 3),
        high=number(interval.high, 3),
        population=sentence("population", interval.target),
        reason=interval.reason,
    )
