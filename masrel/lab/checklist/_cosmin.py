"""COSMIN: what the record says to the design standards of studies on reliability.

Mokkink et al. (2020); topics are in our words. The author grades, masrel does not.
"""

from masrel.lab.checklist._conditions import (
    blinding,
    conditions,
    dates,
    independence,
    order_of_presentations,
)
from masrel.lab.checklist._facts import StudyFacts
from masrel.lab.checklist._items import ChecklistItem
from masrel.tables._tables import counted

_GRADE = "Very good, adequate, doubtful or inadequate: the authors grade this."


def cosmin_items(facts: StudyFacts) -> tuple[ChecklistItem, ...]:
    """Return the six design standards, each with its facts and without a grade."""
    protocol = facts.relative(facts.paths.protocol)
    logs = tuple(facts.relative(session.log) for session in facts.sessions)
    standards = {
        "Patients were stable between the measurements": _stability(facts),
        "The time between the measurements was appropriate": dates(facts),
        "The conditions of the measurements were similar": conditions(facts),
        "Measurements were made without knowledge of other scores": (
            *order_of_presentations(facts),
            *independence(facts),
        ),
        "Scores were given without knowledge of other scores": blinding(facts),
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
    same = [text for text in conditions(facts) if text.startswith("SHA-256")]
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
