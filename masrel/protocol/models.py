"""From the protocol's tables to what the libraries take: scale and SI parameters."""

import math

from masrel.elbow.parameters import ElbowParameters
from masrel.errors import ParameterError
from masrel.protocol.definition import Protocol
from masrel.scales import Scale

__all__ = ["elbow_parameters", "scale_of"]


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
    (model,), shared, own = found, protocol.elbow, found[0].constants
    return ElbowParameters(
        catch_angle_constant=math.radians(model.catch_angle_constant_deg),
        catch_torque_constant=model.catch_torque_nms_rad,
        residual_ratio=model.residual_ratio,
        catch_travel=math.radians(model.catch_travel_deg),
        inertia=_either(own.inertia_kg_m2, shared.inertia_kg_m2),
        damping=_either(own.damping_nms_rad, shared.damping_nms_rad),
        stiffness=_either(own.stiffness_nm_rad, shared.stiffness_nm_rad),
        catch_slope=_either(own.catch_slope_s, shared.catch_slope_s),
        peak_duration=shared.peak_duration_s,
        post_catch_stiffness=_either(
            own.post_catch_stiffness_nm_rad, shared.post_catch_stiffness_nm_rad
        ),
        speed_threshold=math.radians(shared.speed_threshold_deg_s),
        slowest_mean_speed=math.radians(shared.slowest_mean_speed_deg_s),
        smallest_catch_angle=math.radians(shared.smallest_catch_angle_deg),
        range_end=math.radians(shared.range_end_deg),
        post_catch=shared.post_catch,
    )


def _either(own: float | None, shared: float) -> float:
    return shared if own is None else own
