"""Printed agreement held against every table: a row a claim, a row a reading."""

from collections.abc import Sequence
from dataclasses import fields

from masrel.audit import Claim, ClaimAudit, ClaimReading, ConsistentTables
from masrel.tables._tables import Column, Table, Value, in_thousands

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

_ROUNDING = {"half_even": "half even", "half_up": "half up", "either": "either"}

_COUNTED = (
    "A table and its transpose are two; no more than 10 000 are counted. Where there "
    "is none, the numbers do not belong to one table as they were read; it is not said "
    "why."
)


def claims_table(audits: Sequence[ClaimAudit]) -> Table:
    """Return what became of each claim."""
    return Table(
        name="claims",
        caption="Printed agreement held against every table that could give it",
        columns=_CLAIM_COLUMNS,
        rows=tuple(_claim_row(audit) for audit in audits),
        notes=(
            *(f"{audit.claim.name}: {audit.sentence}." for audit in audits),
            *(note for audit in audits for note in _alone_notes(audit)),
            *(note for audit in audits for note in _examples_note(audit)),
            _COUNTED,
        ),
        data="published",
    )


def readings_table(audits: Sequence[ClaimAudit]) -> Table:
    """Return every reading that was tried, with what it leaves."""
    rows = [
        _reading_row(audit, reading) for audit in audits for reading in audit.readings
    ]
    # columns of which there is nothing are left out on a page
    columns = tuple(
        column
        if any(row[k] is not None for row in rows)
        else Column(key=column.key, heading=column.heading, where="csv")
        for k, column in enumerate(_READING_COLUMNS)
    )
    return Table(
        name="readings",
        caption="Every reading that was tried",
        columns=columns,
        rows=tuple(rows),
        data="published",
    )


def claims_document(audits: Sequence[ClaimAudit]) -> dict[str, object]:
    """Return all that was tried, for JSON."""
    return {
        "claims": [
            {
                "claim": _fields(audit.claim),
                "is_possible": audit.is_possible,
                "sentence": audit.sentence,
                "readings": [_fields(reading) for reading in audit.readings],
                "alone": {
                    name: {"n_tables": result.n_tables, "status": result.status}
                    for name, result in audit.alone.items()
                },
                "examples": audit.examples,
            }
            for audit in audits
        ]
    }


def _fields(result: Claim | ClaimReading) -> dict[str, object]:
    return {each.name: getattr(result, each.name) for each in fields(result)}


def _claim_row(audit: ClaimAudit) -> tuple[Value, ...]:
    claim = audit.claim
    result = {True: "some", False: "none", None: "cannot tell"}[audit.is_possible]
    n_some = sum(bool(reading.n_tables) for reading in audit.readings)
    if audit.is_possible and n_some < len(audit.readings):
        result = f"some, by {n_some} of {len(audit.readings)} readings"
    return (
        claim.name,
        claim.n_items,
        claim.n_categories,
        claim.n_raters,
        claim.agreement,
        claim.kappa,
        result,
    )


def _reading_row(audit: ClaimAudit, reading: ClaimReading) -> tuple[Value, ...]:
    agreed = reading.n_agreed
    ends = [str(n) for n in sorted({agreed[0], agreed[-1]})] if agreed else []
    return (
        audit.claim.name,
        reading.n_items,
        reading.agreement_weights,
        reading.kappa_weights,
        _ROUNDING[reading.rounding],
        reading.error,
        reading.test,
        _number(reading),
        " to ".join(ends) or None,
    )


def _number(result: ClaimReading | ConsistentTables) -> Value:
    if result.n_tables is None:
        return "cannot tell"
    number = in_thousands(result.n_tables)
    return f"at least {number}" if result.status == "at least" else number


def _alone_notes(audit: ClaimAudit) -> list[str]:
    return [
        f"{audit.claim.name}: {numbers} alone: {result}."
        for numbers, result in audit.alone.items()
    ]


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
