"""Claims: what a paper reports about agreement, and files with one claim per row.

Every value between the ends of an interval is printed as the same text, and whether the
ends are as well depends on the rule for ties. All is exact: ends are fractions.
"""

import csv
import re
from dataclasses import dataclass, fields
from fractions import Fraction
from itertools import product
from math import ceil, floor
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from masrel._input import check_option, listed, not_utf8, refuse, shown
from masrel.errors import ParameterError, RatingsError

# what becomes of a tie: the even neighbour, or the one further from 0
Rule = Literal["half_even", "half_up"]
RULES: tuple[Rule, ...] = get_args(Rule)
WEIGHTS = ("identity", "linear", "quadratic")

# the least and the greatest whole number that is allowed; none where it is less
Window = tuple[int, int]
# the ends of the values rounded to one text, and whether each is one of them
Bounds = tuple[Fraction, Fraction, bool, bool]

_NUMBER = re.compile(r"-?(\d+\.?\d*|\.\d+)", re.ASCII)
_MAX_DECIMALS = 12
_COUNTS = {  # the least and the greatest
    "n_items": (1, 10_000),
    "n_categories": (2, 20),
    "n_raters": (2, 1_000),
    "n_unrated": (0, 20),
}
_PRINTED = {  # the least, the greatest, an example
    "agreement": (0, 100, "97.4"),
    "kappa": (-1, 1, "0.81"),
    "standard_error": (0, 10, "0.12"),
    "low": (-2, 2, "0.12"),
    "high": (-2, 2, "0.12"),
    "p": (0, 1, "0.003"),
}
MARGINS = ("margins_1", "margins_2")
UNCERTAINTY = ("standard_error", "low", "high", "p")  # of the kappa of two raters
_NEEDED = ("n_items", "n_categories")


@dataclass(frozen=True, slots=True)
class PrintedNumber:
    """A number with the decimals that it was printed with."""

    units: int  # the number in units of its last decimal
    value: Fraction
    half_unit: Fraction  # how far a value may lie from the number

    def bounds(self, rule: Rule) -> Bounds:
        """Return the values that the rule rounds to the number."""
        if rule == "half_even":
            has_low = has_high = self.units % 2 == 0
        else:  # away from 0: of 0 neither end, of others the end nearer to 0
            has_low, has_high = self.units > 0, self.units < 0
        half = self.half_unit
        return self.value - half, self.value + half, has_low, has_high


def _parse_printed(
    text: object, where: str, low: int, high: int, example: str
) -> PrintedNumber:
    """Return a printed number between two limits; `where` begins the message."""
    plain = text.strip().replace("−", "-") if isinstance(text, str) else ""
    plain = plain.removeprefix("<" * (where == "p"))  # of which a bound may be printed
    decimals = len(plain.partition(".")[2])
    is_number = _NUMBER.fullmatch(plain) is not None
    value = Fraction(plain if is_number else 0)
    got = f"got {text!r}"
    refuse(
        (
            not isinstance(text, str),
            f"{where}: needs a text such as {example!r}, because its decimals matter, "
            f"{got}",
        ),
        (
            not is_number,
            f"{where}: needs a number with a decimal point and no unit, such as "
            f"{example!r}, {got}",
        ),
        (
            decimals > _MAX_DECIMALS,
            f"{where}: needs at most {_MAX_DECIMALS} decimals, {got}",
        ),
        (
            not low <= value <= high,
            f"{where}: needs a number from {low} to {high}, {got}",
        ),
    )
    unit = Fraction(1, 10**decimals)
    return PrintedNumber(int(value / unit), value, unit / 2)


def whole_numbers(bounds: Bounds) -> Window:
    """Return the whole numbers within bounds, and at those ends that count."""
    low, high, has_low, has_high = bounds
    return (
        ceil(low) if has_low else floor(low) + 1,
        floor(high) if has_high else ceil(high) - 1,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """What a paper reports about agreement, as it is printed.

    Parameters
    ----------
    name : str, optional
        What it is called in tables.
    n_items, n_categories, n_raters : int
        As for `consistent_tables`.
    agreement, kappa : str, optional
        As for `consistent_tables`; at least one is needed.
    agreement_weights, kappa_weights : str, optional
        As for `consistent_tables`, or ``"any"`` if the paper does not say which.
    rounding : str, optional
        As for `consistent_tables`.
    margins_1, margins_2 : tuple of int, optional
        How many items the first and the second of two raters put into each category.
    standard_error : str, optional
        Standard error of kappa, for two raters.
    low, high : str, optional
        The interval of kappa, of two raters; both or neither.
    level : float, optional
        Level of that interval.
    p : str, optional
        Of the hypothesis that kappa is 0: ``"0.003"`` or ``"<0.001"``.
    n_unrated : int, optional
        How many items at most may have been left out since a rating was absent.
    source : str, optional
        Where it is printed.

    Raises
    ------
    ParameterError
        If anything of it is not what it must be; the message begins with its name here.

    Examples
    --------
    >>> Claim(n_items=20, n_categories=2, agreement="85.0", kappa="0.58").kappa
    '0.58'
    """

    name: str = "claim"
    n_items: int
    n_categories: int
    n_raters: int = 2
    agreement: str | None = None
    kappa: str | None = None
    agreement_weights: str = "identity"
    kappa_weights: str = "any"
    rounding: str = "either"
    margins_1: tuple[int, ...] | None = None
    margins_2: tuple[int, ...] | None = None
    standard_error: str | None = None
    low: str | None = None
    high: str | None = None
    level: float = 0.95
    p: str | None = None
    n_unrated: int = 0
    source: str = ""

    def __post_init__(self) -> None:
        """Check all of it."""
        for key, (least, most) in _COUNTS.items():
            count = getattr(self, key)
            most = min(most, self.n_items - 1) if key == "n_unrated" else most
            needed = f"needs a whole number from {least} to {most}, got {shown(count)}"
            is_in = _is_whole(count) and least <= count <= most
            refuse((not is_in, f"{key}: {needed}"))
        refuse(
            (
                self.agreement is None and self.kappa is None,
                "agreement, kappa: needs at least one of them, got neither",
            )
        )
        check_option("agreement_weights", self.agreement_weights, (*WEIGHTS, "any"))
        check_option("kappa_weights", self.kappa_weights, (*WEIGHTS, "any"))
        check_option("rounding", self.rounding, (*RULES, "either"))
        for key in MARGINS:
            if getattr(self, key) is not None:
                self._check_margins(key, getattr(self, key))
        self._check_uncertainty()

    def _check_margins(self, key: str, margins: tuple[int, ...]) -> None:
        sums = range(self.n_items - self.n_unrated, self.n_items + 1)
        are_counts = all(_is_whole(count) and count >= 0 for count in margins)
        got = f"got {' '.join(map(str, margins))}"
        refuse(
            (self.n_raters != 2, f"{key}: needs two raters, got {self.n_raters}"),
            (
                not are_counts or len(margins) != self.n_categories,
                f"{key}: needs {self.n_categories} counts, one per category, {got}",
            ),
            (
                are_counts and sum(margins) not in sums,
                f"{key}: needs counts that sum to n_items, {self.n_items}, {got}",
            ),
        )

    def _check_uncertainty(self) -> None:
        printed, is_of_two = self.printed(), self.n_raters == 2
        low, high = printed.get("low"), printed.get("high")
        refuse(
            *(
                (
                    key in printed and not (is_of_two and "kappa" in printed),
                    f"{key}: needs the kappa of two raters as well",
                )
                for key in UNCERTAINTY
            ),
            (high and not low, "low: needed with high, got none"),
            (low and not high, "high: needed with low, got none"),
            (
                not 0.5 <= self.level < 1,
                f"level: needs a number from 0.5 to below 1, got {self.level:g}",
            ),
            (
                low and high and low.value > high.value,
                f"low: needs to be at most high, {self.high}, got {self.low}",
            ),
        )

    def printed(self) -> dict[str, PrintedNumber]:
        """Return the numbers that are printed, by their names here."""
        texts = {key: getattr(self, key) for key in _PRINTED}
        return {
            key: _parse_printed(text, key, *_PRINTED[key])
            for key, text in texts.items()
            if text is not None
        }

    @property
    def rules(self) -> tuple[Rule, ...]:
        """The rules that its rounding means."""
        return tuple(rule for rule in RULES if self.rounding in (rule, "either"))

    @property
    def excludes_kappa(self) -> bool:
        """Whether the interval has kappa outside, which is true of no table."""
        if self.low is None:
            return False
        printed = self.printed()
        low, high, kappa = (printed[key] for key in ("low", "high", "kappa"))
        return (
            low.value - low.half_unit > kappa.value + kappa.half_unit
            or high.value + high.half_unit < kappa.value - kappa.half_unit
        )

    def weights(self) -> list[tuple[str, str]]:
        """Return the weights of agreement and of kappa that it may be read with."""
        of_agreement, of_kappa = (
            # of two categories all weights are alike
            WEIGHTS[: 1 if number is None or self.n_categories == 2 else None]
            if name == "any"
            else (name,)
            for number, name in (
                (self.agreement, self.agreement_weights),
                (self.kappa, self.kappa_weights),
            )
        )
        return list(product(of_agreement, of_kappa))


def _is_whole(count: object) -> bool:
    return isinstance(count, int | np.integer) and count is not True


def read_claims(file: Path) -> tuple[Claim, ...]:
    """Read a CSV file with one claim per row.

    Parameters
    ----------
    file : Path
        Columns are called as the parameters of `Claim`; ``n_items``, ``n_categories``
        and one of ``agreement`` and ``kappa`` are needed. Counts of ``margins_1`` and
        ``margins_2`` stand between spaces or semicolons. An empty cell is what the
        paper does not print. Lines that begin with ``#`` are skipped.

    Returns
    -------
    tuple of Claim
        The claims, in the order of the rows.

    Raises
    ------
    RatingsError
        If it is not such a file; the message names row and column.
    OSError
        If it cannot be read.
    """
    try:
        return _claims_of(file.read_bytes().decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise RatingsError(f"{file}: {not_utf8(error)}") from error
    except (ParameterError, csv.Error) as error:
        raise RatingsError(f"{file}: {error}") from error


def _claims_of(text: str) -> tuple[Claim, ...]:
    lines = {
        number: line
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip(" ,;") and not line.startswith("#")
    }
    needed = f"needs a header and one row per claim, got {len(lines)} lines"
    refuse((len(lines) < 2, needed))
    first = next(iter(lines.values()))
    separator = ";" if first.count(";") > first.count(",") else ","
    (_, head), *rows = [
        (
            number,
            [cell.strip() for cell in next(csv.reader([line], delimiter=separator))],
        )
        for number, line in lines.items()
    ]
    known = [field.name for field in fields(Claim)]
    strays = [name for name in head if name not in known]
    refuse(
        (strays, f"needs columns among {', '.join(known)}, got {listed(strays)}"),
        (
            not (set(head).issuperset(_NEEDED) and len(set(head)) == len(head)),
            f"needs the columns {', '.join(_NEEDED)}, and each column once, got "
            f"{listed(head)}",
        ),
        *(
            (
                len(row) != len(head),
                f"row {number}: needs {len(head)} cells, one per column, got "
                f"{len(row)}",
            )
            for number, row in rows
        ),
    )
    claims = []
    for number, row in rows:
        texts = {name: cell for name, cell in zip(head, row, strict=True) if cell}
        try:
            claims.append(claim_of({"name": f"row {number}"} | texts))
        except ParameterError as error:  # its message begins with the parameter
            raise ParameterError(f"row {number}, column {error}") from error
    return tuple(claims)


def claim_of(texts: dict[str, str]) -> Claim:
    """Return a claim from the texts of its parameters."""
    values: dict[str, Any] = {**dict.fromkeys(_NEEDED), **texts}
    for key, text in texts.items():
        if key in _COUNTS:
            values[key] = _whole(text)
        elif key in MARGINS:
            values[key] = tuple(map(_whole, text.replace(";", " ").split()))
        elif key == "level":
            values[key] = float(_parse_printed(text, key, 0, 100, "0.95").value)
    return Claim(**values)


def _whole(text: str) -> int | str:
    # what is no whole number is left as it is, and refused by the claim
    return int(text) if text.isdecimal() and len(text) < 10 else text
