"""Guidelines: the items of each, and what the record of a study says to them.

Kottner et al. (2011), GRRAS: 15 items. Mokkink et al. (2020), COSMIN: six design
standards of studies on reliability, which the author grades and masrel does not.
Topics are in our words.
"""

import statistics
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from masrel._input import listed
from masrel.lab.checklist._facts import StudyFacts, days_between
from masrel.lab.ratings import Rating
from masrel.lab.report._design import beside_presentations, stretches_asked_for
from masrel.lab.report._sample_size import size_sentence
from masrel.lab.report._sentences import TARGETS, coefficient_name
from masrel.lab.schedule._orders import orders_in_words
from masrel.tables._estimate_words import sentence
from masrel.tables._tables import counted, number, percent

State = Literal["filled", "in part", "authors"]
"""Who fills an item: the record, both, or the authors alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChecklistItem:
    """One item of a guideline.

    Attributes
    ----------
    number : str
        Its number in the guideline.
    topic : str
        What it asks for, in our words.
    state : {"filled", "in part", "authors"}
        Whether the record of the study answers it.
    facts : tuple of str
        What the record says, one sentence or more each.
    to_add : str
        What the authors have to add; empty where nothing.
    sources : tuple of Path
        The files that say so, from the study's folder.
    """

    number: str
    topic: str
    state: State
    facts: tuple[str, ...] = ()
    to_add: str = ""
    sources: tuple[Path, ...] = ()


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
    to_add, known = entry.to_add, entry.facts
    if "ratings" in entry.sources and facts.ratings is None:
        to_add, known = "There are no ratings yet.", None
    elif known is None:
        to_add = "For the authors to say."
    elif "logs" in entry.sources and not facts.sessions:
        to_add = "What no log of a session says."
    if known is None:
        return ChecklistItem(
            number=number, topic=entry.topic, state="authors", to_add=to_add
        )
    tables = (facts.paths.ratings_file, facts.paths.published_file)
    files: dict[_Source, list[Path]] = {
        "protocol": [facts.paths.protocol],
        "logs": [session.log for session in facts.sessions],
        "ratings": [table for table in tables if table.is_file()][:1],
    }
    return ChecklistItem(
        number=number,
        topic=entry.topic,
        state="in part" if to_add else "filled",
        facts=known(facts),
        to_add=to_add,
        sources=tuple(facts.relative(f) for key in entry.sources for f in files[key]),
    )


def _order_of_presentations(facts: StudyFacts) -> tuple[str, ...]:
    """Say how the order of presentations comes about."""
    order = "an order of their own, all orders equally likely"
    if facts.protocol.schedule.scheme != "random-order":
        order = orders_in_words(facts.protocol.schedule)
    return (
        f"In each session a rater meets the models in {order}; "
        f"{counted(facts.n_schedules, 'schedule')} drawn.",
    )


def _blinding(facts: StudyFacts) -> tuple[str, ...]:
    """Say what hides the models from the raters, and what was unblinded."""
    if not facts.n_schedules:
        return ("No schedule is drawn: the record says nothing of blinding.",)
    concealed = (
        f"orders and codes of {facts.n_concealed} of {facts.n_schedules} schedules "
        "come from a secret that is not published"
    )
    unblinded = [text for text in facts.remarks if "unblinded" in text]
    known = unblinded or ["The record has no unblinding."]
    return (
        f"Raters meet models by codes that differ by rater and session; {concealed}.",
        *known,
    )


def _independence(facts: StudyFacts) -> tuple[str, ...]:
    """Say what keeps the grades of one rater from another."""
    if not facts.sessions:
        return ("There are no session logs: the record says nothing of it.",)
    n_sheets = sum(dict(each.header)["grades"] == "paper" for each in facts.sessions)
    on_paper = (
        f"{counted(n_sheets, 'session')} on paper: sheets with codes, and no models; "
        "the log has who typed them.",
    )
    return (
        "Every session is of one rater, with codes and an order of its own; masrel "
        "shows no rater the grades of another, and a grade once given is changed by a "
        "correction only, of which the log has who, when and why.",
        *(on_paper if n_sheets else ()),
        f"{counted(len(facts.corrections), 'correction')} of a grade.",
    )


def _dates(facts: StudyFacts) -> tuple[str, ...]:
    """Say when the sessions were, and how far a rater's are from each other."""
    if not facts.sessions:
        return ("There are no session logs: dates and intervals are not known.",)
    days = [session.day for session in facts.sessions]
    span = f"Sessions began from {min(days)} to {max(days)} (UTC)."
    between = sorted(days_between(facts).elements())
    if not between:
        return (span, "No rater has two sessions.")
    middle = between[(len(between) - 1) // 2]
    return (
        span,
        f"Days between a rater's session and the next: {between[0]} to {between[-1]}, "
        f"median {middle}.",
    )


def _conditions(facts: StudyFacts) -> tuple[str, ...]:
    """Say what was the same in all sessions, and what was not."""
    if not facts.sessions:
        return ("There are no session logs: conditions are not known.",)
    texts = []
    for position, (name, _) in enumerate(facts.sessions[0].header):
        counts = Counter(session.header[position][1] for session in facts.sessions)
        each = "; ".join(f"{value} in {n}" for value, n in counts.items())
        texts.append(
            f"{_NAMES[name]}: {next(iter(counts))} in all sessions."
            if len(counts) == 1
            else f"{_NAMES[name]} differs: {each}."
        )
    return tuple(texts)


_NAMES = {
    "device": "Device",
    "grades": "Grades from",
    "clock": "Clock of the device",
    "masrel_version": "Version of masrel",
    "presented_sha256": "SHA-256 of what is presented",
}


def _rater_characteristics(facts: StudyFacts) -> tuple[str, ...]:
    """Say what the public fields of the raters hold, and which are not public."""
    texts, hidden = [], []
    for name, field in facts.protocol.rater_fields.items():
        known = [rater.values[name] for rater in facts.raters]
        values = [value for value in known if value is not None]
        title = field.title or name
        if not field.public:
            hidden.append(title)
        elif field.type in ("whole", "number"):
            texts.append(f"{title}: {_range(values, field.unit)}.")
        else:
            tally = Counter(map(str, values))
            counts = ", ".join(f"{n} {value}" for value, n in tally.items())
            texts.append(f"{title}: {counts or 'not known'}.")
    if hidden:
        texts.append(f"Kept, and not public: {listed(hidden)}.")
    return tuple(texts)


def _range(values: Sequence[object], unit: str) -> str:
    numbers = [float(value) for value in values if isinstance(value, int | float)]
    if not numbers:
        return "not known"
    ends = f"{number(min(numbers), None)} to {number(max(numbers), None)} {unit}"
    return f"{ends.strip()}, median {number(statistics.median(numbers), None)}"


def _rater_flow(facts: StudyFacts) -> str:
    """Say how many raters were planned, and what became of them."""
    status = Counter(rater.status for rater in facts.raters)
    parts = [f"{n} {name}" for name, n in status.items() if name != "planned"]
    n_late = sum(rater.is_late for rater in facts.raters)
    late = f" {n_late} joined after the first draw of schedules." if n_late else ""
    n_begun = ", ".join(parts) or "none has begun"
    return f"{counted(len(facts.raters), 'rater')} planned: {n_begun}.{late}"


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
    return (f"{n_raters} in the protocol.", *_rater_characteristics(facts))


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
        *_order_of_presentations(facts),
        *_blinding(facts),
        stretches or "Before each grade a rater stretches the arm once.",
        *([beside] if beside else []),
        *_dates(facts),
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
    flow = (_rater_flow(facts),) if facts.sessions else ()
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
        *_rater_characteristics(facts),
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
        topic="Whether ratings were independent", facts=_independence, sources=("logs",)
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


_GRADE = "Very good, adequate, doubtful or inadequate: the authors grade this."


def cosmin_items(facts: StudyFacts) -> tuple[ChecklistItem, ...]:
    """Return the six design standards, each with its facts and without a grade."""
    protocol = facts.relative(facts.paths.protocol)
    logs = tuple(facts.relative(session.log) for session in facts.sessions)
    standards = {
        "Patients were stable between the measurements": _stability(facts),
        "The time between the measurements was appropriate": _dates(facts),
        "The conditions of the measurements were similar": _conditions(facts),
        "Measurements were made without knowledge of other scores": (
            *_order_of_presentations(facts),
            *_independence(facts),
        ),
        "Scores were given without knowledge of other scores": _blinding(facts),
        "No other important flaws in design or conduct": _flaws(facts),
    }
    return tuple(
        ChecklistItem(
            number=str(number),
            topic=topic,
            state="in part",
            facts=texts,
            to_add=_GRADE,
            sources=(protocol, *logs),
        )
        for number, (topic, texts) in enumerate(standards.items(), start=1)
    )


def _stability(facts: StudyFacts) -> tuple[str, ...]:
    text = (
        "Subjects are haptic models with constant parameters: what is presented is the "
        "same for every rater in every session as long as its hash is."
    )
    same = [text for text in _conditions(facts) if text.startswith("SHA-256")]
    return (text, *same)


def _flaws(facts: StudyFacts) -> tuple[str, ...]:
    n_missing = "There are no ratings yet."
    if facts.ratings is not None:
        n_absent = counted(facts.ratings.n_missing, "grade")
        n_missing = f"{n_absent} missing of {len(facts.ratings.rows)}."
    open_sessions = [s for s in facts.sessions if not s.is_complete]
    n_faults = sum(session.n_faults for session in facts.sessions)
    return (
        n_missing,
        f"{counted(len(open_sessions), 'session')} begun and not complete; "
        f"{counted(n_faults, 'presentation')} stopped by a fault of the device.",
        *facts.remarks,
    )
