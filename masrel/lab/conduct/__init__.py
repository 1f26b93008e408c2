"""What happened to a study beside its sessions.

In: a protocol and drawn schedules. Out: ``conduct.jsonl``, an append-only log of the
study.
"""

from masrel.lab.conduct._allotment import allot_schedules
from masrel.lab.conduct._notes import record_note
from masrel.lab.conduct._rater_values import rater_values, record_rater_values
from masrel.lab.conduct._standing import excluded_raters, record_standing
from masrel.lab.conduct._study_log import read_conduct
from masrel.lab.conduct._unblinding import record_unblinding

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
