"""Which column of a sheet is what: named by the caller, else by its usual name."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Literal

import numpy as np

from masrel.errors import RatingsError
from masrel.ratings._findings import (
    USUAL_MISSING,
    Finding,
    Reading,
    listed,
    quoted,
)
from masrel.ratings._grade_texts import is_number, normal_form, spelled_alike
from masrel.ratings._sheet import Codes, Column, Sheet
from masrel.scales import Scale

Kind = Literal["long", "wide", "counts", "table"]

USUAL_NAMES = {
    "item": (
        *("item", "item_id", "model", "subject", "subject_id", "patient", "patient_id"),
        *("case", "unit", "task", "task_id", "document", "video"),
    ),
    "rater": (
        *("rater", "rater_id", "annotator", "annotator_id", "coder", "coder_id"),
        *("judge", "observer", "worker", "worker_id", "assessor", "reviewer"),
    ),
    "grade": ("grade", "rating", "score", "label"),
    "session": ("session",),
}
"""Names that are recognized, letter case aside."""

STUDY_COLUMNS = ("session", "rater", "model", "repeat", "grade")
"""Columns of a table that `masrel ratings` writes; it has others, too."""

# Options that name columns, and which two may name the same: groups may be sessions,
# raters, or part of the items' names, as clusters may be.
_NAMED = (
    *("raters", "ignore", "item", "rater", "grade", "session", "by", "clusters"),
    "frequency",
)
_MAY_BE_BOTH = (
    *({"by", "session"}, {"by", "rater"}, {"by", "item"}, {"by", "clusters"}),
    {"clusters", "item"},
)

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Positions of columns."""

    kind: Kind
    item: tuple[int, ...]  # none where rows are items without names
    raters: tuple[int, ...]  # the one with their names, of a long table; or categories
    grades: tuple[int, ...]  # the one that has them, of a long table; else the raters'
    session: int | None = None
    by: int | None = None
    clusters: int | None = None
    frequency: int | None = None
    # whether the item is the first column because nothing else was said of it
    is_item_guessed: bool = False


def find_layout(sheet: Sheet, options: Reading) -> Layout:
    """Decide which column is what, or say which option would."""
    named = {
        option: _columns_of(sheet, option, getattr(options, option))
        for option in _NAMED
        if getattr(options, option)
    }
    for one, other in combinations(named, 2):
        both = set(named[one]) & set(named[other])
        if both and {one, other} not in _MAY_BE_BOTH:
            raise sheet.refuse(
                "two roles",
                options=f"--{one}, --{other}",
                column=sheet.header[min(both)],
            )
    taken = set(named.get("ignore", ()))
    session = named.get("session") or _usual(sheet, "session", taken)
    by, clusters = named.get("by", ()), named.get("clusters", ())
    often = named.get("frequency", ())
    taken |= {*session, *by, *clusters} - ({*clusters} & {*named.get("item", ())})
    taken |= {*often}
    is_counted = options.counts or options.table
    # the corner of a transposed table names its rows, which are now its columns
    is_wide = is_counted or "raters" in named or options.no_item or bool(often)
    is_wide |= sheet.is_transposed and not {"rater", "grade"} & named.keys()
    layout = None if is_wide else _long(sheet, named, taken)
    if layout is None:
        layout = _wide(sheet, options, named, taken)
    return replace(
        layout,
        session=None if is_counted or not session else session[0],
        by=by[0] if by else None,
        clusters=clusters[0] if clusters else None,
        frequency=often[0] if often else None,
    )


def _columns_of(
    sheet: Sheet, option: str, values: str | Sequence[str]
) -> tuple[int, ...]:
    # the columns that an option names: one, or several between commas or one a value
    several = [[values]] if isinstance(values, str) else [v.split(",") for v in values]
    places: list[int] = []
    for parts in several:
        while parts:
            # the longest name first: names of columns may hold commas
            joined = [",".join(parts[:n]).strip() for n in range(len(parts), 0, -1)]
            name = next((name for name in joined if name in sheet.header), None)
            if name is None:
                from difflib import get_close_matches  # loaded only for an error

                near = get_close_matches(joined[-1], sheet.header, n=1)
                raise sheet.refuse(
                    "no column",
                    option=f"--{option}",
                    column=joined[-1],
                    columns=f"but {listed(sheet.header, 12)}",
                    hint=f"; did you mean {near[0]!r}?" if near else "",
                )
            place = sheet.header.index(name)
            if place in places:
                raise sheet.refuse("two roles", options=f"--{option}", column=name)
            places.append(place)
            parts = parts[len(parts) - joined.index(name) :]
    return tuple(places)


def _usual(sheet: Sheet, role: str, taken: set[int]) -> tuple[int, ...]:
    # the column that has a usual name of a role, or none
    usual = USUAL_NAMES[role]
    named = (k for k, n in enumerate(sheet.header) if n.casefold() in usual)
    places = tuple(place for place in named if place not in taken)
    if len(places) > 1:
        raise sheet.refuse(
            "role twice",
            where=sheet.at(0),
            role=role,
            names=" and ".join(sheet.header[place] for place in places),
        )
    return places


def _long(
    sheet: Sheet, named: dict[str, tuple[int, ...]], taken: set[int]
) -> Layout | None:
    # None where the table is not long
    header = sheet.header
    roles = {role: named.get(role, ()) for role in ("item", "rater", "grade")}
    taken = taken.union(*roles.values())
    for role in ("rater", "grade"):
        roles[role] = roles[role] or _usual(sheet, role, taken)
    if not roles["rater"] and not roles["grade"]:
        return None
    taken = taken.union(*roles.values())
    if not roles["item"] and set(STUDY_COLUMNS) <= set(header):
        roles["item"] = header.index("model"), header.index("repeat")
    roles["item"] = roles["item"] or _usual(sheet, "item", taken)
    left = set(range(len(header))) - taken.union(roles["item"])
    unknown = [role for role, places in roles.items() if not places]
    if len(unknown) == len(left) == 1:
        roles[unknown.pop()] = tuple(left)
    if unknown:
        known = (f"the {r} is {header[p[0]]!r}" for r, p in roles.items() if p)
        raise sheet.refuse(
            "unknown role",
            where=sheet.at(0),
            known=", ".join(known),
            needed=" and ".join(f"--{role}" for role in unknown),
            columns=f"but {listed(header, 12)}",
        )
    item, raters, grades = roles.values()
    return Layout(kind="long", item=item, raters=raters, grades=grades)


def _wide(
    sheet: Sheet,
    options: Reading,
    named: dict[str, tuple[int, ...]],
    taken: set[int],
) -> Layout:
    # a wide table, or one of counts
    kind: Kind = "counts" if options.counts else "table" if options.table else "wide"
    item, raters, is_guessed = named.get("item", ()), named.get("raters", ()), False
    places = range(len(sheet.header))
    if not item and not options.no_item:
        others = taken.union(raters)
        item = () if kind == "table" else _usual(sheet, "item", others)
        if not item:
            item = tuple([place for place in places if place not in others][:1])
            is_guessed = bool(item)
        # patterns of ratings need no names, as items do
        if "frequency" in named:
            is_guessed = False
            item = tuple(place for place in item if names_rows(sheet, place))
    raters = raters or tuple(k for k in places if k not in taken.union(item))
    if not raters:
        raise sheet.refuse("no rater", where=sheet.at(0))
    return Layout(
        kind=kind, item=item, raters=raters, grades=raters, is_item_guessed=is_guessed
    )


def names_rows(sheet: Sheet, place: int) -> bool:
    """Return whether a column is called as names of items are, and all differ."""
    n_rows, name = len(sheet.numbers), sheet.header[place]
    is_name = _ITEM_NAME.fullmatch(name) is not None
    return not name or (is_name and len(sheet.columns[place].texts) == n_rows)


def named(sheet: Sheet, role: str, places: Sequence[int]) -> Column:
    """Return what items or raters are called: by columns together, or by numbers."""
    columns = [sheet.columns[place] for place in places]
    if not columns:
        n_rows = len(sheet.numbers)
        return Column(np.arange(n_rows), [str(n) for n in range(1, n_rows + 1)])
    for place, column in zip(places, columns, strict=True):
        for text in set(USUAL_MISSING).intersection(column.texts):
            row = int(np.argmax(column.is_text(text)))
            raise sheet.refuse("unnamed", sheet.where(row), place, role=role, got=text)
    if len(columns) == 1:
        return columns[0]
    codes, names = together(columns)
    return Column(codes, [" ".join(texts) for texts in names])


def together(columns: Sequence[Column]) -> tuple[Codes, list[tuple[str, ...]]]:
    """Return the number of every row's texts in some columns, and these texts."""
    number: dict[tuple[int, ...], int] = {}
    rows = zip(*(column.codes.tolist() for column in columns), strict=True)
    codes = [number.setdefault(row, len(number)) for row in rows]
    texts = [
        tuple(column.texts[k] for column, k in zip(columns, row, strict=True))
        for row in number
    ]
    return np.array(codes, dtype=np.int64), texts


def rated_twice(
    sheet: Sheet, layout: Layout, rows: Codes, item: str, rater: str
) -> RatingsError:
    """Return the error of a rating that is there twice."""
    guess = ""
    if layout.kind == "wide":
        guess = ", --rater and --grade name the columns of one row a rating"
    guess += ", --no-item says that no column names items" * layout.is_item_guessed
    return sheet.refuse(
        "twice",
        rows=" and ".join(sheet.where(row) for row in rows.tolist()),
        item=item,
        rater=rater,
        guess=guess,
    )


# ---- what looks as if it were something else ----


def without_second_header(sheet: Sheet) -> tuple[Sheet, list[Finding]]:
    """Leave Qualtrics' lines of questions and import ids out, and say so."""
    for row in range(min(2, len(sheet.numbers))):
        cells = [column.texts[column.codes[row]] for column in sheet.columns]
        if all('"ImportId"' in cell for cell in cells if cell):
            finding = Finding("qualtrics", first=sheet.where(0), last=sheet.where(row))
            above = np.arange(len(sheet.numbers)) <= row
            return sheet.without(above, "second header"), [finding]
    return sheet, []


def doubt_columns(
    sheet: Sheet, layout: Layout, codes: Codes, scale: Scale, freq: Codes
) -> list[Finding]:
    """Refuse or warn of columns of a wide table that are no raters."""
    # codes (n_items, n_raters): places in the scale, -1 where missing; freq (n_items,)
    names = [sheet.header[place] for place in layout.raters]
    if len(layout.item) == 1 and len(names) == len(sheet.numbers) > 1:
        if set(sheet.columns[layout.item[0]].texts) == set(names):
            raise sheet.refuse("contingency")
    findings = []
    if sheet.has_header and not sheet.is_transposed:
        findings = _first_line(sheet, layout, names, scale)
    if layout.is_item_guessed:  # it may be a rater
        findings += _first_column(sheet, layout.item[0], scale)
    odd = _unlike(codes, scale) if 1 < len(names) <= _MAX_COMPARED else set()
    named = {k for k, name in enumerate(names) if _NO_RATER.fullmatch(name)}
    if odd & named:
        doubtful = odd | named if len(odd) < len(names) else odd & named
        wrong = [names[k] for k in sorted(doubtful)]
        raise sheet.refuse(
            "no raters", columns=", ".join(map(repr, wrong)), names=quoted(wrong)
        )
    findings += [
        Finding("named rater", column=names[k], name=quoted([names[k]]))
        for k in sorted(named)
    ]
    alone = [names[k] for k in sorted(odd - named)][:_SHOWN]
    if alone:
        findings.append(Finding("apart", columns=listed(alone), names=quoted(alone)))
    if all(map(is_number, scale.grades)):
        findings += _looks_counted(names, codes, scale, freq)
    elif sheet.has_header and len(codes) > 3:
        findings += _second_header(sheet, codes, scale)
    unrated = np.flatnonzero((codes < 0).all(axis=0))[:_SHOWN]
    return findings + [Finding("no grade of", rater=names[k]) for k in unrated]


def _first_line(
    sheet: Sheet, layout: Layout, names: Sequence[str], scale: Scale
) -> list[Finding]:
    # names that are grades, and more names than rows
    grades = set(map(normal_form, scale.grades))
    are_numbers = all(map(is_number, scale.grades))
    n_grades = sum(
        normal_form(name) in grades
        or name in USUAL_MISSING
        or (are_numbers and is_number(name))
        for name in names
    )
    findings = []
    items = [(sheet.header[p], sheet.columns[p].texts[0]) for p in layout.item]
    # P1 above P2; a name that is no item's above its names
    is_numbered = any(
        re.sub(r"\d+", "0", name) == re.sub(r"\d+", "0", cell) for name, cell in items
    )
    is_named = items and all(_ITEM_NAME.fullmatch(name) for name, _ in items)
    if is_numbered or (n_grades >= len(names) / 2 and not is_named):
        columns = ", ".join(map(repr, names[:_SHOWN]))
        findings.append(Finding("grades as names", columns=columns))
    n_items = len(sheet.numbers)
    if layout.is_item_guessed and len(names) > 2 * n_items:
        findings.append(Finding("many raters", n=len(names), n_items=n_items))
    return findings


def _first_column(sheet: Sheet, place: int, scale: Scale) -> list[Finding]:
    # a column that is the item because nothing else was
    name, texts = sheet.header[place], sheet.columns[place].texts
    numbers = {float(grade) for grade in scale.grades if is_number(grade)}
    low, high = min(numbers, default=0.0), max(numbers, default=0.0) + 1
    values = [float(text) for text in texts if is_number(text)]
    n_near = sum(low <= value <= high for value in values)
    n_in_scale = sum(value in numbers for value in values)
    n_in_scale += sum(not is_number(t) and t in scale.grades for t in texts)
    facts: dict[str, Any] = {"column": name, "name": quoted([name])}
    if len(texts) < len(sheet.numbers):
        if n_in_scale == len(texts):
            raise sheet.refuse("first column", where=sheet.at(0), **facts)
        return []  # refused as repeated
    if max(n_in_scale, n_near) < len(texts) / 2 or _ITEM_NAME.fullmatch(name):
        return []
    return [Finding("item or rater", **facts)]


def _unlike(codes: Codes, scale: Scale) -> set[int]:
    # columns without a grade, or a value, in common with any other
    n_grades = len(scale.grades)
    rated = [np.unique(column[column >= 0]) for column in codes.T]
    known = np.flatnonzero([len(grades) for grades in rated])
    if len(known) < 2:
        return set()
    if all(map(is_number, scale.grades)):  # measurements seldom are the same twice
        values = np.array(scale.values)
        low, high = (values[[rated[k][end] for k in known]] for end in (0, -1))
        n_like = ((low[:, None] <= high) & (low <= high[:, None])).sum(axis=1)
        return set(known[n_like == 1].tolist())  # each is like itself
    n_columns = np.bincount(np.concatenate(rated), minlength=n_grades)
    return {int(k) for k in known if (n_columns[rated[k]] == 1).all()}


def _looks_counted(
    names: Sequence[str], codes: Codes, scale: Scale, freq: Codes
) -> list[Finding]:
    # Whole numbers whose sum is the same in every row, or in most and nowhere above
    # what one of them is alone, as where all raters agree.
    values = np.array([*scale.values, 0.0])  # a missing count, at -1, is 0
    if min(codes.shape) < 2 or (values < 0).any() or (values % 1 != 0).any():
        return []
    sums = values[codes].sum(axis=1)
    total = sums.max()
    has_zeros = 0 in scale.values or bool((codes < 0).any())
    has_zeros |= all(map(is_number, names))  # as names of grades are
    is_most = values.max() == total
    is_most &= np.average(sums == total, weights=freq) >= 1 / 2
    if total < 2 or not has_zeros or not ((sums == total).all() or is_most):
        return []
    return [Finding("counts", total=total)]


def _second_header(sheet: Sheet, codes: Codes, scale: Scale) -> list[Finding]:
    # a first row whose grades occur nowhere else, while those of the others do
    rest = np.bincount(codes[1:].ravel() + 1, minlength=len(scale.grades) + 1)[1:]
    n_met = np.count_nonzero(rest) + bool((codes[1:] < 0).any())
    is_known = (rest[codes[0][codes[0] >= 0]] > 0).any()
    if is_known or (codes[0] < 0).all() or n_met > codes[1:].size / 2:
        return []
    return [Finding("second header", where=sheet.where(0))]


def doubt_items(
    sheet: Sheet, layout: Layout, n_items: int, n_rows: int
) -> list[Finding]:
    """Warn of a long table none of whose items was rated twice."""
    columns = ", ".join(repr(sheet.header[place]) for place in layout.item)
    return [Finding("numbered", columns=columns)] if n_items == n_rows > 2 else []


def doubt_names(kind: str, names: Sequence[str]) -> list[Finding]:
    """Warn of names that differ by spelling alone, and of what is seldom a name."""
    findings = [
        Finding("alike", kind=kind, names=", ".join(map(repr, group)))
        for group in spelled_alike(names)[:_SHOWN]
    ]
    if kind == "items":
        odd = [
            name
            for name in names
            if name[:1] == "#"
            or (len(name) < 14 and not name[-1].isdigit() and _SUMMARY.fullmatch(name))
        ]
        if 0 < len(odd) < len(names) / 2:
            shown = ", ".join(map(repr, odd[:_SHOWN]))
            findings.append(Finding("summary", names=shown))
    return findings


def doubt_counts(sheet: Sheet, layout: Layout, table: Codes) -> list[Finding]:
    """Refuse or warn of a table of counts that has sums, or no column of items."""
    # of a table (n_rows, n_categories)
    names = [sheet.header[place] for place in layout.raters]
    findings = []
    if len(names) > 1 and (2 * table[:, -1] == table.sum(axis=1)).all():
        facts: dict[str, Any] = {"column": names[-1], "name": quoted([names[-1]])}
        if _SUMMARY.fullmatch(names[-1]):
            raise sheet.refuse("sum column", **facts)
        findings += [Finding("sum column", **facts)] * (len(names) > 2)
    if len(table) > 2 and (2 * table[-1] == table.sum(axis=0)).all():
        where = sheet.where(len(table) - 1)
        items = [sheet.columns[place] for place in layout.item]
        if items and _SUMMARY.fullmatch(items[-1].texts[items[-1].codes[-1]]):
            raise sheet.refuse("sum row", where=where)
        findings.append(Finding("sum row", where=where))
    findings += doubt_names("categories", names)
    if layout.kind == "table" or not layout.item:
        return findings
    name, column = sheet.header[layout.item[0]], sheet.columns[layout.item[0]]
    are_counts = all(text.isdecimal() for text in column.texts)
    if layout.is_item_guessed and are_counts and not _ITEM_NAME.fullmatch(name):
        return [*findings, Finding("category or item", column=name)]
    is_twice = len(column.texts) < len(column.codes) and layout.by is None
    if len(layout.item) == 1 and is_twice:
        findings.append(Finding("items twice", column=name))
    return findings
