"""GRRAS: what the record of a study says to each of the 15 items.

Kottner et al. (2011); topics are in our words.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from masrel.lab.checklist._conditions import (
    blinding,
    dates,
    independence,
    order_of_presentations,
)
from masrel.lab.checklist._facts import StudyFacts
from masrel.lab.checklist._items import ChecklistItem
from masrel.lab.checklist._rater_facts import rater_characteristics, rater_flow
from masrel.lab.ratings import Rating
from masrel.lab.report._design import beside_presentations, stretches_asked_for
from masrel.lab.report._sample_size import size_sentence
from masrel.lab.report._sentences import TARGETS, coefficient_name
from masrel.tables._estimate_words import sentence
from masrel.tables._tables import counted, percent

_Source = Literal["protocol", "logs", "ratings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Entry:
    """An item, what fills it, and what only the authors know."""

    topic: str
    # None where the record says nothing of it
    facts: Callable[[StudyFacts], tuple[str, ...]] | None = None
    sources: tuple[_Source, ...] = ("protocol",)
    to_add: str = ""  # beside the facts


def grras_items(facts: StudyFacts) -> tuple[ChecklistItem, ...]:
    """Return the 15 items."""
    return tuple(
        _item(facts, str(number), entry) for number, entry in enumerate(_ITEMS, start=1)
    )


def _item(facts: StudyFacts, number: str, entry: _Entry) -> ChecklistItem:
    to_add = entry.to_add
    if "ratings" in entry.sources and facts.ratings is None:
        to_add = "There are no ratings yet."
    elif entry.facts is None:
        to_add = "For the authors to say."
    else:
        if "logs" in entry.sources and not facts.sessions:
            to_add = "What no log of a session says."
        return ChecklistItem(
            number=number,
            topic=entry.topic,
            state="in part" if to_add else "filled",
            facts=entry.facts(facts),
            to_add=to_add,
            sources=_files(facts, entry.sources),
        )
    return ChecklistItem(
        number=number, topic=entry.topic, state="authors", to_add=to_add
    )


def _files(facts: StudyFacts, sources: Sequence[_Source]) -> tuple[Path, ...]:
    # those that are there, from the study's folder
    tables = (facts.paths.ratings_file, facts.paths.published_file)
    files: dict[_Source, list[Path]] = {
        "protocol": [facts.paths.protocol],
        "logs": [session.log for session in facts.sessions],
        "ratings": [table for table in tables if table.is_file()][:1],
    }
    return tuple(facts.relative(file) for name in sources for file in files[name])


def _device(facts: StudyFacts) -> tuple[str, ...]:
    protocol = facts.protocol
    grades = ", ".join(protocol.scale.grades)
    kinds = Counter(model.kind for model in protocol.models)
    models = ", ".join(f"{n} of kind {kind}" for kind, n in kinds.items())
    return (
        f"Scale {protocol.scale.name}, grades {grades}.",
        f"A haptic simulator of the elbow, device {protocol.device.backend!r} at "
        f"{protocol.device.rate_hz} Hz, presents {models}.",
    )


def _raters(facts: StudyFacts) -> tuple[str, ...]:
    n_raters = counted(len(facts.protocol.raters), "rater")
    return (f"{n_raters} in the protocol.", *rater_characteristics(facts))


def _sizes(facts: StudyFacts) -> tuple[str, ...]:
    protocol = facts.protocol
    n_models, repeats = len(protocol.models), protocol.schedule.repeats
    sessions = "; ".join(
        f"{counted(len(each.raters), 'rater')} in session {each.id}"
        for each in protocol.sessions
    )
    planned = sum(len(each.raters) for each in protocol.sessions) * n_models * repeats
    return (
        f"Planned: {counted(n_models, 'model')}, each presented "
        f"{counted(repeats, 'time')} a session; {sessions}; {planned} ratings.",
        *(size_sentence(protocol, size) for size in protocol.analysis.sample_sizes),
        "The plan stands in the protocol, whose hash every drawn schedule has.",
    )


def _sampling(facts: StudyFacts) -> tuple[str, ...]:
    roles = Counter(model.role for model in facts.protocol.models)
    return (
        f"Subjects are haptic models: {roles['standard']} that the study is about and "
        f"{counted(roles['dummy'], 'dummy').replace('dummys', 'dummies')} that hide "
        "them.",
    )


def _process(facts: StudyFacts) -> tuple[str, ...]:
    stretches = stretches_asked_for(facts.protocol.presentation)
    beside = beside_presentations(facts.protocol.occasions).strip()
    return (
        *order_of_presentations(facts),
        *blinding(facts),
        stretches or "Before each grade a rater stretches the arm once.",
        *([beside] if beside else []),
        *dates(facts),
    )


def _analysis(facts: StudyFacts) -> tuple[str, ...]:
    plan = facts.protocol.analysis
    lines = tuple(
        f"{line.id}: {coefficient_name(line.coefficient, line.weights)} of the "
        f"{line.models} models, {' and '.join(line.sessions)}, "
        + (
            "without an interval."
            if line.interval == "none"
            else f"with an interval ({line.interval}) for {TARGETS[line.target]}."
        )
        for line in plan.estimates
    )
    if not lines:
        return ("The protocol plans no estimate.",)
    level = f"Intervals have the level {percent(plan.level)} %; computed by masrel."
    return (*lines, level)


def _actual(facts: StudyFacts) -> tuple[str, ...]:
    if facts.ratings is None:
        return ()
    sessions: dict[str, list[Rating]] = {}
    for row in facts.ratings.rows:
        sessions.setdefault(row.session, []).append(row)
    lines = tuple(
        f"Session {session}: {counted(len({row.rater for row in rows}), 'rater')}, "
        f"{counted(len({row.model for row in rows}), 'model')}, "
        f"{counted(len(rows), 'rating')}, "
        f"{sum(row.grade is None for row in rows)} missing."
        for session, rows in sessions.items()
    )
    flow = (rater_flow(facts),) if facts.sessions else ()
    return (*flow, *lines, *facts.remarks)


def _subjects(facts: StudyFacts) -> tuple[str, ...]:
    grades = Counter(
        model.intended_grade
        for model in facts.protocol.models
        if model.intended_grade is not None
    )
    intended = ", ".join(f"{n} of grade {grade}" for grade, n in grades.items())
    return (
        f"Models by the grade they were made to have: {intended or 'none has one'}; "
        "the parameters of each are in the protocol.",
        *rater_characteristics(facts),
    )


def _estimates(facts: StudyFacts) -> tuple[str, ...]:
    if facts.analysis is None:
        return ()
    return tuple(
        f"{planned.line.id}: {sentence(planned.estimate)}"
        if planned.estimate is not None
        else f"{planned.line.id}: not in these data ({planned.reason})."
        for planned in facts.analysis.estimates
    )


def _details(facts: StudyFacts) -> tuple[str, ...]:
    n_corrections = len(facts.corrections)
    return (
        "Every rating, one row each, is in the table of ratings; masrel report makes "
        "tables of grades by model and of every estimate.",
        f"{counted(n_corrections, 'correction')} of a grade.",
    )


_ITEMS = (
    _Entry(topic="Title or abstract names agreement or reliability"),
    _Entry(
        topic="Device or scale",
        facts=_device,
        to_add="Why this scale and this device; what is known of both.",
    ),
    _Entry(topic="Subjects: the population that is of interest"),
    _Entry(
        topic="Raters: the population that is of interest",
        facts=_raters,
        to_add="Whom these raters stand for: profession, experience, training.",
    ),
    _Entry(topic="What is known already, and why this study is needed"),
    _Entry(topic="Planned subjects, raters, replicates", facts=_sizes),
    _Entry(
        topic="How subjects and raters were sampled",
        facts=_sampling,
        to_add="How the raters were recruited, and how the models were chosen.",
    ),
    _Entry(
        topic="The process of measurement and rating",
        facts=_process,
        sources=("protocol", "logs"),
    ),
    _Entry(
        topic="Whether ratings were independent", facts=independence, sources=("logs",)
    ),
    _Entry(topic="Statistical analysis", facts=_analysis),
    _Entry(topic="Actual numbers", facts=_actual, sources=("ratings",)),
    _Entry(
        topic="Characteristics of raters and subjects",
        facts=_subjects,
        to_add="Characteristics of the raters, as far as the protocol has none.",
    ),
    _Entry(
        topic="Estimates with their uncertainty",
        facts=_estimates,
        sources=("ratings",),
    ),
    _Entry(topic="Relevance for practice"),
    _Entry(topic="Detailed results", facts=_details, sources=("ratings",)),
)
"""The items of the guideline in its order."""
