"""Torque of a stretch at any time, and its peak, from the exact events.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1), (3) and (5).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.elbow.events import Events, events
from masrel.elbow.motion import Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.errors import ParameterError

__all__ = ["peak_torque", "torque"]

Floats = NDArray[np.float64]


def torque(
    parameters: ElbowParameters,
    motion: Motion,
    times: ArrayLike,
    *,
    found: Events | None = None,
) -> Floats:
    """Return the torque of a stretch at given times.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The stretch, SI units.
    times : array_like, shape (n_times,)
        Times within the stretch, s.
    found : Events, optional
        Its events, when they are known already.

    Returns
    -------
    ndarray, shape (n_times,)
        Torque that resists extension, N·m. At the instant of an event the later
        phase holds.

    Raises
    ------
    ParameterError
        If a time is outside the stretch, or the stretch starts at or beyond the end
        of range.

    Examples
    --------
    HM3 at 92 deg/s before the catch, by (1): 1.26 ω + 3.15 (θ - 30 deg):

    >>> from math import radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> round(float(torque(STANDARD_MODELS["HM3"], stretch, [0.5])[0]), 4)
    4.5522
    """
    at = np.atleast_1d(np.asarray(times, dtype=np.float64))
    found = events(parameters, motion) if found is None else found
    if at.size and not (at.min() >= 0.0 and at.max() <= found.end):
        raise ParameterError(
            f"times: need 0 to {found.end:g} s, the end of the stretch, "
            f"got {at.min():g} to {at.max():g} s"
        )
    values = _pre_catch(parameters, motion, at)
    if found.catch is None:
        return values
    pre_end, rise = _catch_levels(parameters, motion, found)
    caught = at >= found.catch
    values[caught] = np.where(
        at[caught] < found.catch + parameters.peak_duration,
        pre_end + rise,  # (3), first line
        pre_end + parameters.residual_ratio * rise,  # (3), second line
    )
    if found.catch_end is not None:
        after = at >= found.catch_end
        values[after] = _post_catch(parameters, motion, found, at[after])
        if found.post_catch_end is not None:
            slow = at >= found.post_catch_end
            values[slow] = _pre_catch(parameters, motion, at[slow])
    return values


def peak_torque(parameters: ElbowParameters, motion: Motion) -> float:
    """Return the largest torque of a stretch, without a trace.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The stretch, SI units.

    Returns
    -------
    float
        The largest torque of the whole stretch, N·m: at an event, at an end, or
        where a phase's torque turns.

    Raises
    ------
    ParameterError
        If the stretch starts at or beyond the end of range.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> round(peak_torque(STANDARD_MODELS["HM3"], stretch), 3)
    10.984
    """
    found = events(parameters, motion)
    marks = (found.catch, found.peak_end, found.catch_end, found.post_catch_end)
    times = {0.0, found.end, *(time for time in marks if time is not None)}
    k, b, m = parameters.stiffness, parameters.damping, parameters.inertia
    times.update(motion.turning_times(k, b, m))
    if found.catch_end is not None:
        climb = parameters.post_catch_stiffness
        additive = parameters.post_catch == "additive"
        times.update(
            motion.turning_times(
                climb + (k if additive else 0), b if additive else 0, m
            )
        )
    inside = np.array(sorted(time for time in times if 0.0 <= time <= found.end))
    # The largest torque of a phase may lie at its end, which belongs to the next.
    before = np.nextafter(inside[1:], 0.0)
    every = np.concatenate([inside, before])
    return float(torque(parameters, motion, every, found=found).max())


def _pre_catch(parameters: ElbowParameters, motion: Motion, at: Floats) -> Floats:
    rest = motion.start if parameters.rest_angle is None else parameters.rest_angle
    values = parameters.damping * motion.velocity(at)  # (1)
    values = values + parameters.stiffness * (motion.angle(at) - rest)
    if parameters.inertia:
        values = values + parameters.inertia * motion.acceleration(at)
    return np.asarray(values)


def _catch_levels(
    parameters: ElbowParameters, motion: Motion, found: Events
) -> tuple[float, float]:
    # τ_pre_end and H·v_c of (3)
    at = np.array([found.catch])
    rise = parameters.catch_torque_constant * float(motion.velocity(at)[0])
    return float(_pre_catch(parameters, motion, at)[0]), rise


def _post_catch(
    parameters: ElbowParameters, motion: Motion, found: Events, at: Floats
) -> Floats:
    # (5); found.catch_end is a time
    pre_end, rise = _catch_levels(parameters, motion, found)
    begin = motion.angle(np.array([found.catch_end]))[0]
    climb = np.asarray(parameters.post_catch_stiffness * (motion.angle(at) - begin))
    residual = parameters.residual_ratio * rise
    if parameters.post_catch == "additive":
        return np.asarray(_pre_catch(parameters, motion, at) + residual + climb)
    values = pre_end + residual + climb
    if parameters.inertia:
        values = values + parameters.inertia * motion.acceleration(at)
    return np.asarray(values)
