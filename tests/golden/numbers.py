"""Golden numbers of 2 000 tables: every coefficient, and intervals by all methods.

The file says by name what was computed of every table: a coefficient that is added
later is in none of them, and shifts none.
"""

import zlib
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from itertools import accumulate
from multiprocessing import get_context
from typing import Any

from tests.golden.adapter import Table, result_of
from tests.golden.call import Stream
from tests.golden.compare import Change, changes
from tests.golden.drawn import pick, shares_of
from tests.golden.store import load, save

N_TABLES = 2000

Replay = tuple[list[Change], int]

GROUP = "numbers"

TENTH = range(5, N_TABLES, 10)
"""Tables that every run of the tests computes, in a file of their own."""

NAMED = (
    "identity", "linear", "quadratic", "ordinal", "radical", "ratio", "circular",
    "bipolar",
)  # fmt: skip

LEVELS = [0.8, 0.8, 0.9, 0.9, 0.95, 0.95, 0.95, 0.99]

DIGITS = 9
"""Significant ones of what was drawn; anything else has all of them."""


def table(seed: int) -> Table:
    """Table `seed`: of two raters or more, of two grades or more, maybe with gaps."""
    stream = Stream(f"numbers {seed}")
    n_raters, n_items, n_grades = _sizes(stream, seed)
    weights: object = stream.one_of(["identity", "identity", *NAMED, "matrix"])
    grades, is_text = _grades(stream, n_grades)
    shares, level = shares_of(stream, n_grades), stream.one_of(LEVELS)
    faithful, gaps = stream.uniform(0.2, 1.0), _gaps(stream)
    rows = [
        _row(stream, grades, shares, (n_raters, faithful, gaps)) for _ in range(n_items)
    ]
    if weights == "matrix":
        weights = _matrix(stream, n_grades) if n_grades <= 12 else "radical"
    needs_scale = not isinstance(weights, str) or is_text
    declares = stream.chance(0.9 if needs_scale else 0.5)
    breaks = accumulate(stream.chance(0.5) for _ in rows)
    return Table(
        rows=rows,
        categories=grades if declares else None,
        is_counts=False,
        seed=seed,
        weights=weights,
        level=level,
        clusters=[f"site {k}" for k in breaks],
    )


def _sizes(stream: Stream, seed: int) -> tuple[int, int, int]:
    # raters, items and grades: mostly few, and a few tables of many
    which = stream.uniform(0.0, 1.0)
    n_raters = 2 if which < 0.4 else 3 + stream.below(4 if which < 0.85 else 28)
    which = stream.uniform(0.0, 1.0)
    n_items = 2 + stream.below(12 if which < 0.5 else 40 if which < 0.95 else 300)
    which = stream.uniform(0.0, 1.0)
    n_grades = 2 + stream.below(4 if which < 0.75 else 11 if which < 0.97 else 60)
    if seed == 0:
        return 199, 30, 5
    if seed in (1, 2, 3, 4):
        return n_raters, 60 + n_items, 500
    return n_raters, n_items, n_grades


def _grades(stream: Stream, n: int) -> tuple[list, bool]:
    """Text, ranks from 0 or 1, or numbers at uneven distances; and whether text."""
    which = stream.below(5)
    if which < 2:
        return [f"g{k:03}" for k in range(n)], True
    if which < 4:
        return list(range(which - 2, n + which - 2)), False
    steps = accumulate(1 + stream.below(8) for _ in range(n))
    return [step / 4 - (2.0 if stream.chance(0.02) else 0.0) for step in steps], False


def _gaps(stream: Stream) -> tuple[str, float]:
    """No gaps, gaps anywhere, or items of fewer raters."""
    if stream.chance(0.5):
        return "none", 0.0
    kind = "anywhere" if stream.chance(0.6) else "fewer raters"
    return kind, stream.uniform(0.03, 0.4)


def _row(
    stream: Stream,
    grades: list,
    shares: list[float],
    raters: tuple[int, float, tuple[str, float]],
) -> list:
    n_raters, faithful, (gaps, share) = raters
    truth, row = pick(stream, shares), []
    for _ in range(n_raters):
        k = truth
        if not stream.chance(faithful):  # a neighbouring grade, or any
            k += 1 if stream.chance(0.5) else -1
            if stream.chance(0.4) or not 0 <= k < len(grades):
                k = pick(stream, shares)
        row.append(grades[k])
    if gaps == "anywhere":
        return [None if stream.chance(share) else cell for cell in row]
    if gaps == "fewer raters" and stream.chance(2.0 * share):
        n = 1 + stream.below(n_raters)
        return row[:n] + [None] * (n_raters - n)
    return row


def _matrix(stream: Stream, n: int) -> list[list[float]]:
    w = [[1.0] * n for _ in range(n)]
    for k in range(n):
        for m in range(k):
            w[k][m] = w[m][k] = stream.below(15) / 16
    return w


def rounded(answer: dict) -> dict:
    """Drawn ends with as many digits as are stored."""
    if "mce" not in answer:
        return answer
    ends = {
        key: _digits(answer[key]) for key in ("low", "high", "median") if key in answer
    }
    return answer | ends | {"mce": [_digits(x) for x in answer["mce"]]}


def _digits(x: float) -> float:
    return float(f"{x:.{DIGITS}g}")


def frozen(seed: int, stored: dict) -> dict:
    """A table as the file has it: a check of how it was drawn, and the answers."""
    of, made = table(seed), {}
    for method, answers in stored["answers"].items():
        for name, before in answers.items():
            answer = rounded(result_of(method, name, of))
            # how far drawn ends may jump, which depends on the ratings alone
            answer |= {key: before[key] for key in ("steps",) if key in before}
            made.setdefault(method, {})[name] = answer
    return {"crc": checksum(of), "answers": made}


def checksum(of: Table) -> int:
    """A number that another table would not have."""
    drawn = of.rows, of.categories, of.weights, of.level, of.clusters
    return zlib.crc32(repr(drawn).encode())


def load_tables(*, tenth_alone: bool = False) -> dict[str, dict]:
    """Every table as stored, or the tenth; none if nothing is."""
    tenth: dict = load(f"{GROUP}-tenth")
    return (
        tenth if tenth_alone else dict(sorted((tenth | load(f"{GROUP}-rest")).items()))
    )


def save_tables(made: dict[str, dict]) -> int:
    """Store every table; their size in bytes."""
    tenth = {key: of for key, of in made.items() if int(key) in TENTH}
    rest = {key: of for key, of in made.items() if key not in tenth}
    return save(f"{GROUP}-tenth", tenth) + save(f"{GROUP}-rest", rest)


def replayed(stored: dict[str, dict], *, draws_differ: bool = False) -> Replay:
    """What differs of some tables, and how many of their ends were drawn."""
    found, n_drawn = [], 0
    for seed, frozen_table in stored.items():
        of = table(int(seed))
        if checksum(of) != frozen_table["crc"]:
            raise ValueError(f"table {seed} is drawn otherwise than the stored one")
        for method, answers in frozen_table["answers"].items():
            for name, answer in answers.items():
                found += changes(
                    *(GROUP, answer, rounded(result_of(method, name, of))),
                    where=f"/{seed}/{method}/{name}",
                    has_gaps=of.has_gaps,
                    draws_differ=draws_differ,
                )
                n_drawn += len(answer.get("mce", ()))
    return found, n_drawn


def by_two(work: Callable[..., Any], *arguments: Iterable[Any]) -> list[Any]:
    """What a function makes of every table, on two processes."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        return list(pool.map(work, *arguments, chunksize=20))


def compared_by_two(stored: dict[str, dict]) -> Replay:
    """Replay all tables, on two processes."""
    made = by_two(replayed, [{seed: of} for seed, of in stored.items()])
    return [change for part, _ in made for change in part], sum(n for _, n in made)


def freeze(stored: dict[str, dict]) -> dict[str, dict]:
    """Every table anew: the same coefficients by the same methods."""
    made = by_two(frozen, map(int, stored), stored.values())
    return dict(zip(stored, made, strict=True))
