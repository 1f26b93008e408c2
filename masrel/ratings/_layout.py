"""Roles of columns: named by the caller, or recognised by their usual names."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Literal

import numpy as np

from masrel._input import USUAL_NAMES
from masrel.errors import RatingsError
from masrel.ratings._findings import (
    USUAL_MISSING,
    Finding,
    Reading,
    few,
    listed,
)
from masrel.ratings._grade_texts import is_number
from masrel.ratings._sheet import Codes, Column, Sheet

Kind = Literal["long", "wide", "counts", "table"]
Criteria = dict[str, dict[str, str]]  # criterion to rater to the name of a column

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

_ROLES = ("by", "clusters", "frequency")  # of columns that are only used when named
_MANY_TEXTS = 1000  # of grades, unless most are numbers
# Names of columns that name raters have one of these words.
_RATER = re.compile(
    "rater|annotator|coder|judge|observer|worker|assessor|reviewer|reader|user|expert|"
    "examiner|evaluator",
    re.IGNORECASE,
)
# Two parts of a name, or a word and a number; and a part that is a rater's.
_PARTS = [
    re.compile(pattern)
    for pattern in (
        r"(.+?)[\W_]+(.+?)\W*",
        r"(.+)[\W_]+(.+?)\W*",
        r"([^\W\d_]{3,})(\d+)",
    )
]
_KINDS = (
    "r|rev|obs|ann|dr|novice|nurse|doctor|physician|clinician|student|teacher|human|"
    f"model|llm|resident|therapist|{_RATER.pattern}"
)
_KIND = re.compile(f"({_KINDS})s?", re.IGNORECASE)
_PERSON = re.compile(rf"({_KINDS})[\W_]*(\d+|[a-z])?", re.IGNORECASE)
_CODE = re.compile(r"\d+|[^\W\d_]")
# Names of columns of where a part of a text, or of a recording, begins and ends.
_SPAN = (
    r"((char|token|word|span|text|offset|pos)[\W_]*)?({})([\W_]*(char|token|word|"
    r"offset|pos|position|index|idx))?"
)
_ENDS = ("start|begin|beginning|from|onset", "end|stop|to|offset")
# Names of columns that name items: a word of these, in any case.
ITEM_NAME = re.compile(
    r"|#|(.*[^a-z])?(id|no|nr|num|key|code|name|participants?|[a-z]*(item|subject|patient|"
    r"person|case|row|index|unit|record|target|stimulus|image|document|sample|file|model|"
    r"video|task|label)(s|id|no|nr|name|code)?)([^a-z].*)?",
    re.IGNORECASE,
)


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
    criteria: tuple[tuple[str, str], ...] = ()  # and rater, of every column of ratings
    # whether the item is the first column because nothing else was said of it
    is_item_guessed: bool = False


def find_layout(sheet: Sheet, options: Reading) -> Layout:
    """Decide which column is what, or say which option would."""
    named = {
        option: columns_of(sheet, option, getattr(options, option))
        for option in _NAMED
        if getattr(options, option)
        if not (option == "raters" and options.by_criterion)  # parts of names
    }
    for one, other in combinations(named, 2):
        both = set(named[one]) & set(named[other])
        if both and {one, other} not in _MAY_BE_BOTH:
            raise sheet.refuse(
                "two roles",
                options=f"--{one}, --{other}",
                column=sheet.header[min(both)],
            )
    ignored, item = {*named.get("ignore", ())}, named.get("item", ())
    session = named.get("session") or _usual(sheet, "session", ignored)
    by, clusters, often = (named.get(role, ()) for role in _ROLES)
    taken = {*session, *by, *clusters} - ({*clusters} & {*item})
    taken |= {*ignored, *often}
    is_counted = options.counts or options.table
    # the corner of a transposed table names its rows, which are now its columns
    is_wide = is_counted or "raters" in named or options.no_item or bool(often)
    is_wide |= sheet.is_transposed and not {"rater", "grade"} & named.keys()
    # columns of raters, whose names may be usual ones of something else
    known = {k for k, name in enumerate(sheet.header) if name in options.vouched}
    layout = None
    if options.by_criterion:
        layout = _of_criteria(sheet, options, item, taken)
    elif not is_wide:
        layout = _long(sheet, options, named, taken | known)
    layout = layout or _wide(sheet, options, named, taken, known)
    roles = (layout.item, layout.raters, layout.grades, session, by, clusters, often)
    _refuse_names(sheet, set().union(*roles))
    first: dict[str, Any] = {role: named[role][0] for role in _ROLES if role in named}
    if session and not is_counted:
        first["session"] = session[0]
    return replace(layout, **first)


def _refuse_names(sheet: Sheet, used: set[int]) -> None:
    # columns that are used and have no name, or one that is there twice
    twice = Counter(sheet.header)
    for place in sorted(used):
        name = sheet.header[place]
        # the first may be R's or pandas' row names
        if (twice[name] > 1) if name else place:
            cells = {text for place in used for text in sheet.columns[place].texts}
            hint = "; name the raters with --raters" * (not sheet.advice)
            if cells & {sheet.header[k] for k in used} - {""}:
                hint = "; add --no-header if this line is a row like the others"
            code, facts = (
                "same name" if name else "no name",
                {"hint": hint} if hint else {},
            )
            raise sheet.refuse(
                code, where=sheet.at(0), column=name or place + 1, **facts
            )


def columns_of(
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
                    columns=listed(sheet.header, 12),
                    **({"hint": f"; did you mean {near[0]!r}?"} if near else {}),
                )
            same = [place for place, n in enumerate(sheet.header) if n == name]
            if same[0] in places:
                raise sheet.refuse("two roles", options=f"--{option}", column=name)
            places += same if option == "ignore" else same[:1]
            parts = parts[len(parts) - joined.index(name) :]
    return tuple(places)


def _usual(sheet: Sheet, role: str, taken: set[int]) -> tuple[int, ...]:
    # the column that has a usual name of a role, or none
    usual = USUAL_NAMES[role]
    named = (k for k, n in enumerate(sheet.header) if n.casefold() in usual)
    places = tuple(place for place in named if place not in taken)
    if len({sheet.header[place] for place in places}) < len(places):
        return ()  # names are refused, and not what is called so
    if len(places) > 1:
        raise sheet.refuse(
            "role twice",
            where=sheet.at(0),
            role=role,
            names=" and ".join(sheet.header[place] for place in places),
        )
    return places


def _long(
    sheet: Sheet,
    options: Reading,
    named: dict[str, tuple[int, ...]],
    taken: set[int],
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
    _refuse_spans(sheet, roles["item"], named)
    unknown = [role for role, places in roles.items() if not places]
    # what is left over may be something else than raters
    is_clear = unknown != ["rater"] or any(_RATER.search(header[k]) for k in left)
    if is_clear and len(unknown) == len(left) == 1:
        roles[unknown.pop()] = tuple(left)
    if unknown:
        known = (f"the {r} is {header[p[0]]!r}" for r, p in roles.items() if p)
        raise sheet.refuse(
            "unknown role",
            where=sheet.at(0),
            known=", ".join(known),
            needed=" and ".join(f"--{role}" for role in unknown),
            columns=listed(header, 12),
        )
    item, raters, grades = roles.values()
    if sheet.has_header and not options.names_at:
        _refuse_rows_of_names(sheet, (*item, *raters, *grades))
    return Layout(kind="long", item=item, raters=raters, grades=grades)


def _refuse_rows_of_names(sheet: Sheet, places: Sequence[int]) -> None:
    # names of a long text that are an item and a rater of the rows
    names, one = [sheet.header[place] for place in places], str(sheet.line_of(0))
    *_, rater, grade = columns = [sheet.columns[place] for place in places]
    if all(name in of.texts for name, of in zip(names[:-1], columns, strict=False)):
        raise sheet.refuse(
            "rating as names", sheet.at(0), names=listed(names), line=one
        )
    # and a first row whose item, rater and grade occur nowhere else
    are_rare = all((column.codes == 0).sum() == 1 for column in columns)
    # while another rater does, and it is no measurement
    are_rare &= 4 < len(sheet.numbers) > len(rater.texts) and not is_number(
        grade.texts[0]
    )
    if are_rare and (facts := two_lines(sheet)):
        raise sheet.refuse("second header", **facts)


def two_lines(sheet: Sheet) -> dict[str, str]:
    """Return how a first row of names is read as such; none if names are in no line."""
    if not sheet.facts.keys() & {"delimiter", "sheet"}:
        return {}
    one, two = sheet.line_of(0), sheet.line_of(int(sheet.numbers[0]))
    option = f"--header {one},{two}" if two == one + 1 else f"--skip {two - 1}"
    advice = f"add {option} if these are names, --header {one} if they are grades"
    return {"where": sheet.where(0), "advice": advice}


def _wide(
    sheet: Sheet,
    options: Reading,
    named: dict[str, tuple[int, ...]],
    taken: set[int],
    known: set[int],
) -> Layout:
    # a wide table, or one of counts
    kind: Kind = "counts" if options.counts else "table" if options.table else "wide"
    item, raters, is_guessed = named.get("item", ()), named.get("raters", ()), False
    places = range(len(sheet.header))
    if not item and not options.no_item:
        others = taken.union(raters, known)
        usual = () if kind == "table" else _usual(sheet, "item", others)
        item = usual or tuple([place for place in places if place not in others][:1])
        is_guessed = bool(item) and not usual and "frequency" not in named
        # patterns of ratings need no names, as items do
        if "frequency" in named:
            item = tuple(place for place in item if names_rows(sheet, place))
    raters = raters or tuple(k for k in places if k not in taken.union(item))
    if not raters:
        raise sheet.refuse("no rater", where=sheet.at(0))
    if kind == "wide" and not options.frequency:
        _refuse_spans(sheet, item, named)
    if kind == "wide" and "raters" not in named:
        _refuse_comments(sheet, raters)
    return Layout(
        kind=kind, item=item, raters=raters, grades=raters, is_item_guessed=is_guessed
    )


def _refuse_comments(sheet: Sheet, raters: Sequence[int]) -> None:
    # so many texts, few of them numbers, that hardly any is there twice
    texts = [text for place in raters for text in sheet.columns[place].texts]
    n, n_cells = len(texts), len(raters) * len(sheet.numbers)
    if n > _MANY_TEXTS and 2 * n > n_cells:
        if 2 * sum(re.search(r"\d", text) is None for text in texts) > n:
            raise sheet.refuse("comments", n=n, n_cells=n_cells)


def _of_criteria(
    sheet: Sheet, options: Reading, item: tuple[int, ...], taken: set[int]
) -> Layout:
    # a wide table whose columns are criteria by raters
    header, raters = sheet.header, [r for of in options.raters for r in of.split(",")]
    free = [k for k in range(len(header)) if k not in taken.union(item)]
    ways = criteria_of([header[place] for place in free], raters)
    if len(ways) > 1:
        first, second = (few(list(of[next(iter(of))])) for of in ways)
        raise sheet.refuse("who rates", first=first, second=second)
    pair = {n: (c, r) for way in ways for c, of in way.items() for r, n in of.items()}
    rest = [place for place in free if header[place] not in pair]
    if not item and not options.no_item:
        item = _usual(sheet, "item", {*free} - {*rest}) or tuple(rest[:1])
    others = [header[place] for place in rest if place not in item]
    if not pair or (others and not raters):
        known = listed(list(dict.fromkeys(rater for _, rater in pair.values())))
        facts = {"columns": listed(others), "names": few(others), "raters": known}
        raise sheet.refuse("no criterion" if pair else "no criteria", **facts)
    places = tuple(place for place in free if header[place] in pair)
    criteria = tuple(pair[header[place]] for place in places)
    return Layout(
        kind="wide", item=item, raters=places, grades=places, criteria=criteria
    )


def criteria_of(names: Sequence[str], raters: Sequence[str] = ()) -> list[Criteria]:
    """Return the columns of criteria by raters, as their names may be read.

    One way, none, or two where either part of a name may be the rater.
    """
    grids = [grid for parts in _PARTS for grid in _grids(parts, names, {*raters})]
    grid = max(grids, key=lambda of: sum(map(len, of.values())), default={})
    if raters or not grid:
        return [grid] * bool(grid)
    one, other = list(grid), list(next(iter(grid.values())))
    if any(  # raters of two kinds, numbered
        all(map(_KIND.fullmatch, kinds)) and all(map(_CODE.fullmatch, numbers))
        for kinds, numbers in ((one, other), (other, one))
    ):
        return []
    turned = {name: {part: grid[part][name] for part in one} for name in other}
    more = _like_raters(other, one) - _like_raters(one, other)
    return [grid] * (more >= 0) + [turned] * (more <= 0)


def _grids(
    pattern: re.Pattern[str], names: Sequence[str], raters: set[str]
) -> Iterator[Criteria]:
    # names of two parts, each of which stands beside the same others
    parts = {name: m.groups() for name in names if (m := pattern.fullmatch(name))}
    firsts = {first for first, _ in parts.values()}
    parts = {n: (n, "") for n in names if n in firsts and n not in parts} | parts
    for side in (0, 1):
        of_part: Criteria = {}
        for name, pair in parts.items():
            if not raters or pair[1 - side] in raters:
                of_part.setdefault(pair[side], {})[pair[1 - side]] = name
        blocks: dict[frozenset[str], Criteria] = {}
        for part, of in of_part.items():
            blocks.setdefault(frozenset(of), {})[part] = of
        if raters:
            blocks = {frozenset().union(*blocks): of_part}
        for others, block in blocks.items():
            if raters <= others if raters else min(len(block), len(others)) > 1:
                yield block


def _like_raters(parts: Sequence[str], others: Sequence[str]) -> int:
    # how much parts of names are like names of raters: numbers are of anything
    are_names = all(part[:1].isupper() and part.isalpha() for part in parts)
    are_names &= not any(map(_CODE.fullmatch, (*parts, *others)))
    return 2 if all(map(_PERSON.fullmatch, parts)) else int(are_names)


def _refuse_spans(
    sheet: Sheet, item: tuple[int, ...], named: dict[str, tuple[int, ...]]
) -> None:
    # columns of where a part begins and ends, unless every item is one such part
    pair = [
        place
        for pattern in _ENDS
        for place, name in enumerate(sheet.header)
        if re.fullmatch(_SPAN.format(pattern), name, re.IGNORECASE)
        if place not in named.get("ignore", ())
    ]
    if len(pair) != 2:
        return
    texts, parts, items = (
        together([sheet.columns[place] for place in places])[1] if places else []
        for places in (pair, (*item, *pair), item)
    )
    texts = [ends for ends in texts if not {*ends} & {*USUAL_MISSING}]
    are_spans = texts and all(
        is_number(begin) and is_number(end) and float(begin) <= float(end)
        for begin, end in texts
    )
    if are_spans and ({*item} & {*pair} or len(items) < len(parts)):
        begin, end = (sheet.header[place] for place in pair)
        raise sheet.refuse("span columns", begin=begin, end=end)


def names_rows(sheet: Sheet, place: int) -> bool:
    """Return whether a column is called as names of items are, and all differ."""
    name, n_texts = sheet.header[place], len(sheet.columns[place].texts)
    return not name or bool(ITEM_NAME.fullmatch(name) and n_texts == len(sheet.numbers))


def sides_of(
    rows: Sequence[str], columns: Sequence[str]
) -> tuple[list[str], list[str], tuple[str, str]] | None:
    """Return the categories of both sides of a table, and the raters' names in them."""
    return next(
        (
            (one, other, (first, second))
            for first, one in _without_names(rows)
            for second, other in _without_names(columns)
            if set(one) == set(other) and len(one) == len(set(one)) == len(other)
        ),
        None,
    )


def _without_names(texts: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    # texts as they are, and without words that all begin, or end, with
    yield "", list(texts)
    for mark in re.finditer(r"[\W_]+", texts[0]):
        head, tail = texts[0][: mark.end()], texts[0][mark.start() :]
        for name, rest in (
            (head, [text.removeprefix(head) for text in texts]),
            (tail, [text.removesuffix(tail) for text in texts]),
        ):
            if all(0 < len(r) < len(text) for r, text in zip(rest, texts, strict=True)):
                yield re.sub(r"^[\W_]+|[\W_]+$", "", name), rest


def numbers_rows(sheet: Sheet, place: int) -> bool:
    """Return whether a column counts the rows, from 0 or from 1."""
    from_0 = list(map(str, range(len(sheet.numbers) + 1)))
    return sheet.columns[place].texts in (from_0[:-1], from_0[1:])


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
    is_wide = layout.kind == "wide"
    guess = "; if each row is one rating, name columns with --rater, --grade" * is_wide
    guess += "; if no column names items, add --no-item" * layout.is_item_guessed
    # a usual name of items, such as model, may be that of a rater
    first = sheet.header[0]
    if is_wide and first and 0 not in layout.item and names_rows(sheet, 0):
        guess += f"; if {first!r} names the items, add --item{few([first])}"
    return sheet.refuse(
        "twice",
        rows=" and ".join(sheet.where(row) for row in rows.tolist()),
        item=item,
        rater=rater,
        guess=guess,
    )


# ---- what looks as if it were something else ----


def without_second_header(sheet: Sheet) -> Sheet:
    """Leave Qualtrics' lines of questions and import ids out, and say so."""
    for row in range(min(2, len(sheet.numbers))):
        cells = [column.texts[column.codes[row]] for column in sheet.columns]
        if all('"ImportId"' in cell for cell in cells if cell):
            finding = Finding("qualtrics", first=sheet.where(0), last=sheet.where(row))
            above = np.arange(len(sheet.numbers)) <= row
            sheet = replace(sheet, findings=(*sheet.findings, finding), advice="")
            return sheet.without(above, "second header")
    return sheet
