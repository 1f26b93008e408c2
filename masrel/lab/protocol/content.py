"""What a protocol says to others: scale, joints in SI units, gates, hashes."""

import math
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, get_args

import msgspec

from masrel.analysis._gates import Gate, read_gate
from masrel.errors import ParameterError, ProtocolError
from masrel.lab._study_files import once, sha256_of
from masrel.lab.elbow.parameters import ElbowParameters
from masrel.lab.elbow.tone import JointModel
from masrel.lab.protocol._kinds import DEFAULT_KIND, model_of_kind, without_defaults
from masrel.lab.protocol.definition import (
    ElbowConstants,
    Model,
    Protocol,
    _Section,
)
from masrel.scales import Scale


def scale_of(protocol: Protocol) -> Scale:
    """Return the rating scale of a protocol.

    Parameters
    ----------
    protocol : Protocol
        A protocol.

    Returns
    -------
    Scale
        Name and grades, least first.
    """
    return Scale(name=protocol.scale.name, grades=protocol.scale.grades)


def joint_model(protocol: Protocol, model_id: str) -> JointModel:
    """Return the law of one haptic model, in SI units.

    Parameters
    ----------
    protocol : Protocol
        A protocol; its angles are degrees.
    model_id : str
        Id of one of its models.

    Returns
    -------
    JointModel
        Of the model's kind, with its parameters; of a spastic elbow its L, H, Q and D
        and constants, with those of ``[elbow]`` for the rest.

    Raises
    ------
    ParameterError
        If the protocol has no such model; the message names those there are.
    """
    models = {model.id: model for model in protocol.models}
    if model_id not in models:
        known = ", ".join(models)
        raise ParameterError(f"model: needed one of {known}, got {model_id!r}")
    model = models[model_id]
    if model.kind == DEFAULT_KIND:
        return _joint_of(model, protocol.elbow)
    return model_of_kind(model.kind, model.parameters)


def _coefficient_problems(protocol: Protocol) -> Iterator[tuple[int, str]]:
    """Yield lines of the plan that name no coefficient, and what they needed."""
    from masrel.agreement import coefficient  # loads numpy

    for index, line in enumerate(protocol.analysis.estimates):
        try:
            coefficient(line.coefficient)
        except ParameterError as error:
            yield index, f'analysis.estimates[{index}].{error} (id "{line.id}")'


def _refuse_unknown_coefficients(protocol: Protocol, path: Path) -> None:
    """Refuse a plan that could not be computed once every rating is there."""
    problems = [f"{path}: {problem}" for _, problem in _coefficient_problems(protocol)]
    if problems:
        raise ProtocolError(*problems)


def report_sections(protocol: Protocol) -> tuple[str, ...]:
    """Return the sections of a protocol's report.

    Parameters
    ----------
    protocol : Protocol
        A protocol.

    Returns
    -------
    tuple of str
        Those that ``report.sections`` names. By default, all that the study has
        something for, in the order of a paper; grades given in person, and
        claims of a paper, are shown only where they are named.
    """
    if protocol.report.sections is not None:
        return protocol.report.sections
    has_something = {
        **dict.fromkeys(("in-person", "claims"), False),  # only where they are named
        "sample-size": bool(protocol.analysis.sample_sizes),
        "test-retest": any(
            line.kind == "test-retest" for line in protocol.analysis.estimates
        ),
        "confusion": any(model.intended_grade is not None for model in protocol.models),
        "questionnaires": bool(protocol.questionnaires),
    }
    return tuple(name for name in get_args(_Section) if has_something.get(name, True))


def _joint_of(model: Model, shared: ElbowConstants) -> ElbowParameters:
    """Return the joint of one spastic elbow, in SI units."""
    elbow = msgspec.structs.replace(shared, **model.overrides)
    rest = elbow.rest_angle_deg
    return ElbowParameters(
        # none is missing in a protocol that was read
        catch_angle_constant=math.radians(model.catch_angle_constant_deg or 0.0),
        catch_torque_constant=model.catch_torque_nms_rad or 0.0,
        residual_ratio=model.residual_ratio or 0.0,
        catch_travel=math.radians(model.catch_travel_deg or 0.0),
        inertia=elbow.inertia_kg_m2,
        damping=elbow.damping_nms_rad,
        stiffness=elbow.stiffness_nm_rad,
        catch_slope=elbow.catch_slope_s,
        peak_duration=elbow.peak_duration_s,
        post_catch_stiffness=elbow.post_catch_stiffness_nm_rad,
        speed_threshold=math.radians(elbow.speed_threshold_deg_s),
        slowest_mean_speed=math.radians(elbow.slowest_mean_speed_deg_s),
        smallest_catch_angle=math.radians(elbow.smallest_catch_angle_deg),
        range_end=math.radians(elbow.range_end_deg),
        rest_angle=None if rest is None else math.radians(rest),
        post_catch=elbow.post_catch,
        residual_reading=elbow.residual_reading,
        catch_rise=elbow.catch_rise_s,
    )


# The tables that decide what a rater meets, besides the study's id
_PRESENTED = (
    "scale",
    "elbow",
    "models",
    "schedule",
    "stretch",
    "presentation",
    "occasions",
    "device",
)

# What protocols once had not, with the defaults it then had: it does not enter where it
# says nothing, so that no schedule drawn before turns stale. A list has what is so of
# every entry.
_LATER: dict[str, Any] = {
    "scale": {"anchors": {}},
    "models": [
        {
            "file": None,
            "simulated": False,
            "kind": DEFAULT_KIND,
            "catch_angle_constant_deg": None,
            "catch_torque_nms_rad": None,
            "residual_ratio": None,
            "catch_travel_deg": None,
            "constants": {},
            "parameters": {},
        }
    ],
    "raters": [{"fields": {}, "site": None}],
    "rater_fields": {},
    "sessions": [
        {
            "after": None,
            "at_least_days": None,
            "at_most_days": None,
            "order_policy": "refuse",
        }
    ],
    "questionnaires": (),
    "blinding": {"sealed": False},
    "study": {"language": "en"},
    "elbow": {
        "catch_rise_s": 0.0,
        "residual_reading": "residual",
        "rest_angle_deg": None,
    },
    "schedule": {
        "blocks_by": "repeat",
        "standards_apart": False,
        "max_same_grade": None,
        "strata": "none",
    },
    "stretch": {"largest_speed_deg_s": 131.0},
    "presentation": {
        "stretches": 1,
        "time_limit_s": 60.0,
        "stretch_limit_s": 20.0,
        "slow_speed_deg_s": 10.0,
        "fast_speed_deg_s": 120.0,
        "done_with": "enter",
    },
    "occasions": {
        "instructions": "",
        "practice": (),
        "break_after": None,
        "break_minutes": 5.0,
        "resume": "always",
    },
    "device": {
        "active_torque_limit_nm": 10.0,
        "active_energy_limit_j": 1.0,
        "active_speed_limit_deg_s": 180.0,
        "drift_limit_deg": 3.0,
        "drift_speed_deg_s": 25.0,
        "encoder_noise_deg": 0.0,
        "actuator_limit_nm": 1.5,
        "arrival_deg": 3.0,
        "arrival_speed_deg_s": 5.0,
        "arrival_ms": 100.0,
        "end_ramp_ms": 100.0,
        "post_catch_ramp_ms": 100.0,
        "loose_inertia_kg_m2": 0.06,
        "calibration_max_days": None,
        "torque_sensor": False,
        "backends": {},
    },
    "simulated_raters": {"hold_s": 0.0, "hand": "clamp"},
    "analysis": {"sample_sizes": (), "judges": (), "estimates": [{"title": ""}]},
    "report": {"gates": (), "formats": ("html", "markdown")},
    "training": {
        "kappa_insufficient": 0.6,
        "kappa_sufficient": 0.8,
        "weights": "linear",
        "false_pass": 0.05,
        "false_fail": 0.1,
        "window": 60,
        "order": "blocked",
        "max_presentations": 120,
        "seed": 0,
    },
}


# The default of ``report.sections`` when it entered: it still does, for no choice
_FORMER_SECTIONS = (
    "design",
    "grades",
    "agreement",
    "intended",
    "test-retest",
    "speeds",
    "traces",
)


@once
def protocol_hash(protocol: Protocol) -> str:
    """Hash the whole content of a protocol.

    Parameters
    ----------
    protocol : Protocol
        A protocol; keys left out of the file count with their defaults.

    Returns
    -------
    str
        SHA-256, 64 hexadecimal digits. Comments, order of keys and layout of the
        file do not enter. From a model file its numbers enter, its name, and whether
        it comes from simulated recordings.
    """
    return sha256_of(_protocol_content(protocol))


@once
def presented_hash(protocol: Protocol) -> str:
    """Hash the part of a protocol that decides what a rater meets.

    Parameters
    ----------
    protocol : Protocol
        A protocol.

    Returns
    -------
    str
        SHA-256, 64 hexadecimal digits, of the study's id and the tables
        ``scale`` (without anchors), ``elbow``, ``models``, ``schedule``, ``stretch``,
        ``presentation``, ``occasions`` (practice and breaks alone) and ``device``.

    Notes
    -----
    Raters, sessions, texts, the analysis plan and the report do not enter: adding
    a rater or wording a title better makes nobody's drawn schedule stale. Nor do
    ``device.torque_sensor`` and ``device.calibration_max_days``, which no rater feels.
    """
    return sha256_of(presented_content(protocol))


def presented_content(protocol: Protocol) -> bytes:
    """Return the part of a protocol that decides what a rater meets, as JSON.

    Parameters
    ----------
    protocol : Protocol
        A protocol.

    Returns
    -------
    bytes
        UTF-8, keys sorted, no spaces: what :func:`presented_hash` hashes.
    """
    tables = {name: getattr(protocol, name) for name in _PRESENTED}
    replaced = msgspec.structs.replace
    content = {
        "study": protocol.study.id,
        **tables,
        "scale": replaced(protocol.scale, anchors={}),
        "occasions": replaced(protocol.occasions, instructions="", resume="always"),
        "device": replaced(
            protocol.device, torque_sensor=False, calibration_max_days=None
        ),
    }
    return _canonical(content, ignored=("file", "simulated"))  # numbers are felt


def _protocol_content(protocol: Protocol) -> bytes:
    """Return the whole content of a protocol, as JSON: what `protocol_hash` hashes."""
    return _canonical(protocol)


def _content_differences(
    before: Any, after: Any, *keys: str
) -> Iterator[tuple[str, Any, Any]]:
    """Yield the keys at which two contents differ, and what each has there.

    None where it has nothing. Entries of a list that have ids are compared by these; of
    one that is new or gone the list of ids says all.
    """
    if isinstance(before, dict) and isinstance(after, dict):
        for key in after | before:
            yield from _content_differences(
                before.get(key), after.get(key), *keys, str(key)
            )
    elif _has_ids(before) and _has_ids(after):
        one, other = ({e["id"]: e for e in entries} for entries in (before, after))
        if [*one] != [*other]:
            yield ".".join(keys), [*one], [*other]
        for name in one:
            if name in other:
                yield from _content_differences(one[name], other[name], *keys, name)
    elif before != after:
        yield ".".join(keys), before, after


def _has_ids(value: Any) -> bool:
    return isinstance(value, list | tuple) and all(
        isinstance(entry, dict) and "id" in entry for entry in value
    )


def _canonical(content: object, ignored: tuple[str, ...] = ()) -> bytes:
    # ignored: keys of models that do not enter
    plain: dict[str, Any] = msgspec.to_builtins(content)
    shared = {key: plain["elbow"][key] for key in ("post_catch", *_LATER["elbow"])}
    for model in plain["models"]:
        # without what it repeats of the shared constants, or of its kind
        model["constants"] = {
            key: value
            for key, value in model["constants"].items()
            if value is not None and value != shared.get(key)
        }
        model["parameters"] = without_defaults(model["kind"], model["parameters"])
        for key in ignored:
            model.pop(key, None)
    if "report" in plain and plain["report"]["sections"] is None:
        plain["report"]["sections"] = _FORMER_SECTIONS
    _drop(plain, _LATER)
    return msgspec.json.encode(plain, order="sorted")


def _drop(plain: dict[str, Any], defaults: dict[str, Any]) -> None:
    # takes out what protocols once had not, where it says nothing
    for key, default in defaults.items():
        value = plain.get(key)
        if isinstance(default, list):
            for entry in value or ():
                _drop(entry, default[0])
        elif isinstance(default, dict) and isinstance(value, dict):
            _drop(value, default)  # a study is perhaps its id alone
        if key in plain and value in (default, {}):
            del plain[key]


# Numbers of an estimate that a gate can be about
_NUMBERS = ("value", "low", "high", "width", "n", "n_missing", "p")
_OF_JUDGES = ("winning_rate", "advantage")


def parse_gate(
    text: str,
    estimates: Collection[str],
    *,
    judges: Collection[str] = (),
    where: str,
    why: str = "",
) -> Gate:
    """Read a requirement such as ``kappa.low >= 0.4``.

    Parameters
    ----------
    text : str
        Estimate and number with a dot between, one of ``>=``, ``<=``, ``>``, ``<``, and
        the limit.
    estimates, judges : collection of str
        Ids of the plan's estimates, and of its judges.
    where : str
        Where it stands; a message begins with it.
    why : str, optional
        For what reason the gate is set.

    Returns
    -------
    Gate
        The requirement.

    Raises
    ------
    ParameterError
        If it is not such a text, or the estimate, the number or the limit is invalid.

    Examples
    --------
    >>> str(parse_gate("kappa.low>=0.4", ["kappa"], where="--require"))
    'kappa.low >= 0.4'
    """
    numbers = dict.fromkeys(estimates, _NUMBERS) | dict.fromkeys(judges, _OF_JUDGES)
    return read_gate(text, numbers, where=where, why=why)


def _gate_of(text: str, protocol: Protocol, *, where: str, why: str = "") -> Gate:
    """Read a requirement on what the plan of a protocol has."""
    ids = [line.id for line in protocol.analysis.estimates]
    judges = [line.id for line in protocol.analysis.judges]
    return parse_gate(text, ids, judges=judges, where=where, why=why)


def gates_of(protocol: Protocol) -> tuple[Gate, ...]:
    """Return the gates of a protocol's report.

    Parameters
    ----------
    protocol : Protocol
        A protocol.

    Returns
    -------
    tuple of Gate
        In its order.
    """
    return tuple(
        _gate_of(gate.require, protocol, where=f"report.gates[{index}]", why=gate.why)
        for index, gate in enumerate(protocol.report.gates)
    )
