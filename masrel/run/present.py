"""One presentation of one model: the device, the loop, and the recording on disk."""

import contextlib
import dataclasses
import math
import os
import sys
from dataclasses import dataclass
from pathlib import Path

from masrel.hess import (
    Clock,
    DeviceLimits,
    EmergencyStop,
    Presented,
    RealClock,
    SimulatedHand,
    cut_off,
    open_device,
    run_presentation,
)
from masrel.hess.stop import stop_on_key, stop_on_signals
from masrel.hess.watchdog import watched
from masrel.protocol import Protocol, elbow_parameters
from masrel.recording import write_recording
from masrel.run.chain import Fact
from masrel.run.fault import FaultRecord, fault_record
from masrel.run.grades import Asked
from masrel.run.settings import (
    backend_options,
    device_limits,
    has_simulated_hand,
    model_controller,
)
from masrel.run.simulated import intended_speed

__all__ = ["Shown", "present", "recover", "spool_of"]

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
    fault : FaultRecord or None
        What stopped it, or None.
    simulated : bool
        Whether no hardware moved.
    """

    sha256: str
    mean_speed_deg_s: float | None
    n_missed_ticks: int
    fault: FaultRecord | None
    simulated: bool


def present(
    protocol: Protocol, asked: Asked, *, clock: Clock, file: Path, stop: EmergencyStop
) -> Shown:
    """Present a model once on the protocol's device and write the recording.

    Signals that would end the process, and with a real clock any key of the terminal,
    press the emergency stop while the device is open.

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
    stop : EmergencyStop
        The button that stops the presentation.

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
    limits = device_limits(protocol.device)
    with contextlib.ExitStack() as held:
        held.enter_context(stop_on_signals(stop))
        if isinstance(clock, RealClock):
            held.enter_context(stop_on_key(stop, sys.stdin))
        spool = spool_of(file)
        presented = _on_device(protocol, asked, clock, limits, stop, spool)
    return _keep(presented, protocol, asked, file)


def spool_of(file: Path) -> Path:
    """Return where samples are kept while the recording is made.

    Parameters
    ----------
    file : Path
        The recording's ``.npz`` file.

    Returns
    -------
    Path
        A file beside it.
    """
    return file.with_suffix(".partial")


def recover(protocol: Protocol, asked: Asked, *, file: Path) -> Shown | None:
    """Make a recording of what a process left that died while presenting.

    Parameters
    ----------
    protocol : Protocol
        As for `present`.
    asked : Asked
        What was being presented.
    file : Path
        The recording's ``.npz`` file.

    Returns
    -------
    Shown or None
        What is to be logged; None when no process died here, or before it began.

    Raises
    ------
    RecordingError
        If what lies there is something else.
    OSError
        If the recording cannot be written.
    """
    spool = spool_of(file)
    if not spool.exists():
        return None
    presented = cut_off(spool)
    if presented is None:
        spool.unlink()
        return None
    return _keep(presented, protocol, asked, file)


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


def _keep(presented: Presented, protocol: Protocol, asked: Asked, file: Path) -> Shown:
    shown, recording = asked.presentation, presented.recording
    facts: dict[str, Fact] = {
        **recording.facts,
        "study": protocol.study.id,
        "rater": asked.rater,
        "session": asked.session,
        "code": shown.code,
        "model": shown.model,
        "repeat": shown.repeat,
        "position": shown.position,
        "attempt": asked.attempt,
    }
    try:
        checksum = write_recording(dataclasses.replace(recording, facts=facts), file)
    except OSError as error:
        error.filename = str(file)  # a full disk does not say which file it was
        raise
    for written in (file, file.with_suffix(".json")):
        _sync(written)  # before the log says that they are there
    spool_of(file).unlink(missing_ok=True)  # only now is it of no use
    speed = facts["mean_speed_deg_s"]
    return Shown(
        sha256=checksum,
        mean_speed_deg_s=None if speed is None else float(speed),
        n_missed_ticks=presented.n_missed_ticks,
        fault=fault_record(presented),
        simulated=bool(facts["simulated"]),
    )


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
