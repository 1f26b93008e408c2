"""What happened to a study beside its sessions.

In: a protocol and drawn schedules. Out: ``conduct.jsonl``, an append-only log of the
study.
"""

from masrel.lab.conduct._statements import (
    excluded_raters,
    rater_values,
    record_note,
    record_rater_values,
    record_standing,
    record_unblinding,
)
from masrel.lab.conduct._study_log import allot_schedules, read_conduct

__all__ = [
    "allot_schedules",
    "excluded_raters",
    "rater_values",
    "read_conduct",
    "record_note",
    "record_rater_values",
    "record_standing",
    "record_unblinding",
]
