"""How far golden numbers may be off, and which drawn ends may be others."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from tests.golden.compare import NUMBER, Change, Kind

VALUE = 1e-14
"""Of 1 + |κ|: κ is 1 less a ratio, and has the rounding of both."""

MEASURED = 1e-12
"""The same of what is made of sums of squares, which are rounded: ICC, SEM, MDC …"""

FITTED = 1e-8
"""The same with gaps: a likelihood is flat at its top, and Newton stops below it."""

NEAR_1 = 1e-8
"""Of values and errors where 1 - p_e < 1e-6, by which they are divided."""

ERROR = 1e-12
"""Of a standard error and 0.001."""

END = 1e-9
"""Of 1 + |end|; the same for all else that is read off a distribution."""

DRAWN = 1e-8
"""Of 1 + |end|, drawn with the same seed: nine digits are stored."""

LATTICE = 1e-7
"""The same of the largest of several differences: its quantile is summed over a lattice
of directions, which rounding turns, and is itself right to some 1e-6."""

MOST_ERRORS, NEVER_ERRORS, ONE_OF = 4.0, 6.0, 1000
"""Joint Monte Carlo errors that one in so many drawn ends may be off, and none."""

MEASUREMENTS = re.compile("icc_|sem|mdc|lin_ccc|kendall_w|robinson_a")

OF_DRAWS = ("cut at the end", "standard error of 0", "one value", "and left out")
"""Words of notes that come and go with what is drawn."""


@dataclass(frozen=True, slots=True)
class Question:
    """Which result of which table is compared."""

    where: str
    method: str
    coefficient: str
    has_gaps: bool = False


@dataclass(frozen=True, slots=True)
class DrawnEnd(Change):
    """A drawn end that is not what it was, and by how many of its errors."""

    errors: float = 0.0


def differences(
    question: Question, stored: dict, new: dict, *, draws_differ: bool = False
) -> list[Change]:
    """Every number and text that is not what is stored; `within` where it may be.

    Where draws differ, the same seed draws other numbers: ends are within their Monte
    Carlo errors.
    """
    return list(_walk(question, stored, new, draws_differ))


def beyond(changes: list[Change], n_drawn: int) -> list[Change]:
    """Those that are too many: all not within, and drawn ends but one in a thousand."""
    far = [c for c in changes if isinstance(c, DrawnEnd) and not c.within]
    never = [c for c in far if c.errors > NEVER_ERRORS]
    wrong = [c for c in changes if not isinstance(c, DrawnEnd) and not c.within]
    return wrong + (far if len(far) > max(1, n_drawn // ONE_OF) else never)


def _walk(
    question: Question, stored: dict, new: dict, draws_differ: bool
) -> Iterator[Change]:
    compared = (stored.keys() | new.keys()) - {"steps", "near_1"}
    is_drawn = draws_differ and "mce" in compared
    if is_drawn:
        if "low" in compared:
            yield from _drawn_ends(question, stored, new)
        compared -= {"low", "high", "median", "mce", "n_resamples", "n_undefined"}
        compared -= {"method"}  # which says how many were drawn, or that all were taken
    for key in sorted(compared):
        one, other = stored.get(key), new.get(key)
        if key not in ("notes", "reason", "why", "method"):
            yield from _numbers(question, key, one, other, stored)
        elif not _reads_alike(one, other, is_drawn):
            yield Change(f"{question.where}/{key}", "text", one, other)


def _numbers(
    question: Question, key: str, stored: object, new: object, around: dict
) -> Iterator[Change]:
    where = f"{question.where}/{key}"
    if isinstance(stored, list) and isinstance(new, list) and len(stored) == len(new):
        for one, other in zip(stored, new, strict=True):
            yield from _numbers(question, key, one, other, around)
    elif not (isinstance(stored, float) and isinstance(new, float)):
        if stored != new:
            yield Change(where, "text", stored, new)
    elif repr(stored) != repr(new):
        kind, share, least = _bar(question, key, around)
        size = max(abs(stored), abs(new))
        is_within = math.isfinite(size) and abs(stored - new) <= share * (size + least)
        yield Change(where, kind, stored, new, is_within)


def _bar(question: Question, key: str, around: dict) -> tuple[Kind, float, float]:
    """What a number is, which share of it it may be off, and of which size at least."""
    is_measured = MEASUREMENTS.match(question.coefficient) is not None
    is_fitted = is_measured and question.has_gaps
    if key in ("error", "errors"):
        share = FITTED if is_fitted else NEAR_1 if "near_1" in around else ERROR
        return "standard_error", share, 1e-3
    if key in ("value", "values"):
        exact = MEASURED if is_measured else VALUE
        share = FITTED if is_fitted else NEAR_1 if "near_1" in around else exact
        return "value", share, 1.0
    if question.method == "differences max_t":
        return "interval end", LATTICE, 1.0
    share = FITTED if is_fitted else DRAWN if "mce" in around else END
    return "interval end", share, 1.0


def _drawn_ends(question: Question, stored: dict, new: dict) -> Iterator[Change]:
    """Ends that are farther than their joint Monte Carlo error lets them be."""
    for k, key in enumerate(("low", "high")):
        one, other = stored.get(key, math.nan), new.get(key, math.nan)
        where = f"{question.where}/{key}"
        if math.isnan(one) or math.isnan(other):
            if math.isnan(one) != math.isnan(other):
                yield Change(where, "interval end", one, other)
            continue
        off = abs(one - other)
        errors = (of.get("mce", (0.0, 0.0))[k] for of in (stored, new))
        joint = math.hypot(*errors)
        step = stored.get("steps", (0.0, 0.0))[k]
        if off <= max(step, DRAWN * (1.0 + abs(one))):
            continue
        n = off / joint if joint > 0.0 else math.inf
        yield DrawnEnd(where, "interval end", one, other, n <= MOST_ERRORS, n)


def _reads_alike(stored: object, new: object, drawn: bool) -> bool:
    texts = [[of] if isinstance(of, str) else list(of or ()) for of in (stored, new)]
    if drawn:
        texts = [sorted(of for of in notes if not _is_of_draws(of)) for notes in texts]
    if len(texts[0]) != len(texts[1]):
        return False
    return all(_text_alike(*pair, drawn) for pair in zip(*texts, strict=True))


def _is_of_draws(note: str) -> bool:
    return any(words in note for words in OF_DRAWS)


def _text_alike(one: str, other: str, drawn: bool) -> bool:
    if one == other:
        return True
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    # three decimals: the last one of what was rounded, or all of what was drawn
    return all(
        a == b or ("." in a and (drawn or abs(float(a) - float(b)) < 1.1e-3))
        for a, b in pairs
    )
