"""What the protocol's ``[device]`` means to the driver."""

import bisect
import math
from collections.abc import Iterator
from dataclasses import replace

import msgspec

from masrel._input import listed, refuse
from masrel.errors import ParameterError
from masrel.lab.conduct._calibrations import Calibration, calibration_notes
from masrel.lab.hess import (
    BackendOptions,
    Controller,
    Device,
    DeviceLimits,
    DeviceSetup,
    Friction,
    Hand,
    RealClock,
    SimulatedOptions,
    build_device,
    device_names,
)
from masrel.lab.hess._guard import HELD_TIMES
from masrel.lab.hess._signals import passive_damping
from masrel.lab.hess.device import _options_type
from masrel.lab.protocol import (
    DeviceSettings,
    Model,
    Protocol,
    StudyPaths,
    joint_model,
)
from masrel.lab.protocol._decode import type_problems
from masrel.lab.protocol._kinds import DEFAULT_KIND

_SPEED_DEG_S = 0.01  # to which speeds are determined that are shown whole
_PEAK_TO_MEAN = 1.875  # of a stretch with minimum jerk
_WATCHED_S = 10.0  # for how long Tardieu's scale watches clonus
_WITH_BUTTON = ("simulated",)  # which the simulated hand presses


def check_backend(protocol: Protocol) -> None:
    """Do nothing if a session can be run on the device of a protocol."""
    settings = protocol.device
    names = [name for name in device_names() if name != "replay"]  # that has no hand
    refuse(
        (
            settings.backend not in names,
            f"device.backend: needed one of {', '.join(names)}, "
            f"got {settings.backend!r}",
        ),
        *(
            (
                name not in names,
                f"device.{name}: needed the table of a device, one of "
                f"{', '.join(names)}, got [device.{name}]",
            )
            for name in settings.backends
        ),
        (
            settings.torque_sensor and settings.backend != "simulated",
            "device.torque_sensor: needed false, a device of the backend "
            f"{settings.backend!r} has no torque sensor; got true",
        ),
    )
    device_limits(settings)
    backend_options(settings)
    is_asked_for = protocol.presentation.done_with == "button"
    if is_asked_for and settings.backend not in _WITH_BUTTON:
        raise ParameterError(
            f"device.backend: needed one with a button ({', '.join(_WITH_BUTTON)}), "
            f"as presentation.done_with asks for, got {settings.backend!r}"
        )


def torque_problems(protocol: Protocol) -> Iterator[str]:
    """Yield what is wrong with models that ask for more than the device may send."""
    for index, model in enumerate(protocol.models):
        for problem in _torque_problems(protocol, model):
            yield f'models[{index}]: needed {problem} (id "{model.id}")'


def _torque_problems(protocol: Protocol, model: Model) -> Iterator[str]:
    settings, stretch = protocol.device, protocol.stretch
    start = math.radians(stretch.start_deg)
    joint = joint_model(protocol, model.id)
    if joint.range_end <= start:
        yield (
            f"an end of range beyond stretch.start_deg ({stretch.start_deg:g}), got "
            f"{math.degrees(joint.range_end):g} deg"
        )
        return
    key, limit = _torque_limit(protocol, model)
    largest = _largest_torque(protocol, model, stretch.largest_speed_deg_s)
    if not largest <= limit:
        yield (
            f"at most device.{key} ({limit:g} N·m) at stretch.largest_speed_deg_s "
            f"({stretch.largest_speed_deg_s:g} deg/s), got {largest:.3f} N·m"
        )
    first = abs(joint.stepper(start).step(0.0, start, 0.0))
    if not first <= settings.standing_torque_nm:
        yield (
            f"at most device.standing_torque_nm ({settings.standing_torque_nm:g} N·m) "
            f"where the stretch starts, got {first:.3f} N·m"
        )
    if model.kind != DEFAULT_KIND:
        speed = math.radians(stretch.largest_speed_deg_s)
        yield from _stiffness_problems(settings, *joint.largest_slope(speed=speed))


def device_notes(protocol: Protocol, study: StudyPaths) -> Iterator[str]:
    """Yield what a device does in silence, what of its calibration, and its limits."""
    settings = protocol.device
    if is_hardware := moves_hardware(settings):
        setup = DeviceSetup(clock=RealClock(), options=backend_options(settings))
        if build_device(settings.backend, setup).holds_torque_when_silent:
            yield (
                f'device.backend: "{settings.backend}" keeps its last torque when '
                "nothing more is sent, as after a cable comes off: have an "
                "emergency switch in the supply of its motor within reach"
            )
    yield from calibration_notes(study, protocol, moves_hardware=is_hardware)
    yield from _torque_notes(protocol)


def _torque_notes(protocol: Protocol) -> Iterator[str]:
    # A sentence for each limit that some motion passes in what raters may well do
    settings = protocol.device
    peak = _PEAK_TO_MEAN * protocol.stretch.largest_speed_deg_s
    fastest: dict[str, list[tuple[float, str]]] = {}
    held = []
    for model in protocol.models:
        key, limit = _torque_limit(protocol, model)
        speed = _speed_of_torque(protocol, model, limit)
        if speed < min(settings.speed_limit_deg_s, peak):
            fastest.setdefault(key, []).append((speed, model.id))
        if _largest_torque(protocol, model, 0.0) > settings.standing_torque_nm:
            held.append(model.id)
    for key, models in fastest.items():
        (speed, name), *others = sorted(models)
        more = f", and {len(others)} more at higher speeds" if others else ""
        yield (
            f"device.{key} ({getattr(settings, key):g} N·m) stops a stretch that is "
            f"for a moment faster than {math.floor(speed)} deg/s with {name}{more}: "
            "raise it, or have raters practise slower ones"
        )
    longest = settings.standing_limit_ms * 1e-3 * HELD_TIMES
    if held and longest < _WATCHED_S:
        yield (
            f"device.standing_limit_ms ({settings.standing_limit_ms:g} ms) stops an "
            f"arm that is held still for {longest:g} s with "
            f"{'any model' if len(held) == len(protocol.models) else listed(held)}: "
            f"{_WATCHED_S / HELD_TIMES * 1e3:g} ms let raters watch for clonus"
        )


def _speed_of_torque(protocol: Protocol, model: Model, torque: float) -> float:
    # the speed up to which a model never asks for more, deg/s
    n_steps = math.ceil(protocol.device.speed_limit_deg_s / _SPEED_DEG_S)
    n_within = bisect.bisect_right(
        range(1, n_steps + 1),
        torque,
        key=lambda step: _largest_torque(protocol, model, step * _SPEED_DEG_S),
    )
    return n_within * _SPEED_DEG_S


def _largest_torque(protocol: Protocol, model: Model, speed_deg_s: float) -> float:
    # of which a limit is held, in every phase of every motion up to a speed, N·m
    settings, joint = protocol.device, joint_model(protocol, model.id)
    start, speed = math.radians(protocol.stretch.start_deg), math.radians(speed_deg_s)
    largest = joint.largest_torque(start_angle=start, speed=speed)
    if speed == 0.0 or _torque_limit(protocol, model)[0] != "torque_limit_nm":
        return largest
    # On the way back the device's friction is compensated the way the spring pushes.
    friction = settings.friction_viscous_nms_rad * speed + settings.friction_coulomb_nm
    held = joint.largest_torque(start_angle=start, speed=0.0)
    return max(largest, held + settings.friction_compensation * friction)


def _torque_limit(protocol: Protocol, model: Model) -> tuple[str, float]:
    # the key of the limit that is for this model, and the limit, N·m
    settings = protocol.device
    limits = {"torque_limit_nm": settings.torque_limit_nm}
    if model_controller(protocol, model.id).is_guarded:
        limits["active_torque_limit_nm"] = settings.active_torque_limit_nm
    return min(limits.items(), key=lambda entry: entry[1])


def _stiffness_problems(
    settings: DeviceSettings, stiffness: float, damping: float
) -> Iterator[str]:
    # slopes that the device cannot render without feeding energy into a hand
    most = settings.friction_viscous_nms_rad
    needs = passive_damping(stiffness, damping, settings.rate_hz)
    if not needs <= most:
        yield (
            f"slopes that device.friction_viscous_nms_rad ({most:g} N·m·s/rad) makes "
            f"passive at {settings.rate_hz} Hz, got {stiffness:g} N·m/rad and "
            f"{damping:g} N·m·s/rad, which need {needs:.3g}"
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
        actuator_torque=settings.actuator_limit_nm,
        jump_angle=math.radians(settings.jump_limit_deg),
        drift_angle=math.radians(settings.drift_limit_deg),
        drift_speed=math.radians(settings.drift_speed_deg_s),
        encoder_noise=math.radians(settings.encoder_noise_deg),
        arrival_angle=math.radians(settings.arrival_deg),
        arrival_speed=math.radians(settings.arrival_speed_deg_s),
        arrival_time=settings.arrival_ms * 1e-3,
        watchdog_time=settings.watchdog_ms * 1e-3,
        ramp_time=settings.ramp_ms * 1e-3,
        end_ramp_time=settings.end_ramp_ms * 1e-3,
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
        post_catch_ramp=settings.post_catch_ramp_ms * 1e-3,
        loose_inertia=settings.loose_inertia_kg_m2,
        rate_hz=settings.rate_hz,
    )


def calibrated(protocol: Protocol, calibration: Calibration | None) -> Protocol:
    """Return a protocol whose device is as it was measured, not as it was assumed."""
    if calibration is None:
        return protocol
    of = calibration.values
    measured = {
        "encoder_noise_deg": of["encoder_noise_deg"][0],
        "loose_inertia_kg_m2": of["inertia_kg_m2"][0],
        # a share of more friction than there is would make the arm creep
        "friction_viscous_nms_rad": max(0.0, of["viscous_nms_rad"][1]),
        "friction_coulomb_nm": max(0.0, of["coulomb_nm"][1]),
    }
    device = msgspec.structs.replace(protocol.device, **measured)
    return msgspec.structs.replace(protocol, device=device)


def use_calibration(device: Device, calibration: Calibration) -> None:
    """Give a device the gain and the delay that were measured on it."""
    of = calibration.values
    device.torque_delay = 1e-3 * max(0.0, of["delay_ms"][0])
    device.torque_gain = of.get("torque_gain", (1.0,))[0]


def has_simulated_hand(settings: DeviceSettings) -> bool:
    """Return whether a simulated hand moves the arm."""
    return backend_options(settings).has_simulated_hand


def moves_hardware(settings: DeviceSettings) -> bool:
    """Return whether a motor may move."""
    return backend_options(settings).moves_hardware


def backend_options(
    settings: DeviceSettings, hand: Hand | None = None, seed: int = 0
) -> BackendOptions:
    """Return the options of the backend that a protocol sets; the seed is of noise."""
    kind, table = _options_type(settings.backend), _backend_table(settings)
    where = f"device.{settings.backend}"
    if problems := list(type_problems(table, kind, where)):
        raise ParameterError("; ".join(problems))
    options = msgspec.convert(table, kind)
    if isinstance(options, SimulatedOptions) and options.torque_sensor is not None:
        options = replace(
            options, torque_sensor=replace(options.torque_sensor, seed=seed)
        )
    return options if hand is None else options.emulated(hand.start)


def _backend_table(settings: DeviceSettings) -> dict[str, object]:
    # the table [device.NAME]; once a puck had keys of [device]
    former: dict[str, object] = {}
    if settings.backend == "simulated" and settings.torque_sensor:
        former = {"torque_sensor": {}}
    if settings.backend == "puck":
        former = {
            "interface": settings.puck_interface,
            "channel": settings.puck_channel,
            "puck": settings.puck_node,
            "direction": settings.puck_direction,
            "gear_ratio": settings.puck_gear_ratio,
            "patience_s": min(0.001, 1.0 / settings.rate_hz),  # no longer than a tick
            "checks_torque": settings.puck_checks_torque,
        }
        if settings.puck_properties is not None:
            former["properties"] = {"numbers": settings.puck_properties}
    return {**former, **settings.backends.get(settings.backend, {})}
