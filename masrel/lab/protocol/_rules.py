"""The rules across keys of a protocol whose every key is of its type."""

import math
from collections import Counter
from collections.abc import Iterator
from itertools import chain
from operator import attrgetter

import msgspec

from masrel._input import listed
from masrel.errors import ParameterError
from masrel.lab.protocol._decode import got, needed
from masrel.lab.protocol._gates import parse_gate
from masrel.lab.protocol._kinds import DEFAULT_KIND, kind_problem, value_problems
from masrel.lab.protocol._rater_fields import RESERVED, field_value, needed_of
from masrel.lab.protocol.definition import (
    _FIELD_NAME,
    ElbowConstants,
    EstimatePlan,
    Model,
    Protocol,
    Question,
    SampleSize,
)

_MAX_PRESENTATIONS = 500
"""Presentations of one session; blinded codes are drawn from 1800."""

_DEVICES = {
    *("CON", "PRN", "AUX", "NUL"),
    *(f"{port}{number}" for port in ("COM", "LPT") for number in range(1, 10)),
}
"""Names that Windows keeps for devices, whatever stands behind a dot."""

_MISSING_MARKS = ("NA",)
"""Marks of a missing rating in a ratings file; no grade may be called that."""

_SESSIONS_NEEDED = {"inter-rater": 1, "test-retest": 2}
"""Kind of an estimate to the number of sessions it is made from."""


def broken_rules(protocol: Protocol) -> Iterator[str]:
    """Check the rules across keys."""
    return chain.from_iterable(rule(protocol) for rule in _RULES)


def _id(name: str) -> str:
    # names an entry of an array of tables at the end of a message
    return f" (id {got(name)})"


def _chosen(table: msgspec.Struct, *keys: str) -> list[str]:
    # those of the keys that are not at their defaults
    defaults = {info.name: info.default for info in msgspec.structs.fields(table)}
    return [key for key in keys if getattr(table, key) != defaults[key]]


def _scale(protocol: Protocol) -> Iterator[str]:
    # grades that a file of ratings can hold, each once
    grades = protocol.scale.grades
    for index, grade in enumerate(grades):
        where = f"scale.grades[{index}]"
        if grade in grades[:index]:
            yield f"{where}: needed grades that differ, got {got(grade)} again"
        if grade != grade.strip() or not grade.isprintable():
            yield (
                f"{where}: needed a grade without spaces around it or control "
                f"characters, got {got(grade)}"
            )
        if grade in _MISSING_MARKS:
            yield (
                f"{where}: needed a grade that does not mean a missing one, "
                f"got {got(grade)}"
            )


def _ids(protocol: Protocol) -> Iterator[str]:
    # ids that no file system takes for one: to some, R1 and r1 are the same name
    ids = {
        "models": [model.id for model in protocol.models],
        "raters": [rater.id for rater in protocol.raters],
        "sessions": [session.id for session in protocol.sessions],
        "questionnaires": [each.id for each in protocol.questionnaires],
        "analysis.estimates": [line.id for line in protocol.analysis.estimates],
    }
    for key, names in ids.items():
        first: dict[str, int] = {}
        for index, name in enumerate(names):
            earlier = first.setdefault(name.casefold(), index)
            if earlier != index:
                yield (
                    f"{key}[{index}].id: needed ids that differ by more than case, "
                    f"got {got(name)} where {key}[{earlier}] has {got(names[earlier])}"
                )
            if name.partition(".")[0].upper() in _DEVICES:
                yield (
                    f"{key}[{index}].id: needed an id that Windows takes as the name "
                    f"of a file, got {got(name)}"
                )


def _references(protocol: Protocol) -> Iterator[str]:
    # grades of models that the scale has, raters of sessions that the study has
    grades = protocol.scale.grades
    for index, model in enumerate(protocol.models):
        if model.intended_grade not in (None, *grades):
            yield (
                f"models[{index}].intended_grade: needed a grade of the scale "
                f"({listed(grades)}), got {got(model.intended_grade)}{_id(model.id)}"
            )
    known = dict.fromkeys(rater.id for rater in protocol.raters)
    for index, session in enumerate(protocol.sessions):
        for place, rater in enumerate(session.raters):
            where = f"sessions[{index}].raters[{place}]"
            if rater in session.raters[:place]:
                yield (
                    f"{where}: needed each rater once, got {got(rater)} again"
                    f"{_id(session.id)}"
                )
            elif rater not in known:
                yield (
                    f"{where}: needed a rater of [[raters]] ({listed(known)}), "
                    f"got {got(rater)}{_id(session.id)}"
                )


def _rater_fields(protocol: Protocol) -> Iterator[str]:
    # fields that can be columns of a table, and what raters have in them
    fields = protocol.rater_fields
    for name, field in fields.items():
        where = f"rater_fields.{name}"
        if not _FIELD_NAME.fullmatch(name) or name in RESERVED:
            yield (
                f"{where}: needed a name of 1 to 32 small letters, digits and '_', the "
                f"first a letter, other than {', '.join(RESERVED)}, got {got(name)}"
            )
        if field.type == "choice" and len(set(field.choices)) < 2:
            choices = got(field.choices)
            yield f"{where}.choices: needed at least 2 that differ, got {choices}"
        if field.type != "choice" and field.choices:
            yield (
                f'{where}.choices: needed for type "choice" only, got it for '
                f"{got(field.type)}"
            )
        if field.type in ("text", "choice", "date") and field.unit:
            kind = got(field.type)
            yield f"{where}.unit: needed for numbers only, got it for {kind}"
    for index, rater in enumerate(protocol.raters):
        for name, value in rater.fields.items():
            where = f"raters[{index}].fields.{name}"
            if name not in fields:
                known = listed(fields) if fields else "there is none"
                yield (
                    f"{where}: needed a field of [rater_fields] ({known}), got "
                    f"{got(name)}{_id(rater.id)}"
                )
            elif field_value(fields[name], value) is None:
                yield (
                    f"{where}: needed {needed_of(fields[name])}, got {got(value)}"
                    f"{_id(rater.id)}"
                )


def _schedules(protocol: Protocol) -> Iterator[str]:
    # Schedules are SESSION_RATER.csv and SESSION_RATER_sheet.csv.
    first: dict[str, tuple[str, str]] = {}
    for index, session in enumerate(protocol.sessions):
        for rater in dict.fromkeys(session.raters):
            pair = (session.id, rater)
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
    n_models, repeats = len(protocol.models), protocol.schedule.repeats
    if n_models * repeats > _MAX_PRESENTATIONS:
        yield (
            f"schedule.repeats: needed at most {_MAX_PRESENTATIONS} presentations a "
            f"session, got {n_models} models times {repeats}"
        )


_BELONGS_TO = {
    "blocks_by": "blocks",
    "standards_apart": "restricted",
    "max_same_grade": "restricted",
}
"""Keys that say something of one scheme only."""


def _orders(protocol: Protocol) -> Iterator[str]:
    # keys of the scheme that go together, and an order at all
    rules, models = protocol.schedule, protocol.models
    chosen = _chosen(rules, *_BELONGS_TO)
    for key in chosen:
        if rules.scheme != _BELONGS_TO[key]:
            yield (
                f"schedule.{key}: needed with schedule.scheme = "
                f"{got(_BELONGS_TO[key])} only, got it with {got(rules.scheme)}"
            )
    if rules.scheme == "restricted" and not {*chosen} - {"blocks_by"}:
        yield (
            "schedule.scheme: needed standards_apart = true or max_same_grade beside "
            f"{got(rules.scheme)}, got neither"
        )
    never_twice = ("williams", "latin-square", "no-immediate-repeat")
    if rules.scheme in never_twice and len(models) == 1 and rules.repeats > 1:
        yield (
            "schedule.scheme: needed two models or more so that none comes twice in a "
            f"row, got one {rules.repeats} times"
        )
    roles = {model.role for model in models}
    if rules.scheme == "blocks" and rules.blocks_by == "role" and len(roles) == 1:
        yield (
            "schedule.blocks_by: needed standards and dummies among the models with "
            f'"role", got {"standards" if "standard" in roles else "dummies"} only'
        )
    if rules.scheme == "restricted":
        yield from _too_strict(protocol)


def _too_strict(protocol: Protocol) -> Iterator[str]:
    # limits that no order of these models keeps
    rules, models = protocol.schedule, protocol.models
    n_all = len(models) * rules.repeats
    roles = Counter(model.role for model in models)
    n_standards = roles["standard"] * rules.repeats
    if rules.standards_apart and n_standards > n_all - n_standards + 1:
        yield (
            "schedule.standards_apart: needed an order without two standards in a row, "
            f"got {n_standards} presentations of standards, between which "
            f"{n_all - n_standards} of dummies leave room for {n_all - n_standards + 1}"
        )
    of_grade = Counter(model.intended_grade for model in models)
    if (limit := rules.max_same_grade) is None:
        return
    for grade, n_models in of_grade.items():
        n_same = n_models * rules.repeats
        room = limit * (n_all - n_same + 1)
        if grade is not None and n_same > room:
            yield (
                f"schedule.max_same_grade: needed an order with at most {limit} of one "
                f"grade in a row, got {n_same} presentations of grade {got(grade)}, "
                f"between which {n_all - n_same} others leave room for {room}"
            )


def _sites(protocol: Protocol) -> Iterator[str]:
    # with strata everybody has a site, and none is written in two ways
    first: dict[str, str] = {}
    for index, rater in enumerate(protocol.raters):
        where, site = f"raters[{index}].site", rater.site
        if site is None and protocol.schedule.strata == "site":
            yield (
                f'{where}: needed the id of a site with schedule.strata = "site", got '
                f"none{_id(rater.id)}"
            )
        if site is not None and first.setdefault(site.casefold(), site) != site:
            yield (
                f"{where}: needed sites that differ by more than case, got {got(site)} "
                f"beside {got(first[site.casefold()])}{_id(rater.id)}"
            )


_COMPARISONS = (
    ("stretch.start_deg", "less than", "stretch.end_deg"),
    ("stretch.end_deg", "at most", "elbow.range_end_deg"),
    ("device.dead_zone_deg_s", "less than", "device.full_speed_deg_s"),
    ("training.kappa_insufficient", "less than", "training.kappa_sufficient"),
    ("training.window", "at most", "training.max_presentations"),
    # θ_L of (6)
    ("elbow.smallest_catch_angle_deg", "less than", "elbow.range_end_deg"),
    ("elbow.catch_rise_s", "at most", "elbow.peak_duration_s"),
)
"""Keys, and how each compares with another."""


def _comparisons(protocol: Protocol) -> Iterator[str]:
    for key, comparison, other in _COMPARISONS:
        value, limit = attrgetter(key, other)(protocol)
        if value > limit or (value == limit and comparison == "less than"):
            yield f"{key}: needed {comparison} {other} ({limit:g}), got {value:g}"


def _soft_stops(protocol: Protocol) -> Iterator[str]:
    # the stretch between the device's soft stops
    start, end = protocol.stretch.start_deg, protocol.stretch.end_deg
    device, width = protocol.device, protocol.device.soft_stop_deg
    low, high = device.lowest_angle_deg, device.highest_angle_deg
    if start < low + width:
        yield (
            f"stretch.start_deg: needed at least device.lowest_angle_deg and the soft "
            f"stop beside it ({low:g} + {width:g}), got {start:g}"
        )
    if end > high - width:
        yield (
            f"stretch.end_deg: needed at most device.highest_angle_deg less the soft "
            f"stop before it ({high:g} - {width:g}), got {end:g}"
        )


def _presentation(protocol: Protocol) -> Iterator[str]:
    # keys that say something for what is asked, and speeds that the limits allow
    rules, stretch = protocol.presentation, protocol.stretch
    if rules.stretches == 1:
        for key in _chosen(rules, "time_limit_s", "stretch_limit_s", "done_with"):
            yield (
                f"presentation.{key}: needed with presentation.stretches other "
                f"than 1 only, got {got(getattr(rules, key))}"
            )
    cues = set(rules.stretches) if isinstance(rules.stretches, tuple) else set()
    slow, fast = rules.slow_speed_deg_s, rules.fast_speed_deg_s
    most, limit = stretch.largest_speed_deg_s, rules.stretch_limit_s
    way = stretch.end_deg - stretch.start_deg
    if "fast" in cues and fast > most:
        yield (
            f"presentation.fast_speed_deg_s: needed at most "
            f"stretch.largest_speed_deg_s ({most:g}), got {fast:g}"
        )
    if {"slow", "fast"} <= cues and slow >= fast:
        yield (
            f"presentation.slow_speed_deg_s: needed less than "
            f"presentation.fast_speed_deg_s ({fast:g}), got {slow:g}"
        )
    if "slow" in cues and way >= slow * limit:
        yield (
            f"presentation.slow_speed_deg_s: needed a stretch of {way:g} deg "
            f"within presentation.stretch_limit_s ({limit:g}), got {slow:g}"
        )


def _occasions(protocol: Protocol) -> Iterator[str]:
    # models of practice, and places of breaks
    occasions = protocol.occasions
    models = [model.id for model in protocol.models]
    for place, model in enumerate(occasions.practice):
        if model not in models:
            yield (
                f"occasions.practice[{place}]: needed a model of [[models]] "
                f"({listed(models)}), got {got(model)}"
            )
    after, n_presentations = occasions.break_after, len(models)
    n_presentations *= protocol.schedule.repeats
    if after is not None and after >= n_presentations:
        yield (
            f"occasions.break_after: needed fewer than the {n_presentations} "
            f"presentations of a session, as no break comes after the last, got {after}"
        )
    if after is None and _chosen(occasions, "break_minutes"):
        yield (
            f"occasions.break_minutes: needed with occasions.break_after only, got "
            f"{occasions.break_minutes:g}"
        )


def _session_order(protocol: Protocol) -> Iterator[str]:
    # sessions that come after others, and how long after
    earlier = {session.id: session.after for session in protocol.sessions}
    for index, session in enumerate(protocol.sessions):
        where, after = f"sessions[{index}]", session.after
        low, high = session.at_least_days, session.at_most_days
        if after is not None and after not in earlier:
            yield (
                f"{where}.after: needed another session of [[sessions]] "
                f"({listed(earlier)}), got {got(after)}{_id(session.id)}"
            )
        elif after is not None and _comes_back(session.id, earlier):
            yield (
                f"{where}.after: needed a session that does not come after this "
                f"one, got {got(after)}{_id(session.id)}"
            )
        if low is not None and high is not None and low > high:
            yield (
                f"{where}.at_least_days: needed at most at_most_days ({high}), "
                f"got {low}{_id(session.id)}"
            )
        needing_after = ("at_least_days", "at_most_days", "order_policy")
        for key in _chosen(session, *needing_after) if after is None else ():
            yield (
                f"{where}.{key}: needed with after only, got it alone{_id(session.id)}"
            )


def _comes_back(name: str, earlier: dict[str, str | None]) -> bool:
    # whether the sessions before a session lead back to it
    before, n_steps = earlier.get(name), 0
    while before is not None and before != name and n_steps < len(earlier):
        before, n_steps = earlier.get(before), n_steps + 1
    return before == name


def _questions(protocol: Protocol) -> Iterator[str]:
    # each question with the keys of its type, and its own id
    for index, questionnaire in enumerate(protocol.questionnaires):
        ids: set[str] = set()
        for place, question in enumerate(questionnaire.questions):
            where = f"questionnaires[{index}].questions[{place}]"
            if question.id.casefold() in ids:
                yield (
                    f"{where}.id: needed ids that differ by more than case, got "
                    f"{got(question.id)} again"
                )
            ids.add(question.id.casefold())
            for problem in chain(_range(question), _choices(question)):
                yield f"{where}.{problem}{_id(question.id)}"


def _range(question: Question) -> Iterator[str]:
    kind, low, high = question.type, question.low, question.high
    for key, end in (("low", low), ("high", high)):
        if kind == "whole" and end is None:
            yield f"{key}: needed a whole number for type {got(kind)}, got none"
        elif kind != "whole" and end is not None:
            yield (
                f'{key}: needed for type "whole" only, got {got(end)} for type '
                f"{got(kind)}"
            )
    if kind == "whole" and low is not None and high is not None and low >= high:
        yield f"low: needed less than high ({high}), got {low}"
    if kind in ("choice", "text"):
        for key in _chosen(question, "low_label", "high_label"):
            yield (
                f'{key}: needed for type "whole" or "visual-analogue" only, got it for '
                f"type {got(kind)}"
            )


def _choices(question: Question) -> Iterator[str]:
    kind, choices = question.type, question.choices
    if kind != "choice":
        if choices:
            yield (
                f'choices: needed for type "choice" only, got them for type {got(kind)}'
            )
        return
    if len(choices) < 2:
        yield f"choices: needed at least 2 texts, got {got(choices)}"
    for place, choice in enumerate(choices):
        if choice in choices[:place]:
            yield (
                f"choices[{place}]: needed choices that differ, got {got(choice)} again"
            )
        if choice != choice.strip() or not choice.isprintable():
            yield (
                f"choices[{place}]: needed a choice without spaces around it or "
                f"control characters, got {got(choice)}"
            )


def _models(protocol: Protocol) -> Iterator[str]:
    # shared constants, then models with the keys of their kind
    elbow = protocol.elbow
    yield from _held_torque(protocol, elbow, "elbow")
    for index, model in enumerate(protocol.models):
        where = f"models[{index}]"
        for problem in model_rules(model, elbow):
            yield f"{where}.{problem}{_id(model.id)}"
        overrides = _overrides(model)
        if {"rest_angle_deg", "stiffness_nm_rad"} & overrides.keys():
            place = f"{where}.constants" if "rest_angle_deg" in overrides else "elbow"
            joint = msgspec.structs.replace(elbow, **overrides)
            for problem in _held_torque(protocol, joint, place):
                yield problem + _id(model.id)


def model_rules(model: Model, elbow: ElbowConstants) -> Iterator[str]:
    """Check that a model has the keys of its kind, each with a value it can have."""
    if (problem := kind_problem(model.kind)) is not None:
        yield f"kind: {problem}"
    elif model.kind != DEFAULT_KIND:
        yield from _tone_keys(model)
    else:
        annotations = {info.name: info.type for info in msgspec.structs.fields(Model)}
        for key in _ELBOW_KEYS:
            if getattr(model, key) is None:
                yield f"{key}: needed {needed(annotations[key])}, got none"
        if model.parameters:
            yield (
                f"parameters: needed a kind of model that has some, got "
                f"{got(DEFAULT_KIND)}, whose numbers stand beside its id and in "
                "constants"
            )
        overrides = _overrides(model)
        joint = msgspec.structs.replace(elbow, **overrides)
        yield from _catch_angle(model.catch_angle_constant_deg, joint)
        rise, peak = model.constants.catch_rise_s, joint.peak_duration_s
        if rise is not None and rise > peak:
            yield (
                f"constants.catch_rise_s: needed at most elbow.peak_duration_s "
                f"({peak:g}), got {rise:g}"
            )


_ELBOW_KEYS = (
    "catch_angle_constant_deg",
    "catch_torque_nms_rad",
    "residual_ratio",
    "catch_travel_deg",
)


def _overrides(model: Model) -> dict[str, object]:
    # the constants that a model does not share with the others
    constants = msgspec.structs.asdict(model.constants)
    return {key: value for key, value in constants.items() if value is not None}


def _tone_keys(model: Model) -> Iterator[str]:
    keys = (*_ELBOW_KEYS, "file")
    foreign = [key for key in keys if getattr(model, key) is not None]
    foreign += [f"constants.{key}" for key in _overrides(model)]
    for key in foreign:
        yield (
            f"{key}: needed for kind {got(DEFAULT_KIND)} only, got it for "
            f"{got(model.kind)}; its numbers stand in [models.parameters]"
        )
    for key, problem in value_problems(model.kind, model.parameters):
        yield f"parameters{'.' if key else ''}{key}: {problem}"


def _catch_angle(constant: float | None, joint: ElbowConstants) -> Iterator[str]:
    # constant: L of (2)
    smallest = joint.smallest_catch_angle_deg
    slope, slowest = joint.catch_slope_s, joint.slowest_mean_speed_deg_s
    if constant is None:
        return
    angle = constant - slope * slowest  # first line of (6), the largest of them
    if constant <= smallest:
        yield (
            f"catch_angle_constant_deg: needed more than "
            f"elbow.smallest_catch_angle_deg ({smallest:g}), got {constant:g}"
        )
    elif angle < smallest:
        yield (
            f"catch_angle_constant_deg: needed a catch angle at "
            f"elbow.slowest_mean_speed_deg_s of at least "
            f"elbow.smallest_catch_angle_deg ({smallest:g}), got "
            f"{constant:g} - {slope:g} * {slowest:g} = {angle:g}"
        )


def _held_torque(
    protocol: Protocol, joint: ElbowConstants, where: str
) -> Iterator[str]:
    # An arm that waits where the stretch starts is held by k·(θ_start - θ_rest) of
    # (1). Where that is as much torque as a frozen encoder is recognized by, no
    # presentation would begin.
    rest, stiffness = joint.rest_angle_deg, joint.stiffness_nm_rad
    start, limit = protocol.stretch.start_deg, protocol.device.standing_torque_nm
    if rest is None:
        return
    torque = stiffness * math.radians(start - rest)
    if abs(torque) > limit:
        yield (
            f"{where}.rest_angle_deg: needed at most device.standing_torque_nm "
            f"({limit:g} N·m) where the stretch starts, got {stiffness:g} N·m/rad "
            f"times {start:g} - {rest:g} deg = {torque:.3g} N·m"
        )


def _plan(protocol: Protocol) -> Iterator[str]:
    # the lines of the analysis plan, and the sections of the report
    for index, line in enumerate(protocol.analysis.estimates):
        for problem in _plan_line(line, protocol):
            yield f"analysis.estimates[{index}].{problem}{_id(line.id)}"
    report = protocol.report
    for key, names in (
        ("sections", report.sections or ()),
        ("formats", report.formats),
    ):
        for index, name in enumerate(names):
            if name in names[:index]:
                yield (
                    f"report.{key}[{index}]: needed each {key[:-1]} once, "
                    f"got {got(name)} again"
                )


def _plan_line(line: EstimatePlan, protocol: Protocol) -> Iterator[str]:
    if line.models not in ("all", *(model.role for model in protocol.models)):
        yield f"models: needed a role that some model has, got {got(line.models)}"
    kind, named = line.kind, line.sessions
    count = _SESSIONS_NEEDED[kind]
    if len(named) != count:
        phrase = "exactly one session" if count == 1 else "exactly two sessions"
        yield f"sessions: needed {phrase} for {got(kind)}, got {len(named)}"
    elif len(set(named)) != len(named):
        yield f"sessions: needed two different sessions, got {got(named[0])} twice"
    raters = {session.id: set(session.raters) for session in protocol.sessions}
    for place, name in enumerate(named):
        if name not in raters:
            yield (
                f"sessions[{place}]: needed a session of [[sessions]] "
                f"({', '.join(raters)}), got {got(name)}"
            )
    groups = [raters[name] for name in named if name in raters]
    known = {rater.id for rater in protocol.raters}
    if len(groups) != count or not set[str]().union(*groups) <= known:
        return  # something else is wrong with a session; who meets whom is open
    if kind == "inter-rater" and len(groups[0]) < 2:
        yield "sessions: needed a session of at least two raters, got one of 1"
    if kind == "test-retest" and not groups[0] & groups[1]:
        yield "sessions: needed two sessions that share a rater, got none in both"


def _sample_sizes(protocol: Protocol) -> Iterator[str]:
    # each of a line of the plan, with shares of its grades
    lines = [line.id for line in protocol.analysis.estimates]
    seen: set[str] = set()
    for index, size in enumerate(protocol.analysis.sample_sizes):
        where, name = f"analysis.sample_sizes[{index}]", size.estimate
        if name not in lines:
            known = listed(lines) if lines else "there is none"
            yield (
                f"{where}.estimate: needed an estimate of the plan ({known}), got "
                f"{got(name)}"
            )
        if name in seen:
            yield f"{where}.estimate: needed each once, got {got(name)} again"
        seen.add(name)
        for problem in _shares(size, len(protocol.scale.grades)):
            yield f"{where}.{problem}"


_SUM = 1e-6  # by which prevalences may miss 1


def _shares(size: SampleSize, n_grades: int) -> Iterator[str]:
    shares, rows = size.prevalences, size.table
    if rows and size.model != "table":
        yield f'table: needed model = "table", got {got(size.model)}'
    if size.model == "table" and not rows:
        yield "table: needed the joint probabilities of two raters, got none"
    if shares and len(shares) != n_grades:
        yield f"prevalences: needed one of each of {n_grades} grades, got {len(shares)}"
    if rows and [len(row) for row in rows] != [n_grades] * n_grades:
        yield f"table: needed {n_grades} rows of {n_grades}, one a grade"
    for key, sum_ in (("prevalences", sum(shares)), ("table", sum(map(sum, rows)))):
        if getattr(size, key) and abs(sum_ - 1.0) > _SUM:
            yield f"{key}: needed numbers with sum 1, got sum {sum_:g}"


def _gates(protocol: Protocol) -> Iterator[str]:
    # every gate one, on an estimate of the plan
    names = [line.id for line in protocol.analysis.estimates]
    for index, gate in enumerate(protocol.report.gates):
        if not gate.why.isprintable():  # it stands in a line of a table, and in XML
            yield (
                f"report.gates[{index}].why: needed one line without control "
                f"characters, got {got(gate.why)}"
            )
        try:
            parse_gate(gate.require, names, where=f"report.gates[{index}].require")
        except ParameterError as error:
            yield str(error)


_RULES = (
    _scale,
    _ids,
    _references,
    _rater_fields,
    _schedules,
    _orders,
    _sites,
    _comparisons,
    _soft_stops,
    _presentation,
    _occasions,
    _session_order,
    _questions,
    _models,
    _plan,
    _sample_sizes,
    _gates,
)
