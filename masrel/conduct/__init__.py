"""What happened to a study beside its sessions.

In: a protocol and drawn schedules. Out: ``conduct.jsonl``, an append-only log of the
study.
"""

from masrel.conduct._study_log import read_conduct
from masrel.conduct._unblinding import record_unblinding
from masrel.conduct._withdrawal import record_withdrawal

__all__ = ["read_conduct", "record_unblinding", "record_withdrawal"]
