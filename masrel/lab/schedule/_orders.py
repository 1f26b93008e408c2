"""The order in which one rater meets the models, by the protocol's scheme."""

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from math import comb, prod

from masrel.errors import ScheduleError
from masrel.lab.protocol import Model, Protocol, ScheduleScheme
from masrel.lab.schedule._admissible import (
    FREE,
    MAX_REMAINDERS,
    Cell,
    LimitedRuns,
    PartedRuns,
    arrangement,
    n_arrangements,
    subset,
)
from masrel.lab.schedule._stream import Stream

WITH_ROWS = ("williams", "latin-square")
"""Schemes whose orders are rows of a design, dealt to raters one after the other."""


def draw_order(
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    site: str | None,
    row: int | None,
    secret: bytes | None,
) -> list[tuple[str, int]]:
    """Return model and repeat of each presentation of one rater, in order."""
    rules = protocol.schedule
    _check_row(rules.scheme, row)
    models = [model.id for model in protocol.models]
    stream = Stream(rules.seed, "schedule", session, rater, secret=secret)
    if rules.scheme == "random-order":  # in which repeats come in any order, too
        shown = [(m, repeat) for repeat in range(1, rules.repeats + 1) for m in models]
        stream.shuffle(shown)
        return shown
    if row is not None:
        return _numbered(_design_order(protocol, session, site, row, secret))
    if rules.scheme == "blocks":
        return _numbered(_in_blocks(protocol, stream))
    if (problem := order_problem(protocol)) is not None:
        raise ScheduleError(problem)
    return _numbered(order_at(protocol, stream.below(count_orders(protocol))))


def order_problem(protocol: Protocol) -> str | None:
    """Say why no order can be drawn by the protocol's scheme; None if one can."""
    scheme = protocol.schedule.scheme
    if scheme not in ("no-immediate-repeat", "restricted"):
        return None
    if _is_parted(protocol) and (n := _parted(protocol).n_remainders) > MAX_REMAINDERS:
        return (
            "schedule.max_same_grade: needed orders that can be counted beside "
            f"standards_apart = true (at most {MAX_REMAINDERS} remainders), got {n}: "
            "take intended_grade from dummies, or repeat less"
        )
    if count_orders(protocol) == 0:
        return (
            "schedule.scheme: needed one that some order of the models keeps, got "
            f'"{scheme}", which none does'
        )
    return None


def _numbered(order: Sequence[str]) -> list[tuple[str, int]]:
    # repeats are numbered as they come
    n_before: Counter[str] = Counter()
    shown = []
    for model in order:
        n_before[model] += 1
        shown.append((model, n_before[model]))
    return shown


def orders_in_words(rules: ScheduleScheme) -> str:
    """Say which orders a scheme draws, to follow "meets the models in"."""
    limits = []
    if rules.scheme == "no-immediate-repeat":
        limits.append("no model comes twice in a row")
    if rules.standards_apart:
        limits.append("no two standards come in a row")
    if rules.max_same_grade is not None:
        limits.append(f"at most {rules.max_same_grade} of one grade come in a row")
    if limits:
        return f"an order drawn from all in which {' and '.join(limits)}"
    if rules.scheme == "williams":
        return "an order of a Williams design, which balances places and what follows"
    if rules.scheme == "latin-square":
        return "an order of a Latin square, which balances places"
    if rules.scheme == "blocks" and rules.blocks_by == "role":
        return "a random order with standards and dummies in a block each"
    if rules.scheme == "blocks":
        return "a random order in which each comes once before any comes again"
    return "a random order"


def _check_row(scheme: str, row: int | None) -> None:
    if scheme not in WITH_ROWS and row is not None:
        raise ScheduleError(f"row: needed none, scheme {scheme} has no rows, got {row}")
    if scheme in WITH_ROWS and (row is None or row < 1):
        raise ScheduleError(
            f"row: needed a row of the design, from 1, with scheme {scheme}, got "
            f"{'none' if row is None else row}"
        )


def _design_order(
    protocol: Protocol,
    session: str,
    site: str | None,
    row: int,
    secret: bytes | None,
) -> list[str]:
    """Return the models of a row, from 1: a line of its square for every repeat."""
    rules = protocol.schedule
    n_lines = len(square(rules.scheme, len(protocol.models)))
    replicate, place = divmod(row - 1, n_lines)
    purpose = ("design", session, site or "", str(replicate + 1))
    stream = Stream(rules.seed, *purpose, secret=secret)
    return _replicate(protocol, stream)[place]


def _replicate(protocol: Protocol, stream: Stream) -> list[list[str]]:
    # every row of a replicate, whose repeats have squares of their own
    rules = protocol.schedule
    rows = _lines(protocol, stream)
    for _ in range(1, rules.repeats):
        lines = _lines(protocol, stream)
        # Drawn until no row goes on with the model that it ended with. Of k rows that
        # end with a model k lines begin with it, k = 1 or 2: at worst, of 3 models, one
        # draw in 9 is such, and of many one in 2.7 (k = 1) or 7.4 (k = 2).
        while (
            any(row[-1] == line[0] for row, line in zip(rows, lines, strict=True))
            and len(protocol.models) > 1
        ):
            stream.shuffle(lines)
        rows = [row + line for row, line in zip(rows, lines, strict=True)]
    return rows


def _lines(protocol: Protocol, stream: Stream) -> list[list[str]]:
    # which model a symbol stands for, of a Latin square which column comes when, and
    # which line: each by a permutation of its own
    models = [model.id for model in protocol.models]
    lines = square(protocol.schedule.scheme, len(models))
    columns = list(range(len(models)))
    stream.shuffle(models)
    if protocol.schedule.scheme == "latin-square":
        stream.shuffle(columns)
    stream.shuffle(lines)
    return [[models[line[column]] for column in columns] for line in lines]


def square(scheme: str, n: int) -> list[list[int]]:
    """Return the lines of a design of n symbols, from 0, before anything is drawn."""
    if scheme == "latin-square":
        return [[(i + j) % n for j in range(n)] for i in range(n)]
    # Williams (1949), https://doi.org/10.1071/CH9490149: 0, 1, n - 1, 2, n - 2, ... and
    # its shifts; of an odd number the same in the mirror, too
    first = [(j + 1) // 2 if j % 2 else (n - j // 2) % n for j in range(n)]
    lines = [[(i + symbol) % n for symbol in first] for i in range(n)]
    return lines + [line[::-1] for line in lines] if n % 2 and n > 1 else lines


def _in_blocks(protocol: Protocol, stream: Stream) -> list[str]:
    rules = protocol.schedule
    models = [model.id for model in protocol.models]
    blocks = [list(models) for _ in range(rules.repeats)]
    if rules.blocks_by == "role":
        blocks = [
            [model.id for model in protocol.models if model.role == role]
            * rules.repeats
            for role in ("standard", "dummy")
        ]
        stream.shuffle(blocks)
    for block in blocks:
        stream.shuffle(block)
    return [model for block in blocks for model in block]


def count_orders(protocol: Protocol) -> int:
    """Return how many orders keep the limits of the scheme, repeats not told apart."""
    repeats = protocol.schedule.repeats
    if _is_parted(protocol):
        of_cells = (
            n_arrangements([repeats] * len(m)) for m in _cells(protocol).values()
        )
        return _parted(protocol).count() * prod(of_cells)
    if protocol.schedule.standards_apart:
        standards, dummies = _of_roles(protocol)
        n_gaps = len(dummies) * repeats + 1
        return (
            comb(n_gaps, len(standards) * repeats)
            * n_arrangements([repeats] * len(standards))
            * n_arrangements([repeats] * len(dummies))
        )
    groups, free = _groups(protocol)
    words = _words(protocol).count()
    for group in (*groups, free):
        words *= n_arrangements([repeats] * len(group))
    return words


def order_at(protocol: Protocol, number: int) -> list[str]:
    """Return the order of a number below that of all orders, each number another."""
    if _is_parted(protocol):
        cells = {}
        for cell, models in _cells(protocol).items():
            number, sequence = _arranged(protocol, models, number)
            cells[cell] = iter(sequence)
        return [next(cells[cell]) for cell in _parted(protocol).word(number)]
    if protocol.schedule.standards_apart:
        return _standards_parted(protocol, number)
    groups, free = _groups(protocol)
    sequences = {}
    for index, group in ((FREE, free), *enumerate(groups)):
        number, sequence = _arranged(protocol, group, number)
        sequences[index] = iter(sequence)
    return [next(sequences[group]) for group in _words(protocol).word(number)]


def _standards_parted(protocol: Protocol, number: int) -> list[str]:
    # at most one standard before each dummy, and one after the last
    standards, dummies = _of_roles(protocol)
    number, of_standards = _arranged(protocol, standards, number)
    number, of_dummies = _arranged(protocol, dummies, number)
    gaps = subset(number, range(len(of_dummies) + 1), len(of_standards))
    order = list(of_dummies)
    for gap, standard in reversed(list(zip(gaps, of_standards, strict=True))):
        order.insert(gap, standard)
    return order


def _arranged(
    protocol: Protocol, models: Sequence[str], number: int
) -> tuple[int, list[str]]:
    # what is left of the number, and all presentations of the models in its order
    sizes = [protocol.schedule.repeats] * len(models)
    number, index = divmod(number, n_arrangements(sizes))
    return number, [models[place] for place in arrangement(index, sizes)]


def _is_parted(protocol: Protocol) -> bool:
    """Return whether one limit does not hold by the other: a dummy has a grade."""
    # Two standards that are apart are no two of a grade in a row.
    rules = protocol.schedule
    return (
        rules.standards_apart
        and rules.max_same_grade is not None
        and any(m.role == "dummy" and m.intended_grade for m in protocol.models)
    )


def _cells(protocol: Protocol) -> dict[Cell, list[str]]:
    # models by grade, in the order in which grades first come, and those without last;
    # of each the dummies, then the standards
    grades = dict.fromkeys(m.intended_grade for m in protocol.models)
    names = [*(grade for grade in grades if grade is not None), None]
    return {
        (None if grade is None else index, role == "standard"): [
            m.id for m in protocol.models if (m.intended_grade, m.role) == (grade, role)
        ]
        for index, grade in enumerate(names)
        for role in ("dummy", "standard")
    }


def _parted(protocol: Protocol) -> PartedRuns:
    repeats = protocol.schedule.repeats
    n = {cell: len(models) * repeats for cell, models in _cells(protocol).items()}
    n_grades = len(n) // 2 - 1
    return _counted(
        tuple((n[grade, False], n[grade, True]) for grade in range(n_grades)),
        (n[None, False], n[None, True]),
        protocol.schedule.max_same_grade or 1,
    )


@lru_cache(maxsize=8)
def _counted(
    grades: tuple[tuple[int, int], ...], free: tuple[int, int], longest: int
) -> PartedRuns:
    # one for all raters: what was counted stays with it
    return PartedRuns(grades, free, longest)


def _of_roles(protocol: Protocol) -> tuple[list[str], list[str]]:
    standards = [model.id for model in protocol.models if model.role == "standard"]
    dummies = [model.id for model in protocol.models if model.role == "dummy"]
    return standards, dummies


def _groups(protocol: Protocol) -> tuple[list[list[str]], list[str]]:
    # models that count as the same, and those that may come any number of times
    groups: dict[str, list[str]] = {}
    free = []
    for model in protocol.models:
        name = _group(protocol, model)
        if name is None:
            free.append(model.id)
        else:
            groups.setdefault(name, []).append(model.id)
    return list(groups.values()), free


def _group(protocol: Protocol, model: Model) -> str | None:
    is_by_model = protocol.schedule.scheme == "no-immediate-repeat"
    return model.id if is_by_model else model.intended_grade


def _words(protocol: Protocol) -> LimitedRuns:
    rules = protocol.schedule
    groups, free = _groups(protocol)
    return LimitedRuns(
        sizes=tuple(len(group) * rules.repeats for group in groups),
        n_free=len(free) * rules.repeats,
        longest=rules.max_same_grade or 1,
    )
