"""The first paragraph of a report, and the methods to paste into a paper.

Every number is one of the analysis; the words are those of ``sentences.toml``.
"""

import math
from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any

from masrel.agreement import COEFFICIENTS
from masrel.estimates import Estimate, Interval
from masrel.lab.analysis import PlannedEstimate
from masrel.lab.protocol import EstimatePlan, report_sections, scale_of
from masrel.lab.protocol._kinds import DEFAULT_KIND
from masrel.lab.report._conduct import StudyConduct
from masrel.lab.report._design import (
    models_in_words,
    planned_text,
)
from masrel.lab.report._grade_sections import given_grades
from masrel.lab.report._material import (
    Material,
    coefficient_name,
    main_estimate,
    sentence,
)
from masrel.lab.report._order_tables import effect_rows
from masrel.lab.report._pages import TEMPLATES
from masrel.lab.run._state import FROM_PERSONS
from masrel.lab.schedule._orders import orders_in_words
from masrel.pages._references import (
    bibtex,
    cited,
    coefficient_references,
    interval_references,
    scale_references,
)
from masrel.pages._sections import (
    Content,
    Listing,
    Paragraph,
    template_environment,
)
from masrel.scales import published_scale
from masrel.tables._tables import counted, joined, number, percent


def result_text(material: Material) -> str:
    """Return the first paragraph of a report."""
    analysis = material.analysis
    sentences = [*_between(material)]
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
    sentences += _within(material)
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


def _between(material: Material) -> Iterator[str]:
    analysis = material.analysis
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
        **_words(material, entry),
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


def _within(material: Material) -> Iterator[str]:
    estimates = material.analysis.estimates
    planned = [p for p in estimates if p.line.kind == "test-retest"]
    known = (p for p in planned if p.estimate is not None or p.by_rater)
    entry = next(known, planned[0] if planned else None)
    if entry is None:
        return
    values = [rater.estimate.value for rater in entry.by_rater]
    defined = [value for value in values if not math.isnan(value)]
    words = _words(material, entry)
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


def _words(material: Material, entry: PlannedEstimate) -> dict[str, object]:
    line, estimate = entry.line, entry.estimate
    planned = [s.raters for s in material.protocol.sessions if s.id in line.sessions]
    n_raters, n_planned = len(entry.raters), len(set.intersection(*map(set, planned)))
    are_few = f"{n_raters} of " * (n_raters < n_planned)
    models = "all models" if line.models == "all" else f"the {line.models} models"
    if estimate is not None or entry.by_rater:
        kind = "model" if line.models == "all" else f"{line.models} model"
        models = counted(len(entry.models), kind)
        if len(entry.items) > len(entry.models):
            models += f", {len(entry.items)} presentations of them,"
    return {
        "raters": are_few + counted(max(n_raters, n_planned), "rater"),
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
    protocol, scale = material.protocol, scale_of(material.protocol)
    rows = [row for row in material.ratings.rows if row.grade is not None]
    graded = {row.model for row in rows}
    published = published_scale(scale)
    yield sentence(
        "methods",
        "graded" if rows else "ungraded",
        raters=counted(len({row.rater for row in rows}), "rater"),
        given=counted(len(rows), "grade"),
        models=models_in_words([m for m in protocol.models if m.id in graded]),
        sessions=_sessions_in_words(material.sessions),
        scale=f"scale {scale.name}" if published is None else published.title,
        grades=", ".join(scale.grades),
        reference=_cite(scale_references(published), used),
    )
    yield material.ratings.simulated_counts
    law = ""
    if all(model.kind == DEFAULT_KIND for model in protocol.models):
        law = sentence("methods", "law", reference=_cite(["park2012"], used))
    if material.conduct is not None and material.conduct.is_of_ratings:
        yield law
        yield from _as_recorded(material, material.conduct)
        return
    is_published = material.origin == "published" and protocol.study.source
    file = material.ratings.source_path
    yield sentence(
        "methods",
        "published" if is_published else "elsewhere",
        source=protocol.study.source,
        file="elsewhere" if file is None else f"the file {file.name}",
    )
    yield f"{planned_text(protocol)} {law}"


def _sessions_in_words(sessions: Sequence[str]) -> str:
    return f"session{'s' * (len(sessions) > 1)} {joined(sessions)}"


def _as_recorded(material: Material, conduct: StudyConduct) -> Iterator[str]:
    # what schedules and logs show, sessions of which the same is said together
    protocol = material.protocol
    words: dict[str, object] = {"counted": counted, "joined": joined, "number": number}
    words |= {"from_persons": FROM_PERSONS, "some": _some}
    template = template_environment(TEMPLATES).get_template("methods.txt")
    say: Any = template.make_module(words)
    clauses: dict[str, list[str]] = {}
    for session in [each.id for each in protocol.sessions]:
        places = [each for each in conduct.sessions if each.session == session]
        rows = [
            {
                "n_stretches": r.n_stretches,
                "is_by_person": r.grades_from in FROM_PERSONS,
            }
            for r in material.ratings.rows
            if r.session == session and r.n_stretches is not None
        ]
        orders = orders_in_words(protocol.schedule)
        for line in _lines(say.session(places, rows, protocol, orders)):
            clauses.setdefault(line, []).append(session)
    together: dict[str, list[str]] = {}
    for line, sessions in clauses.items():
        together.setdefault(_sessions_in_words(sessions), []).append(line)
    yield from (f"In {of}, {'; '.join(lines)}." for of, lines in together.items())
    yield from _lines(say.study(conduct))


def _some(some: Sequence[object], every: Sequence[object], noun: str) -> str:
    return f"{noun}s" if len(some) == len(every) > 1 else counted(len(some), noun)


def _lines(text: object) -> list[str]:
    return [line for line in map(str.strip, str(text).split("\n")) if line]


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
    alike: dict[tuple[object, ...], tuple[Interval, dict[str, None]]] = {}
    for line, estimate in estimates:
        interval = estimate.interval
        if interval is not None and not math.isnan(interval.low):
            kind = (interval.level, interval.kind, interval.method, interval.target)
            key = (*kind, interval.prior)
            alike.setdefault(key, (interval, {}))[1][line.id] = None
    for interval, lines in alike.values():
        ends = "lower bounds" if interval.is_one_sided else "intervals"
        yield sentence(
            "methods",
            "interval",
            estimates=joined(list(lines)),
            level=percent(interval.level),
            kind=f"{interval.kind} {ends}",
            population=sentence("population", interval.target),
            method=interval.method,
            prior=f", with the prior {interval.prior}" * bool(interval.prior),
            reference=_cite(interval_references(interval), used),
        )
