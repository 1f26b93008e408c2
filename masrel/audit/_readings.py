"""Readings of a claim: how many tables give the printed numbers under each.

What a program prints as the standard error of kappa is one of several; the interval is
kappa plus and minus a normal quantile of it, and p that of kappa over it. All these are
floats: a printed number fits where it is nearer than half of its last decimal.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from statistics import NormalDist
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from masrel._input import check_option
from masrel.agreement import cohen_kappa, count_table
from masrel.audit._claims import MARGINS, UNCERTAINTY, WEIGHTS, Claim, PrintedNumber
from masrel.audit._search import (
    MAX_COUNTED,
    N_EXAMPLES,
    Integers,
    disagreement,
    search_tables,
)

CellRows = tuple[tuple[int, ...], ...]

CountStatus = Literal["exact", "at least", "cannot tell"]

_Floats = NDArray[np.float64]
_Flags = NDArray[np.bool_]

_BESIDE = (*MARGINS, *UNCERTAINTY)  # what needs tables that are made
_ERRORS = ("delta", "delta n-1", "null", "simple")
_TESTS = {
    "null, two-sided": ("null", 2),
    "null, one-sided": ("null", 1),
    "delta, two-sided": ("delta", 2),
    "delta, one-sided": ("delta", 1),
}
_NORMAL = NormalDist()
_SLACK = 1e-9  # of floats, either side of a tie


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One way to read printed numbers, and how many tables it leaves.

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
        As for `ConsistentTables`.
    status : str
        As for `ConsistentTables`.
    n_agreed : tuple of int
        As for `ConsistentTables`.
    """

    n_items: int
    agreement_weights: str | None
    kappa_weights: str | None
    rounding: str
    error: str | None = None
    test: str | None = None
    n_tables: int | None
    status: CountStatus
    n_agreed: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ConsistentTables:
    """How many tables give the printed numbers.

    Attributes
    ----------
    n_tables : int or None
        Tables that give both numbers, 0 if none does; None if it cannot be told.
    status : str
        ``"exact"``: the number is exact; ``"at least"``: there may be more, since at
        most 10 000 are counted; ``"cannot tell"``: the bound on work was met
        before a table was met.
    examples : tuple of tables
        Up to ten of them, each a tuple of rows. Two raters: categories of the first
        (rows) and of the second rater (columns). More raters: items (rows), and how
        many raters chose each category (columns).
    readings : tuple of Reading
        What was tried, one reading a rule of rounding.
    n_agreed : tuple of int
        On how many items two raters agree in any of these tables; empty for more
        raters, and where not every table was counted.
    n_visited : int
        Partial tables that were visited, at most 10⁸; a step counts as a thousand of
        them at the least.
    """

    n_tables: int | None
    status: CountStatus
    examples: tuple[CellRows, ...] = field(repr=False)
    readings: tuple[Reading, ...] = field(repr=False)
    n_agreed: tuple[int, ...] = ()
    n_visited: int = field(compare=False)

    @property
    def is_possible(self) -> bool | None:
        """Whether any table gives the numbers; None if it cannot be told."""
        return None if self.n_tables is None else self.n_tables > 0

    def __str__(self) -> str:
        return count_text(self.n_tables, self.status)


def count_text(n_tables: int | None, status: CountStatus) -> str:
    """Return a count of tables in words."""
    few = {None: "cannot tell", 0: "no table", 1: "one table"}
    number = f"{n_tables or 0:,} tables".replace(",", " ")
    return f"at least {number}" if status == "at least" else few.get(n_tables, number)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimAudit:
    """The result of checking a claim.

    Attributes
    ----------
    claim : Claim
        The claim.
    readings : tuple of Reading
        Every reading that was tried.
    alone : dict of str to ConsistentTables
        Where no reading leaves a table: how many tables give a part of the numbers,
        which the key names, with the first weights that were tried.
    examples : tuple of tables
        Up to ten tables of the first reading that has some, as of `ConsistentTables`.
    """

    claim: Claim
    readings: tuple[Reading, ...]
    alone: Mapping[str, ConsistentTables] = field(default_factory=dict)
    examples: tuple[CellRows, ...] = ()

    @property
    def is_possible(self) -> bool | None:
        """Whether any reading leaves a table; None if it cannot be told."""
        numbers = [reading.n_tables for reading in self.readings]
        return any(numbers) or (None if None in numbers else False)

    @property
    def sentence(self) -> str:
        """What came out, in a sentence that accuses nobody."""
        claim, n = self.claim, len(self.readings)
        items = "1 item" if claim.n_items == 1 else f"{claim.n_items} items"
        by = f" by {claim.n_raters} raters" if claim.n_raters > 2 else ""
        table = f"table of {items} in {claim.n_categories} categories{by}"
        both = "both " if claim.agreement and claim.kappa else ""
        what = f"{both}{_numbers(claim)}{_beside(claim)}"
        if self.is_possible is None:
            return (
                f"it cannot be decided whether any {table} gives {what}, because the "
                "limit on computation was reached"
            )
        if not self.is_possible:
            tried = "the one reading" if n == 1 else f"any of the {n} readings"
            return f"no {table} gives {what}, by {tried} tried"
        some = [reading for reading in self.readings if reading.n_tables]
        count = _range_text(some)
        verb = "gives" if count == "one table" else "give"
        read = "" if len(some) == n else f", by {len(some)} of {n} readings"
        if all(reading.n_agreed for reading in some):
            agreed = [number for reading in some for number in reading.n_agreed]
            on = f"{ends_text(agreed)} of {claim.n_items}"
            read += f"; in these the raters agree on {on}"
        return f"{count}{table.removeprefix('table')} {verb} {what}{read}"


def ends_text(numbers: Sequence[int]) -> str:
    """Return the ends of some numbers in words."""
    return " to ".join(map(str, sorted({min(numbers), max(numbers)})))


def _numbers(claim: Claim) -> str:
    # percentage and kappa in words
    words = {"{} % agreement": claim.agreement, "κ {}": claim.kappa}
    return " and ".join(name.format(text) for name, text in words.items() if text)


def _beside(claim: Claim) -> str:
    # what else is printed, in words
    parts = {
        "margins": claim.margins_1 or claim.margins_2,
        "standard error": claim.standard_error,
        "interval": claim.low,
        "p": claim.p,
    }
    names = [name for name, printed in parts.items() if printed is not None]
    return f" with its {', '.join(names)}" if names else ""


def _range_text(readings: list[Reading]) -> str:
    # how many tables readings leave
    order = sorted(readings, key=lambda r: (r.n_tables or 0, r.status == "at least"))
    first, last = (count_text(r.n_tables, r.status) for r in (order[0], order[-1]))
    number = "1" if first == "one table" else first.removesuffix(" tables")
    return first if first == last else f"{number} to {last}"


def consistent_tables(
    *,
    n_items: int,
    n_categories: int,
    n_raters: int = 2,
    agreement: str | None = None,
    kappa: str | None = None,
    agreement_weights: str = "identity",
    kappa_weights: str = "identity",
    rounding: str = "either",
) -> ConsistentTables:
    """Count the integer tables that give a printed agreement and a printed kappa.

    Parameters
    ----------
    n_items : int
        Items that every rater rated, 1 to 10 000.
    n_categories : int
        Categories of the scale, used or not, 2 to 20.
    n_raters : int, optional
        Raters of each item. With two, kappa is Cohen's; with more it is Fleiss', and
        the agreement is that of pairs of raters.
    agreement : str, optional
        The agreement in percent as it is printed, without a sign: its decimals count.
    kappa : str, optional
        Kappa as it is printed. At least one of both is needed.
    agreement_weights, kappa_weights : str, optional
        ``"identity"``, ``"linear"`` or ``"quadratic"``.
    rounding : str, optional
        What became of ties: ``"half_even"``, ``"half_up"`` (away from 0), or
        ``"either"``: both numbers by one rule, whichever.

    Returns
    -------
    ConsistentTables
        How many tables there are, some of them, and what was tried.

    Raises
    ------
    ParameterError
        If a parameter is not what it must be, or both numbers are absent.

    Notes
    -----
    Raters and categories are distinguished, and so are items of more than two raters: a
    table and its transpose count as two. Tables with an undefined kappa are not counted
    if a kappa is printed. With two raters all tables are decided, in integers, unless
    the bound on work is met. With more raters this holds for few items; with many, a
    part of the tables is tried, and if none of them fits, the answer is unknown.

    Examples
    --------
    >>> print(consistent_tables(
    ...     n_items=20, n_categories=2, agreement="85.0", kappa="0.58"))
    4 tables
    >>> print(consistent_tables(
    ...     n_items=20, n_categories=2, agreement="65.0", kappa="0.244"))
    no table
    """
    check_option("agreement_weights", agreement_weights, WEIGHTS)
    check_option("kappa_weights", kappa_weights, WEIGHTS)
    return _answer(
        Claim(
            n_items=n_items,
            n_categories=n_categories,
            n_raters=n_raters,
            agreement=agreement,
            kappa=kappa,
            agreement_weights=agreement_weights,
            kappa_weights=kappa_weights,
            rounding=rounding,
        )
    )


def _answer(claim: Claim) -> ConsistentTables:
    # of a claim whose weights are named, by its percentage and kappa alone
    result = search_tables(claim)
    agreed = tuple(sorted(result.n_agreed)) if result.is_whole else ()
    whole, *readings = (
        _reading(claim, result.numbers[rule], result.is_whole, rule or "either", agreed)
        for rule in (None, *claim.rules)
    )
    return ConsistentTables(
        n_tables=whole.n_tables,
        status=whole.status,
        examples=_as_rows(result.tables),
        readings=tuple(readings),
        n_agreed=agreed,
        n_visited=result.n_visited,
    )


def _as_rows(tables: Iterable[Integers]) -> tuple[CellRows, ...]:
    return tuple(tuple(map(tuple, table.tolist())) for table in tables)


def _reading(
    claim: Claim, n: int, is_whole: bool, rounding: str, n_agreed: tuple[int, ...]
) -> Reading:
    # is_whole: whether all tables were looked at, of which n fit
    return Reading(
        n_items=claim.n_items,
        agreement_weights=claim.agreement_weights if claim.agreement else None,
        kappa_weights=claim.kappa_weights if claim.kappa else None,
        rounding=rounding,
        n_tables=min(n, MAX_COUNTED) if n or is_whole else None,
        status="exact" if is_whole else "at least" if n else "cannot tell",
        n_agreed=n_agreed if n else (),
    )


def audit_claim(claim: Claim) -> ClaimAudit:
    """Count the tables that give the printed numbers, under every reading.

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
    read = _one_by_one if _has_more(claim) else _by_rounding
    ways = product(range(claim.n_unrated + 1), claim.weights())
    readings, tables = zip(
        *(
            of_way
            for n_absent, weights in ways
            for of_way in read(_named(claim, weights, claim.n_items - n_absent))
        ),
        strict=True,
    )
    examples = next(filter(None, tables), ())
    audit = ClaimAudit(claim=claim, readings=readings, examples=examples)
    return (
        audit if audit.is_possible is not False else replace(audit, alone=_alone(claim))
    )


def _has_more(claim: Claim) -> bool:
    # whether something is printed beside its percentage and kappa
    return any(getattr(claim, key) is not None for key in _BESIDE)


def _named(claim: Claim, weights: tuple[str, str], n_items: int) -> Claim:
    # a claim read by named weights, of so many items that have both ratings
    # margins of more items than are left say nothing of those that are
    first, second = (
        margins if margins is not None and sum(margins) == n_items else None
        for margins in (claim.margins_1, claim.margins_2)
    )
    return replace(
        claim,
        n_items=n_items,
        n_unrated=0,
        agreement_weights=weights[0],
        kappa_weights=weights[1],
        margins_1=first,
        margins_2=second,
    )


def _alone(claim: Claim) -> dict[str, ConsistentTables]:
    # by the first weights: which of the numbers it is that no table gives
    absent: dict[str, None] = dict.fromkeys(_BESIDE)
    bare = _named(replace(claim, **absent), claim.weights()[0], claim.n_items)  # type: ignore[arg-type]
    parts = [bare] * _has_more(claim)
    if claim.agreement is not None and claim.kappa is not None:
        parts[:0] = replace(bare, kappa=None), replace(bare, agreement=None)
    return {_numbers(part): _answer(part) for part in parts}


_Read = Iterator[tuple[Reading, tuple[CellRows, ...]]]  # each with its examples


def _by_rounding(claim: Claim) -> _Read:
    # one reading where both rules lead to the same
    result = _answer(claim)
    first, *others = result.readings
    if all((r.n_tables, r.status) == (first.n_tables, first.status) for r in others):
        first, others = replace(first, rounding=claim.rounding), []
    yield from ((reading, result.examples) for reading in (first, *others))


def _one_by_one(claim: Claim) -> _Read:
    # readings of margins, errors and p, from tables made one by one
    result = search_tables(claim, n_made=MAX_COUNTED)
    is_whole = result.is_whole or claim.excludes_kappa
    q, printed = claim.n_categories, claim.printed()
    tables = np.array(result.tables, dtype=np.int64).reshape(-1, q, q)
    has_errors = not printed.keys().isdisjoint(UNCERTAINTY)
    values = _errors(tables, claim.kappa_weights) if has_errors else {}
    errors = _ERRORS if printed.keys() & {"standard_error", "low"} else (None,)
    for error, test in product(errors, _TESTS if "p" in printed else (None,)):
        fits = np.ones(len(tables), dtype=bool)
        if error is not None:
            fits &= _has_error(claim, values["kappa"], values[error])
        if test is not None:
            fits &= _has_p(claim, values, test)
        agreed = np.unique(np.trace(tables[fits], axis1=1, axis2=2)).tolist()
        reading = _reading(
            claim,
            int(fits.sum()),
            is_whole,
            claim.rounding,
            tuple(agreed) if is_whole else (),
        )
        examples = _as_rows(tables[fits][:N_EXAMPLES])
        yield replace(reading, error=error, test=test), examples


def _errors(tables: Integers, weights: str) -> dict[str, _Floats]:
    # kappa of every table with the standard errors that programs print; w = 1 - v/v_max
    estimates = [cohen_kappa(count_table(t), weights=weights) for t in tables]
    delta = np.array([estimate.standard_error for estimate in estimates])
    v = disagreement(weights, tables.shape[1]).astype(float)
    w = 1 - v / v.max()
    n = tables.sum(axis=(1, 2))
    p = tables / n[:, None, None]
    rows, columns = p.sum(axis=2), p.sum(axis=1)
    observed = (p * w).sum(axis=(1, 2))
    chance = np.einsum("tk,km,tm->t", rows, w, columns)
    means = (columns @ w.T)[:, :, None] + (rows @ w)[:, None, :]
    # [1], eq. 9: Σ p_i. p_.j [w_ij - (w_i. + w_.j)]² - p_e², of kappa 0
    variance = np.einsum("tk,tkm,tm->t", rows, (w - means) ** 2, columns) - chance**2
    # [2]: the first one of Cohen
    squares = np.maximum((p * w**2).sum(axis=(1, 2)) - observed**2, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return {
            "kappa": np.array([estimate.value for estimate in estimates]),
            "delta": delta * np.sqrt((n - 1) / n),
            "delta n-1": delta,
            "null": np.sqrt(np.maximum(variance, 0.0) / n) / (1 - chance),
            "simple": np.sqrt(squares / n) / (1 - chance),
        }


def _has_error(claim: Claim, kappa: _Floats, error: _Floats) -> _Flags:
    reach = _NORMAL.inv_cdf(0.5 + claim.level / 2) * error
    expected = {"standard_error": error, "low": kappa - reach, "high": kappa + reach}
    ends = {"low": -1.0, "high": 1.0}
    fits = [
        _near(expected[key], number, ends.get(key, 0.0))
        for key, number in claim.printed().items()
        if key in expected
    ]
    return np.asarray(np.all(fits, axis=0))


def _has_p(claim: Claim, values: dict[str, _Floats], test: str) -> _Flags:
    printed = claim.printed()["p"]
    error, sides = _TESTS[test]
    with np.errstate(divide="ignore", invalid="ignore"):
        above = np.array([1 - _NORMAL.cdf(z) for z in values["kappa"] / values[error]])
    p = above if sides == 1 else 2 * np.minimum(above, 1 - above)
    is_bound = str(claim.p).startswith("<")
    return np.asarray(p < float(printed.value)) if is_bound else _near(p, printed)


def _near(values: _Floats, printed: PrintedNumber, end: float = 0.0) -> _Flags:
    # end: -1 or 1 of the scale, where intervals may have been cut off
    value, reach = float(printed.value), float(printed.half_unit) + _SLACK
    is_cut = (value == end) & (values * end > 1)
    return np.asarray((abs(values - value) <= reach) | is_cut)
