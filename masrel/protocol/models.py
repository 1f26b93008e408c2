"""From the protocol's tables to what the libraries take: scale and SI parameters."""

import math

import msgspec

from masrel.elbow.parameters import ElbowParameters
from masrel.errors import ParameterError
from masrel.protocol.definition import ElbowConstants, Model, Protocol
from masrel.scales import Scale

__all__ = ["elbow_parameters", "joint_of", "scale_of"]


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


def elbow_parameters(protocol: Protocol, model_id: str) -> ElbowParameters:
    """Return the joint parameters of one haptic model, in SI units.

    Parameters
    ----------
    protocol : Protocol
        A protocol; its angles are degrees.
    model_id : str
        Id of one of its models.

    Returns
    -------
    ElbowParameters
        The model's L, H, Q and D and its own constants, with those of ``[elbow]``
        for the rest; rad, rad/s, s.

    Raises
    ------
    ParameterError
        If the protocol has no such model; the message names those there are.
    """
    found = [model for model in protocol.models if model.id == model_id]
    if not found:
        known = ", ".join(model.id for model in protocol.models)
        raise ParameterError(f"model: needed one of {known}, got {model_id!r}")
    return joint_of(found[0], protocol.elbow)


def joint_of(model: Model, shared: ElbowConstants) -> ElbowParameters:
    """Return the joint of one model, in SI units."""
    own = {
        key: value
        for key in model.constants.__struct_fields__
        if (value := getattr(model.constants, key)) is not None
    }
    elbow = msgspec.structs.replace(shared, **own)
    rest = elbow.rest_angle_deg
    return ElbowParameters(
        catch_angle_constant=math.radians(model.catch_angle_constant_deg),
        catch_torque_constant=model.catch_torque_nms_rad,
        residual_ratio=model.residual_ratio,
        catch_travel=math.radians(model.catch_travel_deg),
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
