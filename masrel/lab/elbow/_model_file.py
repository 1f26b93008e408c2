"""What can be fitted, files of joints for a protocol to name, and joints in between."""

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from masrel._input import refuse
from masrel.errors import ParameterError
from masrel.lab._study_files import toml_lines
from masrel.lab.elbow.parameters import ElbowParameters

if TYPE_CHECKING:
    from masrel.lab.elbow.identification._clusters import FittedParameter
    from masrel.lab.elbow.identification._identify import ElbowFit


DEGREES = 180.0 / math.pi  # of a radian


class Quantity(NamedTuple):
    """A symbol, a key with the unit for files, that unit in words, and its size.

    A value in SI units times `factor` is in the unit.
    """

    symbol: str
    key: str
    unit: str
    factor: float = 1.0


# The law's parameters, by the names they have in `ElbowParameters`.
QUANTITIES: dict[str, Quantity] = {
    "damping": Quantity("b", "damping_nms_rad", "N·m·s/rad"),
    "stiffness": Quantity("k", "stiffness_nm_rad", "N·m/rad"),
    "inertia": Quantity("m", "inertia_kg_m2", "kg·m²"),
    "catch_angle_constant": Quantity("L", "catch_angle_constant_deg", "deg", DEGREES),
    "catch_slope": Quantity("α", "catch_slope_s", "s"),
    "catch_torque_constant": Quantity("H", "catch_torque_nms_rad", "N·m·s/rad"),
    "residual_ratio": Quantity("Q", "residual_ratio", "1"),
    "catch_travel": Quantity("D", "catch_travel_deg", "deg", DEGREES),
    "post_catch_stiffness": Quantity(
        "k_post", "post_catch_stiffness_nm_rad", "N·m/rad"
    ),
}

# What an arm and a sensor have beside the law.
ARM_QUANTITIES: dict[str, Quantity] = {
    "gravity": Quantity("G", "gravity_nm", "N·m"),
    "arm_inertia": Quantity("J", "arm_inertia_kg_m2", "kg·m²"),
    "lag": Quantity("T", "lag_s", "s"),
    "catch_rise": Quantity("rise", "catch_rise_s", "s"),
}

ALL_QUANTITIES = QUANTITIES | ARM_QUANTITIES

# What the key ``format`` of a model file says.
FORMAT = "masrel joint model 1"


def _keys(*names: str) -> dict[str, tuple[str, float]]:
    return {QUANTITIES[name].key: (name, QUANTITIES[name].factor) for name in names}


# Key of a protocol's model to the parameter and its unit in SI units.
MODEL_KEYS = _keys(
    "catch_angle_constant",  # L
    "catch_torque_constant",  # H
    "residual_ratio",  # Q
    "catch_travel",  # D
)

# Likewise the constants that a model may have of its own.
CONSTANT_KEYS = _keys(
    "inertia", "damping", "stiffness", "catch_slope", "post_catch_stiffness"
)

# How H, Q and k_post are to be read: without it the numbers are another joint.
READING_KEYS = ("post_catch", "residual_reading")

# Constants that are written where they are not the default.
VARIANT_KEYS = {
    "rest_angle_deg": ("rest_angle", DEGREES),
    "catch_rise_s": ("catch_rise", 1.0),
}

Document = dict[str, object]


def model_document(
    joint: ElbowParameters,
    *,
    simulated: bool,
    made_from: str,
    fit: "ElbowFit | None" = None,
) -> Document:
    """Make the content of a model file.

    Parameters
    ----------
    joint : ElbowParameters
        The joint.
    simulated : bool
        Whether it comes from simulated recordings.
    made_from : str
        Where it comes from, for people.
    fit : ElbowFit, optional
        The fit it comes from: its intervals, remarks and recordings are written
        beside the numbers.

    Returns
    -------
    dict
        Tables ``model``, ``constants`` and, of a fit, ``estimates`` and
        ``recordings``; degrees where the key says so.

    Examples
    --------
    >>> from masrel.lab.elbow import STANDARD_MODELS
    >>> hm1 = STANDARD_MODELS["HM1"]
    >>> made = model_document(hm1, simulated=False, made_from="Table III")
    >>> made["model"]["catch_torque_nms_rad"]
    1.4
    """
    constants: Document = {
        key: getattr(joint, name) * factor
        for key, (name, factor) in CONSTANT_KEYS.items()
    }
    constants |= {key: getattr(joint, key) for key in READING_KEYS}
    defaults = {field.name: field.default for field in fields(joint)}
    constants |= {
        key: value * factor
        for key, (name, factor) in VARIANT_KEYS.items()
        if (value := getattr(joint, name)) != defaults[name]
    }
    document: Document = {
        "format": FORMAT,
        "made_from": made_from,
        "simulated": simulated,
        "model": {
            key: getattr(joint, name) * factor
            for key, (name, factor) in MODEL_KEYS.items()
        },
        "constants": constants,
    }
    if fit is not None:
        lack = fit.lack_of_fit
        first = lack.tests[0] if lack.tests else None
        document["remarks"] = [lack.sentence, *fit.remarks]
        document["lack_of_fit"] = {
            "verdict": lack.verdict,
            "level": lack.level,
            **_finite(
                explained=lack.explained,
                after_to_before=lack.after_to_before,
                rest_sd_nm=lack.rest_sd,
            ),
            **({"structure": first.name, "p_value": first.adjusted} if first else {}),
        }
        document["estimates"] = [_estimate(estimate) for estimate in fit.estimates]
        document["recordings"] = [
            {"name": name, **({} if sha256 is None else {"sha256": sha256})}
            for name, sha256 in fit.sources.items()
        ]
    return document


def _finite(**numbers: float) -> Document:
    return {key: value for key, value in numbers.items() if math.isfinite(value)}


def _estimate(estimate: "FittedParameter") -> Document:
    quantity = ALL_QUANTITIES[estimate.name]
    return {
        "key": quantity.key,
        "level": estimate.level,
        **_finite(
            value=estimate.value * quantity.factor,
            standard_error=estimate.standard_error * quantity.factor,
            low=estimate.low * quantity.factor,
            high=estimate.high * quantity.factor,
            degrees_of_freedom=estimate.df,
        ),
        "n_trials": estimate.n_trials,
        **({} if estimate.reason is None else {"reason": estimate.reason}),
    }


def as_toml(document: Mapping[str, object]) -> str:
    """Write a document of plain values, tables and arrays of tables as TOML.

    Parameters
    ----------
    document : mapping
        What `model_document` makes.

    Returns
    -------
    str
        TOML; numbers in full precision.

    Raises
    ------
    ParameterError
        If a value has a type that is not used in these TOML files.

    Examples
    --------
    >>> print(as_toml({"format": "x", "model": {"residual_ratio": 0.3}}), end="")
    format = "x"
    <BLANKLINE>
    [model]
    residual_ratio = 0.3
    """
    try:
        return "\n".join([*toml_lines(document), ""])
    except ValueError as error:
        raise ParameterError(f"value: {error}") from error


def intermediate_models(
    models: Mapping[str, ElbowParameters], n_models: int
) -> dict[str, ElbowParameters]:
    """Put models at even steps between neighbours.

    Parameters
    ----------
    models : mapping of str to ElbowParameters
        Two or more, mildest first: their order says who is whose neighbour.
    n_models : int
        How many to make; the same number in every gap.

    Returns
    -------
    dict of str to ElbowParameters
        ``D01``, ``D02`` and so on. With n in a gap, the i-th is i/(n + 1) of the way;
        L, H, Q, D and all other numbers that differ are interpolated linearly.

    Raises
    ------
    ParameterError
        If there are less than two models, `n_models` does not divide evenly among
        the gaps, or neighbours read (5) differently.

    Examples
    --------
    The paper's design, four standards and twelve dummies, 4 in each of 3 gaps:

    >>> from masrel.lab.elbow import STANDARD_MODELS
    >>> made = intermediate_models(STANDARD_MODELS, 12)
    >>> len(made), round(made["D01"].catch_torque_constant, 6)  # 1.4 + 0.6/5
    (12, 1.52)
    """
    gaps = len(models) - 1
    refuse(
        (gaps < 1, f"models: need two or more, got {len(models)}"),
        (
            n_models < gaps or n_models % max(gaps, 1),
            f"number of models: needs a multiple of {gaps}, one or more in each gap, "
            f"got {n_models}",
        ),
    )
    each = n_models // gaps
    made = [
        _between(pair, models[pair[0]], models[pair[1]], i, each + 1)
        for pair in pairwise(models)
        for i in range(1, each + 1)
    ]
    digits = max(2, int(math.log10(n_models)) + 1)
    return {f"D{i:0{digits}}": model for i, model in enumerate(made, start=1)}


def _between(
    names: tuple[str, str],
    one: ElbowParameters,
    two: ElbowParameters,
    part: int,
    whole: int,
) -> ElbowParameters:
    values: dict[str, Any] = {}
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(two, field.name)
        if isinstance(a, float) and isinstance(b, float) and a != b:
            values[field.name] = ((whole - part) * a + part * b) / whole
        elif a != b:
            raise ParameterError(
                f"models: {names[0]} and {names[1]} need one {field.name}, got {a!r} "
                f"and {b!r}"
            )
    return replace(one, **values)
