"""Notes below a table that are of some of its rows: each is said once, and of which."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from masrel.tables._tables import capital


@dataclass(frozen=True, slots=True, kw_only=True)
class NotedRow:
    """What there is to say of a row."""

    # title, group: which coefficient, and of what
    title: str
    group: str
    texts: tuple[str, ...]  # without the end of the sentence
    # the same of its interval; None where it has none
    interval_texts: tuple[str, ...] | None = ()


def row_notes(rows: Sequence[NotedRow], by: str | None) -> tuple[str, ...]:
    """Return the notes on rows, what is of the same rows as one note."""
    # A note names its rows, unless it holds for all that it could be of.
    # by: what groups are called, if there are any
    rows_of: dict[tuple[str, bool], list[NotedRow]] = {}
    for row in rows:
        for text in row.texts:
            rows_of.setdefault((text, False), []).append(row)
        for text in row.interval_texts or ():
            rows_of.setdefault((text, True), []).append(row)
    n_intervals = sum(row.interval_texts is not None for row in rows)
    texts_of: dict[str, list[str]] = {}
    for (text, is_of_interval), subset in rows_of.items():
        is_of_all = len(subset) == (n_intervals if is_of_interval else len(rows))
        start = text if is_of_all else _names(subset, rows, by)
        texts_of.setdefault(start, []).extend([] if is_of_all else [text])
    return tuple(
        f"{start}: {'; '.join(texts)}." if texts else f"{start}."
        for start, texts in texts_of.items()
    )


def _names(subset: Sequence[NotedRow], rows: Sequence[NotedRow], by: str | None) -> str:
    # The coefficients that a note holds for, with their groups unless it holds for all;
    # three or more that follow each other in the table by the first and the last. The
    # groups alone where it holds for every coefficient of them.
    every, some = _groups_by_title(rows), _groups_by_title(subset)
    names: list[str] = []
    for groups, of_groups in itertools.groupby(every, key=some.get):
        titles = list(of_groups)
        if groups is None:
            continue
        if by is not None and len(titles) == len(every):
            # of several levels, as North: test, the names say enough
            return (
                "; ".join(groups) if "," in by else f"{capital(by)} {', '.join(groups)}"
            )
        is_of_all = all(every[title] == groups for title in titles)
        which = "" if is_of_all else f" ({', '.join(groups)})"
        if len(titles) > 2:
            titles = [f"{titles[0]} to {titles[-1]}"]
        names += [f"{title}{which}" for title in titles]
    return "; ".join(names)


def _groups_by_title(rows: Sequence[NotedRow]) -> dict[str, list[str]]:
    groups: dict[str, list[str]] = {}
    for row in rows:
        groups.setdefault(row.title, []).append(row.group)
    return groups
