"""Bring a moteus up by hand: who is there, can it be driven, where is its arm.

In: where it is, as `MoteusOptions`; nothing moves. Out: reports to print.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from masrel.errors import DeviceTimeoutError
from masrel.lab.hess._can import Link, check_elbow_angle
from masrel.lab.hess._clock import Clock
from masrel.lab.hess._free_arm import (
    PROBE_PATIENCE_S,
    Check,
    ask_often,
    check_bus,
    check_rest,
    check_torque_mode,
)
from masrel.lab.hess.moteus._frames import FLOAT, INT8, INT32, write
from masrel.lab.hess.moteus._moteus_device import ReadyServo, Servo
from masrel.lab.hess.moteus._moteus_options import (
    DRIVEN,
    FAULTS,
    FIRMWARE,
    FREE,
    HOME_STATE,
    SERIAL_NUMBER,
    SET_POSITION,
    TIMEOUT,
    MoteusOptions,
)

N_NODES = 127
_TICK_S = 0.001
_STEP = math.radians(0.005)  # of the angle of an arm at rest
_MOST_TICKS = 50  # from a stop to the torque mode; chosen
_TOLERANCE = math.radians(0.1)  # of an arm that is held while it is zeroed


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoReport:
    """What a moteus on the bus says of itself.

    Attributes
    ----------
    servo : int
        Its number.
    firmware : str
        Version.
    serial : str
        Serial number of the board.
    home_state : int
        2 where it knows where its output is.
    volts, celsius : float
        Of its supply, and of the board.
    fault : str or None
        What it has stopped itself for.
    """

    servo: int
    firmware: str
    serial: str
    home_state: int
    volts: float
    celsius: float
    fault: str | None

    def __str__(self) -> str:
        known = "" if self.home_state == 2 else ", OUTPUT NOT KNOWN"
        fault = "" if self.fault is None else f", FAULT {self.fault}"
        return (
            f"moteus {self.servo}: firmware {self.firmware}, {self.volts:g} V, "
            f"{self.celsius:g} deg C{known}{fault}"
        )


def probe(
    link: Link,
    clock: Clock,
    options: MoteusOptions,
    *,
    progress: Callable[[], object] = lambda: None,
) -> tuple[ServoReport, ...]:
    """Ask every number who it is; nothing is set.

    Parameters
    ----------
    link : Link
        The bus, connected to all nodes.
    clock : Clock
        Its clock.
    options : MoteusOptions
        Which bus.
    progress : callable, optional
        Called after each of the 127 numbers.

    Returns
    -------
    tuple of ServoReport
        Those that answer, in the order of their numbers.

    Raises
    ------
    DeviceError
        If the bus fails.
    """
    reports = []
    for number in range(1, N_NODES + 1):
        servo = Servo(link, clock, replace(options, servo=number))
        try:
            reports.append(_report(servo, number))
        except DeviceTimeoutError:
            pass
        progress()
    return tuple(reports)


def _report(servo: Servo, number: int) -> ServoReport:
    (version,) = servo.get(INT32, FIRMWARE, patience_s=PROBE_PATIENCE_S)
    home_state, volts, celsius, code = servo.get(INT8, HOME_STATE, 4)
    serial = servo.get(INT32, SERIAL_NUMBER, 3)
    major, minor, micro = int(version).to_bytes(4, "big")[1:]
    return ServoReport(
        servo=number,
        firmware=f"{major}.{minor}.{micro}",
        serial="-".join(f"{int(part) % 2**32:08x}" for part in serial),
        home_state=int(home_state),
        volts=volts,
        celsius=celsius,
        fault=FAULTS.get(int(code)),
    )


def check(link: Link, clock: Clock, options: MoteusOptions) -> tuple[Check, ...]:
    """See whether a moteus can be driven.

    The arm must be at rest. The moteus is told no torque for some milliseconds, and
    then nothing, so that its watchdog must let go; it is stopped afterwards.

    Parameters
    ----------
    link : Link
        The bus.
    clock : Clock
        Its clock.
    options : MoteusOptions
        Which moteus, and how its device is to behave.

    Returns
    -------
    tuple of Check
        What was checked.

    Raises
    ------
    DeviceError
        If the bus fails, or the moteus does not answer, does not know where its output
        is, has other settings than a person's arm needs, or cannot be stopped.
    """
    servo = ReadyServo(link, clock, options)
    low, high = servo.bounds
    settings = Check(
        name="settings",
        holds=True,
        result=(
            f"bounds {math.degrees(low):.1f} to {math.degrees(high):.1f} deg, "
            f"servo.timeout_mode {FREE}: free after silence"
        ),
    )

    def angle() -> float:
        servo.ask()
        return options.angle(servo.answer(options.patience_s).position)

    answers, angles = ask_often(servo, angle)
    steps = [round(angle / _STEP) for angle in angles]
    advice = "look whether the arm is there"
    rest = check_rest(steps, angles[-1], advice, "steps") if angles else ()
    torque_mode = check_torque_mode(
        lambda: _fall_silent(servo, options),
        servo.stop,
        f"in it, and out of it after {options.watchdog_ms:g} ms of silence; stopped "
        "now, LOOK WHETHER THE ARM IS FREE",
    )
    return (settings, answers, *rest, torque_mode, check_bus(servo))


def _fall_silent(servo: Servo, options: MoteusOptions) -> None:
    for _ in range(_MOST_TICKS):
        servo.command(0.0)
        driven = servo.answer().mode
        servo.wait(_TICK_S)
    servo.wait(2e-3 * options.watchdog_ms)
    servo.ask()
    silent = servo.answer().mode
    servo.needs(
        (driven, silent) == (DRIVEN, TIMEOUT),
        f"mode {DRIVEN} under torque and {TIMEOUT} after silence, got {driven} and "
        f"{silent}",
    )


def zero(link: Link, clock: Clock, options: MoteusOptions, *, angle: float) -> float:
    """Tell a moteus where the arm is; it forgets when its supply is switched off.

    Parameters
    ----------
    link : Link
        The bus.
    clock : Clock
        Its clock.
    options : MoteusOptions
        Which moteus, and how its device is to behave.
    angle : float
        Where the arm is held, rad; 0 at full flexion, to pi.

    Returns
    -------
    float
        The position that it reports afterwards, turns of its output.

    Raises
    ------
    ParameterError
        If no arm can be at `angle`.
    DeviceError
        If it does not answer, or does not take the position.
    """
    check_elbow_angle(angle)
    servo = Servo(link, clock, options)
    servo.stop()  # its position is about to jump
    servo.ask(write(FLOAT, SET_POSITION, options.position(angle)))
    servo.answer()  # from before
    servo.ask()
    position = servo.answer().position
    servo.needs(
        abs(options.angle(position) - angle) <= _TOLERANCE,
        f"a position of {options.position(angle):.5f} turns after zeroing, got "
        f"{position:.5f}",
    )
    return position
