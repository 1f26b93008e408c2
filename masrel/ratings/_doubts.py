"""What in a table looks as if it were something else: refused, or warned of by name."""

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import filterfalse

import numpy as np
from numpy.typing import NDArray

from masrel.ratings._grade_texts import (
    USUAL_MISSING,
    alike_texts,
    is_number,
    normal_form,
    quoted,
)
from masrel.ratings._layout import Layout
from masrel.ratings._text_cells import Sheet
from masrel.scales import Scale

# Names of columns that are seldom those of raters.
_NO_RATER = re.compile(
    r"(age|sex|gender|comments?|notes?|remarks?|mean|average|avg|median|sd|total|sum|"
    r"id|index|date|day|time|timestamp|duration|lead_time|gold|truth|ground_truth|"
    r"reference|consensus|majority|adjudicated|weight|height|bmi|group|site|cent(er|re)|"
    r"diagnosis|side|text|email|n|count|unnamed: \d+)",
    re.IGNORECASE,
)
# Names of columns that name items: a word of these, in any case.
_ITEM_NAME = re.compile(
    r"|#|(.*[^a-z])?(id|no|nr|num|key|code|name|participants?|[a-z]*(item|subject|patient|"
    r"person|case|row|index|unit|record|target|stimulus|image|document|sample|file|model|"
    r"video|task|label)(s|id|no|nr|name|code)?)([^a-z].*)?",
    re.IGNORECASE,
)
# Names of rows that summarize the others.
_SUMMARY = re.compile(
    r"(grand )?(total|sum|mean|average|avg|median|sd|s\.d\.|std|min|max|n|count|all)s?"
    r"|[Σσ]|kappa|agreement",
    re.IGNORECASE,
)
_MAX_COMPARED = 2000  # columns that are compared with all others
_SHOWN = 6


def without_second_header(sheet: Sheet) -> tuple[Sheet, list[str]]:
    """Leave Qualtrics' lines of questions and import ids out, and say so."""
    for row in range(min(2, len(sheet.cells))):
        if all('"ImportId"' in cell for cell in sheet.cells[row] if cell):
            text = (
                f"{sheet.where(0)} to {sheet.where(row)} are questions and import ids "
                "of Qualtrics, no ratings: left out"
            )
            dropped = {**sheet.dropped, "second header": row + 1}
            rest = slice(row + 1, None)
            cells, numbers = sheet.cells[rest], sheet.numbers[rest]
            return replace(sheet, cells=cells, numbers=numbers, dropped=dropped), [text]
    return sheet, []


def doubt_errors(sheet: Sheet) -> list[str]:
    """Warn of a workbook's errors of formulas, which come as empty cells."""
    errors = sheet.facts.get("errors", {})
    if not errors:
        return []
    listed = ", ".join(f"{text} ×{n}" for text, n in errors.items())
    return [f"errors of formulas in the workbook are read as empty cells: {listed}"]


def doubt_of_name(column: str) -> str:
    """Return how the warning of a column begins that is called as no rater is."""
    return f"column {column!r} counts as a rater"


def doubt_columns(
    sheet: Sheet,
    layout: Layout,
    codes: NDArray[np.int64],
    scale: Scale,
    freq: NDArray[np.int64] | None = None,
) -> list[str]:
    """Refuse or warn of columns of a wide table that are no raters."""
    # codes (n_items, n_raters): places in the scale, -1 where missing; freq: how often
    # each row is there, if not once
    names = [sheet.header[place] for place in layout.raters]
    _refuse_contingency(sheet, layout, names)
    warnings = _first_line(sheet, layout, names, scale)
    warnings += _first_column(sheet, layout, scale)
    odd = _unlike(codes, scale) if len(names) <= _MAX_COMPARED else set()
    named = {k for k, name in enumerate(names) if _NO_RATER.fullmatch(name)}
    nonsense = sorted(odd & named)
    if nonsense and len(names) > 1:
        doubtful = sorted(odd | named) if len(odd) < len(names) else nonsense
        listed = [names[k] for k in doubtful]
        raise sheet.error(
            f"{', '.join(map(repr, listed))}: no grade in common with the other "
            "columns, or the name of something else: --ignore "
            f"{quoted(listed)} leaves such columns aside, --raters names those that "
            "rate"
        )
    warnings += [
        f"{doubt_of_name(names[k])}; if it is none, --ignore {quoted([names[k]])}"
        for k in sorted(named)
    ]
    alone = [names[k] for k in sorted(odd - named)][:_SHOWN]
    if alone and len(names) > 1:
        warnings.append(
            f"no grade in common with the other columns: {', '.join(map(repr, alone))}"
            f"; if it is no rater, --ignore {quoted(alone)}"
        )
    return [
        *warnings,
        *_looks_counted(names, codes, scale, freq),
        *_second_header(sheet, codes, scale),
    ]


def _refuse_contingency(sheet: Sheet, layout: Layout, names: Sequence[str]) -> None:
    if len(layout.item) != 1 or len(names) != len(sheet.cells) or len(names) < 2:
        return
    rows = [str(cell).strip() for cell in sheet.column(layout.item[0])]
    if set(rows) == set(names):
        raise sheet.error(
            "rows and columns have the same names, so that this looks like a "
            "contingency table of two raters: --table reads it as one"
        )


def _first_line(
    sheet: Sheet, layout: Layout, names: Sequence[str], scale: Scale
) -> list[str]:
    # names that are grades, and more names than rows
    if not sheet.has_header or sheet.is_transposed:
        return []
    grades = set(map(normal_form, scale.grades))
    are_numbers = all(map(is_number, scale.grades))
    n_grades = sum(
        normal_form(name) in grades
        or name in USUAL_MISSING
        or (are_numbers and is_number(name))
        for name in names
    )
    warnings = []
    firsts = [(sheet.header[p], str(sheet.column(p)[0])) for p in layout.item]
    # P1 above P2; a name that is no item's above its names
    is_numbered = any(_numbered(name) == _numbered(cell) for name, cell in firsts)
    is_named = firsts and all(_ITEM_NAME.fullmatch(name) for name, _ in firsts)
    if is_numbered or (n_grades >= len(names) / 2 and not is_named):
        warnings.append(
            f"the names of the columns, {', '.join(map(repr, names[:_SHOWN]))}, may be "
            "grades: --no-header if the first line is a row like the others, --counts "
            "if cells are numbers of raters"
        )
    if layout.is_item_guessed and len(names) > 2 * len(sheet.cells):
        warnings.append(
            f"{len(names)} columns count as raters of {len(sheet.cells)} items: "
            "--transpose if a row is a rater"
        )
    return warnings


def _numbered(name: str) -> str:
    return re.sub(r"\d+", "0", name)


def _first_column(sheet: Sheet, layout: Layout, scale: Scale) -> list[str]:
    # The first column is the item because nothing else was: it may be a rater.
    if not layout.is_item_guessed:
        return []
    place = layout.item[0]
    name = sheet.header[place]
    cells = [str(cell).strip() for cell in sheet.column(place)]
    distinct = set(cells)
    numbers = {float(g) for g in scale.grades if is_number(g)}
    ends = (min(numbers, default=0.0), max(numbers, default=0.0) + 1)
    n_in_scale = sum(c in scale.grades or _is_among(c, numbers) for c in distinct)
    n_near = sum(is_number(c) and ends[0] <= float(c) <= ends[1] for c in distinct)
    if len(distinct) < len(cells) and n_in_scale < len(distinct):
        return []  # refused as repeated
    choices = (
        f"--no-item if it is a rater, --item {quoted([name])} if it names the items"
    )
    if len(distinct) < len(cells):
        raise sheet.error(
            f"{sheet.line_of(0)}: the first column, {name!r}, holds grades like the "
            f"others: {choices}"
        )
    if max(n_in_scale, n_near) < len(distinct) / 2 or _ITEM_NAME.fullmatch(name):
        return []
    return [f"the first column, {name!r}, is taken for the names of items: {choices}"]


def _is_among(text: str, numbers: set[float]) -> bool:
    return is_number(text) and float(text) in numbers


def _unlike(codes: NDArray[np.int64], scale: Scale) -> set[int]:
    # columns without a grade, or a value, in common with any other
    rated = [_distinct(column[column >= 0]) for column in codes.T]
    known = np.flatnonzero([len(grades) for grades in rated])
    if len(known) < 2:
        return set()
    if all(map(is_number, scale.grades)):  # measurements seldom are the same twice
        values = np.array(scale.values)
        low, high = (values[[rated[k][end] for k in known]] for end in (0, -1))
        n_like = ((low[:, None] <= high) & (low <= high[:, None])).sum(axis=1)
        return set(known[n_like == 1].tolist())  # each is like itself
    n_columns = np.bincount(np.concatenate(rated), minlength=len(scale.grades))
    return {int(k) for k in known if (n_columns[rated[k]] == 1).all()}


def _distinct(codes: NDArray[np.int64]) -> NDArray[np.int64]:
    ascending = np.sort(codes)  # `np.unique` loads masked arrays, which takes longer
    return np.concatenate([ascending[:1], ascending[1:][np.diff(ascending) > 0]])


def _looks_counted(
    names: Sequence[str],
    codes: NDArray[np.int64],
    scale: Scale,
    freq: NDArray[np.int64] | None,
) -> list[str]:
    # Whole numbers whose sum is the same in every row, or in most and nowhere above
    # what one of them is alone, as where all raters agree.
    if not all(map(is_number, scale.grades)) or len(codes) < 2 or codes.shape[1] < 2:
        return []
    values = np.array([*scale.values, 0.0])  # a missing count, at -1, is 0
    if (values < 0).any() or (values % 1 != 0).any():
        return []
    sums = values[codes].sum(axis=1)
    total = sums.max()
    has_zeros = 0 in scale.values or bool((codes < 0).any())
    has_zeros |= all(map(is_number, names))  # as names of grades are
    is_most = values.max() == total
    is_most &= np.average(sums == total, weights=freq) >= 1 / 2
    if total < 2 or not has_zeros or not ((sums == total).all() or is_most):
        return []
    are = "every row sums" if sums.min() == total else "most rows sum"
    return [
        f"{are} to {total:g}, so that this may be a table of counts, items by "
        "categories: --counts reads it as one"
    ]


def _second_header(sheet: Sheet, codes: NDArray[np.int64], scale: Scale) -> list[str]:
    # a first row whose grades occur nowhere else, while those of the others do
    if len(codes) < 4 or not sheet.has_header or (codes[0] < 0).all():
        return []
    if all(map(is_number, scale.grades)):
        return []
    first, rest = np.unique(codes[0][codes[0] >= 0]), codes[1:]
    if np.isin(first, rest).any() or len(np.unique(rest)) > rest.size / 2:
        return []
    return [
        f"{sheet.where(0)} holds grades that occur nowhere else: if it is a second "
        "line of names, delete it"
    ]


def doubt_long(
    sheet: Sheet, layout: Layout, items: NDArray[np.int64], raters: NDArray[np.int64]
) -> list[str]:
    """Warn of a long table whose items are numbers of rows, or of a second header."""
    warnings = []
    if len(items) > 2 and items.max(initial=0) + 1 == len(items):
        names = ", ".join(repr(sheet.header[place]) for place in layout.item)
        warnings.append(
            f"no item was rated twice: {names} may number the rows, --item names the "
            "column of the items"
        )
    is_first_alone = len(items) > 4 and not (
        (items[1:] == items[0]).any() or (raters[1:] == raters[0]).any()
    )
    if is_first_alone and sheet.has_header:
        warnings.append(
            f"{sheet.where(0)} names a rater and an item that occur nowhere else: if "
            "it is a second line of names, delete it"
        )
    return warnings


def doubt_names(kind: str, names: Sequence[str]) -> list[str]:
    """Warn of names that differ by spelling alone, and of what is seldom a name."""
    warnings = [
        f"{kind} that differ by spelling alone are counted as different: "
        + ", ".join(map(repr, group))
        for group in alike_texts(names)[:_SHOWN]
    ]
    if kind == "items":
        odd = [n for n in filterfalse(str.isdigit, names) if _is_no_item(n)]
        if 0 < len(odd) < len(names) / 2:
            warnings.append(
                f"{', '.join(map(repr, odd[:_SHOWN]))} counts as an item: if it is a "
                "comment, or sums up other rows, delete it"
            )
    return warnings


def _is_no_item(name: str) -> bool:
    return name[:1] == "#" or (len(name) < 14 and bool(_SUMMARY.fullmatch(name)))


def doubt_counts(sheet: Sheet, layout: Layout, table: NDArray[np.int64]) -> list[str]:
    """Refuse or warn of a table of counts that has sums, or no column of items."""
    # of a table (n_rows, n_categories)
    names = [sheet.header[place] for place in layout.raters]
    warnings = []
    if len(names) > 1 and (2 * table[:, -1] == table.sum(axis=1)).all():
        text = (
            f"{names[-1]!r} is the sum of the other columns: --ignore "
            f"{quoted([names[-1]])} leaves it aside"
        )
        if _SUMMARY.fullmatch(names[-1]):
            raise sheet.error(text)
        warnings += [text] * (len(names) > 2)
    cells = [str(cell).strip() for place in layout.item for cell in sheet.column(place)]
    if len(table) > 2 and (2 * table[-1] == table.sum(axis=0)).all():
        text = f"{sheet.where(len(table) - 1)}: is the sum of the rows above: delete it"
        if cells and _SUMMARY.fullmatch(cells[-1]):
            raise sheet.error(text)
        warnings.append(text)
    warnings += doubt_names("categories", names)
    return warnings + (_doubt_items(sheet, layout, cells) if cells else [])


def _doubt_items(sheet: Sheet, layout: Layout, cells: Sequence[str]) -> list[str]:
    # of a table of counts: cells that may be counts, or the same item twice
    name = sheet.header[layout.item[0]]
    are_counts = all(cell.isdecimal() for cell in cells)
    if layout.kind == "table":
        return []
    if layout.is_item_guessed and are_counts and not _ITEM_NAME.fullmatch(name):
        return [
            f"the first column, {name!r}, is taken for the names of items: --no-item "
            "if it is a category"
        ]
    if len(layout.item) == 1 and len(set(cells)) < len(cells) and layout.by is None:
        return [f"{name!r} names items more than once: each row counts as an item"]
    return []
