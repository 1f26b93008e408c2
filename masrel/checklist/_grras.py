"""GRRAS: what the record of a study says to each of the 15 items.

Kottner et al. (2011); topics are in our words.
"""

from collections import Counter
from pathlib import Path

from masrel.checklist._conditions import (
    blinding,
    dates,
    independence,
    order_of_presentations,
)
from masrel.checklist._facts import StudyFacts
from masrel.checklist._items import ChecklistItem
from masrel.checklist._rater_facts import rater_characteristics, rater_flow
from masrel.report._design import beside_presentations, stretches_asked_for
from masrel.report._estimate_words import TARGETS, coefficient_name, sentence
from masrel.report._tables import counted, percent


def grras_items(facts: StudyFacts) -> tuple[ChecklistItem, ...]:
    """Return the 15 items."""
    protocol = facts.relative(facts.paths.protocol)
    logs = tuple(facts.relative(session.log) for session in facts.sessions)
    table = facts.paths.ratings_file
    if not table.is_file():
        table = facts.paths.published_file
    tables = (facts.relative(table),) if table.is_file() else ()
    return (
        _of_authors("1", "Title or abstract names agreement or reliability"),
        _in_part(
            "2",
            "Device or scale",
            _device(facts),
            "Why this scale and this device; what is known of both.",
            protocol,
        ),
        _of_authors("3", "Subjects: the population that is of interest"),
        _in_part(
            "4",
            "Raters: the population that is of interest",
            (
                f"{counted(len(facts.protocol.raters), 'rater')} in the protocol.",
                *rater_characteristics(facts),
            ),
            "Whom these raters stand for: profession, experience, training.",
            protocol,
        ),
        _of_authors("5", "What is known already, and why this study is needed"),
        _filled(
            "6",
            "Planned subjects, raters, replicates",
            _sizes(facts),
            protocol,
        ),
        _in_part(
            "7",
            "How subjects and raters were sampled",
            _sampling(facts),
            "How the raters were recruited, and how the models were chosen.",
            protocol,
        ),
        _with_logs(
            facts,
            "8",
            "The process of measurement and rating",
            _process(facts),
            protocol,
            *logs,
        ),
        _with_logs(
            facts, "9", "Whether ratings were independent", independence(facts), *logs
        ),
        _filled("10", "Statistical analysis", _analysis(facts), protocol),
        _with_ratings(facts, "11", "Actual numbers", _actual(facts), *tables),
        _in_part(
            "12",
            "Characteristics of raters and subjects",
            _subjects(facts),
            "Characteristics of the raters, as far as the protocol has none.",
            protocol,
        ),
        _with_ratings(
            facts, "13", "Estimates with their uncertainty", _estimates(facts), *tables
        ),
        _of_authors("14", "Relevance for practice"),
        _with_ratings(facts, "15", "Detailed results", _details(facts), *tables),
    )


def _of_authors(number: str, topic: str) -> ChecklistItem:
    return ChecklistItem(
        number=number, topic=topic, state="authors", to_add="For the authors to say."
    )


def _filled(
    number: str, topic: str, texts: tuple[str, ...], *sources: Path
) -> ChecklistItem:
    return ChecklistItem(
        number=number, topic=topic, state="filled", facts=texts, sources=sources
    )


def _in_part(
    number: str, topic: str, texts: tuple[str, ...], to_add: str, *sources: Path
) -> ChecklistItem:
    return ChecklistItem(
        number=number,
        topic=topic,
        state="in part",
        facts=texts,
        to_add=to_add,
        sources=sources,
    )


def _with_logs(
    facts: StudyFacts, number: str, topic: str, texts: tuple[str, ...], *sources: Path
) -> ChecklistItem:
    if facts.sessions:
        return _filled(number, topic, texts, *sources)
    return _in_part(number, topic, texts, "What no log of a session says.", *sources)


def _with_ratings(
    facts: StudyFacts, number: str, topic: str, texts: tuple[str, ...], *sources: Path
) -> ChecklistItem:
    if facts.ratings is not None:
        return _filled(number, topic, texts, *sources)
    return ChecklistItem(
        number=number,
        topic=topic,
        state="authors",
        to_add="There are no ratings yet.",
    )


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
    table = facts.ratings.table
    lines = tuple(
        f"Session {session}: {counted(rows['rater'].nunique(), 'rater')}, "
        f"{counted(rows['model'].nunique(), 'model')}, {counted(len(rows), 'rating')}, "
        f"{int(rows['grade'].isna().sum())} missing."
        for session, rows in table.groupby("session", sort=False)
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
