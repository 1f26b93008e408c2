"""The rules across keys of a protocol, applied to whatever could be decoded."""

from collections.abc import Callable, Iterator
from typing import Any

from masrel.protocol.plan_rules import plan_rules
from masrel.protocol.wording import got

__all__ = ["broken_rules"]

Values = dict[str, Any]

MOST_PRESENTATIONS = 500
"""Presentations of one session; blinded codes are drawn from 1800."""

MISSING_MARKS = ("NA",)
"""Marks of a missing rating in a ratings file; no grade may be called that."""


def broken_rules(values: Values) -> tuple[str, ...]:
    """Check the rules across keys.

    Parameters
    ----------
    values : dict
        The usable values of a protocol file; what is absent is not checked.

    Returns
    -------
    tuple of str
        Each broken rule as ``key.path: needed ..., got ...``.
    """
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
                f"({', '.join(grades)}), got {got(grade)}{_named(model)}"
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
                    f"{_named(session)}"
                )
            # With an unusable rater in the list, nobody can be said to be unknown.
            elif known and None not in known and rater not in (None, *known):
                yield (
                    f"{where}: needed a rater of [[raters]] ({', '.join(known)}), "
                    f"got {got(rater)}{_named(session)}"
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


def _stretch(values: Values) -> Iterator[str]:
    stretch, elbow = values.get("stretch") or {}, values.get("elbow") or {}
    start, end = stretch.get("start_deg"), stretch.get("end_deg")
    limit = elbow.get("range_end_deg")
    if start is not None and end is not None and start >= end:
        yield (
            f"stretch.start_deg: needed less than stretch.end_deg ({end:g}), "
            f"got {start:g}"
        )
    if end is not None and limit is not None and end > limit:
        yield (
            f"stretch.end_deg: needed at most elbow.range_end_deg ({limit:g}), "
            f"got {end:g}"
        )


def _device(values: Values) -> Iterator[str]:
    device, stretch = values.get("device") or {}, values.get("stretch") or {}
    dead_zone, full_speed = (
        device.get("dead_zone_deg_s"),
        device.get("full_speed_deg_s"),
    )
    if dead_zone is not None and full_speed is not None and dead_zone >= full_speed:
        yield (
            f"device.dead_zone_deg_s: needed less than device.full_speed_deg_s "
            f"({full_speed:g}), got {dead_zone:g}"
        )
    width = device.get("soft_stop_deg")
    low, high = device.get("lowest_angle_deg"), device.get("highest_angle_deg")
    start, end = stretch.get("start_deg"), stretch.get("end_deg")
    if width is None:
        return
    if None not in (low, start) and start < low + width:
        yield (
            f"stretch.start_deg: needed at least device.lowest_angle_deg and the soft "
            f"stop beside it ({low:g} + {width:g}), got {start:g}"
        )
    if None not in (high, end) and end > high - width:
        yield (
            f"stretch.end_deg: needed at most device.highest_angle_deg less the soft "
            f"stop before it ({high:g} - {width:g}), got {end:g}"
        )


def _catch_angles(values: Values) -> Iterator[str]:
    elbow = values.get("elbow") or {}
    smallest = elbow.get("smallest_catch_angle_deg")  # θ_L of (6)
    limit = elbow.get("range_end_deg")
    if smallest is None:
        return
    if limit is not None and smallest >= limit:
        yield (
            f"elbow.smallest_catch_angle_deg: needed less than elbow.range_end_deg "
            f"({limit:g}), got {smallest:g}"
        )
    for index, model in _entries(values, "models"):
        constant = model.get("catch_angle_constant_deg")  # L of (2)
        if constant is not None:
            own = (model.get("constants") or {}).get("catch_slope_s")
            shared = elbow if own is None else {**elbow, "catch_slope_s": own}
            for problem in _catch_angle(constant, smallest, shared):
                where = f"models[{index}].catch_angle_constant_deg"
                yield f"{where}: {problem}{_named(model)}"


def _catch_angle(constant: float, smallest: float, elbow: Values) -> Iterator[str]:
    slope, slowest = elbow.get("catch_slope_s"), elbow.get("slowest_mean_speed_deg_s")
    if constant <= smallest:
        yield (
            f"needed more than elbow.smallest_catch_angle_deg ({smallest:g}), "
            f"got {constant:g}"
        )
    elif slope is not None and slowest is not None:
        angle = constant - slope * slowest  # first line of (6), the largest of them
        if angle < smallest:
            yield (
                f"needed a catch angle at elbow.slowest_mean_speed_deg_s of at least "
                f"elbow.smallest_catch_angle_deg ({smallest:g}), got "
                f"{constant:g} - {slope:g} * {slowest:g} = {angle:g}"
            )


def _sections(values: Values) -> Iterator[str]:
    sections = (values.get("report") or {}).get("sections") or []
    for index, section in enumerate(sections):
        if section is not None and section in sections[:index]:
            yield (
                f"report.sections[{index}]: needed each section once, "
                f"got {got(section)} again"
            )


def _named(entry: Values) -> str:
    return f" (id {got(entry['id'])})" if "id" in entry else ""


_RULES: tuple[Callable[[Values], Iterator[str]], ...] = (
    _grades,
    _ids,
    _intended,
    _raters,
    _file_names,
    _size,
    _stretch,
    _device,
    _catch_angles,
    plan_rules,
    _sections,
)
