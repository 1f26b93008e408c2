"""What the protocol's ``[device]`` means to the driver."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from masrel.errors import ParameterError
from masrel.hess import (
    BackendOptions,
    Controller,
    DeviceLimits,
    Friction,
    Hand,
    device_names,
)
from masrel.protocol import DeviceSettings, Protocol, joint_model

if TYPE_CHECKING:
    from masrel.hess.puck import PuckOptions


def check_backend(settings: DeviceSettings) -> None:
    """Do nothing if a session can be run on the device of a protocol."""
    names = [name for name in device_names() if name != "replay"]  # that has no hand
    if settings.backend not in names:
        raise ParameterError(
            f"device.backend: needed one of {', '.join(names)}, "
            f"got {settings.backend!r}"
        )
    device_limits(settings)
    backend_options(settings)


def torque_problems(protocol: Protocol) -> Iterator[str]:
    """Yield what is wrong with models that ask for more than the device may send."""
    settings, stretch = protocol.device, protocol.stretch
    start = math.radians(stretch.start_deg)
    speed = math.radians(stretch.largest_speed_deg_s)
    for index, model in enumerate(protocol.models):
        where, name = f"models[{index}]", f'(id "{model.id}")'
        key, limit = "torque_limit_nm", settings.torque_limit_nm
        if model_controller(protocol, model.id).is_guarded:
            active = settings.active_torque_limit_nm
            if active < limit:
                key, limit = "active_torque_limit_nm", active
        joint = joint_model(protocol, model.id)
        if joint.range_end <= start:
            yield (
                f"{where}: needed an end of range beyond stretch.start_deg "
                f"({stretch.start_deg:g}), got {math.degrees(joint.range_end):g} deg "
                f"{name}"
            )
            continue
        largest = joint.largest_torque(start_angle=start, speed=speed)
        if not largest <= limit:
            yield (
                f"{where}: needed at most device.{key} ({limit:g} N·m) at "
                f"stretch.largest_speed_deg_s ({stretch.largest_speed_deg_s:g} deg/s), "
                f"got {largest:.3f} N·m {name}"
            )
        first = abs(joint.stepper(start).step(0.0, start, 0.0))
        if not first <= settings.standing_torque_nm:
            yield (
                f"{where}: needed at most device.standing_torque_nm "
                f"({settings.standing_torque_nm:g} N·m) where the stretch starts, got "
                f"{first:.3f} N·m {name}"
            )


def device_limits(settings: DeviceSettings) -> DeviceLimits:
    """Return the limits that a protocol sets."""
    return DeviceLimits(
        torque=settings.torque_limit_nm,
        torque_rate=settings.torque_rate_limit_nm_s,
        active_torque=settings.active_torque_limit_nm,
        active_energy=settings.active_energy_limit_j,
        active_speed=math.radians(settings.active_speed_limit_deg_s),
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

    Raises
    ------
    ProtocolError
        If the protocol has no such model.
    """
    settings = protocol.device
    return Controller(
        joint_model(protocol, model),
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


def has_simulated_hand(settings: DeviceSettings) -> bool:
    """Return whether a simulated hand moves the arm."""
    return settings.backend == "simulated" or (
        settings.backend == "puck" and settings.puck_interface == "virtual"
    )


def moves_hardware(settings: DeviceSettings) -> bool:
    """Return whether a motor may move."""
    if settings.backend != "puck":
        return settings.backend != "simulated"
    return _puck_options(settings).moves_hardware


def backend_options(
    settings: DeviceSettings, hand: Hand | None = None
) -> BackendOptions | None:
    """Return the options of the backend that a protocol sets."""
    if settings.backend != "puck":
        return None
    options = _puck_options(settings)
    return options if hand is None else options.emulated(hand.start)


def _puck_options(settings: DeviceSettings) -> "PuckOptions":
    from masrel.hess.puck import PropertyTable, PuckOptions  # only when chosen

    numbers = settings.puck_properties
    try:
        properties = PropertyTable(numbers=numbers) if numbers is not None else None
    except ParameterError as error:
        raise ParameterError(f"[device] puck_{error}") from error
    return PuckOptions(
        interface=settings.puck_interface,
        channel=settings.puck_channel,
        puck=settings.puck_node,
        direction=settings.puck_direction,
        gear_ratio=settings.puck_gear_ratio,
        patience_s=min(0.001, 1.0 / settings.rate_hz),  # no longer than a tick
        checks_torque=settings.puck_checks_torque,
        properties=properties,
    )
