"""What a caller says of a file of ratings, and the texts of what is found in it."""

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Literal, get_args

from masrel._input import refuse
from masrel.errors import RatingsError

Repeated = Literal["error", "first", "last", "mean", "each"]
"""What to do with a second grade of an item by the same rater."""

USUAL_MISSING = ("", "NA")
"""Cells that mean a missing grade unless the scale has them."""

_SEPARATORS = {"tab": "\t", "\\t": "\t", "space": " ", "blanks": " ", "auto": None}
_NO_MARKS = "+-0123456789eE"  # letters of numbers
_SHOWN = 6  # texts that a message lists
MOST_CODES = 5
"""Number of codes of missing grades that a message suggests at once."""
_LONGEST = 60  # letters of a text that it shows


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """How a file of ratings is read; None and () are for the file to tell.

    Parameters
    ----------
    item : str or tuple of str
        Column of the items; several name an item together.
    rater, grade : str or None
        Columns of a long table, one row a rating.
    raters, ignore : str or tuple of str
        Columns of a wide table that are raters, and columns that are left aside.
    reference : str or None
        The rater whom others are held against, whatever the column is called.
    no_item, no_header : bool
        Whether no column names the items; whether the first line is a row.
    skip : int
        How many lines of a text, or rows of a sheet, are above that of the names.
    header : tuple of int
        The lines, from 1, that make up the names.
    session, by : str or None
        Columns of the sessions, and of groups that are told apart.
    by_criterion : bool
        Whether columns such as ``tone_Kim, tone_Lee, gait_Kim, gait_Lee`` are groups,
        one a criterion; `raters` then are the other parts of their names.
    clusters : str or None
        Column of the clusters that items come in, such as patients with several
        sites: one of each item.
    frequency : str or None
        Column that says how many items each row of a wide table stands for.
    repeated : {"error", "first", "last", "mean", "each"}
        What becomes of a second grade of an item by the same rater; each is kept for
        limits of agreement alone, those of all sessions as repeats.
    categories : sequence of str or None
        Every grade of the scale, in order; the grades met unless given.
    missing_codes : sequence of str
        Cells that stand for a missing grade, beside empty ones and NA.
    decimal, thousands : str or None
        Decimal mark, and the mark between thousands; a point, and none, unless the
        grades tell. Beside a point between thousands it is a comma.
    units : bool
        Whether every grade is a number with one unit, which is taken off.
    set_separator : str or None
        What stands between the labels of a cell, so that a grade is a set of them.
    delimiter, encoding, sheet : str or None
        Separator of cells (tab and blanks by name), encoding, and sheet of a workbook.
    transpose : bool
        Whether a row is a rater and a column an item.
    counts, table : bool
        Whether it is a table of counts, items by categories, or a contingency table
        of two raters, the first of them in the rows.
    source : str or None
        The tool whose export it is, of annotation or of evaluation; most of the
        latter are recognized.
    stream : bool or None
        Whether DuckDB groups it to the rows of ratings that differ, so that a
        file may be larger than memory; by its size unless given.

    Raises
    ------
    ParameterError
        If options contradict each other.

    Examples
    --------
    >>> Reading(item="patient", raters=("Kim", "Lee")).raters
    ('Kim', 'Lee')
    """

    item: str | tuple[str, ...] = ()
    rater: str | None = None
    grade: str | None = None
    raters: str | tuple[str, ...] = ()
    ignore: str | tuple[str, ...] = ()
    reference: str | None = None
    no_item: bool = False
    no_header: bool = False
    skip: int = 0
    header: tuple[int, ...] = ()
    session: str | None = None
    by: str | None = None
    by_criterion: bool = False
    clusters: str | None = None
    frequency: str | None = None
    repeated: Repeated = "error"
    categories: Sequence[str] | None = None
    missing_codes: Sequence[str] = ()
    decimal: str | None = None
    thousands: str | None = None
    units: bool = False
    set_separator: str | None = None
    delimiter: str | None = None
    encoding: str | None = None
    sheet: str | None = None
    transpose: bool = False
    counts: bool = False
    table: bool = False
    source: str | None = None
    stream: bool | None = None

    def __post_init__(self) -> None:
        mark = _SEPARATORS.get(self.delimiter or "auto", self.delimiter)
        object.__setattr__(self, "delimiter", mark)
        # in Python a column may be a number, and a grade
        for name in ("item", "raters", "ignore", "missing_codes", "categories"):
            if (value := getattr(self, name)) is not None:
                several = [value] if isinstance(value, str | int) else value
                object.__setattr__(self, name, tuple(map(str, several)))
        codes = ",".join(self.missing_codes).split(",") if self.missing_codes else ()
        object.__setattr__(self, "missing_codes", tuple(map(str.strip, codes)))
        self._check()

    def record(self) -> dict[str, object]:
        """Return what the caller said, as plain values for JSON."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in values.items()
            if value != getattr(Reading(), name)
        }

    @property
    def whole(self) -> list[str]:
        """The options that need the whole file in memory."""
        names = (
            *("by", "by_criterion", "session", "clusters", "frequency", "counts"),
            "table",
        )
        options = [f"--{n.replace('_', '-')}" for n in names if getattr(self, n)]
        is_kept = self.repeated == "error"
        return options if is_kept else [*options, f"--repeated {self.repeated}"]

    @property
    def names_at(self) -> tuple[int, ...]:
        """The lines of the names; none where they are the first."""
        return tuple(self.header) or ((self.skip + 1,) if self.skip else ())

    def _check(self) -> None:
        """Refuse what is wrong whatever the file is."""
        mark, is_counted = self.delimiter, self.counts or self.table
        is_long = bool(self.rater or self.grade)
        refuse(
            (
                mark is not None and len(mark) != 1,
                f"--delimiter: needed auto, one letter, tab or blanks, got {mark!r}",
            ),
            *(
                (
                    not isinstance(value, str) or len(value) != 1 or value in _NO_MARKS,
                    f"--{name}: needed one letter such as a comma, got {value!r}",
                )
                for name in ("decimal", "thousands")
                if (value := getattr(self, name)) is not None
            ),
            (
                self.decimal is not None and self.decimal == self.thousands,
                f"--decimal, --thousands: needed two marks, got {self.decimal!r} twice",
            ),
            (
                self.set_separator is not None
                and not (isinstance(self.set_separator, str) and self.set_separator),
                "--set-separator: needed text that stands between labels, got "
                f"{self.set_separator!r}",
            ),
            (
                self.set_separator and (self.units or self.categories is not None),
                "--set-separator: makes grades sets of labels, which have no order and "
                f"no unit, and not {'--units' if self.units else '--categories'}",
            ),
            (
                is_counted and (self.units or self.set_separator),
                f"--{'units' if self.units else 'set-separator'}: is of grades, and "
                f"cells of --{'counts' if self.counts else 'table'} are numbers of "
                "ratings",
            ),
            (
                self.repeated not in get_args(Repeated),
                f"--repeated: needed one of {', '.join(get_args(Repeated))}, got "
                f"{self.repeated!r}",
            ),
            (
                self.stream and self.whole,
                f"{', '.join(self.whole[:1])}: needs the whole file in memory, and not "
                "--stream",
            ),
            (
                self.counts and self.table,
                "--counts, --table: needed one of them, got both",
            ),
            (
                self.session and is_counted,
                "--session: counts do not say who rated what; --by tells groups apart",
            ),
            (
                self.clusters and is_counted,
                "--clusters: counts do not say which item is which, so needs ratings",
            ),
            (
                self.frequency and (is_long or is_counted or self.session),
                "--frequency: says how many items a row of a wide table stands for, "
                "and not with --rater, --grade, --counts, --table or --session",
            ),
            (
                self.frequency and (self.clusters or self.repeated != "error"),
                "--frequency: items that a row stands for have no names, as --clusters "
                "and --repeated need",
            ),
            (
                self.by_criterion
                and (is_long or is_counted or self.frequency or self.by),
                "--by-criterion: groups the columns of a wide table, and not with "
                "--rater, --grade, --counts, --table, --frequency or --by",
            ),
            (
                self.missing_codes and is_counted,
                "--missing: names grades that are missing, and cells of "
                f"--{'counts' if self.counts else 'table'} are numbers of ratings; got "
                f"{', '.join(self.missing_codes)}",
            ),
            (
                self.raters and is_long,
                "--raters names the columns of a wide table, --rater and --grade those "
                "of a long one: needed one kind, got both",
            ),
            (
                self.names_at != tuple(n for n in sorted({*self.names_at}) if n > 0),
                "--skip, --header: needed numbers of lines in order, got "
                f"{', '.join(map(str, self.names_at))}",
            ),
            (
                self.header and (self.skip or self.no_header),
                f"--{'skip' if self.skip else 'no-header'}, --header: needed one of "
                "them, got both",
            ),
            (
                self.no_item and self.item,
                "--item, --no-item: needed one of them, got both",
            ),
        )


class Finding(str):
    """What is found in a file: a text, with its code and the facts it is made of.

    Parameters
    ----------
    code : str
        Its row in the table of texts.
    **facts
        Columns, grades and options that it names.

    Attributes
    ----------
    code : str
        Its row in the table of texts.
    facts : dict
        Columns, grades and options that it names.

    Examples
    --------
    >>> Finding("no grade of", rater="Kim").code
    'no grade of'
    """

    __slots__ = ("code", "facts")
    code: str
    facts: dict[str, Any]

    def __new__(cls, code: str, /, **facts: Any) -> "Finding":
        finding = super().__new__(cls, _TEXTS[code].format(**facts))
        finding.code, finding.facts = code, facts
        return finding


def refusal(name: str, code: str, /, **facts: Any) -> RatingsError:
    """Return the error of a file."""
    return RatingsError(f"{name}: {Finding(code, **facts)}")


def quoted(names: Iterable[str]) -> str:
    """Return a list as an option takes it on a command line."""
    return shlex.quote(",".join(names))


def if_missing(texts: Sequence[str]) -> str:
    """Return how texts are counted as missing, if that can be said of so many."""
    # an option separates its codes by commas
    if not 0 < len(texts) <= MOST_CODES or any("," in text for text in texts):
        return ""
    return f"; if that is missing, --missing {quoted(texts)}"


def few(names: Sequence[str]) -> str:
    """Return what an option takes behind it, unless that is too long to be of help."""
    return f" {quoted(names)}" if len(names) <= MOST_CODES else ""


def listed(texts: Sequence[str], most: int = _SHOWN, more: str = "") -> str:
    """Return the first of some texts, and how many more there are."""
    shown = ", ".join(repr(text[:_LONGEST]) for text in texts[:most])
    n_more = len(texts) - most
    return f"{shown} and {n_more} more{more}" if n_more > 0 else shown


def library(name: str, module: str, extra: str = "files") -> Any:
    """Import a library that not everybody needs, or say how to get it."""
    if find_spec(top := module.partition(".")[0]) is None:
        raise refusal(name, "library", library=top, extra=extra)
    return import_module(module)


_TEXTS = {
    # the file
    "no table": "needed a path, a DataFrame, columns by name, or rows of the same "
    "length, got {got}",
    "folder": "needed a file, got a folder",
    "absent": "no such file",
    "device": "needed a file or a pipe, got a device",
    "empty": "needed a header and rows, the file is empty",
    "no records": "needed a header and rows, the file has none",
    "no rows": "needed rows of ratings below the names, got none",
    "library": "reading it needs {library}: pip install 'masrel[{extra}]'",
    "damaged": "is damaged, or no {suffix} file ({error})",
    "members": "needed one file in it, got {n}: {members}; --from says which tool "
    "exports several",
    "unpacked": "is more than {most} bytes when unpacked: {do}",
    "kind": "needed text, got a file of the kind {suffix}",
    "html": "is HTML, as web programs call .xls, too: open it in a spreadsheet program "
    "and save it as .xlsx or CSV",
    "no stream": "--stream: needed a Parquet file, or text in UTF-8 with a separator "
    "that is no blank, as it stands and not packed, without --transpose, --sheet and "
    "--from",
    # text
    "encoding": "line {line}: needed {encoding} text, got the byte 0x{byte:02x}; "
    "--encoding {hint}",
    "zero byte": "line {line}: needed text, got a zero byte{hint}",
    "comment or header": "line {line}: begins with # and has as many cells as the line "
    "below: take the # away if it is the header, or the line if it is a comment",
    "two separators": "line 1: needed one separator, {names} both make columns; "
    "--delimiter chooses",
    "one column": "line 1: needed columns, got one, {first!r}; --delimiter names the "
    "separator",
    "other separator": "line {line}: needed cells with the separator {delimiter}, got "
    "{first!r}",
    "width": "{where}: needed {width} cells, as the first line has, got {n}: {cells!r}",
    "open quote": "{where}: a quote that is opened is not closed",
    "names again": "holds the names of the columns a second time: delete that line; "
    "if the first line is a row like the others, add --no-header",
    "no name": "{where}: needed a name for column {column}, got none{hint}",
    "same name": "{where}: needed different names of the columns that are used, "
    "{column!r} is there twice{hint}",
    "titles": "needed names of columns, got {got!r}: {option} takes them from a line "
    "below",
    "no line": "--skip, --header: there are no names in {unit} {n} or below",
    "no lines": "--skip, --header: needed text or a workbook, with names in a line",
    "note below": "{where} is left out, since it stands alone below an empty one: "
    "{got!r}",
    # workbooks, JSON, exports
    "no cells": "sheet {sheet}: needed a header and rows, got none",
    "no workbook": "--sheet {sheet}: needed a workbook",
    "no sheet": "--sheet: there is no sheet {sheet!r}, but {sheets}",
    "sheets": "needs --sheet with one of its sheets, {sheets}",
    "nested cell": "column {column!r}, value {number}: needed text or numbers, got a "
    "{kind}; --from reads exports of annotation tools",
    "levels": "has names in two levels, and may have its raters in either: --raters"
    "{raters} if these rate, --transpose if {others} do",
    "lists": "item {item!r}: needed an annotator of each annotation, got {raters} and "
    "{grades}",
    "no export": "needed .json, .jsonl or .csv in it, got none",
    "no objects": "needed a JSON list of objects, one a row",
    "shape": "is no export of {source}, or damaged: a record has another shape "
    "({error})",
    "sources": "has the keys of more than one tool: {options} says whose it is",
    "zstd": "is packed by zstd, which pyarrow reads: pip install 'masrel[files]'; or "
    "inspect log convert --to json makes a log that needs nothing",
    "inconsistent": "judgements that differ with the order of the answers count as "
    "ties: {n}",
    "no fields": "needed labels of whole items, got none; spans, regions and relations "
    "are not read",
    "fields": "--grade: needed one of its fields, {fields}, got {got}",
    "field's name": "--grade: a field cannot be called {chosen!r} here",
    "no item": "needed an item of every annotation, {rater} gave {got} to none",
    "no annotator": "item {item}: needed its annotator, got none",
    "spans": "item {item}: needed a category of the whole, got {got}; spans, regions "
    "and relations are not read",
    "several labels": "item {item}: needed one category of each annotator, {rater} "
    "gave several, {got}, which are not read",
    "no rating": "needed ratings of {field}, got none",
    "no role": "needed a column of the {role}, which --{role} names, got {columns}",
    "no spans": "needed spans that begin and end at numbers: in a table, in an export "
    "of Label Studio as JSON, or in a folder that has a folder of .ann files of each "
    "annotator ({error})",
    "no step": "needed whole numbers of where spans begin and end; --step 0.001 counts "
    "seconds in milliseconds",
    "xpt": "is damaged, or no .xpt file (needed lines of 80 bytes)",
    # columns
    "no column": "{option}: there is no column {column!r}; there are {columns}{hint}",
    "two roles": "{options}: needed each column once, got {column!r} twice",
    "role twice": "{where}: needed one column for the {role}, got {names}: --{role} "
    "chooses one, --ignore leaves a column aside{hint}",
    "unknown role": "{where}: looks like one row per rating ({known}). Found columns "
    "{columns}: name columns with {needed}; if columns are raters, name them with "
    "--raters; if they are items, add --transpose{hint}",
    "no rater": "{where}: needed columns of raters, or of categories, got none",
    "span columns": "{begin!r} and {end!r} look like where spans begin and end, parts "
    "of a text or a recording, which masrel spans reads; --item names the items, if "
    "all raters have the same ones",
    "facets of text": "needed numbers, or --categories with every grade in order, got "
    "text",
    "unnamed": "needed the {role}, got {got!r}{hint}",
    "no value": "needed a value",
    "contingency": "rows and columns have the same names, so that this looks like a "
    "contingency table of two raters: --table reads it as one, --raters{names} if a "
    "row is an item",
    "no raters": "{columns}: no rater by {why}: {advice}",
    "criteria": "the columns look like criteria by raters, {first} by {second}: "
    "{advice}, --raters with all their names takes them for raters",
    "who rates": "--by-criterion: needs --raters with those who rate: --raters{first} "
    "or --raters{second}",
    "no criteria": "--by-criterion: needs columns that are called as tone_Kim, "
    "tone_Lee, gait_Kim and gait_Lee are, got {columns}",
    "no criterion": "--by-criterion: {columns}: no columns of all raters, {raters}: "
    "--ignore{names} leaves them aside, --raters names those who rate",
    "other grades": "criterion {criterion!r} has no grade in common with the others: "
    "it needs to be read by itself, without --by-criterion",
    "nothing in common": "{one} beside {other}: no grade in common: if they are the "
    "same grades, write them alike, if others, --raters {names} counts them so",
    "frequency": "column {column!r} looks like how often each row is there: "
    "--frequency {name} counts it so; if a row is one item, --ignore {name} together "
    "with --raters says so",
    "first column": "{where}: the first column, {column!r}, holds grades like the "
    "others: --no-item if it is a rater, --item {name} if it names the items",
    "grades as names": "{where}: the names of the columns, {columns}, may be grades: "
    "--no-header if this line is a row like the others, --raters{names} if they are "
    "raters",
    "counts": "rows sum to {total:g}, so that this may be a table of counts, items by "
    "categories: --counts reads it as one, --raters{names} as raters",
    "rating as names": "{names} may be a rating: --no-header if this line is a row, "
    "--header {line} if it has the names",
    "comments": "{n} different texts in {n_cells} cells are comments, no grades: "
    "--raters names the columns that rate",
    "summary row": "{item!r} sums up other rows, or is a comment: delete the line, or "
    "name the item otherwise",
    # warnings of columns
    "apart": "no value in common with the other columns: {columns}: {advice}",
    "many raters": "{n} columns are read as raters of {n_items} items; if each row is "
    "a rater, add --transpose",
    "second header": "{where} has grades that occur nowhere else: {advice}",
    "numbered": "no item was rated twice: {columns} may number the rows, --item names "
    "the column of the items",
    "alike": "{kind} that differ only in spelling are counted as different: {names}",
    "summary": "{names} is read as an item; if it is a comment or sums up other rows, "
    "delete it",
    "no grade of": "{rater!r} has no grade",
    "qualtrics": "{first} to {last} are questions and import ids of Qualtrics, no "
    "ratings: left out",
    "errors": "errors of formulas in the workbook are read as empty cells: {errors}",
    "stream": "read as a stream: names of items that differ by spelling alone, or sum "
    "up others, are not looked for",
    # tables of counts
    "count": "--{kind} needs whole numbers from 0 to 1e12, got {text!r}{hint}",
    "no counts": "--{kind}: needed at least one rating, got none",
    "other categories": "--categories: needed those of the columns, {names}, in order, "
    "got {categories}",
    "rows of table": "--table: needed as many rows as categories, {n}, got {n_rows}; "
    "--no-item if no column names the rows",
    "names of table": "--table: needed rows and columns of the same categories, got "
    "{rows} and {names}",
    "sum column": "{column!r} is the sum of the other columns: --ignore {name} leaves "
    "it aside, --raters names the columns of categories",
    "sum row": "{where}: is the sum of the rows above: delete it",
    "category or item": "the first column, {column!r}, may name items or be a "
    "category: --item {name} if it names them, --no-item if not",
    "items twice": "{column!r} names items more than once; each row is counted as a "
    "separate item",
    # grades
    "no grades": "needed at least one grade, got none",
    "other grade": "needed one of {scale}, got {got}{hint}",
    "looks missing": "{got} looks like a missing grade: --missing {codes} counts it as "
    "one, --categories with it in the scale as a grade",
    "broken": "needed a grade on one line, got {got}: a quote may be opened and not "
    "closed",
    "thousands": "{got} may have a thousands mark: {ways}",
    "thousands read": "{got}: read with a thousands mark; --thousands {mark} says so",
    "groups": "--thousands: needed {mark!r} before groups of three digits, got {got}",
    "units": "{got}: numbers with the unit {unit!r}; --units takes it off, "
    "--categories keeps it",
    "no unit": "--units: needed a number with the unit {unit}, got {got}{hint}",
    "no set": "--set-separator: needed {separator!r} between labels of some cell, and "
    "no semicolon in a label, got {got}",
    "decimal comma": "{got} looks like a number with a decimal comma: --decimal , "
    "reads it so, --set-separator , as two labels",
    "plus": "{got} beside grades such as {other!r} may be that number or the grade "
    "'{grade}': --categories with the scale in order tells",
    "truth": "{got} beside 0 or 1 and others may be these numbers, or grades of their "
    "own: write them alike, or --categories with all grades of the scale",
    "alike grades": "grades that differ only in spelling are counted as different: "
    "{grades}",
    "too near": "{one} and {other} are too close to differ as numbers, so weights use "
    "the place of each grade in the scale",
    "measurements": "{n} different numbers in {n_ratings} ratings look like "
    "measurements: percent agreement and unweighted kappas count only equal numbers; "
    "--coefficients icc_a1 or --metric interval take the distances into account",
    "far": "{grades}: far from the other grades{hint}",
    "no number": "no number: {got} ({where}), so that all grades are text{hint}",
    "number": "a number among grades that are text: {got} ({where}){hint}",
    # ratings
    "twice": "{rows}: {rater!r} graded {item!r} more than once: --by or --session "
    "names a column that tells such ratings apart, --repeated first, last or "
    "mean keeps one; limits of agreement can take all{guess}",
    "means": "--repeated mean: needs grades that are numbers without a declared scale, "
    "got {grades}; --repeated first or last keeps one",
    "two clusters": "{rows}: needed one cluster of item {item!r} in column {column!r}, "
    "got {both}; if items are numbered in each cluster, --item names both columns",
}
