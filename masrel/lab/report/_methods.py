"""Section `methods`: paragraphs to paste into a paper, and what they cite."""

import math
from collections.abc import Iterator
from importlib import import_module

from masrel.estimates import Estimate, Interval
from masrel.lab.analysis import PlannedEstimate
from masrel.lab.protocol import report_sections, scale_of
from masrel.lab.protocol._kinds import DEFAULT_KIND
from masrel.lab.report._design import beside_presentations, stretches_asked_for
from masrel.lab.report._grade_tables import shows_confusion
from masrel.lab.report._material import Material
from masrel.lab.report._order_section import shows_order
from masrel.lab.report._result import excluded_text, main_estimate, name_within
from masrel.lab.report._sentences import sentence
from masrel.lab.schedule._orders import orders_in_words
from masrel.pages._references import (
    bibtex,
    cited,
    coefficient_references,
    interval_references,
    scale_references,
)
from masrel.pages._sections import Content, Listing, Paragraph, Section
from masrel.scales import published_scale
from masrel.tables._tables import counted, joined, percent


def methods_section(material: Material) -> Section:
    """Say how the study was made and its numbers computed, with references."""
    used: list[str] = []  # keys of all that is cited
    blocks: list[Content] = [
        Paragraph(text=" ".join(filter(None, sentences)))
        for sentences in (_study(material, used), _statistics(material, used))
    ]
    if used:
        title = sentence("references", "listing")
        blocks.append(Listing(title=title, text=bibtex(used)))
    return Section(name="methods", title="Methods", blocks=tuple(blocks))


def _cite(keys: tuple[str, ...], used: list[str]) -> str:
    used += keys
    return cited(keys)


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
        yield sentence("methods", "law", reference=_cite(("park2012",), used))
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
    for kind, name in (("inter-rater", "between"), ("test-retest", "within")):
        of_kind = [p for p in known if p.line.kind == kind]
        if of_kind:
            yield sentence("methods", name, coefficients=_coefficients(of_kind, used))
    yield from _intervals(known, used)
    lacking = [f"{p.n_missing} of {p.line.id}" for p in known if p.n_missing]
    if lacking:
        text = f"{', '.join(lacking)} are missing"
        yield sentence("methods", "missing", missing=text)
    if analysis.excluded:
        yield excluded_text("methods", analysis.excluded)
    if any(e.coefficient.endswith("kappa") for p in known for e in _estimates(p)):
        yield sentence("methods", "strength", reference=_cite(("landis1977",), used))
    of_sections = [*_of_sections(material, used)]
    yield from of_sections
    has_intervals = any(e.interval for p in known for e in _estimates(p))
    names = ("numpy", "scipy") if of_sections or has_intervals else ("numpy",)
    yield sentence(
        "methods",
        "software",
        masrel=analysis.masrel_version,
        libraries=", ".join(f"{n} {import_module(n).__version__}" for n in names),
    )


def _of_sections(material: Material, used: list[str]) -> Iterator[str]:
    # how what only single sections show is computed, of those that have something
    sections = report_sections(material.protocol)
    main = main_estimate(material.analysis)
    if "categories" in sections and main is not None and main.estimate is not None:
        yield sentence(
            "methods",
            "categories",
            reference=_cite(("cicchetti1990",), used),
            interval_reference=_cite(("korn1998",), used),
            kappa_reference=_cite(("fleiss1971",), used),
        )
    if "confusion" in sections and shows_confusion(material):
        yield sentence("methods", "confusion", reference=_cite(("korn1998",), used))
    if "order" in sections and shows_order(material):
        yield sentence("methods", "order")


def _coefficients(planned: list[PlannedEstimate], used: list[str]) -> str:
    names = {
        name_within(p.line)
        + _cite(coefficient_references(p.line.coefficient, p.line.weights), used): None
        for p in planned
    }
    return joined(list(names))


def _intervals(planned: list[PlannedEstimate], used: list[str]) -> Iterator[str]:
    # one sentence for each kind of interval, with the lines whose estimates have it
    lines: dict[tuple[float, str, str, str], list[str]] = {}
    kinds: dict[tuple[float, str, str, str], Interval] = {}
    for entry in planned:
        for estimate in _estimates(entry):
            each = estimate.interval
            if each is None or math.isnan(each.low):
                continue
            key = (each.level, each.kind, each.method, each.target)
            kinds[key] = each
            if entry.line.id not in lines.setdefault(key, []):
                lines[key].append(entry.line.id)
    for same, interval in kinds.items():
        yield sentence(
            "methods",
            "interval",
            estimates=joined(lines[same]),
            level=percent(interval.level),
            kind=interval.kind,
            population=sentence("population", interval.target),
            method=interval.method,
            reference=_cite(interval_references(interval), used),
        )


def _estimates(entry: PlannedEstimate) -> list[Estimate]:
    over_raters = [] if entry.estimate is None else [entry.estimate]
    return [*over_raters, *(rater.estimate for rater in entry.by_rater)]
