"""One presentation of one model: the device, the loop, and the recording on disk."""

import dataclasses
import math
import os
from dataclasses import dataclass
from pathlib import Path

from masrel.hess import (
    Clock,
    Controller,
    DeviceLimits,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.protocol import Protocol, elbow_parameters
from masrel.recording import Recording, write_recording
from masrel.run.chain import Fact
from masrel.run.grades import Asked
from masrel.run.simulated import intended_speed

__all__ = ["SIMULATED_BACKEND", "Shown", "present"]

SIMULATED_BACKEND = "simulated"
"""The device that needs a simulated hand."""

LONGEST_STRETCH_S = 10.0
"""After this a presentation ends, wherever the arm is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """What a presentation left.

    Attributes
    ----------
    sha256 : str
        Checksum of the recording.
    mean_speed_deg_s : float or None
        Mean speed before the catch, deg/s; None when the arm never moved.
    n_missed_ticks : int
        Ticks the loop skipped.
    fault : str or None
        What stopped it, or None.
    simulated : bool
        Whether no hardware moved.
    """

    sha256: str
    mean_speed_deg_s: float | None
    n_missed_ticks: int
    fault: str | None
    simulated: bool


def present(protocol: Protocol, asked: Asked, *, clock: Clock, file: Path) -> Shown:
    """Present a model once on the protocol's device and write the recording.

    Parameters
    ----------
    protocol : Protocol
        Device, limits, stretch and models.
    asked : Asked
        What is presented to whom.
    clock : Clock
        The clock of the loop.
    file : Path
        The recording's ``.npz`` file.

    Returns
    -------
    Shown
        What is to be logged; the recording is on disk.

    Raises
    ------
    DeviceError
        If the device cannot be opened or closed. A fault while presenting is no
        error: it is in the result.
    OSError
        If the recording cannot be written.
    """
    settings, stretch = protocol.device, protocol.stretch
    parameters = elbow_parameters(protocol, asked.presentation.model)
    start, end = math.radians(stretch.start_deg), math.radians(stretch.end_deg)
    speed = _speed(protocol, asked)
    hand = (
        None if speed is None else SimulatedHand(start=start, end=end, mean_speed=speed)
    )
    controller = Controller(
        parameters,
        start_angle=start,
        compensation=settings.friction_compensation,
        slip_speed_drop=math.radians(settings.slip_speed_drop_deg_s),
        rate_hz=settings.rate_hz,
    )
    limits = DeviceLimits(
        torque=settings.torque_limit_nm,
        speed=math.radians(settings.speed_limit_deg_s),
        missed_ticks=settings.missed_ticks_limit,
    )
    with open_device(
        settings.backend, clock=clock, hand=hand, range_end=parameters.range_end
    ) as device:
        presented = run_presentation(
            device,
            controller,
            clock=clock,
            limits=limits,
            rate_hz=settings.rate_hz,
            max_duration_s=_longest(end - start, speed),
            end_angle=end,
        )
    return _keep(presented.recording, protocol, asked, file)


def _speed(protocol: Protocol, asked: Asked) -> float | None:
    # rad/s of the simulated hand; None when a person moves the arm
    if protocol.device.backend != SIMULATED_BACKEND:
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


def _keep(recording: Recording, protocol: Protocol, asked: Asked, file: Path) -> Shown:
    shown, found = asked.presentation, recording.facts
    facts: dict[str, Fact] = {
        **found,
        "study": protocol.study.id,
        "rater": asked.rater,
        "session": asked.session,
        "code": shown.code,
        "model": shown.model,
        "repeat": shown.repeat,
        "position": shown.position,
        "attempt": asked.attempt,
    }
    checksum = write_recording(dataclasses.replace(recording, facts=facts), file)
    for written in (file, file.with_suffix(".json")):
        _sync(written)  # before the log says that they are there
    speed, fault = found["mean_speed_deg_s"], found["fault"]
    return Shown(
        sha256=checksum,
        mean_speed_deg_s=None if speed is None else float(speed),
        n_missed_ticks=int(found["n_missed_ticks"] or 0),
        fault=None if fault is None else str(fault),
        simulated=bool(found["simulated"]),
    )


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
