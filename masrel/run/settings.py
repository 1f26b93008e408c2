"""What the protocol's ``[device]`` means to the driver."""

import math

from masrel.hess import BackendOptions, Controller, DeviceLimits, Friction
from masrel.protocol import DeviceSettings, Protocol, elbow_parameters

__all__ = ["backend_options", "device_limits", "model_controller"]


def device_limits(settings: DeviceSettings) -> DeviceLimits:
    """Return the limits that a protocol sets.

    Parameters
    ----------
    settings : DeviceSettings
        The table ``[device]``.

    Returns
    -------
    DeviceLimits
        The same in SI units.
    """
    return DeviceLimits(
        torque=settings.torque_limit_nm,
        torque_rate=settings.torque_rate_limit_nm_s,
        speed=math.radians(settings.speed_limit_deg_s),
        lowest_angle=math.radians(settings.lowest_angle_deg),
        highest_angle=math.radians(settings.highest_angle_deg),
        soft_stop_width=math.radians(settings.soft_stop_deg),
        soft_stop_torque=settings.soft_stop_torque_nm,
        missed_ticks=settings.missed_ticks_limit,
        missed_replies=settings.missed_replies_limit,
        missed_replies_per_100=settings.missed_replies_per_100_limit,
        stale_time=settings.stale_limit_ms * 1e-3,
        frozen_time=settings.frozen_limit_ms * 1e-3,
        standing_time=settings.standing_limit_ms * 1e-3,
        standing_torque=settings.standing_torque_nm,
        jump_angle=math.radians(settings.jump_limit_deg),
        watchdog_time=settings.watchdog_ms * 1e-3,
        ramp_time=settings.ramp_ms * 1e-3,
    )


def model_controller(protocol: Protocol, model: str) -> Controller:
    """Return a new controller of one model.

    Parameters
    ----------
    protocol : Protocol
        The models, the stretch and the device.
    model : str
        Id of the model.

    Returns
    -------
    Controller
        For one presentation.
    """
    settings = protocol.device
    return Controller(
        elbow_parameters(protocol, model),
        start_angle=math.radians(protocol.stretch.start_deg),
        friction=Friction(
            viscous=settings.friction_viscous_nms_rad,
            coulomb=settings.friction_coulomb_nm,
        ),
        compensation=settings.friction_compensation,
        dead_zone=math.radians(settings.dead_zone_deg_s),
        full_speed=math.radians(settings.full_speed_deg_s),
        slip_speed_drop=math.radians(settings.slip_speed_drop_deg_s),
        rate_hz=settings.rate_hz,
    )


def backend_options(settings: DeviceSettings) -> BackendOptions | None:
    """Return what a protocol tells the backend alone.

    Parameters
    ----------
    settings : DeviceSettings
        The table ``[device]``.

    Returns
    -------
    BackendOptions or None
        None for a backend that needs to be told nothing.
    """
    if settings.backend != "puck":
        return None
    from masrel.hess.puck.options import PuckOptions  # only when chosen

    return PuckOptions(
        interface=settings.puck_interface,
        channel=settings.puck_channel,
        puck=settings.puck_node,
        direction=settings.puck_direction,
    )
