"""One presentation of one model on the device of its study."""

import contextlib
import math
import sys
from pathlib import Path

from masrel.hess import (
    Clock,
    DeviceLimits,
    EmergencyStop,
    Presented,
    RealClock,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.hess._stop import stop_on_key, stop_on_signals
from masrel.hess._watchdog import watched
from masrel.protocol import Protocol, elbow_parameters
from masrel.run.grades import Asked
from masrel.run.kept import Shown, keep, spool_of
from masrel.run.settings import (
    backend_options,
    device_limits,
    has_simulated_hand,
    model_controller,
)
from masrel.run.simulated import intended_speed

__all__ = ["present"]

LONGEST_STRETCH_S = 10.0
"""After this a presentation ends, wherever the arm is."""


def present(
    protocol: Protocol, asked: Asked, *, clock: Clock, file: Path, stop: EmergencyStop
) -> Shown:
    """Present a model once on the protocol's device and write the recording."""
    # Signals that would end the process, and with a real clock any key of the terminal,
    # press the emergency stop while the device is open.
    limits = device_limits(protocol.device)
    with contextlib.ExitStack() as held:
        held.enter_context(stop_on_signals(stop))
        if isinstance(clock, RealClock):
            held.enter_context(stop_on_key(stop, sys.stdin))
        spool = spool_of(file)
        presented = _on_device(protocol, asked, clock, limits, stop, spool)
    return keep(presented, protocol, asked, file)


def _on_device(
    protocol: Protocol,
    asked: Asked,
    clock: Clock,
    limits: DeviceLimits,
    stop: EmergencyStop,
    spool: Path,
) -> Presented:
    settings, stretch = protocol.device, protocol.stretch
    start, end = math.radians(stretch.start_deg), math.radians(stretch.end_deg)
    speed = _speed(protocol, asked)
    hand = _hand(start, end, speed)
    model = asked.presentation.model
    with contextlib.ExitStack() as held:
        device = held.enter_context(
            open_device(
                settings.backend,
                clock=clock,
                hand=hand,
                range_end=elbow_parameters(protocol, model).range_end,
                options=backend_options(settings, hand),
            )
        )
        watchdog = watched(device, limits.watchdog_time)
        if watchdog is not None:
            held.enter_context(watchdog)
        return run_presentation(
            device,
            model_controller(protocol, model),
            clock=clock,
            limits=limits,
            rate_hz=settings.rate_hz,
            max_duration_s=_longest(end - start, speed),
            end_angle=end,
            stop=stop,
            watchdog=watchdog,
            spool=spool,
        )


def _hand(start: float, end: float, speed: float | None) -> SimulatedHand | None:
    if speed is None:
        return None
    return SimulatedHand(start=start, end=end, mean_speed=speed)


def _speed(protocol: Protocol, asked: Asked) -> float | None:
    # rad/s of the simulated hand; None when a person moves the arm
    if not has_simulated_hand(protocol.device):
        return None
    shown = asked.presentation
    return math.radians(
        intended_speed(protocol, asked.rater, asked.session, shown.model, shown.repeat)
    )


def _longest(travel: float, speed: float | None) -> float:
    # A simulated hand told to be slow is given the time it needs.
    return (
        LONGEST_STRETCH_S
        if speed is None
        else max(LONGEST_STRETCH_S, 2.0 * travel / speed)
    )
