"""The order in which one rater meets the models, by the protocol's scheme."""

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from math import prod
from typing import Any

from masrel._input import refuse
from masrel.errors import ScheduleError
from masrel.lab.protocol import Protocol, ScheduleScheme
from masrel.lab.schedule._admissible import (
    FREE,
    MAX_REMAINDERS,
    LimitedRuns,
    PartedRuns,
    StandardsApart,
    arrangement,
    n_arrangements,
)
from masrel.lab.schedule._secret import Stream

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
    _, words = _limited(protocol)
    if isinstance(words, PartedRuns) and (n := words.n_remainders) > MAX_REMAINDERS:
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
    n_same = rules.max_same_grade
    limits = (
        (rules.scheme == "no-immediate-repeat", "no model comes twice in a row"),
        (rules.standards_apart, "no two standards come in a row"),
        (n_same is not None, f"at most {n_same} of one grade come in a row"),
    )
    if words := " and ".join(limit for is_one, limit in limits if is_one):
        return f"an order drawn from all in which {words}"
    by = rules.blocks_by if rules.scheme == "blocks" else None
    return _IN_WORDS[rules.scheme, by]


# Schemes without limits, and what is blocked, to words for them
_IN_WORDS = {
    ("random-order", None): "a random order",
    ("williams", None): "an order of a Williams design, which balances places and what "
    "follows",
    ("latin-square", None): "an order of a Latin square, which balances places",
    ("blocks", "role"): "a random order with standards and dummies in a block each",
    ("blocks", "repeat"): "a random order in which each comes once before any comes "
    "again",
}


def _check_row(scheme: str, row: int | None) -> None:
    refuse(
        (
            scheme not in WITH_ROWS and row is not None,
            f"row: needed none, scheme {scheme} has no rows, got {row}",
        ),
        (
            scheme in WITH_ROWS and (row is None or row < 1),
            f"row: needed a row of the design, from 1, with scheme {scheme}, got "
            f"{'none' if row is None else row}",
        ),
        error=ScheduleError,
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
    rows = _lines(protocol, stream)  # every row of the replicate
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
    return rows[place]


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
    groups, words = _limited(protocol)
    repeats = protocol.schedule.repeats
    of_groups = (n_arrangements([repeats] * len(each)) for each in groups.values())
    return words.count() * prod(of_groups)


def order_at(protocol: Protocol, number: int) -> list[str]:
    """Return the order of a number below that of all orders, each number another."""
    groups, words = _limited(protocol)
    sequences = {}
    for group, models in groups.items():
        sizes = [protocol.schedule.repeats] * len(models)
        number, index = divmod(number, n_arrangements(sizes))
        sequences[group] = iter([models[place] for place in arrangement(index, sizes)])
    return [next(sequences[group]) for group in words.word(number)]


_Groups = dict[Any, list[str]]


def _limited(
    protocol: Protocol,
) -> tuple[_Groups, LimitedRuns | PartedRuns | StandardsApart]:
    """Return models that count as the same, and the words of groups they may form."""
    rules, models = protocol.schedule, protocol.models
    # Two standards that are apart are no two of a grade in a row: the one limit does
    # not hold by the other where a dummy has a grade.
    are_both = rules.standards_apart and rules.max_same_grade is not None
    if are_both and any(m.role == "dummy" and m.intended_grade for m in models):
        return _parted(protocol)
    if rules.standards_apart:
        of_roles: _Groups = {
            role: [model.id for model in models if model.role == role]
            for role in ("standard", "dummy")
        }
        return of_roles, StandardsApart(
            n_standards=len(of_roles["standard"]) * rules.repeats,
            n_dummies=len(of_roles["dummy"]) * rules.repeats,
        )
    # what may come any number of times is free
    groups: _Groups = {FREE: []}
    numbers: dict[str, int] = {}
    is_by_model = rules.scheme == "no-immediate-repeat"
    for model in models:
        name = model.id if is_by_model else model.intended_grade
        group = FREE if name is None else numbers.setdefault(name, len(numbers))
        groups.setdefault(group, []).append(model.id)
    n_free, *sizes = (len(group) * rules.repeats for group in groups.values())
    longest = rules.max_same_grade or 1
    return groups, LimitedRuns(sizes=tuple(sizes), n_free=n_free, longest=longest)


def _parted(protocol: Protocol) -> tuple[_Groups, PartedRuns]:
    # models by grade, in the order in which grades first come, and those without last;
    # of each the dummies, then the standards
    rules, models = protocol.schedule, protocol.models
    grades = dict.fromkeys(m.intended_grade for m in models if m.intended_grade)
    cells: _Groups = {
        (None if grade is None else index, role == "standard"): [
            m.id for m in models if (m.intended_grade, m.role) == (grade, role)
        ]
        for index, grade in enumerate([*grades, None])
        for role in ("dummy", "standard")
    }
    n = {cell: len(each) * rules.repeats for cell, each in cells.items()}
    sizes = tuple((n[grade, False], n[grade, True]) for grade in range(len(grades)))
    free = n[None, False], n[None, True]
    return cells, _counted(sizes, free, rules.max_same_grade or 1)


@lru_cache(maxsize=8)
def _counted(
    grades: tuple[tuple[int, int], ...], free: tuple[int, int], longest: int
) -> PartedRuns:
    # one for all raters: what was counted stays with it
    return PartedRuns(grades, free, longest)
