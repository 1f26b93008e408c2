"""How far golden numbers may be off, and what may differ later, by name.

To let something differ, add its name to `IN_FORCE`, in the commit that changes it.
"""

import math
import re
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass

from tests.golden.compare import NUMBER, Change, Kind

IN_FORCE: tuple[str, ...] = ()
"""Names of `EXCEPTIONS`: none, as all that differed is stored anew."""

EXCEPTIONS = {
    "order of notes": "notes come in another order",
    "wording": "notes, reasons and methods are worded otherwise: their `KINDS` stay",
    "seeded draws": "the same seed draws other numbers, and fewer or more resamples "
    "are taken one by one: ends are within their Monte Carlo errors",
}
"""What may differ and why."""

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

KINDS = {
    # notes
    "few": r"(\d+) (item|rater|cluster)s?\b.*: below (\d+)",
    "chosen: few": r"chosen for other (.+): few items \((\d+)\)",
    "chosen: rare": r"chosen for other (.+): categories are rare \((\d+)",
    "chosen: still": r"chosen for other (.+): leaving any out says next to nothing",
    "chosen": r"chosen for other (.+): (items|raters|what items|the spread|one|no|too)",
    "chosen: clusters": r"chosen for other clusters",
    "cut": r"cut at the ends? of the parameter space",
    "undefined resamples": r"undefined, and left out",
    "single ratings": r"left out, items of a single rating: (\d+)",
    "lifted": r"is lifted halfway",
    "extended": r"is extended from",
    "careless": r"careless raters are not covered",
    "held": r"ordinal metric, which depends .*, was taken from all ratings once",
    "prior": r"so the prior weighs|rests on the prior, too",
    "one value": r"both ends are one value",
    "infinite": r"studentized values are infinite",
    "pairs drawn": r"pairs of values are drawn",
    "mean of k": r"k is the (\d+) raters",
    "REML": r"variances by REML",
    "drawn out": r"its interval is drawn out to the value",
    "asked for": r"asked for other (.+): there is this interval",
    # reasons
    "chance is 1": r"chance agreement is 1",
    "scale of one": r"a scale of one category|one category is declared",
    "rater of one": r"one category is all of the raters in columns (\d+) and (\d+)",
    "all the same": r"all ratings are the same|neither items nor ratings .* differ",
    "rater of one grade": r"every rater gives all items one rating",
    "only raters vary": r"no variance but between raters",
    "ratio of 0": r"ratio weights divide|no such weights",
    "no variance": r"the total variance is estimated as",
    "one resample": r"every resample gives the same value",
    "few complete": r"fewer than (two|three) items",
    "few raters": r"fewer than two raters|too few ratings",
    "nothing moves": r"leaves the (estimate|difference) as it is|no item moves the",
    "never differ": r"never differ, or always",
    "undefined": r"the estimate itself is undefined",
    "undefined without": r"one (?:of the )?(item|rater|cluster)s? left out",
    "no pair": r"no item has (?:both|two|ratings)",
    "one item": r"one item with",
    "one cluster": r"one cluster has no",
    "no error": r"no standard error to studentize|no error: fewer",
    "few units": r"need(?:s)? at least (\d+)",
    "one side": r"one side of the estimate",
    "at an end": r"not inside the ends",
    "degrees": r"Satterthwaite's degrees",
}  # fmt: skip
"""Kinds of notes and reasons: by which words each is known, as it is worded today.

What a pattern has in brackets is a part of the kind. Where the package has kinds of its
own, `adapter` may word them by these.
"""

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
    question: Question, stored: dict, new: dict, in_force: Collection[str] = IN_FORCE
) -> list[Change]:
    """Every number and text that is not what is stored; `within` where it may be."""
    return list(_walk(question, stored, new, in_force))


def beyond(changes: list[Change], n_drawn: int) -> list[Change]:
    """Those that are too many: all not within, and drawn ends but one in a thousand."""
    far = [c for c in changes if isinstance(c, DrawnEnd) and not c.within]
    never = [c for c in far if c.errors > NEVER_ERRORS]
    wrong = [c for c in changes if not isinstance(c, DrawnEnd) and not c.within]
    return wrong + (far if len(far) > max(1, n_drawn // ONE_OF) else never)


def _walk(
    question: Question, stored: dict, new: dict, in_force: Collection[str]
) -> Iterator[Change]:
    compared = (stored.keys() | new.keys()) - {"steps", "near_1"}
    is_drawn = "seeded draws" in in_force and "mce" in compared
    if is_drawn:
        if "low" in compared:
            yield from _drawn_ends(question, stored, new)
        compared -= {"low", "high", "median", "mce", "n_resamples", "n_undefined"}
        compared -= {"method"}  # which says how many were drawn, or that all were taken
    for key in sorted(compared):
        one, other = stored.get(key), new.get(key)
        if key not in ("notes", "reason", "why", "method"):
            yield from _numbers(question, key, one, other, stored)
        elif not _reads_alike(key, one, other, in_force, is_drawn):
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


def _reads_alike(
    key: str, stored: object, new: object, in_force: Collection[str], drawn: bool
) -> bool:
    texts = [[of] if isinstance(of, str) else list(of or ()) for of in (stored, new)]
    if drawn:
        texts = [[of for of in notes if not _is_of_draws(of)] for notes in texts]
    if "wording" in in_force:
        if key == "method":
            return True
        one, other = (Counter(map(kind_of, of)) for of in texts)
        return one == other
    if "order of notes" in in_force or drawn:
        texts = [sorted(of) for of in texts]
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


def kind_of(text: str) -> tuple[str, ...]:
    """What kind of note or reason it is, and whom or how many it is about."""
    for kind, words in KINDS.items():
        if match := re.search(words, text):
            return (kind, *(part for part in match.groups() if part))
    return (NUMBER.sub("#", text),)
