"""The estimates a study's plan asks for, and nothing else.

In: a protocol, its ratings and grades given in person. Out: an `Analysis`, written
as JSON in full precision.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.analysis.files import as_analysis_document, write_analysis
    from masrel.analysis.plan import analyze
    from masrel.analysis.results import (
        Analysis,
        InPersonAgreement,
        InPersonPair,
        IntendedAgreement,
        ModelAgreement,
        PlannedEstimate,
        RaterEstimate,
        Speed,
        Speeds,
        SpeedSummary,
    )

__all__ = [
    "Analysis",
    "InPersonAgreement",
    "InPersonPair",
    "IntendedAgreement",
    "ModelAgreement",
    "PlannedEstimate",
    "RaterEstimate",
    "Speed",
    "SpeedSummary",
    "Speeds",
    "analyze",
    "as_analysis_document",
    "write_analysis",
]

_HOMES = {
    "analyze": "plan",
    "as_analysis_document": "files",
    "write_analysis": "files",
}


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    home = importlib.import_module(f"masrel.analysis.{_HOMES.get(name, 'results')}")
    return getattr(home, name)
