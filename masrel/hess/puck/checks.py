"""What must hold before a person touches the arm; it is idle but for a moment."""

import math
import statistics
from dataclasses import dataclass

from masrel.errors import DeviceError, DeviceTimeoutError
from masrel.hess.limits import DeviceLimits
from masrel.hess.puck.bring_up import activate, check_torque
from masrel.hess.puck.connection import Awake
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.options import PuckOptions
from masrel.hess.puck.properties import PropertyTable
from masrel.hess.puck.release import release

__all__ = ["Check", "check"]

_N_REQUESTS = 1000
_REST_COUNTS = 4  # between the largest and the smallest of an arm at rest
_LONGEST_ANSWER_S = (
    0.0007  # of the millisecond; the rest is for the torque and the host
)
_SHARE_IN_TIME = 0.99


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing that was looked at."""

    name: str  # what
    holds: bool  # whether it is as it must be
    found: str  # what was found


def check(puck: Awake, options: PuckOptions) -> tuple[Check, ...]:
    """Look at a puck that has been woken and configured."""
    # The arm must be at rest. It is put into torque mode with zero torque, and with one
    # current unit (0.007 N·m) for a millisecond, and idled again.
    node, table, transmission = puck.node, puck.table, puck.transmission
    counts, took_s, n_lost = _requests(node, table, options.patience_s)
    units = f"CTS {transmission.counts_per_turn}, IPNM {transmission.units_per_nm}"
    steps = (
        f"{units}: {math.degrees(transmission.angle_step):.6f} deg and "
        f"{transmission.torque_step:.5f} N·m a step"
    )
    checks = [Check(name="units", holds=True, found=steps), _answers(took_s, n_lost)]
    if counts:
        checks += _position(counts, puck)
    checks.append(_torque_mode(node, table, options))
    arrivals = node.arrivals
    checks.append(
        Check(
            name="error frames",
            holds=arrivals.n_errors == 0,
            found=f"{arrivals.n_errors}, and {arrivals.n_foreign} frames of others",
        )
    )
    return tuple(checks)


def _requests(
    node: PuckNode, table: PropertyTable, patience_s: float
) -> tuple[list[int], list[float], int]:
    # -> counts, how long each took s, how many stayed without an answer
    number = table.number("P")
    counts, took_s, n_lost = [], [], 0
    for _ in range(_N_REQUESTS):
        asked_ns = node.now_ns()
        try:
            counts.append(node.position(number, patience_s=patience_s)[1])
        except DeviceTimeoutError:
            n_lost += 1
        else:
            took_s.append((node.now_ns() - asked_ns) * 1e-9)
        node.wait(max(0.0, 0.001 - (node.now_ns() - asked_ns) * 1e-9))
    return counts, took_s, n_lost


def _answers(took_s: list[float], n_lost: int) -> Check:
    if not took_s:
        return Check(name="answers", holds=False, found=f"none of {n_lost} came")
    in_time = sum(took <= _LONGEST_ANSWER_S for took in took_s) / _N_REQUESTS
    return Check(
        name="answers",
        holds=n_lost == 0 and in_time >= _SHARE_IN_TIME,
        found=(
            f"median {1e3 * statistics.median(took_s):.2f} ms, longest "
            f"{1e3 * max(took_s):.2f} ms, {n_lost} of {_N_REQUESTS} lost; needs "
            f"{100 * _SHARE_IN_TIME:g} % within {1e3 * _LONGEST_ANSWER_S:g} ms"
        ),
    )


def _position(counts: list[int], puck: Awake) -> list[Check]:
    angle = puck.transmission.angle(counts[-1])
    look = "not zeroed yet" if puck.was_asleep else "look whether the arm is there"
    spread = max(counts) - min(counts)
    limits = DeviceLimits()
    return [
        Check(
            name="position",
            holds=limits.lowest_angle <= angle <= limits.highest_angle,
            found=f"{math.degrees(angle):.2f} deg; {look}",
        ),
        Check(
            name="rest",
            holds=spread <= _REST_COUNTS,
            found=f"{spread} counts in a second; at most {_REST_COUNTS} at rest",
        ),
    ]


def _torque_mode(node: PuckNode, table: PropertyTable, options: PuckOptions) -> Check:
    try:
        activate(node, table)
        if options.checks_torque:
            check_torque(node, table)
    except DeviceError as error:
        return Check(name="torque mode", holds=False, found=str(error))
    finally:
        release(node, torque_number=table.number("T"), mode_number=table.number("MODE"))
    said = "T reads back" if options.checks_torque else "T not asked for"
    return Check(
        name="torque mode", holds=True, found=f"in and out of it; {said}; idle now"
    )
