"""Whether the record of a study is whole: from the protocol to the report.

In: the folder of a study, and the hashes that were kept outside it. Out: what is there,
and every finding, each with its file.
"""

from masrel.lab.verification._log_findings import (
    Anchor,
    Finding,
    anchor_findings,
    anchors_of,
    read_anchors,
    write_anchors,
)
from masrel.lab.verification._sessions import SessionRecord
from masrel.lab.verification._stamps import read_stamp, request_stamp
from masrel.lab.verification.record import Verification, verify_sessions, verify_study

__all__ = [
    "Anchor",
    "Finding",
    "SessionRecord",
    "Verification",
    "anchor_findings",
    "anchors_of",
    "read_anchors",
    "read_stamp",
    "request_stamp",
    "verify_sessions",
    "verify_study",
    "write_anchors",
]
