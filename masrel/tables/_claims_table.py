"""Tables of an audit: one row per claim, and one row per reading."""

from collections.abc import Sequence
from dataclasses import asdict

from masrel.audit import ClaimAudit, Reading
from masrel.audit._readings import ends_text
from masrel.tables._tables import Column, Table, table_of

_CLAIM_COLUMNS = (
    Column(key="claim", heading="Claim", align="left"),
    Column(key="n_items", heading="Items"),
    Column(key="n_categories", heading="Categories"),
    Column(key="n_raters", heading="Raters"),
    Column(key="agreement_percent", heading="Agreement (%)"),
    Column(key="kappa", heading="κ"),
    Column(key="result", heading="Tables that give them", align="left"),
)

_READING_COLUMNS = (
    Column(key="claim", heading="Claim", align="left"),
    Column(key="n_items", heading="Items"),
    Column(key="agreement_weights", heading="Weights of agreement", align="left"),
    Column(key="kappa_weights", heading="Weights of κ", align="left"),
    Column(key="rounding", heading="Rounding", align="left"),
    Column(key="error", heading="Standard error", align="left"),
    Column(key="test", heading="p", align="left"),
    Column(key="n_tables", heading="Tables"),
    Column(key="n_agreed", heading="Items agreed on"),
)

_COUNTED = (
    "A table and its transpose count as two; counting stops at 10 000. If no table "
    "fits, the numbers as read cannot all come from one table; the reason is unknown."
)


def claims_table(audits: Sequence[ClaimAudit]) -> Table:
    """Return what became of each claim."""
    notes = [f"{audit.claim.name}: {audit.sentence}." for audit in audits]
    notes += [
        f"{audit.claim.name}: {numbers} alone: {result}."
        for audit in audits
        for numbers, result in audit.alone.items()
    ]
    notes += [note for audit in audits for note in _examples_note(audit)]
    return table_of(
        "claims",
        "Printed agreement compared with every table that could give it",
        _CLAIM_COLUMNS,
        [
            asdict(audit.claim)
            | {
                "claim": audit.claim.name,
                "agreement_percent": audit.claim.agreement,
                "result": _result(audit),
            }
            for audit in audits
        ],
        notes=(*notes, _COUNTED),
        data="published",
    )


def readings_table(audits: Sequence[ClaimAudit]) -> Table:
    """Return every reading that was tried, with what it leaves."""
    rows = [
        asdict(reading)
        | {
            "claim": audit.claim.name,
            "rounding": reading.rounding.replace("_", " "),
            "n_tables": _number(reading),
            "n_agreed": ends_text(reading.n_agreed) if reading.n_agreed else None,
        }
        for audit in audits
        for reading in audit.readings
    ]
    return table_of(
        "readings",
        "All readings that were tried",
        _READING_COLUMNS,
        rows,
        hide_empty=True,
        data="published",
    )


def claims_document(audits: Sequence[ClaimAudit]) -> dict[str, object]:
    """Return all that was tried, for JSON."""
    return {
        "claims": [
            {
                "claim": asdict(audit.claim),
                "is_possible": audit.is_possible,
                "sentence": audit.sentence,
                "readings": list(map(asdict, audit.readings)),
                "alone": {
                    name: {"n_tables": result.n_tables, "status": result.status}
                    for name, result in audit.alone.items()
                },
                "examples": audit.examples,
            }
            for audit in audits
        ]
    }


def _result(audit: ClaimAudit) -> str:
    n_some = sum(bool(reading.n_tables) for reading in audit.readings)
    if audit.is_possible and n_some < len(audit.readings):
        return f"some, by {n_some} of {len(audit.readings)} readings"
    return {True: "some", False: "none", None: "cannot tell"}[audit.is_possible]


def _number(reading: Reading) -> str:
    if reading.n_tables is None:
        return "cannot tell"
    at_least = "at least " if reading.status == "at least" else ""
    return at_least + f"{reading.n_tables:,}".replace(",", " ")


def _examples_note(audit: ClaimAudit) -> tuple[str, ...]:
    # the tables themselves, where they are few
    first = next((reading for reading in audit.readings if reading.n_tables), None)
    n = len(audit.examples)
    if first is None or first.status != "exact" or first.n_tables != n:
        return ()
    tables = ", ".join(
        "[" + "; ".join(" ".join(map(str, row)) for row in table) + "]"
        for table in audit.examples
    )
    return (f"{audit.claim.name}: {'it is' if n == 1 else 'they are'} {tables}.",)
