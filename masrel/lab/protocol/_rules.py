"""The rules across keys of a protocol, applied to whatever could be decoded."""

import math
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any

import msgspec

from masrel._input import listed
from masrel.lab.protocol._decode import got, needed, with_id
from masrel.lab.protocol._gates import gate_rules
from masrel.lab.protocol._kinds import DEFAULT_KIND, kind_problem, value_problems
from masrel.lab.protocol._occasions import occasion_rules
from masrel.lab.protocol._order_rules import order_rules
from masrel.lab.protocol._questions import question_rules
from masrel.lab.protocol._rater_fields import rater_field_rules
from masrel.lab.protocol._sample_sizes import sample_size_rules
from masrel.lab.protocol.definition import Model, PresentationRules

Values = dict[str, Any]

MAX_PRESENTATIONS = 500
"""Presentations of one session; blinded codes are drawn from 1800."""

_DEVICES = {
    *("CON", "PRN", "AUX", "NUL"),
    *(f"{port}{number}" for port in ("COM", "LPT") for number in range(1, 10)),
}
"""Names that Windows keeps for devices, whatever stands behind a dot."""

MISSING_MARKS = ("NA",)
"""Marks of a missing rating in a ratings file; no grade may be called that."""

SESSIONS_NEEDED = {"inter-rater": 1, "test-retest": 2}
"""Kind of an estimate to the number of sessions it is made from."""


def broken_rules(values: Values) -> Iterator[str]:
    """Check the rules across keys."""
    return chain(
        _scale(values),
        _ids(values),
        _references(values),
        rater_field_rules(values),
        _schedules(values),
        order_rules(values),
        _device(values),
        _presentation(values),
        _training(values),
        occasion_rules(values),
        question_rules(values),
        kind_rules(values),
        joint_rules(values),
        _plan(values),
        sample_size_rules(values),
        gate_rules(values),
    )


def _entries(values: Values, key: str) -> list[tuple[int, Values]]:
    # the usable entries of an array of tables, with their indices
    return [(i, e) for i, e in enumerate(values.get(key) or []) if e is not None]


def _scale(values: Values) -> Iterator[str]:
    # grades that a file of ratings can hold, each once
    grades = (values.get("scale") or {}).get("grades") or []
    seen: set[str] = set()
    for index, grade in enumerate(grades):
        where = f"scale.grades[{index}]"
        if grade is None:
            continue
        if grade in seen:
            yield f"{where}: needed grades that differ, got {got(grade)} again"
        seen.add(grade)
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
    # ids that no file system takes for one: to some, R1 and r1 are the same name
    keys = ("models", "raters", "sessions", "questionnaires")
    arrays = {key: _entries(values, key) for key in keys}
    analysis = values.get("analysis") or {}
    arrays["analysis.estimates"] = _entries(analysis, "estimates")
    for key, entries in arrays.items():
        first: dict[str, tuple[int, str]] = {}
        for index, entry in entries:
            name = entry.get("id")
            if name is None:
                continue
            earlier = first.setdefault(name.casefold(), (index, name))
            if earlier[0] != index:
                yield (
                    f"{key}[{index}].id: needed ids that differ by more than case, "
                    f"got {got(name)} where {key}[{earlier[0]}] has {got(earlier[1])}"
                )
            if name.partition(".")[0].upper() in _DEVICES:
                yield (
                    f"{key}[{index}].id: needed an id that Windows takes as the name "
                    f"of a file, got {got(name)}"
                )


def _references(values: Values) -> Iterator[str]:
    # grades of models that the scale has, raters of sessions that the study has
    grades = (values.get("scale") or {}).get("grades")
    on_scale = {None, *(grades or ())}
    for index, model in _entries(values, "models"):
        grade = model.get("intended_grade")
        # With an unusable grade in the scale, none can be said to be unknown.
        if grades and None not in grades and grade not in on_scale:
            yield (
                f"models[{index}].intended_grade: needed a grade of the scale "
                f"({listed(grades)}), got {got(grade)}{with_id(model)}"
            )
    raters = values.get("raters") or []
    known: dict[Any, None] = dict.fromkeys(
        None if rater is None else rater.get("id") for rater in raters
    )
    for index, session in _entries(values, "sessions"):
        named: set[Any] = set()
        for place, rater in enumerate(session.get("raters") or []):
            where = f"sessions[{index}].raters[{place}]"
            if rater is not None and rater in named:
                yield (
                    f"{where}: needed each rater once, got {got(rater)} again"
                    f"{with_id(session)}"
                )
            # With an unusable rater in the list, nobody can be said to be unknown.
            elif (
                known and None not in known and rater is not None and rater not in known
            ):
                yield (
                    f"{where}: needed a rater of [[raters]] ({listed(known)}), "
                    f"got {got(rater)}{with_id(session)}"
                )
            named.add(rater)


def _schedules(values: Values) -> Iterator[str]:
    # Schedules are SESSION_RATER.csv and SESSION_RATER_sheet.csv.
    first: dict[str, tuple[str, str]] = {}
    for index, session in _entries(values, "sessions"):
        raters = dict.fromkeys(r for r in session.get("raters") or [] if r)
        for rater in raters if session.get("id") else ():
            pair = (session["id"], rater)
            stem = "_".join(pair).casefold()
            for name in (stem, f"{stem}_sheet"):
                other = first.setdefault(name, pair)
                if [p.casefold() for p in other] != [p.casefold() for p in pair]:
                    both = " and for ".join(
                        f"session {got(session_id)} with rater {got(rater_id)}"
                        for session_id, rater_id in (pair, other)
                    )
                    yield (
                        f"sessions[{index}]: needed ids that give each schedule a file "
                        f"of its own, got {name}.csv for {both}"
                    )
    repeats = (values.get("schedule") or {}).get("repeats")
    models = values.get("models") or []
    if repeats and len(models) * repeats > MAX_PRESENTATIONS:
        yield (
            f"schedule.repeats: needed at most {MAX_PRESENTATIONS} presentations a "
            f"session, got {len(models)} models times {repeats}"
        )


def _device(values: Values) -> Iterator[str]:
    # the stretch inside the range of motion and between the device's soft stops
    device, stretch = values.get("device") or {}, values.get("stretch") or {}
    start, end = stretch.get("start_deg"), stretch.get("end_deg")
    range_end = (values.get("elbow") or {}).get("range_end_deg")
    if start is not None and end is not None and start >= end:
        yield (
            f"stretch.start_deg: needed less than stretch.end_deg ({end:g}), "
            f"got {start:g}"
        )
    if end is not None and range_end is not None and end > range_end:
        yield (
            f"stretch.end_deg: needed at most elbow.range_end_deg ({range_end:g}), "
            f"got {end:g}"
        )
    slow, fast = device.get("dead_zone_deg_s"), device.get("full_speed_deg_s")
    if slow is not None and fast is not None and slow >= fast:
        yield (
            f"device.dead_zone_deg_s: needed less than device.full_speed_deg_s "
            f"({fast:g}), got {slow:g}"
        )
    width = device.get("soft_stop_deg")
    low, high = device.get("lowest_angle_deg"), device.get("highest_angle_deg")
    if width is None:
        return
    if low is not None and start is not None and start < low + width:
        yield (
            f"stretch.start_deg: needed at least device.lowest_angle_deg and the soft "
            f"stop beside it ({low:g} + {width:g}), got {start:g}"
        )
    if high is not None and end is not None and end > high - width:
        yield (
            f"stretch.end_deg: needed at most device.highest_angle_deg less the soft "
            f"stop before it ({high:g} - {width:g}), got {end:g}"
        )


def _presentation(values: Values) -> Iterator[str]:
    # keys that say something for what is asked, and speeds that the limits allow
    rules, stretch = values.get("presentation") or {}, values.get("stretch") or {}
    stretches = rules.get("stretches")
    if stretches == 1:
        for key in ("time_limit_s", "stretch_limit_s", "done_with"):
            default = getattr(PresentationRules(), key)
            if rules.get(key, default) != default:
                yield (
                    f"presentation.{key}: needed with presentation.stretches other "
                    f"than 1 only, got {got(rules[key])}"
                )
    if isinstance(stretches, list | tuple):
        yield from _cued_speeds(rules, stretch, stretches)


def _cued_speeds(
    rules: Values, stretch: Values, cues: Sequence[str | None]
) -> Iterator[str]:
    slow, fast = rules.get("slow_speed_deg_s"), rules.get("fast_speed_deg_s")
    most, limit = stretch.get("largest_speed_deg_s"), rules.get("stretch_limit_s")
    start, end = stretch.get("start_deg"), stretch.get("end_deg")
    if slow is None or fast is None or most is None:
        return
    if "fast" in cues and fast > most:
        yield (
            f"presentation.fast_speed_deg_s: needed at most "
            f"stretch.largest_speed_deg_s ({most:g}), got {fast:g}"
        )
    if {"slow", "fast"} <= set(cues) and slow >= fast:
        yield (
            f"presentation.slow_speed_deg_s: needed less than "
            f"presentation.fast_speed_deg_s ({fast:g}), got {slow:g}"
        )
    if "slow" not in cues or limit is None or start is None or end is None:
        return
    if end - start >= slow * limit:
        yield (
            f"presentation.slow_speed_deg_s: needed a stretch of {end - start:g} deg "
            f"within presentation.stretch_limit_s ({limit:g}), got {slow:g}"
        )


def _training(values: Values) -> Iterator[str]:
    # two kappas apart, and a window that training can fill
    rules = values.get("training") or {}
    low, high = rules.get("kappa_insufficient"), rules.get("kappa_sufficient")
    if low is not None and high is not None and low >= high:
        yield (
            f"training.kappa_insufficient: needed less than training.kappa_sufficient "
            f"({high:g}), got {low:g}"
        )
    window, longest = rules.get("window"), rules.get("max_presentations")
    if window is not None and longest is not None and window > longest:
        yield (
            f"training.window: needed at most training.max_presentations "
            f"({longest}), got {window}"
        )


_ELBOW_KEYS = (
    "catch_angle_constant_deg",
    "catch_torque_nms_rad",
    "residual_ratio",
    "catch_travel_deg",
)


def kind_rules(values: Values) -> Iterator[str]:
    """Check that models have the keys of their kind, each with a value it can have."""
    for index, model in _entries(values, "models"):
        where, kind = f"models[{index}]", model.get("kind")
        if kind is None:
            continue
        problems: Iterator[str]
        if (problem := kind_problem(kind)) is not None:
            problems = iter([f"{where}.kind: {problem}"])
        elif kind == DEFAULT_KIND:
            problems = _elbow_keys(model, where)
        else:
            problems = _tone_keys(model, kind, where)
        yield from (f"{problem}{with_id(model)}" for problem in problems)


def _elbow_keys(model: Values, where: str) -> Iterator[str]:
    annotations = {info.name: info.type for info in msgspec.structs.fields(Model)}
    for key in _ELBOW_KEYS:
        if model.get(key, "unusable") is None:
            yield f"{where}.{key}: needed {needed(annotations[key])}, got none"
    if model.get("parameters"):
        yield (
            f"{where}.parameters: needed a kind of model that has some, got "
            f"{got(DEFAULT_KIND)}, whose numbers stand beside its id and in constants"
        )


def _tone_keys(model: Values, kind: str, where: str) -> Iterator[str]:
    constants = model.get("constants") or {}
    foreign = [key for key in (*_ELBOW_KEYS, "file") if model.get(key) is not None]
    foreign += [f"constants.{k}" for k, value in constants.items() if value is not None]
    for key in foreign:
        yield (
            f"{where}.{key}: needed for kind {got(DEFAULT_KIND)} only, got it for "
            f"{got(kind)}; its numbers stand in [models.parameters]"
        )
    for key, problem in value_problems(kind, model.get("parameters") or {}):
        yield f"{where}.parameters{'.' if key else ''}{key}: {problem}"


def joint_rules(values: Values) -> Iterator[str]:
    """Check shared constants, and those of each model, against each other."""
    elbow = values.get("elbow") or {}
    smallest, limit = elbow.get("smallest_catch_angle_deg"), elbow.get("range_end_deg")
    # θ_L of (6)
    if smallest is not None and limit is not None and smallest >= limit:
        yield (
            f"elbow.smallest_catch_angle_deg: needed less than elbow.range_end_deg "
            f"({limit:g}), got {smallest:g}"
        )
    yield from _constants(elbow, elbow, values, "elbow")
    for index, model in _entries(values, "models"):
        where, constants = f"models[{index}]", model.get("constants") or {}
        overrides = {k: value for k, value in constants.items() if value is not None}
        joint = {**elbow, **overrides}
        problems = [
            *_catch_angle(model.get("catch_angle_constant_deg"), joint, where),
            *_constants(overrides, joint, values, f"{where}.constants"),
        ]
        yield from (f"{problem}{with_id(model)}" for problem in problems)


def _catch_angle(constant: float | None, joint: Values, where: str) -> Iterator[str]:
    # constant: L of (2)
    smallest = joint.get("smallest_catch_angle_deg")
    slope, slowest = joint.get("catch_slope_s"), joint.get("slowest_mean_speed_deg_s")
    if constant is None or smallest is None:
        return
    if constant <= smallest:
        yield (
            f"{where}.catch_angle_constant_deg: needed more than "
            f"elbow.smallest_catch_angle_deg ({smallest:g}), got {constant:g}"
        )
    elif slope is not None and slowest is not None:
        angle = constant - slope * slowest  # first line of (6), the largest of them
        if angle < smallest:
            yield (
                f"{where}.catch_angle_constant_deg: needed a catch angle at "
                f"elbow.slowest_mean_speed_deg_s of at least "
                f"elbow.smallest_catch_angle_deg ({smallest:g}), got "
                f"{constant:g} - {slope:g} * {slowest:g} = {angle:g}"
            )


def _constants(
    constants: Values, joint: Values, values: Values, where: str
) -> Iterator[str]:
    # constants: those that stand at `where`; joint: these and all it shares
    rise, peak = constants.get("catch_rise_s"), joint.get("peak_duration_s")
    if rise is not None and peak is not None and rise > peak:
        yield (
            f"{where}.catch_rise_s: needed at most elbow.peak_duration_s ({peak:g}), "
            f"got {rise:g}"
        )
    if not {"rest_angle_deg", "stiffness_nm_rad"} & constants.keys():
        return
    # An arm that waits where the stretch starts is held by k·(θ_start - θ_rest) of
    # (1). Where that is as much torque as a frozen encoder is recognized by, no
    # presentation would begin.
    rest, stiffness = joint.get("rest_angle_deg"), joint.get("stiffness_nm_rad")
    start = (values.get("stretch") or {}).get("start_deg")
    limit = (values.get("device") or {}).get("standing_torque_nm")
    if rest is None or stiffness is None or start is None or limit is None:
        return
    torque = stiffness * math.radians(start - rest)
    if abs(torque) > limit:
        place = where if "rest_angle_deg" in constants else "elbow"
        yield (
            f"{place}.rest_angle_deg: needed at most device.standing_torque_nm "
            f"({limit:g} N·m) where the stretch starts, got {stiffness:g} N·m/rad "
            f"times {start:g} - {rest:g} deg = {torque:.3g} N·m"
        )


def _plan(values: Values) -> Iterator[str]:
    # the lines of the analysis plan, and the sections of the report
    for index, line in _entries(values.get("analysis") or {}, "estimates"):
        for problem in _plan_line(line, values):
            yield f"analysis.estimates[{index}].{problem}{with_id(line)}"
    for key in ("sections", "formats"):
        names = (values.get("report") or {}).get(key) or []
        for index, name in enumerate(names):
            if name is not None and name in names[:index]:
                yield (
                    f"report.{key}[{index}]: needed each {key[:-1]} once, "
                    f"got {got(name)} again"
                )


def _plan_line(line: Values, values: Values) -> Iterator[str]:
    role = line.get("models")
    models = values.get("models") or []
    roles = {None if model is None else model.get("role") for model in models}
    # With a model whose role is unusable, none can be said to be missing.
    if role in ("standard", "dummy") and roles and not roles & {None, role}:
        yield f"models: needed a role that some model has, got {got(role)}"
    kind, named = line.get("kind"), line.get("sessions")
    if kind is None or named is None or None in named:
        return
    count = SESSIONS_NEEDED[kind]
    if len(named) not in SESSIONS_NEEDED.values():
        return  # no line has so many, and the key itself has been refused
    if len(named) != count:
        phrase = "exactly one session" if count == 1 else "exactly two sessions"
        yield f"sessions: needed {phrase} for {got(kind)}, got {len(named)}"
    elif len(set(named)) != len(named):
        yield f"sessions: needed two different sessions, got {got(named[0])} twice"
    yield from _plan_raters(kind, named, values)


def _plan_raters(kind: str, named: list[str], values: Values) -> Iterator[str]:
    sessions = values.get("sessions") or []
    if not sessions or any(s is None or "id" not in s for s in sessions):
        return  # nothing can be said to be unknown
    raters = {session["id"]: session.get("raters") for session in sessions}
    for place, name in enumerate(named):
        if name not in raters:
            known = ", ".join(raters)
            yield (
                f"sessions[{place}]: needed a session of [[sessions]] ({known}), "
                f"got {got(name)}"
            )
    groups = [set(raters.get(name) or ()) for name in named]
    present = {rater.get("id") for rater in values.get("raters") or [] if rater}
    if not all(group and group <= present for group in groups):
        return  # something else is wrong with a session; who meets whom is open
    if kind == "inter-rater" and len(groups) == 1 and len(groups[0]) < 2:
        yield "sessions: needed a session of at least two raters, got one of 1"
    if kind == "test-retest" and len(groups) == 2 and not groups[0] & groups[1]:
        yield "sessions: needed two sessions that share a rater, got none in both"
