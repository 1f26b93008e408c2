"""masrel and other packages beside exact fractions: how far is each number off?

``python -m docs.make.accuracy [--quiet]`` runs the cases of ``tests/accuracy``, which
takes some minutes, and writes ``accuracy.csv``, a part of ``accuracy.md`` in
``docs/evidence``, and the figure. Packages that are not installed are left out.
"""

import argparse
import math
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import mpmath
from tqdm import tqdm

import masrel
from docs.make.accuracy.peers import PACKAGES, Answer, ask, installed, offers_errors
from docs.make.evidence import EVIDENCE, FIGURES, write_part, write_rows
from tests.accuracy.cases import CASES, METRICS, Case
from tests.accuracy.exactness import relative
from tests.accuracy.reference import units_off
from tests.accuracy.scenes import Exact, estimate, exact, prepared


@dataclass(frozen=True)
class Off:
    """How far a number is off the exact one.

    Of an exact 0 there are no units and no relative error: `absolute` is the number
    found in its place.
    """

    units: float = math.nan
    relative: float = math.nan
    absolute: float | None = None
    note: str = ""

    @property
    def is_offered(self) -> bool:
        return self.note != "not offered"

    @property
    def is_comparable(self) -> bool:
        return self.note != "other formula"

    @property
    def is_unasked(self) -> bool:
        return self.note.startswith("no answer")

    @property
    def size(self) -> float:
        """What makes one error larger than another; that there is no number, most."""
        if self.note:
            return math.inf
        return self.relative if self.absolute is None else self.absolute


@dataclass(frozen=True)
class Line:
    """A coefficient of a case: the exact one, and how far each package is off."""

    case: Case
    coefficient: str
    weights: str
    true: Exact
    has_reason: bool  # masrel's nan
    values: dict[str, Off]
    errors: dict[str, Off]

    def off(self, what: str) -> dict[str, Off]:
        return self.values if what == "value" else self.errors

    def exact(self, what: str) -> Any:
        return self.true.value if what == "value" else self.true.standard_error


def off(number: float | None, true: Any) -> Off:
    """Compare a number with the exact one, None where that is undefined."""
    if number is None:
        return Off(note="not offered")
    if true is None or math.isnan(number):
        return Off(note="nan" if math.isnan(number) else f"gives {number:.3g}")
    if true == 0:
        return Off(absolute=abs(number))
    if isinstance(true, mpmath.mpf):
        units = float(abs(number - true)) / math.ulp(float(true))
    else:
        units = units_off(number, true)
        true = mpmath.mpf(true.numerator) / true.denominator
    return Off(units, relative(number, true))


def compare(case: Case, coefficient: str, weights: str, packages: list[str]) -> Line:
    """Ask masrel and every package, and hold them to the exact coefficient."""
    with mpmath.workdps(50):
        true = exact(case, coefficient, weights)
        ours = estimate(coefficient, weights, prepared(case))
        answers = {"masrel": Answer(ours.value, ours.standard_error)}
        answers |= {p: ask(p, case, coefficient, weights) for p in packages}
        values = {p: _off_value(answer, true) for p, answer in answers.items()}
        errors = {p: _off_error(answer, true, case) for p, answer in answers.items()}
        for package in packages:
            if not offers_errors(package, coefficient):
                errors[package] = Off(note="not offered")
    has_reason = math.isnan(ours.value) and bool(ours.reason)
    return Line(case, coefficient, weights, true, has_reason, values, errors)


def _off_value(answer: Answer, true: Exact) -> Off:
    return Off(note=answer.note) if answer.note else off(answer.value, true.value)


def _off_error(answer: Answer, true: Exact, case: Case) -> Off:
    if answer.note:
        return Off(note=answer.note.split(":")[0])  # the value says of what kind
    if answer.standard_error is None:
        return Off(note="not offered")
    if answer.other_error:
        return Off(note="other formula")
    error = true.standard_error
    if answer.over_n and error is not None:
        n = sum(item.times for item in case.items if item.pairs)
        error = error * mpmath.sqrt(mpmath.mpf(n - 1) / n)
    return off(answer.standard_error, error)


def parts(case: Case) -> Iterator[tuple[Case, str, str]]:
    """Pair a case with its coefficients and weights."""
    for weights in case.weights:
        for coefficient in case.coefficients:
            if weights not in METRICS or coefficient == "krippendorff_alpha":
                yield case, coefficient, weights


def main() -> None:
    """Run every case and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    quiet = parser.parse_args().quiet
    if not (packages := installed(list(PACKAGES))):
        parser.error(f"needs one to compare with: {', '.join(PACKAGES)}")
    work = [part for case in CASES for part in parts(case)]
    lines = []
    with tqdm(work, desc="accuracy", unit=" numbers", disable=quiet) as bar:
        for case, coefficient, weights in bar:
            bar.set_postfix_str(case.name)
            lines.append(compare(case, coefficient, weights, list(packages)))
    from docs.make.accuracy.figure import draw
    from docs.make.accuracy.page import rows, summary

    versions = {"masrel": masrel.__version__, **packages}
    versions |= installed(["numpy", "scipy", "pandas", "mpmath"])
    versions["Python"] = platform.python_version()
    draw(lines, FIGURES / "accuracy.png")
    write_rows("accuracy", list(rows(lines)))
    write_part(EVIDENCE / "accuracy.md", "numbers", summary(lines, versions))


if __name__ == "__main__":
    main()
