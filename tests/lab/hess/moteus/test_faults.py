"""Faults of a moteus, its bus and its motor, each put into a presentation.

``python -m tests.lab.hess.moteus.test_faults`` prints the table of the page.
"""

import math
import warnings
from math import radians
from pathlib import Path

import pytest

from masrel.errors import (
    DeviceError,
    IdledError,
    LimitExceededError,
    OverrunWarning,
)
from masrel.lab.hess import SimulatedClock
from masrel.lab.hess._emulated import FaultKind
from masrel.lab.hess.puck import InjectedFault, steady_runs
from tests.lab.hess.moteus.rig import opened, presented
from tests.lab.hess.rig import ActingClock, missing

PAGE = (Path(__file__).parents[4] / "docs/howto/laboratory/moteus.md").read_text(
    "utf-8"
)
CATCH = 0.7  # HM3 at 92 deg/s is in its catch from 0.63 to 0.96 s
LOST = "missed-replies"
WATCHDOG_MS = 20.0


def fault(kind, start_s: float = CATCH, *, lasts: float = math.inf, **more):
    return InjectedFault(kind=kind, start_s=start_s, end_s=start_s + lasts, **more)


CODES = {
    **{32: "calibration", 33: "motor-driver", 34: "over-voltage", 35: "encoder"},
    **{36: "not-configured", 37: "pwm-overrun", 38: "over-temperature"},
    **{39: "outside-limits", 40: "under-voltage", 41: "settings-changed"},
    **{42: "commutation-unknown", 43: "position-unknown", 44: "driver-not-enabled"},
    **{45: "stop-position", 46: "timing", 47: "feedforward-without-limit"},
    **{48: "invalid-limits", 49: "unknown-fault"},
}
FAULTS: list[tuple[str, InjectedFault, str | None]] = [
    ("one request lost", fault("dropped-requests", lasts=0.001), None),
    ("requests lost for 20 ms", fault("dropped-requests", lasts=0.02), LOST),
    ("requests lost for good", fault("dropped-requests"), LOST),
    ("one answer lost", fault("dropped-replies", lasts=0.001), None),
    ("every fourth answer lost", fault("dropped-replies", every=4), LOST),
    ("every tenth answer lost", fault("dropped-replies", every=10), None),
    ("answers lost for good", fault("dropped-replies"), LOST),
    ("one torque lost", fault("dropped-torques", lasts=0.001), None),
    ("torques lost for good", fault("dropped-torques"), "watchdog"),
    ("answers late by 0.5 ms", fault("late-replies", size=0.0005), None),
    ("answers late by 1.5 ms", fault("late-replies"), LOST),
    ("answers late by 3 ms", fault("late-replies", size=0.003), LOST),
    ("answers late by 4 ms", fault("late-replies", size=0.004), LOST),
    ("answers twice", fault("duplicated-replies"), None),
    ("one answer is the one before", fault("stale-replies", lasts=0.001), None),
    ("answers are the one before", fault("stale-replies"), LOST),
    ("an answer is torn", fault("short-replies", lasts=0.001), "bad-frame"),
    ("a position is no number", fault("nan-replies", lasts=0.001), "bad-frame"),
    ("answers under another number", fault("renumbered-replies"), LOST),
    ("frames of others", fault("foreign-frames"), None),
    ("five error frames", fault("error-frames", lasts=0.005), None),
    ("error frames for good", fault("error-frames"), "error-frames"),
    ("bus off for 10 ms", fault("bus-off", lasts=0.01), "bus-off"),
    ("bus off for good", fault("bus-off"), "bus-off"),
    ("encoder frozen", fault("frozen-encoder"), "frozen"),
    ("encoder jumps 200 counts", fault("jumping-encoder", size=200), "jump"),
    ("stopped from outside", fault("idled", CATCH + 0.0012), "idled"),
    ("a second host sends torques", fault("other-torques"), "lost-torques"),
    ("supply fails for a moment", fault("reset"), "idled"),
    ("cable out for 10 ms", fault("unplugged", lasts=0.01), LOST),
    ("cable out for good", fault("unplugged"), LOST),
    ("motor without current", fault("dead-motor"), "lost-torques"),
    ("a limit for one answer", fault("limited", lasts=0.001), None),
    ("torque × 1.5", fault("scaled-torque", size=1.5), None),
    *((f"code {c}: {n}", fault("board-fault", size=c), n) for c, n in CODES.items()),
    *((f"code {c}", fault("limited", size=c), "limited") for c in range(96, 104)),
]
QUICK = {"torques lost for good", "answers late by 3 ms", "a position is no number"}
QUICK |= {"stopped from outside", "motor without current", "code 34: over-voltage"}
QUICK |= {"bus off for good", "answers late by 4 ms", "code 103"}
OUT_OF_REACH = {"bus off for good", "cable out for good", "requests lost for good"}
NO_WORD = {"answers lost for good", "answers are the one before"}
NO_WORD |= {"answers under another number", *OUT_OF_REACH}


def outcome(injected: InjectedFault) -> tuple[str | None, list[float], str]:
    """What a fault is named -> and ms to notice, N·m then and at most, ms to zero."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OverrunWarning)
        done, device = presented(injected)
    if done.fault is None:
        return None, [], ""
    start_ns = device.emulator.faults.started_ns  # the first torque of the loop
    noticed_ns = start_ns + round(done.fault.time_s * 1e9)
    before = [held for at, held in device.emulator.torques if at <= noticed_ns]
    after = [one for one in device.emulator.torques if one[0] > noticed_ns]
    last_ns, left = noticed_ns, before[-1]
    while after and after[-1][1] == 0.0:
        last_ns, left = after.pop()
    assert left == 0.0
    peak = max((abs(held) for _, held in after), default=0.0)
    was_zero = before[-1] == peak == 0.0
    noticed_ms = 1e3 * (done.fault.time_s - injected.start_s)
    zero_ms = 0.0 if was_zero else 1e-6 * (last_ns - noticed_ns)
    return done.fault.kind, [noticed_ms, abs(before[-1]), peak, zero_ms], str(done)


def tier(name: str) -> list[pytest.MarkDecorator]:
    """Presentations with another code come to the same; each is named below."""
    if name in QUICK:
        return []
    return [pytest.mark.long if name.startswith("code ") else pytest.mark.slow]


@pytest.mark.parametrize(
    ("name", "injected", "kind"),
    [pytest.param(*row, marks=tier(row[0])) for row in FAULTS],
)
def test_a_fault_is_named_and_leaves_no_torque(
    name: str, injected: InjectedFault, kind: str | None
) -> None:
    named, numbers, words = outcome(injected)
    assert named == kind
    if f"| {name} |" in PAGE:
        assert row(name, named, numbers) in PAGE
    if kind is None:
        return
    noticed_ms, held, peak, zero_ms = numbers
    assert noticed_ms <= (45.0 if name.startswith("every") else 31.0)
    assert peak <= held + 1e-9 or name.startswith("a second host")
    assert zero_ms <= 51.0  # none where it has let go by itself: nothing starts it
    assert ("SWITCH ITS SUPPLY OFF" in words) == (name in NO_WORD)
    if name in OUT_OF_REACH:  # its own watchdog has let go
        assert zero_ms <= WATCHDOG_MS + 1.0


@pytest.mark.parametrize(
    ("kind", "code", "named"),
    [
        *(("board-fault", code, name) for code, name in CODES.items()),
        *(("limited", code, "limited") for code in range(96, 104)),
    ],
)
def test_each_code_has_its_name(kind: FaultKind, code: int, named: str) -> None:
    clock = SimulatedClock()

    def ten_ticks() -> None:
        for _ in range(10):
            device.command(0.0)
            clock.sleep_until_ns(clock.now_ns() + 1_000_000)
            device.read()

    with opened(fault(kind, 0.002, size=code), clock=clock) as device:
        faults = (IdledError, LimitExceededError)
        with pytest.raises(faults, match=f"code {code}") as caught:
            ten_ticks()
    assert caught.value.kind == named


def test_a_host_that_was_away_under_torque_does_not_just_go_on() -> None:
    # for less than the loop's own limits of 20 ticks and 50 ms
    clock = ActingClock(missing({CATCH: 0.0208}))
    with pytest.warns(OverrunWarning):
        done, device = presented(clock=clock)
    assert done.fault is not None
    assert done.fault.kind == "watchdog"
    assert device.emulator.torques[-1][1] == 0.0


@pytest.mark.parametrize("factor", [-1.0, 0.0])
def test_a_motor_that_turns_the_other_way_is_noticed_by_a_free_arm(
    factor: float,
) -> None:
    clock = SimulatedClock()
    reversed_motor = fault("scaled-torque", 0.0, size=factor)
    if factor == 0.0:
        reversed_motor = fault("dead-motor", 0.0)
    with opened(reversed_motor, clock=clock) as device:
        words = "have different signs" if factor else "N·m do not move it"
        with pytest.raises(DeviceError, match=words):
            steady_runs(device, clock)
        assert abs(device.read().angle - radians(60.0)) < radians(2.0)


def row(name: str, kind: str | None, numbers: list[float]) -> str:
    cells = [f"{number:.1f}" for number in numbers] or [""] * 4
    return "| " + " | ".join([name, kind or "let pass", *cells]) + " |"


if __name__ == "__main__":
    for name, injected, _ in FAULTS:
        print(row(name, *outcome(injected)[:2]))
