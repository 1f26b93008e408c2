"""What the page of accuracy says of the lines measured, and their rows."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from docs.make import evidence
from docs.make.accuracy.peers import PACKAGES
from masrel.agreement import COEFFICIENTS

if TYPE_CHECKING:
    from docs.make.accuracy.__main__ import Line, Off

Lines = Sequence["Line"]

QUANTITIES = ("value", "standard error")
_NEAREST = 0.5  # ulp
_MISSES = ("no answer", "crash, nan")
_BOUNDS = {"≤ 4 ulp": 4.0, "≤ 10⁴ ulp": 1e4, "≤ 10⁸ ulp": 1e8, "more": math.inf}


def rows(lines: Lines) -> Iterator[dict[str, object]]:
    """Yield a row a number that a package offers."""
    for line in lines:
        for what in QUANTITIES:
            exact = line.exact(what)
            for package, off in line.off(what).items():
                if off.is_offered:
                    yield {
                        "group": line.case.group,
                        "case": line.case.name,
                        "coefficient": line.coefficient,
                        "weights": line.weights,
                        "number": what,
                        "exact": "0/0" if exact is None else float(exact),
                        "package": package,
                        "ulp": off.units,
                        "relative": off.relative,
                        "in place of 0": "" if off.absolute is None else off.absolute,
                        "note": off.note,
                    }


def summary(lines: Lines, versions: Mapping[str, str]) -> str:
    """Return the versions, what is seen of masrel, and the tally of all packages."""
    defined = [line for line in lines if line.true.value is not None]
    undefined = [line for line in lines if line.true.value is None]
    ours = [line.values["masrel"] for line in defined]
    nearest = sum(off.absolute == 0 or off.units <= _NEAREST for off in ours)
    farthest = max(
        off.relative * abs(float(line.true.value or 0.0)) + (off.absolute or 0.0)
        for line, off in zip(defined, ours, strict=True)
        if not off.note
    )
    worst = max(lines, key=_error)
    title = COEFFICIENTS[worst.coefficient].title
    n_reasons = sum(line.has_reason for line in undefined)
    head = ["", "package", "asked", *_BOUNDS, *_MISSES]
    programs = ", ".join(f"{name} {version}" for name, version in versions.items())
    seen = [
        f"{nearest} of {len(ours)} values of masrel are the float nearest to the exact "
        f"number; the farthest is off by {farthest:.0e}.",
        f"The largest relative error of a standard error of masrel is "
        f"{_error(worst):.0e} ({title}, {worst.case.name}).",
        f"Of {len(undefined)} coefficients that are 0/0 masrel gives `nan` with the "
        f"reason for {n_reasons}.",
    ]
    counts = evidence.table(head, list(_tally(lines)), n_text=2)
    return "\n".join(f"- {text}" for text in seen) + f"\n\n{counts}\n\n{programs}."


def _error(line: "Line") -> float:
    # of masrel's standard error; 0 where there is none, infinite in place of 0
    off = line.errors["masrel"]
    if off.absolute is not None:
        return math.inf if off.absolute else 0.0
    return 0.0 if off.note else off.relative


def _tally(lines: Lines) -> Iterator[list[object]]:
    for what in QUANTITIES:
        defined = [line for line in lines if line.exact(what) is not None]
        for package in ("masrel", *PACKAGES):
            offs = [of.off(what)[package] for of in defined if package in of.off(what)]
            offs = [off for off in offs if off.is_offered and off.is_comparable]
            met = [_bound(off) for off in offs]
            counts = [met.count(name) or "" for name in (*_BOUNDS, *_MISSES)]
            if offs:
                yield [what, package, len(offs), *counts]


def _bound(off: "Off") -> str:
    if off.note:
        return _MISSES[0] if off.is_unasked else _MISSES[1]
    # in place of an exact 0: in units of a number near 1
    units = off.units if off.absolute is None else off.absolute / math.ulp(0.5)
    return next(name for name, most in _BOUNDS.items() if units <= most)
