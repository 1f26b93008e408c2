"""The first paragraph of a report, and the methods to paste into a paper.

Every number is one of the analysis, and what was done is stated as schedules and logs
show it; the words are those of ``paragraphs.txt``.
"""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from importlib import import_module
from typing import Any

from masrel.agreement import COEFFICIENTS
from masrel.estimates import Estimate, Interval
from masrel.lab.analysis import Analysis, PlannedEstimate
from masrel.lab.protocol import EstimatePlan, Protocol, report_sections, scale_of
from masrel.lab.protocol._kinds import DEFAULT_KIND
from masrel.lab.report._conduct import StudyConduct
from masrel.lab.report._grade_sections import given_grades
from masrel.lab.report._material import (
    SUPPLEMENT,
    Material,
    coefficient_name,
    estimate_titles,
    lines_of,
    macros,
    main_estimate,
    too_few,
)
from masrel.lab.report._order_tables import effect_rows
from masrel.lab.run._state import FROM_PERSONS
from masrel.lab.schedule._orders import orders_in_words
from masrel.pages._methods_text import (
    bibtex,
    cited,
    coefficient_references,
    interval_references,
    reference_texts,
    scale_references,
)
from masrel.pages._sections import Content, Paragraph, References
from masrel.scales import published_scale
from masrel.tables._tables import number


def result_text(material: Material) -> str:
    """Return the first paragraph of a report."""
    analysis, main = material.analysis, main_estimate(material.analysis)
    again = [p for p in analysis.estimates if p.line.kind == "test-retest"]
    say = _macros(
        material.protocol,
        analysis=analysis,
        main=main,
        further=[] if main is None else [*_further(analysis, main.line)],
        again=next((p for p in again if _is_known(p)), again[0] if again else None),
        n_planned_raters=partial(_n_planned_raters, material.protocol),
        extremes=_extremes,
    )
    return " ".join(lines_of(say.result()))


def planned_text(protocol: Protocol) -> str:
    """Say what a protocol plans, whatever came of it."""
    return " ".join(lines_of(_macros(protocol).planned()))


def _macros(protocol: Protocol, **words: object) -> Any:
    orders = orders_in_words(protocol.schedule)
    shared = {"protocol": protocol, "orders": orders, "name_within": _name_within}
    return macros("paragraphs.txt", {**shared, **words})


def _is_known(planned: PlannedEstimate) -> bool:
    return planned.estimate is not None or bool(planned.by_rater)


def _name_within(line: EstimatePlan) -> str:
    # the name of a line's coefficient within a sentence
    name = coefficient_name(line.coefficient)
    if line.coefficient in _COMMON:
        name = name[0].lower() + name[1:]
    return name if line.weights == "identity" else f"{name} with {line.weights} weights"


# Coefficients that are not called by anybody's name
_COMMON = ("percent_agreement", "pooled_kappa", "stratified_kappa")


def _further(analysis: Analysis, line: EstimatePlan) -> Iterator[Interval]:
    # intervals of the same number for other populations
    keys = ("kind", "coefficient", "weights", "models", "sessions")
    for other in analysis.estimates:
        estimate, interval = other.estimate, getattr(other.estimate, "interval", None)
        is_one = all(getattr(other.line, k) == getattr(line, k) for k in keys)
        is_one &= other.line.target != line.target
        if estimate and interval and is_one and not too_few(estimate):
            yield from [interval] * (not math.isnan(interval.low))


def _n_planned_raters(protocol: Protocol, line: EstimatePlan) -> int:
    raters = [{*s.raters} for s in protocol.sessions if s.id in line.sessions]
    return len(set.intersection(*raters))


def _extremes(values: Sequence[float]) -> list[str]:
    known = [value for value in values if not math.isnan(value)]
    return [number(end, 3) for end in (min(known), max(known))] if known else []


def methods_section(material: Material) -> Iterator[Content]:
    """Say how the study was made and its numbers computed, with references."""
    protocol, analysis = material.protocol, material.analysis
    used: list[str] = []  # keys of all that is cited

    def cite(keys: Sequence[str]) -> str:
        used.extend(keys)
        return cited(tuple(keys))

    def coefficients(kind: str) -> list[str]:
        lines = [p.line for p in known if p.line.kind == kind]
        references = (coefficient_references(p.coefficient, p.weights) for p in lines)
        named = zip(map(_name_within, lines), map(cite, references), strict=True)
        return list(dict.fromkeys(map("".join, named)))

    known = [planned for planned in analysis.estimates if _is_known(planned)]
    titles = estimate_titles([planned.line for planned in analysis.estimates])
    estimates = [(titles[p.line.id], of) for p in known for of in _estimates(p)]
    say = _macros(
        protocol,
        material=material,
        analysis=analysis,
        cite=cite,
        coefficients=coefficients,
        known=known,
        titles=titles,
        has_words=any(
            COEFFICIENTS[e.coefficient].chance_corrected for _, e in estimates
        ),
        published=published_scale(scale_of(protocol)),
        elbow=DEFAULT_KIND,
        from_persons=FROM_PERSONS,
        scale_references=scale_references,
        interval_references=interval_references,
    )
    sections, intervals = _sections(material), _alike(estimates)
    libraries = ("numpy", "scipy") if sections or intervals else ("numpy",)
    versions = [f"{name} {import_module(name).__version__}" for name in libraries]
    yield Paragraph(text=" ".join(_study(material, say)))
    of_numbers = lines_of(say.statistics(intervals, sections, versions))
    yield Paragraph(text=" ".join(of_numbers))
    yield SUPPLEMENT
    if used:
        texts = tuple(reference_texts(used))
        yield References(texts=texts, bibtex=f"{bibtex(used)}\n")


def _estimates(planned: PlannedEstimate) -> list[Estimate]:
    of_all = [] if planned.estimate is None else [planned.estimate]
    return [*of_all, *(each.estimate for each in planned.by_rater)]


def _study(material: Material, say: Any) -> Iterator[str]:
    conduct = material.conduct
    record = conduct if conduct is not None and conduct.is_of_ratings else None
    graded = {row.model for row in material.ratings.rows if row.grade is not None}
    models = [model for model in material.protocol.models if model.id in graded]
    yield from lines_of(say.study(models, record))
    if record is None:
        yield from lines_of(f"{say.planned()}{say.law()}")
    else:
        yield from lines_of(say.law())
        yield from _of_sessions(material, record, say)
        yield from lines_of(say.conduct(record))


def _of_sessions(material: Material, record: StudyConduct, say: Any) -> Iterator[str]:
    # sessions of which the same is said together
    clauses: dict[str, list[str]] = {}
    for session in material.protocol.sessions:
        places = [each for each in record.sessions if each.session == session.id]
        rows = [row for row in material.ratings.rows if row.session == session.id]
        made = [row for row in rows if row.n_stretches is not None]
        for line in lines_of(say.session(places, made)):
            clauses.setdefault(line, []).append(session.id)
    together: dict[str, list[str]] = {}
    for line, sessions in clauses.items():
        together.setdefault(str(say.of_sessions(sessions)), []).append(line)
    yield from (f"In {of}, {'; '.join(lines)}." for of, lines in together.items())


def _sections(material: Material) -> list[str]:
    # of those whose numbers nothing else shows, the ones that have something
    protocol, analysis = material.protocol, material.analysis
    main, ratings = main_estimate(analysis), material.ratings.without(analysis.excluded)
    has_something = {
        "categories": main is not None and main.estimate is not None,
        "confusion": bool(given_grades(material)[1]),
        "order": bool(effect_rows(protocol, ratings, analysis.level)),
    }
    return [name for name in report_sections(protocol) if has_something.get(name)]


def _alike(
    estimates: Sequence[tuple[str, Estimate]],
) -> list[tuple[Interval, list[str]]]:
    # one interval of each kind, with the titles of the estimates that have such
    alike: dict[tuple[object, ...], tuple[Interval, list[str]]] = {}
    for title, estimate in estimates:
        interval = estimate.interval
        if interval is not None and not math.isnan(interval.low):
            kind = (interval.level, interval.kind, interval.method, interval.target)
            _, titles = alike.setdefault((*kind, interval.prior), (interval, []))
            titles += [title] * (title not in titles)
    return list(alike.values())
