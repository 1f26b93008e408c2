"""What a paper prints of an agreement, checked; and files with one claim a row."""

import csv
from dataclasses import dataclass, fields
from io import StringIO
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from masrel._input import MAX_TABLE, listed, not_utf8, read_regular
from masrel.audit._printed import RULES, PrintedNumber, Rule, parse_printed
from masrel.errors import MasrelError, ParameterError, RatingsError

AuditWeights = Literal["identity", "linear", "quadratic"]
"""Weights of printed coefficients."""

WEIGHTS: tuple[AuditWeights, ...] = get_args(AuditWeights)

_MAX_UNRATED = 20  # items of which it is tried that not both ratings are there
_COUNTS = {  # the least and the greatest
    "n_items": (1, 10_000),
    "n_categories": (2, 20),
    "n_raters": (2, 1_000),
    "n_unrated": (0, _MAX_UNRATED),
}
_PRINTED = {  # the least, the greatest, an example
    "agreement": (0, 100, "97.4"),
    "kappa": (-1, 1, "0.81"),
    "standard_error": (0, 10, "0.12"),
    "low": (-2, 2, "0.12"),
    "high": (-2, 2, "0.12"),
    "p": (0, 1, "0.003"),
}
_MARGINS = ("margins_1", "margins_2")
UNCERTAINTY = ("standard_error", "low", "high", "p")
"""What may be printed beside the kappa of two raters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """What a paper prints, as it prints it; what it does not print is left out.

    Parameters
    ----------
    name : str, optional
        What it is called in tables.
    n_items, n_categories, n_raters : int
        As of `consistent_tables`.
    agreement, kappa : str, optional
        As of `consistent_tables`; at least one is needed.
    agreement_weights, kappa_weights : str, optional
        As of `consistent_tables`, or ``"any"``: the paper does not say which.
    rounding : str, optional
        As of `consistent_tables`.
    margins_1, margins_2 : tuple of int, optional
        How many items the first and the second of two raters put into each category.
    standard_error : str, optional
        Of kappa, of two raters.
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
            if key == "n_unrated":
                most = min(most, self.n_items - 1)
            _check_count(key, getattr(self, key), least, most)
        if self.agreement is None and self.kappa is None:
            raise ParameterError(
                "agreement, kappa: needs at least one of them, got neither"
            )
        printed = self.printed()
        for key in ("agreement_weights", "kappa_weights"):
            check_weights(key, getattr(self, key), (*WEIGHTS, "any"))
        if self.rounding not in (*RULES, "either"):
            raise ParameterError(
                f"rounding: needs half_even, half_up or either, got {self.rounding!r}"
            )
        for key in _MARGINS:
            self._check_margins(key, getattr(self, key))
        self._check_uncertainty(printed)

    def _check_margins(self, key: str, margins: tuple[int, ...] | None) -> None:
        if margins is None:
            return
        if self.n_raters != 2:
            raise ParameterError(f"{key}: needs two raters, got {self.n_raters}")
        shown = ";".join(map(str, margins))
        sums = range(self.n_items - self.n_unrated, self.n_items + 1)
        if len(margins) != self.n_categories or min(margins) < 0:
            raise ParameterError(
                f"{key}: needs {self.n_categories} counts, one a category, got {shown}"
            )
        if sum(margins) not in sums:
            raise ParameterError(
                f"{key}: needs counts that sum to n_items, {self.n_items}, got "
                f"{shown}, which sum to {sum(margins)}"
            )

    def _check_uncertainty(self, printed: dict[str, PrintedNumber]) -> None:
        for key in UNCERTAINTY:
            if key in printed and (self.n_raters != 2 or self.kappa is None):
                raise ParameterError(f"{key}: needs the kappa of two raters beside it")
        for absent, other in (("low", "high"), ("high", "low")):
            if other in printed and absent not in printed:
                raise ParameterError(f"{absent}: needed beside {other}, got none")
        if not 0.5 <= self.level < 1:
            raise ParameterError(
                f"level: needs a number from 0.5 to below 1, got {self.level!r}"
            )
        if self.low is not None and printed["low"].value > printed["high"].value:
            raise ParameterError(
                f"low: needs to be no higher than high, {self.high}, got {self.low}"
            )

    def printed(self) -> dict[str, PrintedNumber]:
        """Return the numbers that are printed, by their names here."""
        numbers = {}
        for key, (low, high, example) in _PRINTED.items():
            text = getattr(self, key)
            if text is not None:
                text = (
                    text.removeprefix("<") if key == "p" and str(text) == text else text
                )
                numbers[key] = parse_printed(
                    text, key, low=low, high=high, example=example
                )
        return numbers

    @property
    def rules(self) -> tuple[Rule, ...]:
        """The rules that its rounding stands for."""
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

    def weights(self) -> list[tuple[AuditWeights, AuditWeights]]:
        """Return the weights of agreement and of kappa that it may be read with."""
        pairs = []
        for number, name in (
            (self.agreement, self.agreement_weights),
            (self.kappa, self.kappa_weights),
        ):
            # of two categories all weights are alike
            is_one = number is None or (name == "any" and self.n_categories == 2)
            chosen = "identity" if is_one else name
            pairs.append([w for w in WEIGHTS if chosen in (w, "any")])
        return [(a, k) for a in pairs[0] for k in pairs[1]]


def _check_count(name: str, count: object, least: int, most: int) -> None:
    is_whole = isinstance(count, int | np.integer) and not isinstance(count, bool)
    if not is_whole or not least <= count <= most:  # type: ignore[operator]
        raise ParameterError(
            f"{name}: needs a whole number from {least} to {most}, got {count!r}"
        )


def check_weights(name: str, weights: str, known: tuple[str, ...] = WEIGHTS) -> None:
    """Refuse weights that cannot be audited."""
    if weights not in known:
        raise ParameterError(
            f"{name}: needs one of {', '.join(known)}, got {weights!r}"
        )


def read_claims(file: Path) -> tuple[Claim, ...]:
    """Read a CSV file of claims, one a row.

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
        text = read_regular(file, most=MAX_TABLE).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise RatingsError(f"{file}: {not_utf8(error)}") from error
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip(" ,;") and not line.startswith("#")
    ]
    if len(lines) < 2:
        raise RatingsError(
            f"{file}: needs a line of column names and a row a claim, got "
            f"{len(lines)} lines"
        )
    separator = ";" if lines[0][1].count(";") > lines[0][1].count(",") else ","
    try:
        rows = [next(csv.reader(StringIO(t), delimiter=separator)) for _, t in lines]
    except csv.Error as error:
        raise RatingsError(f"{file}: needs CSV, got what is none: {error}") from error
    head = [name.strip() for name in rows[0]]
    known, needed = [field.name for field in fields(Claim)], ("n_items", "n_categories")
    if strays := [name for name in head if name not in known]:
        raise RatingsError(
            f"{file}: needs columns among {', '.join(known)}, got {listed(strays)}"
        )
    if not set(head).issuperset(needed) or len(set(head)) < len(head):
        raise RatingsError(
            f"{file}: needs the columns {', '.join(needed)}, and each column once, "
            f"got {listed(head)}"
        )
    return tuple(
        _claim(f"{file}: row {number}", number, head, row)
        for (number, _), row in zip(lines[1:], rows[1:], strict=True)
    )


def _claim(where: str, number: int, head: list[str], row: list[str]) -> Claim:
    if len(row) != len(head):
        raise RatingsError(
            f"{where}: needs {len(head)} cells, as many as there are columns, got "
            f"{len(row)}"
        )
    cells = {
        name: text.strip() for name, text in zip(head, row, strict=True) if text.strip()
    }
    for name in ("n_items", "n_categories"):
        if name not in cells:
            raise RatingsError(f"{where}, column {name}: needs a number, got nothing")
    try:
        return claim_of({"name": f"row {number}"} | cells)
    except MasrelError as error:  # its message begins with the parameter
        raise RatingsError(f"{where}, column {error}") from error


def claim_of(texts: dict[str, str]) -> Claim:
    """Return a claim from the texts of its parameters."""
    values: dict[str, object] = dict(texts)
    for key, text in texts.items():
        if key in _COUNTS:
            values[key] = _whole(key, text)
        elif key in _MARGINS:
            parts = text.replace(";", " ").split()
            values[key] = tuple(_whole(key, part) for part in parts)
        elif key == "level":
            try:
                values[key] = float(text)
            except ValueError:
                raise ParameterError(
                    f"level: needs a number such as 0.95, got {text!r}"
                ) from None
    return Claim(**values)  # type: ignore[arg-type]


def _whole(key: str, text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 10):
        raise ParameterError(f"{key}: needs a whole number, got {text!r}")
    return int(text)
