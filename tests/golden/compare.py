"""Compare two results, bit for bit or to bars, number by number."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

__all__ = ["Change", "changes"]

Kind = Literal[
    "value", "standard_error", "interval end", "event", "torque", "other", "text"
]

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.]*\w)")

COEFFICIENTS = (
    "agreement", "intervals", "agree", "analyze", "demo", "transcripts",
)  # fmt: skip
"""Groups whose values are coefficients, good to some ulp."""

SAMPLED = ("latent",)
"""Groups of Markov chains, which one last bit sends elsewhere."""


@dataclass(frozen=True, slots=True)
class Change:
    """A place where a result differs from what is stored."""

    where: str
    kind: Kind
    stored: object
    new: object
    within: bool = False  # the bar of its kind

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


def changes(group: str, stored: object, new: object) -> list[Change]:
    """Every difference, of the bits; `within` says whether its bar holds still."""
    peak = max((abs(x) for x in _torques(stored)), default=0.0)
    return list(_walk(_Place(group, "", {}, peak), stored, new))


@dataclass(frozen=True, slots=True)
class _Place:
    group: str
    path: str
    around: dict  # the stored dictionary that the number is in
    peak: float

    def at(self, key: object, around: dict | None = None) -> "_Place":
        path = f"{self.path}/{key}"
        return _Place(self.group, path, around or self.around, self.peak)

    @property
    def kind(self) -> Kind:
        key = next(k for k in reversed(self.path.split("/")) if not k.isdigit())
        if key == "standard_error":
            return "standard_error"
        if key in ("low", "high"):
            return "interval end"
        if "torque" in key and "nms" not in key:
            return "torque"
        if key in ("start_s", "end_s"):
            return "event"
        if key in ("value", "observed", "chance"):
            return "value" if self.group in COEFFICIENTS else "other"
        return "other"


def _walk(place: _Place, stored: object, new: object) -> Iterator[Change]:
    if isinstance(stored, dict) and isinstance(new, dict):
        yield from _keys(place, list(stored), list(new))
        for key in [key for key in stored if key in new]:
            yield from _walk(place.at(key, stored), stored[key], new[key])
    elif isinstance(stored, list) and isinstance(new, list):
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


def _keys(place: _Place, stored: list[str], new: list[str]) -> Iterator[Change]:
    # those of one alone; or all, where only their order differs
    gone = [key for key in stored if key not in new]
    come = [key for key in new if key not in stored]
    if gone or come:
        yield Change(place.path + "/keys", "text", gone, come)
    elif stored != new:
        yield Change(place.path + "/keys", "text", stored, new)


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
    # how far a number of this size may be off
    if place.kind == "value":
        # of grades that are measurements there are sums of squares, which are rounded
        return 1e-12 * size if "/icc_" in place.path else 1e-14 * (1.0 + size)
    if place.kind == "standard_error":
        chance = place.around.get("chance")
        near_one = isinstance(chance, float) and 1.0 - chance < 1e-6
        return (1e-9 if near_one else 1e-12) * size
    if place.kind == "event":
        return 1e-11
    if place.kind == "torque":
        return 1e-12 * place.peak
    return 1e-9 * (max(size, 1e-3) if place.kind == "interval end" else size)


def _torques(stored: object, path: str = "") -> Iterator[float]:
    if isinstance(stored, dict):
        for key, value in stored.items():
            yield from _torques(value, key)
    elif isinstance(stored, list):
        for value in stored:
            yield from _torques(value, path)
    elif isinstance(stored, float) and "torque" in path and math.isfinite(stored):
        yield stored
