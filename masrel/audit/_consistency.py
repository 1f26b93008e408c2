"""How many integer tables give a printed agreement and a printed kappa."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Literal

from masrel.audit._item_tables import (
    FIRST_VISITED_ITEMS,
    MAX_VISITED_ITEMS,
    ItemTables,
)
from masrel.audit._printed import Rule
from masrel.audit._square_tables import (
    MAX_COUNTED,
    SquareTables,
    Work,
    WorkLimitError,
)
from masrel.audit._windows import AuditWeights, Question, pose_question

RoundingName = Literal["half_even", "half_up", "either"]
CountStatus = Literal["exact", "at least", "cannot tell"]
CellRows = tuple[tuple[int, ...], ...]

N_EXAMPLES = 10
"""Tables that are shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One way to read the printed numbers, and how many tables it leaves.

    Attributes
    ----------
    rounding : str
        ``"half_even"`` or ``"half_up"``.
    agreement_weights, kappa_weights : str
        Weights of the agreement and of kappa.
    n_tables : int or None
        As of `ConsistentTables`.
    status : str
        As of `ConsistentTables`.
    """

    rounding: Rule
    agreement_weights: AuditWeights
    kappa_weights: AuditWeights
    n_tables: int | None
    status: CountStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class ConsistentTables:
    """How many tables give the printed numbers.

    Attributes
    ----------
    n_tables : int or None
        Tables that give both numbers, 0 if none does; None if it cannot be told.
    status : str
        ``"exact"``: there are so many; ``"at least"``: there may be more, since no
        more than 10 000 are counted; ``"cannot tell"``: the bound on work was met
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
    if n_tables is None:
        return "cannot tell"
    number = f"{n_tables:,}".replace(",", " ")
    if status == "at least":
        return f"at least {number} tables"
    if n_tables < 2:
        return "one table" if n_tables else "no table"
    return f"{number} tables"


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
        Raters of each item. Of two, kappa is Cohen's; of more it is Fleiss', and the
        agreement is that of pairs of raters.
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
    Raters and categories are told apart, and so are items of more than two raters: a
    table and its transpose are two. Tables of which kappa is undefined are not counted
    where a kappa is printed. Of two raters all tables are decided, in integers, unless
    the bound on work is met. Of more raters this holds for few items; with many, a
    part of the tables is tried, and where none of them fits it cannot be told.

    Examples
    --------
    >>> print(consistent_tables(
    ...     n_items=20, n_categories=2, agreement="85.0", kappa="0.58"))
    4 tables
    >>> print(consistent_tables(
    ...     n_items=20, n_categories=2, agreement="65.0", kappa="0.244"))
    no table
    """
    question = pose_question(
        n_items=n_items,
        n_categories=n_categories,
        n_raters=n_raters,
        agreement=agreement,
        kappa=kappa,
        agreement_weights=agreement_weights,
        kappa_weights=kappa_weights,
        rounding=rounding,
    )
    return answer(question)


def answer(question: Question) -> ConsistentTables:
    """Return the tables of a question that was checked."""
    if question.n_raters == 2:
        return _answer(question, Work())
    first = _answer(question, Work(limit=FIRST_VISITED_ITEMS))
    if first.status == "exact" or first.n_tables == MAX_COUNTED:
        return first
    return _answer(question, Work(limit=MAX_VISITED_ITEMS))


def _answer(question: Question, work: Work) -> ConsistentTables:
    count = _Count(question, work)
    search = _square_counts if question.n_raters == 2 else _item_counts
    try:
        for numbers, n_agreed, examples in search(question, work):
            count.add(numbers, n_agreed, examples)
            if count.numbers[None] >= MAX_COUNTED:
                return count.result("at least")
    except WorkLimitError:
        return count.result("cannot tell")
    return count.result("exact")


_Step = tuple[dict[Rule | None, int], int | None, Callable[[], Iterator[CellRows]]]
"""Tables by rule and by any (None); on how many items they agree; the tables."""


def _square_counts(question: Question, work: Work) -> Iterator[_Step]:
    search = SquareTables(question, work)
    for hit in search.hits():
        examples = lambda hit=hit: (  # noqa: E731 - made only where they are shown
            tuple(map(tuple, table.tolist()))
            for block in search.tables(hit)
            for table in block
        )
        yield search.count(hit), int(hit.diagonals[0].sum()), examples


def _item_counts(question: Question, work: Work) -> Iterator[_Step]:
    for numbers, examples in ItemTables(question, work).counts():
        yield numbers, None, examples


class _Count:
    """What was counted so far."""

    def __init__(self, question: Question, work: Work) -> None:
        self.question = question
        self.work = work
        self.numbers: dict[Rule | None, int] = dict.fromkeys((None, *question.rules), 0)
        self.examples: list[CellRows] = []
        self.n_agreed: set[int] = set()

    def add(
        self,
        numbers: dict[Rule | None, int],
        n_agreed: int | None,
        examples: Callable[[], Iterator[CellRows]],
    ) -> None:
        for rule, n in numbers.items():
            self.numbers[rule] += n
        if not numbers[None]:
            return
        if n_agreed is not None:
            self.n_agreed.add(n_agreed)
        if len(self.examples) < N_EXAMPLES:
            for table in examples():
                self.examples.append(table)
                if len(self.examples) == N_EXAMPLES:
                    break

    def result(self, status: CountStatus) -> ConsistentTables:
        q = self.question
        is_whole = status == "exact"
        return ConsistentTables(
            n_tables=_number(self.numbers[None], status),
            status=_status(self.numbers[None], status),
            examples=tuple(self.examples),
            readings=tuple(
                Reading(
                    rounding=rule,
                    agreement_weights=q.agreement_weights,
                    kappa_weights=q.kappa_weights,
                    n_tables=_number(self.numbers[rule], status),
                    status=_status(self.numbers[rule], status),
                )
                for rule in q.rules
            ),
            n_agreed=tuple(sorted(self.n_agreed)) if is_whole else (),
            n_visited=self.work.n_visited,
        )


def _number(n: int, status: CountStatus) -> int | None:
    return None if n == 0 and status != "exact" else min(n, MAX_COUNTED)


def _status(n: int, status: CountStatus) -> CountStatus:
    if status == "exact":
        return "exact"
    return "at least" if n else "cannot tell"
