"""The first paragraph of a report, and the methods to paste into a paper.

Every number is one of the analysis; the words are those of ``sentences.toml``.
"""

import math
from collections.abc import Iterator, Sequence
from importlib import import_module

from masrel.agreement import COEFFICIENTS
from masrel.estimates import Estimate, Interval
from masrel.lab.analysis import Analysis, PlannedEstimate
from masrel.lab.protocol import EstimatePlan, report_sections, scale_of
from masrel.lab.protocol._kinds import DEFAULT_KIND
from masrel.lab.report._design import beside_presentations, stretches_asked_for
from masrel.lab.report._grade_sections import given_grades
from masrel.lab.report._material import (
    Material,
    coefficient_name,
    main_estimate,
    sentence,
)
from masrel.lab.report._order_tables import effect_rows
from masrel.lab.schedule._orders import orders_in_words
from masrel.pages._references import (
    bibtex,
    cited,
    coefficient_references,
    interval_references,
    scale_references,
)
from masrel.pages._sections import Content, Listing, Paragraph
from masrel.scales import published_scale
from masrel.tables._tables import counted, joined, number, percent


def result_text(analysis: Analysis) -> str:
    """Return the first paragraph of a report."""
    sentences = [*_between(analysis)]
    if (intended := analysis.intended) is not None:
        rated = sum(1 for model in intended.models if model.n_ratings)
        name = "intended_one" if rated == 1 else "intended"
        sentences.append(
            sentence(
                "result",
                "intended_undefined" if math.isnan(intended.mean) else name,
                reason=intended.reason,
                models=counted(rated, "standard model"),
                percent=number(intended.mean, 1),
            )
        )
    sentences += _within(analysis)
    if analysis.excluded:
        sentences.append(_excluded_text("result", analysis.excluded))
    return " ".join(sentences)


def _excluded_text(group: str, raters: Sequence[str]) -> str:
    verb = "is" if len(raters) == 1 else "are"
    return sentence(group, "excluded", raters=", ".join(raters), are=verb)


def _name_within(line: EstimatePlan) -> str:
    # the name of a line's coefficient within a sentence
    name = coefficient_name(line.coefficient)
    if line.coefficient in _COMMON:
        name = name[0].lower() + name[1:]
    return name if line.weights == "identity" else f"{name} with {line.weights} weights"


# Coefficients that are not called by anybody's name
_COMMON = ("percent_agreement", "pooled_kappa", "stratified_kappa")


def _between(analysis: Analysis) -> Iterator[str]:
    entry = main_estimate(analysis)
    if entry is None:
        yield sentence("result", "none")
        return
    name, estimate = "absent", entry.estimate
    if estimate is not None:
        name = "undefined" if math.isnan(estimate.value) else "agreement"
    n_grades = len(entry.items) * len(entry.raters) - entry.n_missing
    yield sentence(
        "result",
        name,
        **_words(entry),
        session=entry.line.sessions[0],
        grades=f"{counted(n_grades, 'grade')}, {entry.n_missing or 'none'} missing",
    )
    # the same number for other populations
    keys = ("kind", "coefficient", "weights", "models", "sessions")
    for other in analysis.estimates:
        interval = None if other.estimate is None else other.estimate.interval
        if interval is None or math.isnan(interval.low):
            continue
        is_one = all(getattr(other.line, k) == getattr(entry.line, k) for k in keys)
        if estimate and is_one and other.line.target != entry.line.target:
            name = "further_lower" if interval.is_one_sided else "further"
            yield _ends(interval, name)


def _within(analysis: Analysis) -> Iterator[str]:
    planned = [p for p in analysis.estimates if p.line.kind == "test-retest"]
    known = (p for p in planned if p.estimate is not None or p.by_rater)
    entry = next(known, planned[0] if planned else None)
    if entry is None:
        return
    values = [rater.estimate.value for rater in entry.by_rater]
    defined = [value for value in values if not math.isnan(value)]
    words = _words(entry)
    words["first"], words["second"] = entry.line.sessions
    if entry.estimate is not None:
        name = "retest_undefined" if math.isnan(entry.estimate.value) else "retest"
    elif defined:
        name = "retest_raters"
        words |= {"least": number(min(defined), 3), "most": number(max(defined), 3)}
    else:
        name = "retest_absent"
        words["reason"] = entry.reason or entry.by_rater[0].estimate.reason
    yield sentence("result", name, **words)


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
        "coefficient": _name_within(line),
        "reason": entry.reason if estimate is None else estimate.reason,
        "value": "" if estimate is None else number(estimate.value, 3),
        "interval": "" if estimate is None else _uncertainty(estimate.interval),
    }


def _uncertainty(interval: Interval | None) -> str:
    if interval is None:
        return sentence("interval", "none")
    name = "lower_end" if interval.is_one_sided else "both_ends"
    return _ends(interval, "undefined" if math.isnan(interval.low) else name)


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


def methods_section(material: Material) -> Iterator[Content]:
    """Say how the study was made and its numbers computed, with references."""
    used: list[str] = []  # keys of all that is cited
    for sentences in (_study(material, used), _statistics(material, used)):
        yield Paragraph(text=" ".join(filter(None, sentences)))
    if used:
        yield Listing(title=sentence("references", "listing"), text=bibtex(used))


def _cite(keys: Sequence[str], used: list[str]) -> str:
    used += keys
    return cited(tuple(keys))


def _study(material: Material, used: list[str]) -> Iterator[str]:
    protocol = material.protocol
    models, sessions, scale = protocol.models, protocol.sessions, scale_of(protocol)
    n_standard = sum(model.role == "standard" for model in models)
    published = published_scale(scale)
    yield sentence(
        "methods",
        "models",
        raters=counted(len(protocol.raters), "rater"),
        models=counted(len(models), "haptic model"),
        standard=n_standard,
        dummy=len(models) - n_standard,
        sessions=counted(len(sessions), "session"),
        scale=f"scale {scale.name}" if published is None else published.title,
        grades=", ".join(scale.grades),
        reference=_cite(scale_references(published), used),
    )
    if all(model.kind == DEFAULT_KIND for model in models):
        yield sentence("methods", "law", reference=_cite(["park2012"], used))
    yield sentence("methods", "orders", orders=orders_in_words(protocol.schedule))
    if protocol.schedule.repeats > 1:
        yield sentence("methods", "repeats", repeats=protocol.schedule.repeats)
    yield stretches_asked_for(protocol.presentation)
    yield beside_presentations(protocol.occasions).strip()
    if material.ratings.simulated:
        yield sentence("methods", "simulated")
    elif material.data == "published" and protocol.study.source:
        yield sentence("methods", "published", source=protocol.study.source)


def _statistics(material: Material, used: list[str]) -> Iterator[str]:
    analysis = material.analysis
    known = [p for p in analysis.estimates if p.estimate is not None or p.by_rater]
    estimates = [
        (planned.line, estimate)
        for planned in known
        for estimate in (planned.estimate, *(r.estimate for r in planned.by_rater))
        if estimate is not None
    ]
    for kind, name in (("inter-rater", "between"), ("test-retest", "within")):
        lines = [p.line for p in known if p.line.kind == kind]
        names = {
            _name_within(line)
            + _cite(coefficient_references(line.coefficient, line.weights), used): None
            for line in lines
        }
        if names:
            yield sentence("methods", name, coefficients=joined(list(names)))
    yield from _intervals(estimates, used)
    lacking = [f"{p.n_missing} of {p.line.id}" for p in known if p.n_missing]
    if lacking:
        text = f"{', '.join(lacking)} are missing"
        yield sentence("methods", "missing", missing=text)
    if analysis.excluded:
        yield _excluded_text("methods", analysis.excluded)
    if any(COEFFICIENTS[of.coefficient].chance_corrected for _, of in estimates):
        yield sentence("methods", "strength", reference=_cite(["landis1977"], used))
    of_sections = [*_of_sections(material, used)]
    yield from of_sections
    has_scipy = of_sections or any(estimate.interval for _, estimate in estimates)
    names_used = ("numpy", "scipy") if has_scipy else ("numpy",)
    versions = [f"{n} {import_module(n).__version__}" for n in names_used]
    yield sentence(
        "methods",
        "software",
        masrel=analysis.masrel_version,
        libraries=", ".join(versions),
    )


def _of_sections(material: Material, used: list[str]) -> Iterator[str]:
    # how what only single sections show is computed, of those that have something
    sections = report_sections(material.protocol)
    main = main_estimate(material.analysis)
    if "categories" in sections and main is not None and main.estimate is not None:
        yield sentence(
            "methods",
            "categories",
            reference=_cite(["cicchetti1990"], used),
            interval_reference=_cite(["korn1998"], used),
            kappa_reference=_cite(["fleiss1971"], used),
        )
    if "confusion" in sections and given_grades(material)[1]:
        yield sentence("methods", "confusion", reference=_cite(["korn1998"], used))
    ratings = material.ratings.without(material.analysis.excluded)
    if "order" in sections and effect_rows(
        material.protocol, ratings, material.analysis.level
    ):
        yield sentence("methods", "order")


def _intervals(
    estimates: Sequence[tuple[EstimatePlan, Estimate]], used: list[str]
) -> Iterator[str]:
    # one sentence for each kind of interval, with the lines whose estimates have it
    alike: dict[tuple[float, str, str, str], tuple[Interval, dict[str, None]]] = {}
    for line, estimate in estimates:
        interval = estimate.interval
        if interval is not None and not math.isnan(interval.low):
            kind = (interval.level, interval.kind, interval.method, interval.target)
            alike.setdefault(kind, (interval, {}))[1][line.id] = None
    for interval, lines in alike.values():
        yield sentence(
            "methods",
            "interval",
            estimates=joined(list(lines)),
            level=percent(interval.level),
            kind=interval.kind,
            population=sentence("population", interval.target),
            method=interval.method,
            reference=_cite(interval_references(interval), used),
        )
