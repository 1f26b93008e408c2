"""Golden numbers of 2 000 tables: every coefficient, and intervals by all methods.

The file says by name what was computed of every table: a coefficient that is added
later is in none of them, and shifts none.
"""

import math
import zlib
from bisect import bisect
from collections.abc import Collection, Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import accumulate
from multiprocessing import get_context

from tests.golden.adapter import Table, drawn_values, result_of
from tests.golden.call import Stream
from tests.golden.compare import Change
from tests.golden.drawn import pick, shares_of
from tests.golden.may_differ import MOST_ERRORS, Question, differences
from tests.golden.store import load, save

N_TABLES = 2000

GROUP = "numbers"

TENTH = range(5, N_TABLES, 10)
"""Tables that every run of the tests computes, in a file of their own."""

NAMED = (
    "identity", "linear", "quadratic", "ordinal", "radical", "ratio", "circular",
    "bipolar",
)  # fmt: skip

LEVELS = [0.8, 0.8, 0.9, 0.9, 0.95, 0.95, 0.95, 0.99]

OTHER_SEEDS = tuple(range(1_000_001, 1_000_005))
"""By which it is seen how far drawn ends may jump, where nothing else says it."""

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


def frozen(seed: int, plan: dict[str, Collection[str]]) -> dict:
    """A table as the file has it: a check of how it was drawn, and the answers."""
    of, made = table(seed), {}
    for method, name in ((m, name) for m, names in plan.items() for name in names):
        try:
            answer = rounded(result_of(method, name, of))
            if "mce" in answer and method.startswith("bootstrap"):
                answer |= _steps(method, name, of, answer)
        except Exception as error:  # noqa: BLE001 - a fault is no golden result
            print(f"left out: table {seed}, {method}, {name}: {error!r}")
            continue
        made.setdefault(method, {})[name] = answer
    return {"crc": checksum(of), "answers": made}


def _steps(method: str, name: str, of: Table, answer: dict) -> dict[str, list[float]]:
    """How far apart the values next to drawn ends are, where errors do not cover it.

    Few values are possible there, so that the error of a quantile is 0 or says little.
    """
    ends = answer["low"], answer["high"]
    drawn = drawn_values(method, name, of)
    if drawn is None:  # of ratios, which are none of the coefficient's values
        others = [result_of(method, name, of, seed) for seed in OTHER_SEEDS]
        steps = [
            2.0 * max(abs(other.get(key, end) - end) for other in others)
            for key, end in zip(("low", "high"), ends, strict=True)
        ]
    else:
        steps = [_step(drawn, end) for end in ends]
    covered = MOST_ERRORS * math.sqrt(2.0)  # as both ends have an error
    pairs = zip(steps, answer["mce"], strict=True)
    if not any(step > covered * error for step, error in pairs):
        return {}
    return {"steps": [float(f"{1.001 * step:.4g}") for step in steps]}


def _step(values: list[float], end: float) -> float:
    """How far an end moves with two errors of its rank, and at least to a neighbour."""
    n, rounding = len(values), 1e-8 * (1.0 + abs(end))
    lower, upper = bisect(values, end - rounding), bisect(values, end + rounding)
    reach = 3 + round(2.0 * math.sqrt(lower * (n - lower) / n))
    first = min(lower - 1, (lower + upper) // 2 - reach)
    last = max(upper, (lower + upper) // 2 + reach)
    near = values[max(first, 0)], values[min(last, n - 1)]
    return max(abs(end - value) for value in near)


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


def freeze(stored: dict[str, dict]) -> dict[str, dict]:
    """Every table anew on two processes: the same coefficients by the same methods."""
    plans = [of["answers"] for of in stored.values()]
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        made = pool.map(frozen, range(N_TABLES), plans, chunksize=20)
        return {f"{seed:04}": of for seed, of in enumerate(made)}


def replayed(stored: dict[str, dict]) -> Iterator[tuple[Question, dict, dict]]:
    """Every stored answer of some tables, with the result of today."""
    for seed, frozen_table in stored.items():
        of = table(int(seed))
        if checksum(of) != frozen_table["crc"]:
            raise ValueError(f"table {seed} is drawn otherwise than the stored one")
        for method, answers in frozen_table["answers"].items():
            for name, answer in answers.items():
                question = Question(
                    f"{seed}/{method}/{name}", method, name, of.has_gaps
                )
                yield question, answer, rounded(result_of(method, name, of))


def compared(
    stored: dict[str, dict], *, draws_differ: bool = False
) -> tuple[list[Change], int]:
    """What differs of some tables, and how many of their ends were drawn."""
    changes, n_drawn = [], 0
    for question, answer, new in replayed(stored):
        changes += differences(question, answer, new, draws_differ=draws_differ)
        n_drawn += len(answer.get("mce", ()))
    return changes, n_drawn


def compared_by_two(stored: dict[str, dict]) -> tuple[list[Change], int]:
    """The same of all tables, on two processes."""
    parts = [{seed: of} for seed, of in stored.items()]
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        made = list(pool.map(compared, parts, chunksize=20))
    return [change for part, _ in made for change in part], sum(n for _, n in made)
