"""What the page of accuracy says of the numbers compared, and their rows."""

import math
from collections.abc import Iterator, Mapping, Sequence

from docs.make import evidence
from docs.make.accuracy.numbers import QUANTITIES, Number
from docs.make.accuracy.peers import PACKAGES
from masrel.agreement import COEFFICIENTS

_NEAREST = 0.5  # ulp
_MISSES = ("no answer", "crash, nan")
_BOUNDS = {"≤ 4 ulp": 4.0, "≤ 10⁴ ulp": 1e4, "≤ 10⁸ ulp": 1e8, "more": math.inf}


def rows(numbers: Sequence[Number]) -> Iterator[dict[str, object]]:
    """Yield a row a number that a package offers."""
    for of in numbers:
        if of.is_offered:
            yield {
                "group": of.case.group,
                "case": of.case.name,
                "coefficient": of.coefficient,
                "weights": of.weights,
                "number": of.what,
                "exact": "0/0" if of.exact is None else float(of.exact),
                "package": of.package,
                "ulp": of.units,
                "relative": of.relative,
                "in place of 0": of.absolute,
                "note": of.note,
            }


def summary(numbers: Sequence[Number], versions: Mapping[str, str]) -> str:
    """Return the versions, what is seen of masrel, and the tally of all packages."""
    ours = [of for of in numbers if of.package == "masrel"]
    values = [of for of in ours if of.what == "value" and of.exact is not None]
    undefined = [of for of in ours if of.what == "value" and of.exact is None]
    nearest = sum(of.absolute == 0 or of.units <= _NEAREST for of in values)
    farthest = max(
        abs(of.relative * float(of.exact)) if of.absolute is None else of.absolute
        for of in values
        if not of.note
    )
    worst = max((of for of in ours if of.what == "standard error"), key=_error)
    title = COEFFICIENTS[worst.coefficient].title
    n_reasons = sum(of.note == "nan" and of.has_reason for of in undefined)
    head = ["", "package", "asked", *_BOUNDS, *_MISSES]
    programs = ", ".join(f"{name} {version}" for name, version in versions.items())
    seen = [
        f"{nearest} of {len(values)} values of masrel are the float nearest to the "
        f"exact number; the farthest is off by {farthest:.0e}.",
        f"The largest relative error of a standard error of masrel is "
        f"{_error(worst):.0e} ({title}, {worst.case.name}).",
        f"Of {len(undefined)} coefficients that are 0/0 masrel gives `nan` with the "
        f"reason for {n_reasons}.",
    ]
    counts = evidence.table(head, list(_tally(numbers)), n_text=2)
    return "\n".join(f"- {text}" for text in seen) + f"\n\n{counts}\n\n{programs}."


def _error(of: Number) -> float:
    # 0 where there is none, infinite in place of 0
    if of.absolute is not None:
        return math.inf if of.absolute else 0.0
    return 0.0 if of.note else of.relative


def _tally(numbers: Sequence[Number]) -> Iterator[list[object]]:
    for what in QUANTITIES:
        for package in ("masrel", *PACKAGES):
            kind = what, package
            met = [
                _bound(of)
                for of in numbers
                if (of.what, of.package) == kind and of.counts
            ]
            counts = [met.count(name) or "" for name in (*_BOUNDS, *_MISSES)]
            if met:
                yield [what, package, len(met), *counts]


def _bound(of: Number) -> str:
    if of.note:
        return _MISSES[0] if of.is_unasked else _MISSES[1]
    # in place of an exact 0: in units of a number near 1
    units = of.units if of.absolute is None else of.absolute / math.ulp(0.5)
    return next(name for name, most in _BOUNDS.items() if units <= most)
