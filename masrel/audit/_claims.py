"""What a paper prints of an agreement, checked; and files with one claim a row."""

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path

from masrel._input import MAX_TABLE, listed, not_utf8, read_regular
from masrel.audit._printed import PrintedNumber, parse_printed
from masrel.audit._windows import (
    MAX_CATEGORIES,
    MAX_ITEMS,
    MAX_RATERS,
    WEIGHTS,
    AuditWeights,
    check_count,
    check_rounding,
    check_weights,
    parse_agreement,
    parse_kappa,
)
from masrel.errors import MasrelError, ParameterError, RatingsError

MAX_UNRATED = 20
"""Items of which it is tried that not both ratings are there."""


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
        check_count("n_items", self.n_items, 1, MAX_ITEMS)
        check_count("n_categories", self.n_categories, 2, MAX_CATEGORIES)
        check_count("n_raters", self.n_raters, 2, MAX_RATERS)
        check_count("n_unrated", self.n_unrated, 0, min(MAX_UNRATED, self.n_items - 1))
        if self.agreement is None and self.kappa is None:
            raise ParameterError(
                "agreement, kappa: needs at least one of them, got neither"
            )
        if self.agreement is not None:
            parse_agreement(self.agreement)
        if self.kappa is not None:
            parse_kappa(self.kappa)
        for key in ("agreement_weights", "kappa_weights"):
            if getattr(self, key) != "any":
                check_weights(key, getattr(self, key), more=("any",))
        check_rounding(self.rounding)
        self._check_margins()
        self._check_uncertainty()

    def _check_margins(self) -> None:
        for key in ("margins_1", "margins_2"):
            margins = getattr(self, key)
            if margins is None:
                continue
            if self.n_raters != 2:
                raise ParameterError(f"{key}: needs two raters, got {self.n_raters}")
            sums = range(self.n_items - self.n_unrated, self.n_items + 1)
            if len(margins) != self.n_categories or min(margins) < 0:
                raise ParameterError(
                    f"{key}: needs {self.n_categories} counts, one a category, got "
                    f"{';'.join(map(str, margins))}"
                )
            if sum(margins) not in sums:
                raise ParameterError(
                    f"{key}: needs counts that sum to n_items, {self.n_items}, got "
                    f"{';'.join(map(str, margins))}, which sum to {sum(margins)}"
                )

    def _check_uncertainty(self) -> None:
        for key in ("standard_error", "low", "high", "p"):
            if getattr(self, key) is None:
                continue
            if self.n_raters != 2 or self.kappa is None:
                raise ParameterError(f"{key}: needs the kappa of two raters beside it")
        if (self.low is None) != (self.high is None):
            absent, other = ("low", "high") if self.low is None else ("high", "low")
            raise ParameterError(f"{absent}: needed beside {other}, got none")
        if not 0.5 <= self.level < 1:
            raise ParameterError(
                f"level: needs a number from 0.5 to below 1, got {self.level!r}"
            )
        printed = self.printed()
        if self.low is not None and printed["low"].value > printed["high"].value:
            raise ParameterError(
                f"low: needs to be no higher than high, {self.high}, got {self.low}"
            )

    @property
    def excludes_kappa(self) -> bool:
        """Whether the interval has kappa outside, which is true of no table."""
        if self.low is None or self.kappa is None:
            return False
        printed, kappa = self.printed(), parse_kappa(self.kappa)
        low, high = printed["low"], printed["high"]
        return (
            low.value - low.half_unit > kappa.value + kappa.half_unit
            or high.value + high.half_unit < kappa.value - kappa.half_unit
        )

    def printed(self) -> dict[str, PrintedNumber]:
        """Return standard error, interval and p, as far as they are printed."""
        limits = {"standard_error": (0, 10), "low": (-2, 2), "high": (-2, 2)}
        texts = {key: getattr(self, key) for key in limits}
        numbers = {
            key: parse_printed(
                text, key, low=limits[key][0], high=limits[key][1], example="0.12"
            )
            for key, text in texts.items()
            if text is not None
        }
        if self.p is not None:
            p = self.p.removeprefix("<") if isinstance(self.p, str) else self.p
            numbers["p"] = parse_printed(p, "p", low=0, high=1, example="0.003")
        return numbers

    @property
    def numbers(self) -> str:
        """Return percentage and kappa in words."""
        parts = []
        if self.agreement is not None:
            parts.append(f"{self.agreement} % agreement")
        if self.kappa is not None:
            parts.append(f"κ {self.kappa}")
        return " and ".join(parts)

    def weights(self) -> list[tuple[AuditWeights, AuditWeights]]:
        """Return the weights of agreement and of kappa that it may be read with."""
        names = [self.agreement_weights, self.kappa_weights]
        if self.agreement is None:
            names[0] = "identity"
        if self.kappa is None:
            names[1] = "identity"
        if self.n_categories == 2:  # all weights are alike
            names = ["identity" if name == "any" else name for name in names]
        first, second = (
            WEIGHTS if name == "any" else (check_weights("weights", name),)
            for name in names
        )
        return [(a, k) for a in first for k in second]


_TEXTS = ("name", "agreement", "kappa", "agreement_weights", "kappa_weights",
          "rounding", "standard_error", "low", "high", "p", "source")  # fmt: skip
_WHOLE = ("n_items", "n_categories", "n_raters", "n_unrated")
_NEEDED = ("n_items", "n_categories")


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
        rows = [next(csv.reader(io.StringIO(t), delimiter=separator)) for _, t in lines]
    except csv.Error as error:
        raise RatingsError(f"{file}: needs CSV, got what is none: {error}") from error
    head = [name.strip() for name in rows[0]]
    _check_head(file, head)
    return tuple(
        _claim(file, number, head, row)
        for (number, _), row in zip(lines[1:], rows[1:], strict=True)
    )


def _check_head(file: Path, head: list[str]) -> None:
    known = [field.name for field in fields(Claim)]
    strays = [name for name in head if name not in known]
    absent = [name for name in _NEEDED if name not in head]
    if strays:
        raise RatingsError(
            f"{file}: needs columns among {', '.join(known)}, got {listed(strays)}"
        )
    if absent or len(set(head)) < len(head):
        raise RatingsError(
            f"{file}: needs the columns {', '.join(_NEEDED)}, and each column once, "
            f"got {listed(head)}"
        )


def _claim(file: Path, number: int, head: list[str], row: list[str]) -> Claim:
    where = f"{file}: row {number}"
    if len(row) != len(head):
        raise RatingsError(
            f"{where}: needs {len(head)} cells, as many as there are columns, got "
            f"{len(row)}"
        )
    cells = {
        name: text.strip() for name, text in zip(head, row, strict=True) if text.strip()
    }
    absent = [name for name in _NEEDED if name not in cells]
    if absent:
        raise RatingsError(f"{where}, column {absent[0]}: needs a number, got nothing")
    try:
        return Claim(**({"name": f"row {number}"} | _values(cells)))  # type: ignore[arg-type]
    except MasrelError as error:  # its message begins with the parameter
        raise RatingsError(f"{where}, column {error}") from error


def _values(cells: Mapping[str, str]) -> dict[str, object]:
    # the parameters of a claim from their texts
    values: dict[str, object] = {key: cells[key] for key in _TEXTS if key in cells}
    for key in _WHOLE:
        if key in cells:
            values[key] = whole(key, cells[key])
    for key in ("margins_1", "margins_2"):
        if key in cells:
            values[key] = margins_of(key, cells[key])
    if "level" in cells:
        try:
            values["level"] = float(cells["level"])
        except ValueError:
            raise ParameterError(
                f"level: needs a number such as 0.95, got {cells['level']!r}"
            ) from None
    return values


def whole(key: str, text: str) -> int:
    """Return a whole number from its text."""
    if not (text.isascii() and text.isdecimal() and len(text) < 10):
        raise ParameterError(f"{key}: needs a whole number, got {text!r}")
    return int(text)


def margins_of(key: str, text: str) -> tuple[int, ...]:
    """Return counts from a text that has them between spaces or semicolons."""
    return tuple(whole(key, part) for part in text.replace(";", " ").split())
