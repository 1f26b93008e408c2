"""The rules across keys of a protocol whose every key is of its type."""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from operator import attrgetter

import msgspec

from masrel._input import listed
from masrel.errors import ParameterError
from masrel.lab._study_files import repeated
from masrel.lab.protocol._decode import got, needed
from masrel.lab.protocol._kinds import DEFAULT_KIND, kind_problem, value_problems
from masrel.lab.protocol._values import RESERVED, field_value, needed_of
from masrel.lab.protocol.content import _gate_of
from masrel.lab.protocol.definition import (
    _FIELD_NAME,
    ElbowConstants,
    EstimatePlan,
    GateKeys,
    JudgeKeys,
    Model,
    Protocol,
    Question,
    Rater,
    SampleSize,
    Session,
)

# Presentations of one session; blinded codes are drawn from 1800
_MAX_PRESENTATIONS = 500

# Names that Windows keeps for devices, whatever stands behind a dot
_DEVICES = {
    *("CON", "PRN", "AUX", "NUL"),
    *(f"{port}{number}" for port in ("COM", "LPT") for number in range(1, 10)),
}

# Marks of a missing rating in a ratings file; no grade may be called that
_MISSING_MARKS = ("NA",)

# Kind of an estimate to the number of sessions it is made from
_SESSIONS_NEEDED = {
    "inter-rater": (1, "one session"),
    "test-retest": (2, "two sessions"),
}


def broken_rules(protocol: Protocol) -> Iterator[str]:
    """Check the rules across keys."""
    for array, rule in _RULES:
        if array is None:
            yield from rule(protocol)
            continue
        for index, entry in enumerate(attrgetter(array)(protocol)):
            # its id helps to find it in the file
            at_end = f" (id {got(entry.id)})" if hasattr(entry, "id") else ""
            for problem in rule(entry, protocol):
                yield f"{array}[{index}].{problem}{at_end}"


def _broken(*rules: tuple[object, str]) -> Iterator[str]:
    """Yield the messages of the rules that are broken."""
    return (sentence for is_broken, sentence in rules if is_broken)


def _again(names: Sequence[str], where: str, needs: str) -> Iterator[str]:
    return (
        f"{where}[{index}]: needed {needs}, got {got(name)} again"
        for index, (name, is_again) in enumerate(
            zip(names, repeated(names), strict=True)
        )
        if is_again
    )


def _chosen(table: msgspec.Struct, *keys: str) -> list[str]:
    # those of the keys that are not at their defaults
    defaults = {info.name: info.default for info in msgspec.structs.fields(table)}
    return [key for key in keys if getattr(table, key) != defaults[key]]


def _scale(protocol: Protocol) -> Iterator[str]:
    # grades that a file of ratings can hold, each once, and no anchor of another
    grades = protocol.scale.grades
    yield from _again(grades, "scale.grades", "grades that differ")
    for index, grade in enumerate(grades):
        where = f"scale.grades[{index}]"
        yield from _broken(
            (
                _is_padded(grade),
                f"{where}: needed a grade without spaces around it or control "
                f"characters, got {got(grade)}",
            ),
            (
                grade in _MISSING_MARKS,
                f"{where}: needed a grade that does not mean a missing one, "
                f"got {got(grade)}",
            ),
        )
    yield from (
        f"scale.anchors: needed grades of the scale ({listed(grades)}), got {got(each)}"
        for each in protocol.scale.anchors
        if each not in grades
    )


def _is_padded(text: str) -> bool:
    return text != text.strip() or not text.isprintable()


def _ids(protocol: Protocol) -> Iterator[str]:
    # ids that no file system takes for one: to some, R1 and r1 are the same name
    ids = {
        "models": [model.id for model in protocol.models],
        "raters": [rater.id for rater in protocol.raters],
        "sessions": [session.id for session in protocol.sessions],
        "questionnaires": [each.id for each in protocol.questionnaires],
        "analysis.estimates": [line.id for line in protocol.analysis.estimates],
        "analysis.judges": [line.id for line in protocol.analysis.judges],
    }
    for key, names in ids.items():
        first: dict[str, int] = {}
        for index, name in enumerate(names):
            earlier = first.setdefault(name.casefold(), index)
            yield from _broken(
                (
                    earlier != index,
                    f"{key}[{index}].id: needed ids that differ by more than case, "
                    f"got {got(name)} where {key}[{earlier}] has {got(names[earlier])}",
                ),
                (
                    name.partition(".")[0].upper() in _DEVICES,
                    f"{key}[{index}].id: needed an id that Windows takes as the name "
                    f"of a file, got {got(name)}",
                ),
            )


def _intended_grade(model: Model, protocol: Protocol) -> Iterator[str]:
    # of the scale
    grades, grade = protocol.scale.grades, model.intended_grade
    if grade not in (None, *grades):
        yield (
            f"intended_grade: needed a grade of the scale ({listed(grades)}), got "
            f"{got(grade)}"
        )


def _session_raters(session: Session, protocol: Protocol) -> Iterator[str]:
    # of the study, each once
    known = dict.fromkeys(rater.id for rater in protocol.raters)
    yield from _again(session.raters, "raters", "each rater once")
    for place, rater in enumerate(session.raters):
        if rater not in known:
            yield (
                f"raters[{place}]: needed a rater of [[raters]] ({listed(known)}), got "
                f"{got(rater)}"
            )


def _rater_fields(protocol: Protocol) -> Iterator[str]:
    # fields that can be columns of a table
    for name, field in protocol.rater_fields.items():
        where, kind = f"rater_fields.{name}", field.type
        yield from _broken(
            (
                not _FIELD_NAME.fullmatch(name) or name in RESERVED,
                f"{where}: needed a name of 1 to 32 small letters, digits and '_', the "
                f"first a letter, other than {', '.join(RESERVED)}, got {got(name)}",
            ),
            (
                kind == "choice" and len(set(field.choices)) < 2,
                f"{where}.choices: needed at least 2 that differ, got "
                f"{got(field.choices)}",
            ),
            (
                kind != "choice" and field.choices,
                f'{where}.choices: needed for type "choice" only, got it for '
                f"{got(kind)}",
            ),
            (
                kind in ("text", "choice", "date") and field.unit,
                f"{where}.unit: needed for numbers only, got it for {got(kind)}",
            ),
        )


def _rater_values(rater: Rater, protocol: Protocol) -> Iterator[str]:
    # what a rater has in them
    fields = protocol.rater_fields
    for name, value in rater.fields.items():
        if name not in fields:
            yield (
                f"fields.{name}: needed a field of [rater_fields] "
                f"({listed(fields) or 'there is none'}), got {got(name)}"
            )
        elif field_value(fields[name], value) is None:
            yield f"fields.{name}: needed {needed_of(fields[name])}, got {got(value)}"


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


# Keys that say something of one scheme only
_BELONGS_TO = {
    "blocks_by": "blocks",
    "standards_apart": "restricted",
    "max_same_grade": "restricted",
}


def _orders(protocol: Protocol) -> Iterator[str]:
    # keys of the scheme that go together, and an order at all
    rules, models = protocol.schedule, protocol.models
    chosen, scheme = _chosen(rules, *_BELONGS_TO), rules.scheme
    roles = {model.role for model in models}
    never_twice = ("williams", "latin-square", "no-immediate-repeat")
    yield from _broken(
        *(
            (
                scheme != needed_by,
                f"schedule.{key}: needed with schedule.scheme = {got(needed_by)} only, "
                f"got it with {got(scheme)}",
            )
            for key, needed_by in _BELONGS_TO.items()
            if key in chosen
        ),
        (
            scheme == "restricted" and not {*chosen} - {"blocks_by"},
            "schedule.scheme: needed standards_apart = true or max_same_grade beside "
            f"{got(scheme)}, got neither",
        ),
        (
            scheme in never_twice and len(models) == 1 and rules.repeats > 1,
            "schedule.scheme: needed two models or more so that none comes twice in a "
            f"row, got one {rules.repeats} times",
        ),
        (
            scheme == "blocks" and rules.blocks_by == "role" and len(roles) == 1,
            "schedule.blocks_by: needed standards and dummies among the models with "
            f'"role", got {"standards" if "standard" in roles else "dummies"} only',
        ),
    )
    if scheme == "restricted":
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


def _site(rater: Rater, protocol: Protocol) -> Iterator[str]:
    # with strata everybody has a site, and none is written in two ways
    site = rater.site or ""
    sites = (each.site or "" for each in protocol.raters)
    first = next(each for each in sites if each.casefold() == site.casefold())
    return _broken(
        (
            rater.site is None and protocol.schedule.strata == "site",
            'site: needed the id of a site with schedule.strata = "site", got none',
        ),
        (
            first != site,
            f"site: needed sites that differ by more than case, got {got(site)} "
            f"beside {got(first)}",
        ),
    )


# Keys, and how each compares with another
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
    return _broken(
        (
            start < low + width,
            f"stretch.start_deg: needed at least device.lowest_angle_deg and the soft "
            f"stop beside it ({low:g} + {width:g}), got {start:g}",
        ),
        (
            end > high - width,
            f"stretch.end_deg: needed at most device.highest_angle_deg less the soft "
            f"stop before it ({high:g} - {width:g}), got {end:g}",
        ),
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
    yield from _broken(
        (
            "fast" in cues and fast > most,
            f"presentation.fast_speed_deg_s: needed at most "
            f"stretch.largest_speed_deg_s ({most:g}), got {fast:g}",
        ),
        (
            {"slow", "fast"} <= cues and slow >= fast,
            f"presentation.slow_speed_deg_s: needed less than "
            f"presentation.fast_speed_deg_s ({fast:g}), got {slow:g}",
        ),
        (
            "slow" in cues and way >= slow * limit,
            f"presentation.slow_speed_deg_s: needed a stretch of {way:g} deg "
            f"within presentation.stretch_limit_s ({limit:g}), got {slow:g}",
        ),
    )


def _occasions(protocol: Protocol) -> Iterator[str]:
    # models of practice, and places of breaks
    occasions = protocol.occasions
    models = [model.id for model in protocol.models]
    after, n_presentations = occasions.break_after, len(models)
    n_presentations *= protocol.schedule.repeats
    return _broken(
        *(
            (
                model not in models,
                f"occasions.practice[{place}]: needed a model of [[models]] "
                f"({listed(models)}), got {got(model)}",
            )
            for place, model in enumerate(occasions.practice)
        ),
        (
            after is not None and after >= n_presentations,
            f"occasions.break_after: needed fewer than the {n_presentations} "
            "presentations of a session, as no break comes after the last, got "
            f"{after}",
        ),
        (
            after is None and _chosen(occasions, "break_minutes"),
            f"occasions.break_minutes: needed with occasions.break_after only, got "
            f"{occasions.break_minutes:g}",
        ),
    )


def _session_order(session: Session, protocol: Protocol) -> Iterator[str]:
    # sessions that come after others, and how long after
    earlier = {each.id: each.after for each in protocol.sessions}
    after, low, high = session.after, session.at_least_days, session.at_most_days
    before = after
    for _ in earlier:  # at most so many come before it
        if before != session.id:
            before = earlier.get(before or "")
    return _broken(
        (
            after not in (None, *earlier),
            f"after: needed another session of [[sessions]] ({listed(earlier)}), got "
            f"{got(after)}",
        ),
        (
            before == session.id,
            f"after: needed a session that does not come after this one, got "
            f"{got(after)}",
        ),
        (
            low is not None and high is not None and low > high,
            f"at_least_days: needed at most at_most_days ({high}), got {low}",
        ),
        *(
            (after is None, f"{key}: needed with after only, got it alone")
            for key in _chosen(session, "at_least_days", "at_most_days", "order_policy")
        ),
    )


def _questions(protocol: Protocol) -> Iterator[str]:
    # each question with the keys of its type, and its own id
    for index, questionnaire in enumerate(protocol.questionnaires):
        again = repeated([each.id.casefold() for each in questionnaire.questions])
        for place, question in enumerate(questionnaire.questions):
            where = f"questionnaires[{index}].questions[{place}]"
            if again[place]:
                yield (
                    f"{where}.id: needed ids that differ by more than case, got "
                    f"{got(question.id)} again"
                )
            for problem in chain(_range(question), _choices(question)):
                yield f"{where}.{problem} (id {got(question.id)})"


def _range(question: Question) -> Iterator[str]:
    kind, low, high = question.type, question.low, question.high
    labels = _chosen(question, "low_label", "high_label")
    yield from _broken(
        *(
            (
                (kind == "whole") == (end is None),
                f"{key}: needed a whole number for type {got(kind)}, got none"
                if end is None
                else f'{key}: needed for type "whole" only, got {got(end)} for type '
                f"{got(kind)}",
            )
            for key, end in (("low", low), ("high", high))
        ),
        (
            kind == "whole" and low is not None and high is not None and low >= high,
            f"low: needed less than high ({high}), got {low}",
        ),
        *(
            (
                kind in ("choice", "text"),
                f'{key}: needed for type "whole" or "visual-analogue" only, got it for '
                f"type {got(kind)}",
            )
            for key in labels
        ),
    )


def _choices(question: Question) -> Iterator[str]:
    kind, choices = question.type, question.choices
    yield from _broken(
        (
            kind != "choice" and choices,
            f'choices: needed for type "choice" only, got them for type {got(kind)}',
        ),
        (
            kind == "choice" and len(choices) < 2,
            f"choices: needed at least 2 texts, got {got(choices)}",
        ),
    )
    if kind == "choice":
        yield from _again(choices, "choices", "choices that differ")
        for place, choice in enumerate(choices):
            if _is_padded(choice):
                yield (
                    f"choices[{place}]: needed a choice without spaces around it or "
                    f"control characters, got {got(choice)}"
                )


def model_rules(model: Model, elbow: ElbowConstants) -> Iterator[str]:
    """Check that a model has the keys of its kind, each with a value it can have."""
    if (problem := kind_problem(model.kind)) is not None:
        yield f"kind: {problem}"
    elif model.kind != DEFAULT_KIND:
        yield from _tone_keys(model)
    else:
        annotations = {info.name: info.type for info in msgspec.structs.fields(Model)}
        yield from (
            f"{key}: needed {needed(annotations[key])}, got none"
            for key in _ELBOW_KEYS
            if getattr(model, key) is None
        )
        if model.parameters:
            yield (
                f"parameters: needed a kind of model that has some, got "
                f"{got(DEFAULT_KIND)}, whose numbers are beside its id and in "
                "constants"
            )
        joint = msgspec.structs.replace(elbow, **model.overrides)
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


def _tone_keys(model: Model) -> Iterator[str]:
    keys = [key for key in (*_ELBOW_KEYS, "file") if getattr(model, key) is not None]
    for key in (*keys, *(f"constants.{key}" for key in model.overrides)):
        yield (
            f"{key}: needed for kind {got(DEFAULT_KIND)} only, got it for "
            f"{got(model.kind)}; its numbers are in [models.parameters]"
        )
    for key, problem in value_problems(model.kind, model.parameters):
        yield f"parameters{'.' if key else ''}{key}: {problem}"


def _catch_angle(constant: float | None, joint: ElbowConstants) -> Iterator[str]:
    # constant: L of (2)
    if constant is None:
        return iter(())
    smallest = joint.smallest_catch_angle_deg
    slope, slowest = joint.catch_slope_s, joint.slowest_mean_speed_deg_s
    angle = constant - slope * slowest  # first line of (6), the largest of them
    return _broken(
        (
            constant <= smallest,
            f"catch_angle_constant_deg: needed more than "
            f"elbow.smallest_catch_angle_deg ({smallest:g}), got {constant:g}",
        ),
        (
            angle < smallest < constant,
            f"catch_angle_constant_deg: needed a catch angle at "
            f"elbow.slowest_mean_speed_deg_s of at least "
            f"elbow.smallest_catch_angle_deg ({smallest:g}), got "
            f"{constant:g} - {slope:g} * {slowest:g} = {angle:g}",
        ),
    )


def _held_torque(protocol: Protocol) -> Iterator[str]:
    # An arm that waits where the stretch starts is held by k·(θ_start - θ_rest) of
    # (1). Where that is as much torque as a frozen encoder is recognized by, no
    # presentation would begin.
    start, limit = protocol.stretch.start_deg, protocol.device.standing_torque_nm
    joints = [("elbow", protocol.elbow, "")]
    for index, model in enumerate(protocol.models):
        overrides = model.overrides
        if overrides.keys() & {"rest_angle_deg", "stiffness_nm_rad"}:
            has_rest = "rest_angle_deg" in overrides
            where = f"models[{index}].constants" if has_rest else "elbow"
            joint = msgspec.structs.replace(protocol.elbow, **overrides)
            joints.append((where, joint, f" (id {got(model.id)})"))
    for where, joint, at_end in joints:
        rest, stiffness = joint.rest_angle_deg, joint.stiffness_nm_rad
        torque = stiffness * math.radians(start - (start if rest is None else rest))
        if rest is not None and abs(torque) > limit:
            yield (
                f"{where}.rest_angle_deg: needed at most device.standing_torque_nm "
                f"({limit:g} N·m) where the stretch starts, got {stiffness:g} N·m/rad "
                f"times {start:g} - {rest:g} deg = {torque:.3g} N·m{at_end}"
            )


def _report(protocol: Protocol) -> Iterator[str]:
    # nothing twice
    report = protocol.report
    yield from _again(report.sections or (), "report.sections", "each section once")
    yield from _again(report.formats, "report.formats", "each format once")


def _plan(line: EstimatePlan, protocol: Protocol) -> Iterator[str]:
    kind, named = line.kind, line.sessions
    count, phrase = _SESSIONS_NEEDED[kind]
    raters = {session.id: set(session.raters) for session in protocol.sessions}
    groups = [raters[name] for name in named if name in raters]
    known = {rater.id for rater in protocol.raters}
    # where something else is wrong with a session, who meets whom is open
    is_open = len(groups) != count or not set[str]().union(*groups) <= known
    return _broken(
        (
            line.models not in ("all", *(model.role for model in protocol.models)),
            f"models: needed a role that some model has, got {got(line.models)}",
        ),
        (
            len(named) != count,
            f"sessions: needed exactly {phrase} for {got(kind)}, got {len(named)}",
        ),
        (
            len(named) == count and len(set(named)) != count,
            f"sessions: needed two different sessions, got {got(named[0])} twice",
        ),
        *(
            (
                name not in raters,
                f"sessions[{place}]: needed a session of [[sessions]] "
                f"({', '.join(raters)}), got {got(name)}",
            )
            for place, name in enumerate(named)
        ),
        (
            not is_open and kind == "inter-rater" and len(groups[0]) < 2,
            "sessions: needed a session of at least two raters, got one of 1",
        ),
        (
            not is_open and kind == "test-retest" and not set.intersection(*groups),
            "sessions: needed two sessions that share a rater, got none in both",
        ),
    )


_SUM = 1e-6  # by which prevalences may miss 1


def _sample_size(size: SampleSize, protocol: Protocol) -> Iterator[str]:
    # of a line of the plan, with shares of its grades
    lines = [line.id for line in protocol.analysis.estimates]
    n_grades, known = len(protocol.scale.grades), listed(lines) or "there is none"
    sizes = protocol.analysis.sample_sizes
    first = next(each for each in sizes if each.estimate == size.estimate)
    shares, rows = size.prevalences, size.table
    sums = {"prevalences": sum(shares), "table": sum(map(sum, rows))}
    return _broken(
        (
            size.estimate not in lines,
            f"estimate: needed an estimate of the plan ({known}), got "
            f"{got(size.estimate)}",
        ),
        (
            first is not size,
            f"estimate: needed each once, got {got(size.estimate)} again",
        ),
        (
            rows and size.model != "table",
            f'table: needed model = "table", got {got(size.model)}',
        ),
        (
            size.model == "table" and not rows,
            "table: needed the joint probabilities of two raters, got none",
        ),
        (
            shares and len(shares) != n_grades,
            f"prevalences: needed one of each of {n_grades} grades, got {len(shares)}",
        ),
        (
            rows and [len(row) for row in rows] != [n_grades] * n_grades,
            f"table: needed {n_grades} rows of {n_grades}, one a grade",
        ),
        *(
            (
                getattr(size, key) and abs(sum_ - 1.0) > _SUM,
                f"{key}: needed numbers with sum 1, got sum {sum_:g}",
            )
            for key, sum_ in sums.items()
        ),
    )


def _judge(line: JudgeKeys, protocol: Protocol) -> Iterator[str]:
    # beside humans of one session, on presentations enough
    raters = {session.id: session.raters for session in protocol.sessions}
    met = raters.get(line.session, ())
    humans = line.humans or [name for name in met if name != line.judge]
    stray = [name for name in humans if name not in met or name == line.judge]
    n_items = len(protocol.models) * protocol.schedule.repeats
    return _broken(
        (
            line.id in {each.id for each in protocol.analysis.estimates},
            f"id: {got(line.id)} is also an estimate of the plan",
        ),
        (
            line.session not in raters,
            f"session: needed a session of [[sessions]] ({', '.join(raters)}), got "
            f"{got(line.session)}",
        ),
        (
            met and line.judge not in met,
            f"judge: needed a rater of the session ({', '.join(met)}), got "
            f"{got(line.judge)}",
        ),
        (
            met and (len(set(humans)) < 2 or stray),
            f"humans: needed two raters of the session or more, beside the judge, got "
            f"{listed(humans) or 'none'}",
        ),
        (
            line.min_items > n_items,
            f"min_items: needed at most {n_items}, the presentations of a session, got "
            f"{line.min_items}",
        ),
    )


def _gate(gate: GateKeys, protocol: Protocol) -> Iterator[str]:
    # one on an estimate of the plan
    if not gate.why.isprintable():  # it stands in a line of a table, and in XML
        yield (f"why: needed one line without control characters, got {got(gate.why)}")
    try:
        _gate_of(gate.require, protocol, where="require")
    except ParameterError as error:
        yield str(error)


# Arrays of tables whose every entry is held against a rule; None for a rule of all
_RULES: tuple[tuple[str | None, Callable[..., Iterator[str]]], ...] = (
    (None, _scale),
    (None, _ids),
    ("models", _intended_grade),
    ("sessions", _session_raters),
    (None, _rater_fields),
    ("raters", _rater_values),
    (None, _schedules),
    (None, _orders),
    ("raters", _site),
    (None, _comparisons),
    (None, _soft_stops),
    (None, _presentation),
    (None, _occasions),
    ("sessions", _session_order),
    (None, _questions),
    (None, _held_torque),
    ("models", lambda model, protocol: model_rules(model, protocol.elbow)),
    ("analysis.estimates", _plan),
    (None, _report),
    ("analysis.sample_sizes", _sample_size),
    ("analysis.judges", _judge),
    ("report.gates", _gate),
)
