"""Whether printed agreement can be true: which tables give the numbers of a paper.

In: how many items, categories and raters, and the numbers as they are printed. Out:
how many integer tables give them, under which reading of what was printed.
"""

from masrel.audit._claims import Claim, read_claims
from masrel.audit._readings import (
    ClaimAudit,
    ConsistentTables,
    Reading,
    audit_claim,
    consistent_tables,
)

__all__ = [
    "Claim",
    "ClaimAudit",
    "ConsistentTables",
    "Reading",
    "audit_claim",
    "consistent_tables",
    "read_claims",
]
