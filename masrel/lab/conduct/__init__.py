"""What happened to a study beside its sessions.

In: a protocol and drawn schedules. Out: ``conduct.jsonl``, an append-only log of the
study.
"""

from masrel.lab.conduct._plan_versions import (
    PlanChange,
    plan_changes,
    record_amendment,
    registration,
)
from masrel.lab.conduct._statements import (
    Note,
    excluded_raters,
    rater_values,
    record_new_rater,
    record_note,
    record_rater_values,
    record_standing,
    record_unblinding,
)
from masrel.lab.conduct._study_log import allot_schedules, read_conduct

__all__ = [
    "Note",
    "PlanChange",
    "allot_schedules",
    "excluded_raters",
    "plan_changes",
    "rater_values",
    "read_conduct",
    "record_amendment",
    "record_new_rater",
    "record_note",
    "record_rater_values",
    "record_standing",
    "record_unblinding",
    "registration",
]
