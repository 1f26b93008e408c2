"""The rules across keys of a protocol, applied to whatever could be decoded."""

from collections.abc import Callable, Iterator
from typing import Any

from masrel.protocol.device_rules import device_rules
from masrel.protocol.joint_rules import joint_rules
from masrel.protocol.plan_rules import plan_rules
from masrel.protocol.wording import got, with_id

__all__ = ["broken_rules"]

Values = dict[str, Any]

MOST_PRESENTATIONS = 500
"""Presentations of one session; blinded codes are drawn from 1800."""

MISSING_MARKS = ("NA",)
"""Marks of a missing rating in a ratings file; no grade may be called that."""


def broken_rules(values: Values) -> tuple[str, ...]:
    """Check the rules across keys."""
    return tuple(problem for rule in _RULES for problem in rule(values))


def _entries(values: Values, key: str) -> list[tuple[int, Values]]:
    # The usable entries of an array of tables with their places.
    return [(i, e) for i, e in enumerate(values.get(key) or []) if e is not None]


def _grades(values: Values) -> Iterator[str]:
    grades = (values.get("scale") or {}).get("grades") or []
    for index, grade in enumerate(grades):
        where = f"scale.grades[{index}]"
        if grade is None:
            continue
        if grade in grades[:index]:
            yield f"{where}: needed grades that differ, got {got(grade)} again"
        if grade != grade.strip() or not grade.isprintable():
            yield (
                f"{where}: needed a grade without spaces around it or control "
                f"characters, got {got(grade)}"
            )
        if grade in MISSING_MARKS:
            yield (
                f"{where}: needed a grade that does not mean a missing one, "
                f"got {got(grade)}"
            )


def _ids(values: Values) -> Iterator[str]:
    for key in ("models", "raters", "sessions"):
        yield from _repeated_ids(key, _entries(values, key))
    analysis = values.get("analysis") or {}
    yield from _repeated_ids("analysis.estimates", _entries(analysis, "estimates"))


def _repeated_ids(key: str, entries: list[tuple[int, Values]]) -> Iterator[str]:
    first: dict[str, tuple[int, str]] = {}
    for index, entry in entries:
        name = entry.get("id")
        if name is None:
            continue
        # Some file systems take R1 and r1 for one name.
        earlier = first.setdefault(name.casefold(), (index, name))
        if earlier[0] != index:
            yield (
                f"{key}[{index}].id: needed ids that differ by more than case, "
                f"got {got(name)} where {key}[{earlier[0]}] has {got(earlier[1])}"
            )


def _intended(values: Values) -> Iterator[str]:
    grades = (values.get("scale") or {}).get("grades")
    if not grades or None in grades:
        return
    for index, model in _entries(values, "models"):
        grade = model.get("intended_grade")
        if grade is not None and grade not in grades:
            yield (
                f"models[{index}].intended_grade: needed a grade of the scale "
                f"({', '.join(grades)}), got {got(grade)}{with_id(model)}"
            )


def _raters(values: Values) -> Iterator[str]:
    known = [rater and rater.get("id") for rater in values.get("raters") or []]
    known = list(dict.fromkeys(known))
    for index, session in _entries(values, "sessions"):
        named = session.get("raters") or []
        for place, rater in enumerate(named):
            where = f"sessions[{index}].raters[{place}]"
            if rater is not None and rater in named[:place]:
                yield (
                    f"{where}: needed each rater once, got {got(rater)} again"
                    f"{with_id(session)}"
                )
            # With an unusable rater in the list, nobody can be said to be unknown.
            elif known and None not in known and rater not in (None, *known):
                yield (
                    f"{where}: needed a rater of [[raters]] ({', '.join(known)}), "
                    f"got {got(rater)}{with_id(session)}"
                )


def _file_names(values: Values) -> Iterator[str]:
    # Schedules are SESSION_RATER.csv and SESSION_RATER_sheet.csv.
    owner: dict[str, str] = {}
    for index, session in _entries(values, "sessions"):
        raters = dict.fromkeys(r for r in session.get("raters") or [] if r)
        for rater in raters if session.get("id") else ():
            stem = f"{session['id']}_{rater}".casefold()
            pair = f"session {got(session['id'])} with rater {got(rater)}"
            for name in (stem, f"{stem}_sheet"):
                other = owner.setdefault(name, pair)
                if other.casefold() != pair.casefold():
                    yield (
                        f"sessions[{index}]: needed ids that give each schedule a file "
                        f"of its own, got {name}.csv for {pair} and for {other}"
                    )


def _size(values: Values) -> Iterator[str]:
    repeats = (values.get("schedule") or {}).get("repeats")
    models = values.get("models") or []
    if repeats and len(models) * repeats > MOST_PRESENTATIONS:
        yield (
            f"schedule.repeats: needed at most {MOST_PRESENTATIONS} presentations a "
            f"session, got {len(models)} models times {repeats}"
        )


def _sections(values: Values) -> Iterator[str]:
    sections = (values.get("report") or {}).get("sections") or []
    for index, section in enumerate(sections):
        if section is not None and section in sections[:index]:
            yield (
                f"report.sections[{index}]: needed each section once, "
                f"got {got(section)} again"
            )


_RULES: tuple[Callable[[Values], Iterator[str]], ...] = (
    _grades,
    _ids,
    _intended,
    _raters,
    _file_names,
    _size,
    device_rules,
    joint_rules,
    plan_rules,
    _sections,
)
