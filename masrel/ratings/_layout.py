"""Which column of a sheet is what: named by the caller, else by its usual name."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from masrel.errors import ParameterError, RatingsError
from masrel.ratings._text_cells import Sheet

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


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutOptions:
    """What a caller says of the columns; None and () are for the file to tell."""

    # a name each; several for an item that several columns name together
    item: tuple[str, ...] = ()
    rater: str | None = None
    grade: str | None = None
    session: str | None = None
    by: str | None = None
    clusters: str | None = None
    raters: tuple[str, ...] = ()  # the raters of a wide table
    ignore: tuple[str, ...] = ()  # columns that are left aside
    no_item: bool = False  # whether every column is a rater, or a category
    counts: bool = False  # whether it is a table of items by categories
    table: bool = False  # whether it is a contingency table of two raters


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Positions of columns."""

    kind: Kind
    item: tuple[int, ...]  # none where rows are items without names
    raters: tuple[int, ...] = ()  # of a wide table; categories of a table of counts
    # rater, grade: of a long table
    rater: int | None = None
    grade: int | None = None
    session: int | None = None
    by: int | None = None
    clusters: int | None = None
    # whether the item is the first column because nothing else was said of it
    is_item_guessed: bool = False


def find_layout(sheet: Sheet, options: LayoutOptions) -> Layout:
    """Decide which column is what, or say which option would."""
    options = _resolved(sheet, options)
    layout = _columns_of(sheet, options)
    if options.clusters is None:
        return layout
    return replace(layout, clusters=sheet.header.index(options.clusters))


def _columns_of(sheet: Sheet, options: LayoutOptions) -> Layout:
    # every column but that of the clusters
    header = sheet.header
    position = {name: place for place, name in enumerate(header)}
    taken = {position[name] for name in options.ignore}
    by = None if options.by is None else position[options.by]
    session = _role(sheet, "session", options.session, taken)
    taken |= {place for place in (by, session) if place is not None}
    if options.clusters is not None and options.clusters not in options.item:
        taken.add(position[options.clusters])
    if options.counts or options.table:
        kind: Kind = "counts" if options.counts else "table"
        return _wide(sheet, kind, options, taken, session=None, by=by)
    is_wide = bool(options.raters) or options.no_item
    # the corner of a transposed table names its rows, which are now its columns
    is_wide |= sheet.is_transposed and not (options.rater or options.grade)
    if not is_wide:
        columns = _long(sheet, options, taken)
        if columns is not None:
            item, rater, grade = columns
            return Layout(
                kind="long",
                item=item,
                rater=rater,
                grade=grade,
                session=session,
                by=by,
            )
    return _wide(sheet, "wide", options, taken, session=session, by=by)


def resolve_names(option: str, values: Sequence[str], sheet: Sheet) -> tuple[str, ...]:
    """Return the columns that an option names, between commas or one a value."""
    names: list[str] = []
    for value in values:
        parts = value.split(",")
        while parts:
            # the longest name first: names of columns may hold commas
            for n in range(len(parts), 0, -1):
                name = ",".join(parts[:n]).strip()
                if name in sheet.header:
                    break
            else:
                raise unknown_column(sheet, option, parts[0].strip())
            names.append(name)
            parts = parts[n:]
    return tuple(names)


def unknown_column(sheet: Sheet, option: str, name: str) -> RatingsError:
    """Return the error of a column that is not there."""
    from difflib import get_close_matches  # loaded only for an error

    near = get_close_matches(name, sheet.header, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    return sheet.error(f"{option}: there is no column {name!r}, {_listed(sheet)}{hint}")


def _listed(sheet: Sheet) -> str:
    shown = ", ".join(repr(name) for name in sheet.header[:12])
    n_more = len(sheet.header) - 12
    return f"but {shown}" + (f" and {n_more} more" if n_more > 0 else "")


def _resolved(sheet: Sheet, options: LayoutOptions) -> LayoutOptions:
    # the options with every name checked
    if options.counts and options.table:
        raise ParameterError("--counts, --table: needed one of them, got both")
    if options.session and (options.counts or options.table):
        raise ParameterError(
            "--session: counts do not say who rated what; --by tells groups apart"
        )
    if options.clusters and (options.counts or options.table):
        raise ParameterError(
            "--clusters: counts do not say which item is which, so needs ratings"
        )
    if options.raters and (options.rater or options.grade):
        raise ParameterError(
            "--raters names the columns of a wide table, --rater and --grade those of "
            "a long one: needed one kind, got both"
        )
    if options.no_item and options.item:
        raise ParameterError("--item, --no-item: needed one of them, got both")
    for role in ("rater", "grade", "session", "by", "clusters"):
        name: str | None = getattr(options, role)
        if name is not None and name not in sheet.header:
            raise unknown_column(sheet, f"--{role}", name)
    options = replace(
        options,
        item=resolve_names("--item", options.item, sheet),
        raters=resolve_names("--raters", options.raters, sheet),
        ignore=resolve_names("--ignore", options.ignore, sheet),
    )
    _refuse_two_roles(sheet, options)
    return options


def _refuse_two_roles(sheet: Sheet, options: LayoutOptions) -> None:
    # a column that is named twice; groups may be sessions, or part of the items' names,
    # as clusters may be
    named = [(name, "--raters") for name in options.raters]
    named += [(name, "--ignore") for name in options.ignore]
    named += [(name, "--item") for name in options.item]
    for role in ("rater", "grade", "session", "by", "clusters"):
        name: str | None = getattr(options, role)
        if name is not None:
            named.append((name, f"--{role}"))
    allowed = {"--item", "--session", "--by", "--rater"}
    first: dict[str, str] = {}
    for name, option in named:
        other = first.setdefault(name, option)
        if (name, option) == (name, other) and named.count((name, option)) == 1:
            continue
        both_are = {option, other}
        is_cluster = both_are in ({"--clusters", "--item"}, {"--clusters", "--by"})
        if not (is_cluster or ("--by" in both_are and both_are <= allowed)):
            both = option if other == option else f"{other}, {option}"
            raise sheet.error(f"{both}: needed each column once, got {name!r} twice")


def _role(sheet: Sheet, role: str, name: str | None, taken: set[int]) -> int | None:
    # the column of a role: the one that is named, else the one with a usual name
    if name is not None:
        return sheet.header.index(name)
    usual = USUAL_NAMES[role]
    places = [
        place
        for place, column in enumerate(sheet.header)
        if column.casefold() in usual and place not in taken
    ]
    if len(places) > 1:
        names = " and ".join(sheet.header[place] for place in places)
        raise sheet.error(
            f"{sheet.line_of(0)}: needed one column for the {role}, got {names}: "
            f"--{role} chooses one, --ignore leaves a column aside"
        )
    return places[0] if places else None


def _long(
    sheet: Sheet, options: LayoutOptions, taken: set[int]
) -> tuple[tuple[int, ...], int, int] | None:
    # item, rater and grade, or None where the table is not long
    header = sheet.header
    item = tuple(header.index(name) for name in options.item)
    named = {header.index(n) for n in (options.rater, options.grade) if n is not None}
    taken = taken | named | {*item}
    rater = _places(_role(sheet, "rater", options.rater, taken))
    grade = _places(_role(sheet, "grade", options.grade, taken))
    if not rater and not grade:
        return None
    taken = taken | {*rater, *grade}
    roles = {
        "item": item or _usual_item(sheet, taken),
        "rater": rater,
        "grade": grade,
    }
    unknown = [role for role, places in roles.items() if not places]
    taken = taken | {*roles["item"]}
    left = [place for place in range(len(header)) if place not in taken]
    if len(unknown) == len(left) == 1:
        roles[unknown.pop()] = (left[0],)
    if unknown:
        raise _unknown_roles(sheet, roles)
    every = [place for places in roles.values() for place in places]
    if len({*every}) < len(every):
        raise sheet.error(
            "needed different columns for item, rater and grade, got "
            + ", ".join(header[place] for place in every)
        )
    return roles["item"], roles["rater"][0], roles["grade"][0]


def _places(place: int | None) -> tuple[int, ...]:
    return () if place is None else (place,)


def _usual_item(sheet: Sheet, taken: set[int]) -> tuple[int, ...]:
    # the columns of the items where nobody named them
    if set(STUDY_COLUMNS) <= set(sheet.header):
        return sheet.header.index("model"), sheet.header.index("repeat")
    return _places(_role(sheet, "item", None, taken))


def _unknown_roles(sheet: Sheet, roles: dict[str, tuple[int, ...]]) -> RatingsError:
    # the error of a long table some columns of which are not known
    known = ", ".join(
        f"the {role} is {sheet.header[places[0]]!r}"
        for role, places in roles.items()
        if places
    )
    needed = " and ".join(f"--{role}" for role, places in roles.items() if not places)
    return sheet.error(
        f"{sheet.line_of(0)}: looks like one row a rating ({known}): needs "
        f"{needed}, {_listed(sheet)}; if its columns are raters, --raters "
        "names them, if they are items, --transpose"
    )


def _wide(
    sheet: Sheet,
    kind: Kind,
    options: LayoutOptions,
    taken: set[int],
    *,
    session: int | None,
    by: int | None,
) -> Layout:
    header = sheet.header
    raters = tuple(header.index(name) for name in options.raters)
    item = tuple(header.index(name) for name in options.item)
    is_guessed = False
    if not item and not options.no_item:
        place = (
            None if kind == "table" else _role(sheet, "item", None, {*taken, *raters})
        )
        free = [p for p in range(len(header)) if p not in taken and p not in raters]
        if place is None and free:
            place, is_guessed = free[0], True
        item = () if place is None else (place,)
    if not raters:
        used = taken | set(item)
        raters = tuple(p for p in range(len(header)) if p not in used)
    if not raters:
        what = {"wide": "a rater", "counts": "a category", "table": "a category"}[kind]
        raise sheet.error(f"{sheet.line_of(0)}: needed a column for {what}, got none")
    return Layout(
        kind=kind,
        item=item,
        raters=raters,
        session=session,
        by=by,
        is_item_guessed=is_guessed,
    )
