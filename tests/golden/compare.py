"""Compare two results, bit for bit or to bars, number by number."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

__all__ = ["MOST_ERRORS", "Change", "beyond", "changes"]

Kind = Literal[
    "value", "standard_error", "interval end", "event", "torque", "other", "text"
]

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.]*\w)")

TABLES = "numbers"
"""The group of 2 000 tables, whose keys are short and whose ends may be drawn."""

COEFFICIENTS = (
    "agreement", "intervals", "agree", "analyze", "demo", "transcripts",
)  # fmt: skip
"""Groups whose values are coefficients, good to some ulp."""

SAMPLED = ("latent",)
"""Groups of Markov chains, which one last bit sends elsewhere."""

KINDS: dict[str, Kind] = {
    **dict.fromkeys(("value", "observed", "chance"), "value"),
    **dict.fromkeys(("low", "high"), "interval end"),
    **dict.fromkeys(("start_s", "end_s"), "event"),
    "standard_error": "standard_error",
}
"""What a number is by its key; of `TABLES`, all else is read off a distribution."""

KINDS_OF_TABLES: dict[str, Kind] = {
    **dict.fromkeys(("value", "values"), "value"),
    **dict.fromkeys(("error", "errors"), "standard_error"),
}

MEASUREMENTS = re.compile("icc_|sem|mdc|lin_ccc|kendall_w|robinson_a")
"""Made of sums of squares, which are rounded; with gaps, of a likelihood."""

MOST_ERRORS, NEVER_ERRORS, ONE_OF = 4.0, 6.0, 1000
"""Joint Monte Carlo errors that one in so many drawn ends may be off, and none."""

OF_DRAWS = (
    "interval was cut at",
    "standard error of 0",
    "the same value",
    "and left out",
)
"""Words of notes that come and go with what is drawn."""

DRAWN_KEYS = ("low", "high", "median", "mce", "n_resamples", "n_undefined", "method")
"""What is drawn, and the method, which says how many were or that all were taken."""


@dataclass(frozen=True, slots=True)
class Change:
    """A place where a result differs from what is stored."""

    where: str
    kind: Kind
    stored: object
    new: object
    within: bool = False  # the bar of its kind
    errors: float | None = None  # by how many joint errors a drawn end is off

    def __str__(self) -> str:
        return f"{self.where} ({self.kind}): {self.stored!r} stored, {self.new!r} now"

    @property
    def is_number(self) -> bool:
        """Whether both are numbers, so that their distance says something."""
        both = (self.stored, self.new)
        return all(isinstance(x, int | float) and math.isfinite(x) for x in both)

    @property
    def absolute(self) -> float:
        return abs(self.new - self.stored)  # type: ignore[operator]

    @property
    def relative(self) -> float:
        most = max(abs(self.stored), abs(self.new))  # type: ignore[arg-type]
        return self.absolute / most if most else 0.0


def changes(
    group: str,
    stored: object,
    new: object,
    *,
    where: str = "",
    has_gaps: bool = False,
    draws_differ: bool = False,
) -> list[Change]:
    """Every difference, of the bits; `within` says whether its bar holds still.

    Where draws differ, the same seed draws other numbers: ends of tables are within
    their Monte Carlo errors.
    """
    peak = max((abs(x) for x in _torques(stored)), default=0.0)
    place = _Place(group, where, {}, peak, has_gaps, draws_differ)
    return list(_walk(place, stored, new))


def beyond(changes: list[Change], n_drawn: int) -> list[Change]:
    """Those that are too many: all not within, and drawn ends but one in a thousand."""
    wrong = [c for c in changes if not c.within and c.errors is None]
    far = [c for c in changes if not c.within and c.errors is not None]
    never = [c for c in far if c.errors > NEVER_ERRORS]  # type: ignore[operator]
    return wrong + (far if len(far) > max(1, n_drawn // ONE_OF) else never)


@dataclass(frozen=True, slots=True)
class _Place:
    group: str
    path: str
    around: dict  # the stored dictionary that the number is in
    peak: float
    has_gaps: bool
    draws_differ: bool

    def at(self, key: object, around: dict | None = None) -> "_Place":
        path = f"{self.path}/{key}"
        return replace(self, path=path, around=around or self.around)

    @property
    def kind(self) -> Kind:
        key = next(k for k in reversed(self.path.split("/")) if not k.isdigit())
        if self.group == TABLES:
            return KINDS_OF_TABLES.get(key, "interval end")
        if "torque" in key and "nms" not in key:
            return "torque"
        kind = KINDS.get(key, "other")
        return "other" if kind == "value" and self.group not in COEFFICIENTS else kind

    @property
    def is_drawn(self) -> bool:
        """Whether it is of an answer whose ends are drawn, and not as they were."""
        return self.draws_differ and "mce" in self.around


def _walk(place: _Place, stored: object, new: object) -> Iterator[Change]:
    if isinstance(stored, dict) and isinstance(new, dict):
        yield from _parts(place, stored, new)
    elif isinstance(stored, list) and isinstance(new, list):
        if place.is_drawn and place.path.endswith("/notes"):
            stored, new = (sorted(filter(_says_more, of)) for of in (stored, new))
        if len(stored) != len(new):
            yield Change(place.path + "/length", "text", len(stored), len(new))
        for k, parts in enumerate(zip(stored, new, strict=False)):
            yield from _walk(place.at(k), *parts)
    elif isinstance(stored, str) and isinstance(new, str):
        yield from _texts(place, stored, new)
    elif type(stored) is not type(new):
        yield Change(place.path, place.kind, stored, new)
    elif repr(stored) != repr(new):  # of floats, every bit; nan is nan
        yield Change(place.path, place.kind, stored, new, _within(place, stored, new))


def _says_more(note: str) -> bool:
    return not any(words in note for words in OF_DRAWS)


def _parts(place: _Place, stored: dict, new: dict) -> Iterator[Change]:
    # keys of one alone; or all, where only their order differs
    ignored = ("steps", "near_1") if place.group == TABLES else ()
    if place.draws_differ and "mce" in stored:
        yield from _drawn_ends(place, stored, new)
        ignored += DRAWN_KEYS
        stored, new = ({"notes": [], **of} for of in (stored, new))
    keys, others = ([key for key in of if key not in ignored] for of in (stored, new))
    gone = [key for key in keys if key not in others]
    come = [key for key in others if key not in keys]
    if gone or come:
        yield Change(place.path + "/keys", "text", gone, come)
    elif keys != others:
        yield Change(place.path + "/keys", "text", keys, others)
    for key in [key for key in keys if key in new]:
        yield from _walk(place.at(key, stored), stored[key], new[key])


def _drawn_ends(place: _Place, stored: dict, new: dict) -> Iterator[Change]:
    """Ends that are farther than their joint Monte Carlo error lets them be."""
    for k, key in enumerate(("low", "high")):
        one, other = stored.get(key, math.nan), new.get(key, math.nan)
        where = f"{place.path}/{key}"
        if math.isnan(one) or math.isnan(other):
            if math.isnan(one) != math.isnan(other):
                yield Change(where, "interval end", one, other)
            continue
        off = abs(one - other)
        joint = math.hypot(*(of.get("mce", (0.0, 0.0))[k] for of in (stored, new)))
        step = stored.get("steps", (0.0, 0.0))[k]
        if off > max(step, 1e-8 * (1.0 + abs(one))):
            n = off / joint if joint > 0.0 else math.inf
            yield Change(where, "interval end", one, other, n <= MOST_ERRORS, n)


def _texts(place: _Place, stored: str, new: str) -> Iterator[Change]:
    # line by line; numbers in a text may move as far as their bar lets them
    is_hash = "sha256" in place.path
    lines, others = stored.splitlines(), new.splitlines()
    if is_hash or len(lines) != len(others):
        if stored != new:
            yield Change(place.path, "text", stored, new, is_hash)
        return
    for k, (line, other) in enumerate(zip(lines, others, strict=True), 1):
        if line != other:
            where = f"{place.path}, line {k}" if len(lines) > 1 else place.path
            yield Change(where, "text", line, other, _reads_alike(place, line, other))
    if lines == others and stored != new:
        yield Change(f"{place.path}, ends of lines", "text", stored, new)


def _reads_alike(place: _Place, stored: str, new: str) -> bool:
    if NUMBER.sub("#", stored) != NUMBER.sub("#", new):
        return False
    pairs = zip(NUMBER.findall(stored), NUMBER.findall(new), strict=True)
    if place.group in SAMPLED:
        return True
    if place.group == TABLES:
        # three decimals: the last one of what was rounded, or all of what was drawn
        return all(
            a == b
            or ("." in a and (place.is_drawn or abs(float(a) - float(b)) < 1.1e-3))
            for a, b in pairs
        )
    return all(math.isclose(float(a), float(b), rel_tol=1e-9) for a, b in pairs)


def _within(place: _Place, stored: object, new: object) -> bool:
    if isinstance(stored, bool) or not isinstance(stored, float):
        return False
    if not (math.isfinite(stored) and math.isfinite(new)):  # type: ignore[arg-type]
        return False
    a, b = stored, float(new)  # type: ignore[arg-type]
    if place.group in SAMPLED or "/monte_carlo_error/" in place.path:
        return True  # the error of a quantile jumps where resamples all but tie
    return abs(a - b) <= _bar(place, max(abs(a), abs(b)))


def _bar(place: _Place, size: float) -> float:
    """How far a number of this size may be off."""
    if place.kind == "event":
        return 1e-11
    if place.kind == "torque":
        return 1e-12 * place.peak
    if place.group == TABLES:
        least = 1e-3 if place.kind == "standard_error" else 1.0
        return _share_of_tables(place) * (size + least)
    if place.kind == "value":
        return 1e-12 * size if "/icc_" in place.path else 1e-14 * (1.0 + size)
    if place.kind == "standard_error":
        chance = place.around.get("chance")
        near_one = isinstance(chance, float) and 1.0 - chance < 1e-6
        if place.group == "fit":
            return 1e-10 * size  # nearly collinear: other processors differ by 1e-11
        return (1e-9 if near_one else 1e-12) * size
    # what is 0 but for rounding has no digits
    return 1e-9 * max(size, 1e-3 if place.kind == "interval end" else 1e-6)


def _share_of_tables(place: _Place) -> float:
    _, _, method, coefficient, *_ = place.path.split("/")
    is_measured = MEASUREMENTS.match(coefficient) is not None
    if place.kind == "interval end" and method == "differences max_t":
        return 1e-7  # its quantile is summed over a lattice, which rounding turns
    if is_measured and place.has_gaps:
        return 1e-8  # a likelihood is flat at its top, and Newton stops below it
    if place.kind == "interval end":
        return 1e-8 if "mce" in place.around else 1e-9  # of draws nine digits are kept
    if "near_1" in place.around:
        return 1e-8  # 1 - p_e < 1e-6, by which both are divided
    if place.kind == "standard_error" or is_measured:
        return 1e-12
    return 1e-14  # κ is 1 less a ratio, and has the rounding of both


def _torques(stored: object, path: str = "") -> Iterator[float]:
    if isinstance(stored, dict):
        for key, value in stored.items():
            yield from _torques(value, key)
    elif isinstance(stored, list):
        for value in stored:
            yield from _torques(value, path)
    elif isinstance(stored, float) and "torque" in path and math.isfinite(stored):
        yield stored
