"""How a file of ratings is read, and the texts of what is found in it."""

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
    """How a file of ratings is read; None and () leave the choice to the file.

    Parameters
    ----------
    item : str or tuple of str
        Column of the items; several name an item together.
    rater, grade : str or None
        Columns of a long table, with one row per rating.
    raters, ignore : str or tuple of str
        Columns of a wide table that are raters, and columns that are left aside.
    reference : str or None
        The rater to compare the others with, whatever the column is called.
    known : tuple of str
        Other names that are those of raters, whatever their columns are called.
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
        Column with the number of items that each row of a wide table represents.
    repeated : {"error", "first", "last", "mean", "each"}
        What becomes of a second grade of an item by the same rater; each is kept for
        limits of agreement alone, those of all sessions as repeats.
    categories : sequence of str or None
        Every grade of the scale, in order; the grades met unless given.
    missing_codes : sequence of str
        Cells that mean a missing grade, besides empty ones and NA.
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
        Whether each row is a rater and each column is an item.
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
    known: tuple[str, ...] = ()
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
    def vouched(self) -> set[str | None]:
        """Names that are those of raters."""
        return {self.reference, *self.known}

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
                f"--delimiter: needed auto, tab, blanks or one character, got {mark!r}",
            ),
            *(
                (
                    not isinstance(value, str) or len(value) != 1 or value in _NO_MARKS,
                    f"--{name}: needed one character such as a comma, got {value!r}",
                )
                for name in ("decimal", "thousands")
                if (value := getattr(self, name)) is not None
            ),
            (
                self.decimal is not None and self.decimal == self.thousands,
                "--decimal, --thousands: needed two different marks, got "
                f"{self.decimal!r}",
            ),
            (
                self.set_separator is not None
                and not (isinstance(self.set_separator, str) and self.set_separator),
                "--set-separator: needed the text between labels, got "
                f"{self.set_separator!r}",
            ),
            (
                self.set_separator and (self.units or self.categories is not None),
                f"--set-separator, {'--units' if self.units else '--categories'}: "
                "needed one of them, because sets of labels have no order and no unit, "
                "got both",
            ),
            (
                is_counted and (self.units or self.set_separator),
                f"--{'units' if self.units else 'set-separator'}: needed grades, but "
                f"the cells of --{'counts' if self.counts else 'table'} are numbers of "
                "ratings",
            ),
            (
                self.repeated not in get_args(Repeated),
                f"--repeated: needed one of {', '.join(get_args(Repeated))}, got "
                f"{self.repeated!r}",
            ),
            (
                self.stream and self.whole,
                f"{', '.join(self.whole[:1])}: needs the whole file in memory, so it "
                "cannot be combined with --stream",
            ),
            (
                self.counts and self.table,
                "--counts, --table: needed one of them, got both",
            ),
            (
                self.session and is_counted,
                "--session: counts do not show who rated what; name groups with --by",
            ),
            (
                self.clusters and is_counted,
                "--clusters: needed ratings, because counts do not show which item is "
                "which",
            ),
            (
                self.frequency and (is_long or is_counted or self.session),
                "--frequency: is for tables with one column per rater, so it cannot be "
                "combined with --rater, --grade, --counts, --table or --session",
            ),
            (
                self.frequency and (self.clusters or self.repeated != "error"),
                "--frequency: cannot be combined with --clusters or --repeated, "
                "because the items of a row have no names",
            ),
            (
                self.by_criterion
                and (is_long or is_counted or self.frequency or self.by),
                "--by-criterion: is for tables with one column per criterion and "
                "rater, so it cannot be combined with --rater, --grade, --counts, "
                "--table, --frequency or --by",
            ),
            (
                self.missing_codes and is_counted,
                "--missing: needed grades, but the cells of "
                f"--{'counts' if self.counts else 'table'} are numbers of ratings, got "
                f"{', '.join(self.missing_codes)}",
            ),
            (
                self.raters and is_long,
                "--raters is for one column per rater, --rater and --grade are for one "
                "row per rating: needed one kind, got both",
            ),
            (
                self.names_at != tuple(n for n in sorted({*self.names_at}) if n > 0),
                "--skip, --header: needed line numbers in ascending order, got "
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
    """A finding in a file: its text, with its code and facts.

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
    """Return how texts are counted as missing, if there are not too many."""
    # an option separates its codes by commas
    if not 0 < len(texts) <= MOST_CODES or any("," in text for text in texts):
        return ""
    return f"; if that means a missing grade, add --missing {quoted(texts)}"


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
    "no table": "needed a path, a DataFrame, columns by name, or rows of equal length, "
    "got {got}",
    "folder": "needed a file, got a folder",
    "absent": "no such file",
    "device": "needed a file or a pipe, got a device",
    "empty": "needed a header and rows, but the file is empty",
    "no records": "needed a header and rows, but the file has none",
    "no rows": "needed rows of ratings below the header, got none",
    "library": "needs {library}: pip install 'masrel[{extra}]'",
    "damaged": "is damaged or not a {suffix} file ({error})",
    "members": "needed one file in the archive, got {n}: {members}; if a tool exported "
    "them, name it with --from",
    "unpacked": "is larger than {most} bytes when unpacked: {do}",
    "kind": "needed text, got a file of type {suffix}",
    "html": "is HTML, which web programs also save as .xls: open it in a spreadsheet "
    "program and save it as .xlsx or CSV",
    "no stream": "--stream: needed a Parquet file, or text in UTF-8 that is not "
    "compressed and whose separator is not a blank, without --transpose, --sheet and "
    "--from",
    # text
    "encoding": "line {line}: needed {encoding} text, got the byte 0x{byte:02x}; "
    "{hint}",
    "zero byte": "line {line}: needed text, got a zero byte{hint}",
    "comment or header": "line {line}: begins with # and has as many cells as the line "
    "below: if it is the header, delete the #; if it is a comment, delete the line",
    "two separators": "line 1: {names} could both be the separator: choose one with "
    "--delimiter",
    "one column": "line 1: needed several columns, got one, {first!r}; name the "
    "separator with --delimiter",
    "other separator": "line {line}: needed cells separated by {delimiter}, got "
    "{first!r}",
    "width": "{where}: needed {width} cells, as in the first line, got {n}: {cells!r}",
    "open quote": "{where}: a quote is opened but not closed",
    "names again": "the names of the columns are repeated: delete this line; if the "
    "first line is a row like the others, add --no-header",
    "no name": "{where}: needed a name for column {column}, got none{hint}",
    "same name": "{where}: needed different names for the columns used, but {column!r} "
    "occurs twice{hint}",
    "titles": "needed the names of the columns, got {got!r}: to read them from below, "
    "add {option}",
    "no line": "--skip, --header: no names of columns in {unit} {n} or below",
    "no lines": "--skip, --header: needed text or a workbook; other files have no "
    "lines of names",
    "note below": "{where} is left out because it stands alone below an empty one: "
    "{got!r}",
    # workbooks, JSON, exports
    "no cells": "sheet {sheet}: needed a header and rows, got none",
    "no workbook": "--sheet {sheet}: needed a workbook, such as .xlsx",
    "no sheet": "--sheet: there is no sheet {sheet!r}; found {sheets}",
    "sheets": "has several sheets, {sheets}: choose one with --sheet",
    "nested cell": "column {column!r}, value {number}: needed text or a number, got a "
    "{kind}; if a tool exported this file, name it with --from",
    "levels": "has names at two levels, and either may be the raters: name them with "
    "--raters{raters}, or add --transpose if they are {others}",
    "lists": "item {item!r}: needed one grade from each annotator, got {raters} and "
    "{grades}",
    "no export": "needed a .json, .jsonl or .csv file in the archive, got none",
    "no objects": "needed a JSON list of objects, one per row",
    "shape": "is damaged or not an export of {source}: a record has another structure "
    "({error})",
    "sources": "has the keys of more than one tool: choose it with {options}",
    "zstd": "is compressed with zstd, which needs pyarrow: pip install "
    "'masrel[files]'; or convert the log with inspect log convert --to json",
    "inconsistent": "judgements that changed with the order of the answers, counted as "
    "ties: {n}",
    "no fields": "needed labels of whole items, got none; spans, regions and relations "
    "are not read",
    "fields": "--grade: needed one of the fields {fields}, got {got}",
    "field's name": "--grade: a field cannot be called {chosen!r} here",
    "no item": "needed an item for every annotation, but {rater} gave {got} without "
    "one",
    "no annotator": "item {item}: needed an annotator, got none",
    "spans": "item {item}: needed a category of the whole item, got {got}; spans, "
    "regions and relations are not read",
    "several labels": "item {item}: needed one category from each annotator, but "
    "{rater} gave several, {got}",
    "no rating": "needed ratings of {field}, got none",
    "no role": "needed a column with the {role} of each span: name it with --{role}; "
    "found {columns}",
    "no spans": "needed numbers for where spans begin and end, in a table, in a JSON "
    "export of Label Studio, or in a folder with one folder of .ann files per "
    "annotator ({error})",
    "no step": "needed whole numbers for where spans begin and end; --step 0.001 "
    "counts seconds in milliseconds",
    "xpt": "is damaged or not an .xpt file (needed lines of 80 bytes)",
    # columns
    "no column": "{option}: there is no column {column!r}; found {columns}{hint}",
    "two roles": "{options}: needed each column once, got {column!r} twice",
    "role twice": "{where}: needed one column for the {role}, got {names}: choose one "
    "with --{role}, or leave one out with --ignore{hint}",
    "unknown role": "{where}: looks like one row per rating ({known}). Found columns "
    "{columns}: name columns with {needed}; if columns are raters, name them with "
    "--raters; if they are items, add --transpose{hint}",
    "no rater": "{where}: needed columns of raters or of categories, got none",
    "span columns": "{begin!r} and {end!r} look like the beginning and end of spans in "
    "a text or recording, which masrel spans reads; if all raters have the same spans, "
    "name the items with --item",
    "facets of text": "needed grades that are numbers, or --categories with every "
    "grade in order, got text",
    "unnamed": "needed a name for the {role}, got {got!r}{hint}",
    "no value": "needed a value, got an empty cell",
    "contingency": "rows and columns have the same names: if this is a contingency "
    "table of two raters, add --table; if each row is an item, name the raters with "
    "--raters{names}",
    "no raters": "columns that do not look like raters, by {why}: {columns}; {advice}",
    "criteria": "columns look like combinations of criteria and raters, {first} and "
    "{second}: {advice}; if every column is a rater, name all of them with --raters",
    "who rates": "--by-criterion: name the raters with --raters{first} or "
    "--raters{second}",
    "no criteria": "--by-criterion: needed names of columns such as tone_Kim, "
    "tone_Lee, gait_Kim and gait_Lee, got {columns}",
    "no criterion": "--by-criterion: needed columns of all raters, {raters}, got "
    "{columns} as well: leave them out with --ignore{names}, or name the raters with "
    "--raters",
    "other grades": "criterion {criterion!r} has no grade in common with the others: "
    "estimate it separately, without --by-criterion",
    "nothing in common": "one column has {one}, the other {other}: if these are the "
    "same grades, spell them alike; if not, add --raters {names}",
    "frequency": "column {column!r} looks like the number of items that each row "
    "represents: if it is, add --frequency {name}; if each row is one item, add "
    "--ignore {name} and name the raters with --raters",
    "first column": "{where}: the first column, {column!r}, has the same grades as the "
    "others: add --no-item if it is a rater, or --item {name} if it names the items",
    "grades as names": "{where}: the names of the columns, {columns}, may be grades: "
    "add --no-header if this line is a row like the others, or name the raters with "
    "--raters{names} if they are raters",
    "counts": "rows sum to {total:g}: if this is a table of counts, items by "
    "categories, add --counts; if the columns are raters, name them with "
    "--raters{names}",
    "rating as names": "{names} may be a rating: add --no-header if this line is a "
    "row, or --header {line} if it has the names of the columns",
    "comments": "{n} different texts in {n_cells} cells look like comments, not "
    "grades: name the raters with --raters",
    "summary row": "{item!r} looks like a summary of other rows or a comment: delete "
    "the line, or give the item another name",
    # warnings of columns
    "apart": "columns with no value in common with the others: {columns}; {advice}",
    "many raters": "{n} columns are read as raters of {n_items} items; if each row is "
    "a rater, add --transpose",
    "second header": "{where} has grades that occur nowhere else: {advice}",
    "numbered": "no item was rated twice: {columns} may only number the rows; name the "
    "column of the items with --item",
    "alike": "{kind} that differ only in spelling are counted as different: {names}",
    "summary": "read as items: {names}; delete them if they are comments or summaries "
    "of other rows",
    "no grade of": "rater {rater!r} gave no grade",
    "qualtrics": "{first} to {last} are left out because they have questions and "
    "import ids of Qualtrics",
    "errors": "formulas with errors in the workbook are read as empty cells: {errors}",
    "stream": "read in batches: items whose names differ only in spelling, or that sum "
    "up others, are not looked for",
    # tables of counts
    "count": "--{kind} needs whole numbers from 0 to 1e12, got {text!r}{hint}",
    "no counts": "--{kind}: needed at least one rating, got none",
    "other categories": "--categories: needed the names of the columns, {names}, in "
    "order, got {categories}",
    "rows of table": "--table: needed as many rows as categories, {n}, got {n_rows}; "
    "if no column names the rows, add --no-item",
    "names of table": "--table: needed the same categories in rows and columns, got "
    "{rows} and {names}",
    "sum column": "{column!r} is the sum of the other columns: leave it out with "
    "--ignore {name}, or name the columns of the categories with --raters",
    "sum row": "{where} is the sum of the rows above: delete it",
    "category or item": "the first column, {column!r}, may name items or be a "
    "category: add --item {name} if it names items, or --no-item if it does not",
    "items twice": "{column!r} has the same item more than once; each row is counted "
    "as a separate item",
    # grades
    "no grades": "needed at least one grade, got none",
    "other grade": "needed one of {scale}, got {got}{hint}",
    "looks missing": "{got} may mean that a grade is missing: if so, add --missing "
    "{codes}; if not, list all grades with --categories",
    "broken": "needed a grade on one line, got {got}: perhaps a quote is not closed",
    "thousands": "{got} may have a thousands separator: {ways}",
    "thousands read": "read with a thousands separator: {got}; --thousands {mark} "
    "confirms it",
    "groups": "--thousands: needed {mark!r} before groups of three digits, got {got}",
    "units": "unit {unit!r} in {got}: remove it with --units, or keep it by listing "
    "all grades with --categories",
    "no unit": "--units: needed a number with {unit}, got {got}{hint}",
    "no set": "--set-separator: needed {separator!r} between labels in at least one "
    "cell, and no semicolon in a label, got {got}",
    "decimal comma": "{got} may be a number with a decimal comma or two labels: "
    "--decimal , reads it as a number, --set-separator , as two labels",
    "plus": "{got} beside grades such as {other!r} may be a number or the grade "
    "'{grade}': list all grades in order with --categories",
    "truth": "{got} may mean 0 or 1, or be grades of their own: write equal grades "
    "alike, or list all grades with --categories",
    "alike grades": "grades that differ only in spelling are counted as different: "
    "{grades}",
    "too near": "{one} and {other} are too close to differ as numbers, so weights use "
    "the position of each grade in the scale",
    "measurements": "{n} different numbers in {n_ratings} ratings look like "
    "measurements: percent agreement and unweighted kappas count only equal numbers; "
    "--coefficients icc_a1 or --metric interval takes the distances into account",
    "far": "{grades}: far from the other grades{hint}",
    "no number": "not a number: {got} ({where}), so all grades are read as text{hint}",
    "number": "a number among grades that are text: {got} ({where}){hint}",
    # ratings
    "twice": "{rows}: {rater!r} graded {item!r} more than once: name a column that "
    "distinguishes these ratings with --by or --session, or keep one with --repeated "
    "first, last or mean; limits of agreement can use all of them{guess}",
    "means": "--repeated mean: needed grades that are numbers, without --categories, "
    "got {grades}; --repeated first or last keeps one",
    "two clusters": "{rows}: needed one cluster for item {item!r} in column "
    "{column!r}, got {both}; if items are numbered within clusters, name both columns "
    "with --item",
}
