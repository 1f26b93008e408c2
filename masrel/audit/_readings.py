"""Every reading of a claim, and how many tables each of them leaves."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from masrel.audit._claims import Claim
from masrel.audit._consistency import (
    CellRows,
    ConsistentTables,
    CountStatus,
    answer,
    count_text,
)
from masrel.audit._square_tables import (
    MAX_COUNTED,
    SquareTables,
    Work,
    WorkLimitError,
)
from masrel.audit._uncertainty import ERROR_KINDS, Uncertainty
from masrel.audit._windows import AuditWeights, Integers, Question, pose_question

_MAX_LISTED = 10_000  # tables that are made to look at their margins and errors


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimReading:
    """One way to read a claim, and how many tables it leaves.

    Attributes
    ----------
    n_items : int
        Items that both ratings are there of.
    agreement_weights, kappa_weights : str or None
        None where no such number is printed.
    rounding : str
        ``"half_even"``, ``"half_up"``, or ``"either"`` where they lead to the same.
    error : str or None
        Which standard error the printed one and the interval are: ``"delta"`` of
        Fleiss, Cohen and Everitt (1969) with divisor n, ``"delta n-1"``, ``"null"``
        (theirs for kappa 0) or ``"simple"`` (Cohen 1960); None where none is printed.
    test : str or None
        Which standard error p is of, and how many sides it has: ``"null, two-sided"``;
        None where no p is printed.
    n_tables : int or None
        As of `ConsistentTables`.
    status : str
        As of `ConsistentTables`.
    n_agreed : tuple of int
        As of `ConsistentTables`.
    """

    n_items: int
    agreement_weights: AuditWeights | None
    kappa_weights: AuditWeights | None
    rounding: str
    error: str | None = None
    test: str | None = None
    n_tables: int | None
    status: CountStatus
    n_agreed: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimAudit:
    """What became of a claim.

    Attributes
    ----------
    claim : Claim
        The claim.
    readings : tuple of ClaimReading
        Every reading that was tried.
    alone : dict of str to ConsistentTables
        Where no reading leaves a table: how many tables give a part of the numbers,
        which the key names, with the first weights that were tried.
    examples : tuple of tables
        Up to ten tables of the first reading that has some, as of `ConsistentTables`.
    """

    claim: Claim
    readings: tuple[ClaimReading, ...]
    alone: Mapping[str, ConsistentTables] = field(default_factory=dict)
    examples: tuple[CellRows, ...] = ()

    @property
    def is_possible(self) -> bool | None:
        """Whether any reading leaves a table; None if it cannot be told."""
        numbers = [reading.n_tables for reading in self.readings]
        if any(numbers):
            return True
        return None if None in numbers else False

    @property
    def sentence(self) -> str:
        """What came out, in a sentence that accuses nobody."""
        claim, n = self.claim, len(self.readings)
        table = f"of {counted_items(claim.n_items)} in {claim.n_categories} categories"
        if claim.n_raters > 2:
            table += f" by {claim.n_raters} raters"
        both = "both " if claim.agreement and claim.kappa else ""
        what = f"{both}{claim.numbers}{_beside(claim)}"
        if self.is_possible is None:
            return (
                f"cannot tell whether any table {table} gives {what}: the bound on "
                "work was met first"
            )
        if not self.is_possible:
            tried = "the one reading" if n == 1 else f"any of the {n} readings"
            return f"no table {table} gives {what}, by {tried} tried"
        some = [reading for reading in self.readings if reading.n_tables]
        count = _range_text(some)
        verb = "gives" if count == "one table" else "give"
        by = "" if len(some) == n else f", by {len(some)} of {n} readings"
        return f"{count} {table} {verb} {what}{by}{_agreed_text(claim, some)}"


def counted_items(n_items: int) -> str:
    """Return a number of items in words."""
    return "1 item" if n_items == 1 else f"{n_items} items"


def _range_text(readings: list[ClaimReading]) -> str:
    # how many tables readings leave
    order = sorted(readings, key=lambda r: (r.n_tables or 0, r.status == "at least"))
    first, last = (count_text(r.n_tables, r.status) for r in (order[0], order[-1]))
    if first == last:
        return first
    first = "1" if first == "one table" else first.removesuffix(" tables")
    return f"{first} to {last}"


def _agreed_text(claim: Claim, readings: list[ClaimReading]) -> str:
    # on how many items the raters agree, where it is known of every table
    numbers = {n for reading in readings for n in reading.n_agreed}
    if not numbers or not all(reading.n_agreed for reading in readings):
        return ""
    ends = " to ".join(map(str, sorted({min(numbers), max(numbers)})))
    return f"; in them the raters agree on {ends} of {claim.n_items}"


def _beside(claim: Claim) -> str:
    # what else is printed, in words
    parts = {
        "margins": claim.margins_1 is not None or claim.margins_2 is not None,
        "standard error": claim.standard_error is not None,
        "interval": claim.low is not None,
        "p": claim.p is not None,
    }
    names = [name for name, is_printed in parts.items() if is_printed]
    return f" with its {', '.join(names)}" if names else ""


def audit_claim(claim: Claim) -> ClaimAudit:
    """Count the tables that give what a paper prints, by every reading of it.

    Parameters
    ----------
    claim : Claim
        What is printed.

    Returns
    -------
    ClaimAudit
        Every reading with its number of tables.

    Notes
    -----
    Readings differ in the weights that the paper does not name, in the rounding of
    ties, in how many items were left out since a rating was absent, and in what
    standard error, interval and p are of. Weights lead, and the first that leave a
    table have the examples. With margins or errors the tables are looked at one by one,
    10 000 of them at the most.

    References
    ----------
    .. [1] Fleiss, J. L., Cohen, J., Everitt, B. S. (1969). Large sample standard
       errors of kappa and weighted kappa. Psychological Bulletin, 72(5), 323-327.
       https://doi.org/10.1037/h0028106
    .. [2] Cohen, J. (1960). A coefficient of agreement for nominal scales.
       Educational and Psychological Measurement, 20(1), 37-46.
       https://doi.org/10.1177/001316446002000104

    Examples
    --------
    >>> claim = Claim(
    ...     n_items=12, n_categories=3, kappa="0.771", kappa_weights="identity"
    ... )
    >>> audit_claim(claim).sentence
    'no table of 12 items in 3 categories gives κ 0.771, by the one reading tried'
    """
    readings: list[ClaimReading] = []
    examples: tuple[CellRows, ...] = ()
    for n_absent, weights in product(range(claim.n_unrated + 1), claim.weights()):
        question = _question(claim, claim.n_items - n_absent, weights)
        if _has_more(claim):
            rows, tables = _looked_at(claim, question)
        else:
            result = answer(question)
            rows, tables = _by_rounding(claim, question, result), result.examples
        readings += rows
        examples = examples or tables
    audit = ClaimAudit(claim=claim, readings=tuple(readings), examples=examples)
    if audit.is_possible is False:
        return replace(audit, alone=_alone(claim))
    return audit


def _question(
    claim: Claim, n_items: int, weights: tuple[AuditWeights, AuditWeights]
) -> Question:
    return pose_question(
        n_items=n_items,
        n_categories=claim.n_categories,
        n_raters=claim.n_raters,
        agreement=claim.agreement,
        kappa=claim.kappa,
        agreement_weights=weights[0],
        kappa_weights=weights[1],
        rounding=claim.rounding,
    )


def _has_more(claim: Claim) -> bool:
    return bool(claim.printed()) or not claim.margins_1 is claim.margins_2 is None


def _alone(claim: Claim) -> dict[str, ConsistentTables]:
    # by the first weights: which of the numbers it is that no table gives
    question = _question(claim, claim.n_items, claim.weights()[0])
    alone = {}
    if claim.agreement is not None and claim.kappa is not None:
        alone[f"{claim.agreement} % agreement"] = answer(replace(question, kappa=None))
        alone[f"κ {claim.kappa}"] = answer(replace(question, agreement=None))
    if _has_more(claim):
        alone[claim.numbers] = answer(question)
    return alone


def _by_rounding(
    claim: Claim, question: Question, result: ConsistentTables
) -> list[ClaimReading]:
    # one reading where both rules lead to the same
    first = result.readings[0]
    if all(
        (reading.n_tables, reading.status) == (first.n_tables, first.status)
        for reading in result.readings
    ):
        named = {claim.rounding: first}
    else:
        named = {reading.rounding: reading for reading in result.readings}
    return [
        replace(
            _reading(question, reading.n_tables, reading.status),
            rounding=rounding,
            n_agreed=result.n_agreed if reading.n_tables else (),
        )
        for rounding, reading in named.items()
    ]


def _reading(
    question: Question, n_tables: int | None, status: CountStatus
) -> ClaimReading:
    return ClaimReading(
        n_items=question.n_items,
        agreement_weights=question.agreement_weights if question.agreement else None,
        kappa_weights=question.kappa_weights if question.kappa else None,
        rounding="either" if len(question.rules) > 1 else question.rules[0],
        n_tables=n_tables,
        status=status,
    )


def _looked_at(
    claim: Claim, question: Question
) -> tuple[list[ClaimReading], tuple[CellRows, ...]]:
    # readings of margins, errors and p, from tables made one by one
    tables, is_whole = _listed(claim, question)
    is_whole = is_whole or claim.excludes_kappa
    uncertainty = Uncertainty.of(claim, tables, question.kappa_weights)
    errors = ERROR_KINDS if uncertainty.has_error else (None,)
    tests = tuple(uncertainty.tests) or (None,)
    readings: list[ClaimReading] = []
    examples: tuple[CellRows, ...] = ()
    for error, test in product(errors, tests):
        fits = uncertainty.fits(error, test)
        n = int(fits.sum())
        status: CountStatus = (
            "exact" if is_whole else "at least" if n else "cannot tell"
        )
        agreed = np.unique(np.trace(tables[fits], axis1=1, axis2=2)).tolist()
        readings.append(
            replace(
                _reading(question, n if n or is_whole else None, status),
                error=error,
                test=test,
                n_agreed=tuple(agreed) if is_whole else (),
            )
        )
        examples = examples or _as_rows(tables[fits][:10])
    return readings, examples


def _as_rows(tables: Integers) -> tuple[CellRows, ...]:
    return tuple(tuple(map(tuple, table)) for table in tables.tolist())


def _listed(claim: Claim, question: Question) -> tuple[Integers, bool]:
    # the tables that have the margins, and whether it is all of them
    q = question.n_categories
    blocks, n = [np.zeros((0, q, q), dtype=np.int64)], 0
    try:
        for block in _with_margins(claim, question):
            blocks.append(block)
            n += len(block)
            if n >= _MAX_LISTED:
                return np.concatenate(blocks)[:MAX_COUNTED], False
    except WorkLimitError:
        return np.concatenate(blocks), False
    return np.concatenate(blocks), True


def _with_margins(claim: Claim, question: Question) -> Iterator[Integers]:
    sides = [
        None
        if margins is None or sum(margins) != question.n_items
        else np.array(margins)
        for margins in (claim.margins_1, claim.margins_2)
    ]
    # margins of more items than are left say nothing of those that are
    both = None if sides[0] is None or sides[1] is None else sides[0] + sides[1]
    search = SquareTables(question, Work(), margins=both)
    for hit in search.hits():
        for block in search.tables(hit):
            fits = np.ones(len(block), dtype=bool)
            for margins, axis in zip(sides, (2, 1), strict=True):
                if margins is not None:
                    fits &= (block.sum(axis=axis) == margins).all(axis=1)
            if fits.any():
                yield block[fits]
