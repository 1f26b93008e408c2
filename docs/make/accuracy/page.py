"""The page of accuracy: every number on it comes from the lines measured."""

import math
import string
import textwrap
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from docs.make.accuracy import cells
from docs.make.accuracy.peers import PACKAGES
from masrel.agreement import COEFFICIENTS
from tests.accuracy.cases import METRICS

if TYPE_CHECKING:
    from docs.make.accuracy.__main__ import Line, Off

Lines = Sequence["Line"]

NEAREST = 0.5  # ulp
_TEMPLATE = Path(__file__).with_name("page_template.md")
_WHY = {
    "Ordinary tables": "No trap: tables as studies have them.",
    "Counts up to 10¹⁵": "Squares of counts pass 2⁵³, from where floats leave out "
    "whole numbers, and 2⁶³, from where 64-bit integers wrap around.",
    "Chance agreement near 1": "κ is a ratio of two differences of numbers that agree "
    "in up to 15 digits.",
    "κ near 0": "Observed and chance agreement agree in up to 13 digits.",
    "κ near 1": "The value is safe; its standard error is what is left of terms that "
    "cancel.",
    "Ten million items, few disagreements": "Sums over very many equal items hide the "
    "few that matter.",
    "Many categories": "Most categories are rare, and sums have many terms.",
    "Missing ratings": "Items have different numbers of ratings, so that sums have "
    "many denominators.",
    "Weights": "Some weights are irrational, and one scale is unequally spaced. A cell "
    "holds the largest error over seven weights, or four metrics of α; “of 2”: only "
    "so many of them are offered.",
    "Undefined or nearly": "0/0 should be `nan`, and nothing else should; a single "
    "item has a value and no standard error.",
}


def page(lines: Lines, versions: Mapping[str, str]) -> str:
    """Write the page in Markdown."""
    groups = groupby(lines, key=lambda line: line.case.group)
    return string.Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        versions=textwrap.fill(
            ", ".join(f"{name} {version}" for name, version in versions.items()), 118
        ),
        tally=_tally(lines),
        worst=_worst(lines),
        groups="\n\n".join(
            f"### {group}\n\n{textwrap.fill(_WHY[group], 118)}\n\n"
            f"{_of_group(list(of_group))}"
            for group, of_group in groups
        ),
        **_seen(lines),
    )


def _seen(lines: Lines) -> dict[str, str]:
    defined = [line for line in lines if line.true.value is not None]
    undefined = [line for line in lines if line.true.value is None]
    ours = [line.values["masrel"] for line in defined]
    away = [
        off.relative * abs(float(line.true.value or 0.0)) + (off.absolute or 0.0)
        for line, off in zip(defined, ours, strict=True)
        if not off.note
    ]
    nearest = sum(off.absolute == 0 or off.units <= NEAREST for off in ours)
    worst = max(lines, key=_error)
    return {
        "n_values": str(len(ours)),
        "n_nearest": str(nearest),
        "largest_value": cells.power(max(away)),
        "largest_error": cells.power(_error(worst)),
        "where": f"{_title(worst)}, {worst.case.name}",
        "ordinary": cells.units(_largest_of_others(lines)),
        "n_undefined": str(len(undefined)),
        "n_reasons": str(sum(line.has_reason for line in undefined)),
        "n_missed": str(sum(off.note != "" for off in ours)),
    }


def _error(line: "Line") -> float:
    # of masrel's standard error; 0 where there is none, infinite in place of 0
    off = line.errors["masrel"]
    if off.absolute is not None:
        return math.inf if off.absolute else 0.0
    return 0.0 if off.note else off.relative


def _largest_of_others(lines: Lines) -> float:
    # in ulp, of values of ordinary tables
    return max(
        off.units
        for line in lines
        if line.case.group == lines[0].case.group
        for package, off in line.values.items()
        if package != "masrel" and not off.note
    )


def _title(line: "Line") -> str:
    return COEFFICIENTS[line.coefficient].title


def _offering(lines: Lines, what: str) -> list[str]:
    # packages that offer any of it, ours first
    return [
        package
        for package in ("masrel", *PACKAGES)
        if package in lines[0].values
        and any(line.off(what)[package].is_offered for line in lines)
    ]


_MISSES = ("no answer", "crash, nan")
_BOUNDS = {"≤ 4 ulp": 4.0, "≤ 10⁴ ulp": 1e4, "≤ 10⁸ ulp": 1e8, "more": math.inf}


def _tally(lines: Lines) -> str:
    rows = []
    for what in ("value", "standard error"):
        defined = [line for line in lines if line.exact(what) is not None]
        for package in _offering(lines, what):
            offs = [line.off(what)[package] for line in defined]
            offs = [off for off in offs if off.is_offered and off.is_comparable]
            met = [_bound(off) for off in offs]
            counts = [met.count(name) for name in (*_BOUNDS, *_MISSES)]
            shown = [str(n) if n else "" for n in counts]
            rows.append([what, package, str(len(offs)), *shown])
    return cells.table(["", "package", "asked", *_BOUNDS, *_MISSES], rows, n_text=2)


def _bound(off: "Off") -> str:
    if off.note:
        return _MISSES[0] if off.is_unasked else _MISSES[1]
    # in place of an exact 0: in units of a number near 1
    units = off.units if off.absolute is None else off.absolute / math.ulp(0.5)
    return next(name for name, most in _BOUNDS.items() if units <= most)


def _worst(lines: Lines) -> str:
    rows = []
    packages = _offering(lines, "value")
    for what in ("value", "standard error"):
        for name in dict.fromkeys(line.coefficient for line in lines):
            of_name = [line for line in lines if line.coefficient == name]
            largest = [_largest(of_name, package, what) for package in packages]
            rows.append([what, COEFFICIENTS[name].title, *largest])
    return cells.table(["", "coefficient", *packages], rows, n_text=2)


def _largest(lines: Lines, package: str, what: str) -> str:
    offs = [line.off(what)[package] for line in lines]
    known = [off for off in offs if not off.note and off.absolute is None]
    return cells.both(max(known, key=lambda off: off.relative)) if known else "–"


def _of_group(lines: Lines) -> str:
    letters = dict(
        zip(
            dict.fromkeys(line.case.name for line in lines),
            string.ascii_lowercase,
            strict=False,
        )
    )
    cases = "\n".join(f"- {letter}: {name}" for name, letter in letters.items())
    packages, with_error = (_offering(lines, w) for w in ("value", "standard error"))
    head = ["", "coefficient", *packages, *(f"SE {p}" for p in with_error)]
    weighted = len(lines[0].case.weights) > 1  # a row is of several coefficients
    if not weighted:
        head.insert(2, "exact")
    rows, last = [], ""
    for (case, title), of_row in _alike(lines).items():
        row = ["" if case == last else letters[case], title]
        row += [] if weighted else [cells.exact(of_row[0].true.value)]
        for packages_of, what in ((packages, "value"), (with_error, "standard error")):
            for package in packages_of:
                offs = [line.off(what)[package] for line in of_row]
                row.append(cells.error(offs, relative=what != "value"))
        rows.append(row)
        last = case
    return f"{cases}\n\n{cells.table(head, rows, n_text=2)}"


def _alike(lines: Lines) -> "dict[tuple[str, str], list[Line]]":
    # a case's lines of one coefficient, with all weights or all metrics
    rows: dict[tuple[str, str], list[Line]] = {}
    for line in lines:
        several, title = len(line.case.weights) > 1, _title(line)
        if several and line.weights in METRICS:
            title += ", metrics"
        rows.setdefault((line.case.name, title), []).append(line)
    return rows
