"""Faults of the bus and the puck itself, each put into a presentation.

``python -m tests.lab.hess.puck.test_faults`` prints the table of
docs/howto/laboratory/hardware_faults.md.
"""

import math
import re
import tempfile
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from masrel.errors import OverrunWarning
from masrel.lab.hess import Device, SimulatedOptions, open_device
from masrel.lab.hess.puck import InjectedFault
from tests.lab.hess.faults import FaultyDevice
from tests.lab.hess.injected import N_STRETCHES, Injection, cell, later_s
from tests.lab.hess.injected import Outcome as SessionOutcome
from tests.lab.hess.injected import outcome as session_outcome
from tests.lab.hess.puck.rig import (
    PUCK,
    FaultKind,
    PuckDevice,
    fault,
    n_memory_writes,
    presented,
    puck_options,
)

PAGE = Path(__file__).parents[4] / "docs/howto/laboratory/hardware_faults.md"
CATCH = 0.7  # HM3 at 92 deg/s is in its catch from 0.63 to 0.96 s


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What came of a fault."""

    kind: str | None
    noticed_ms: float = math.nan  # after it began
    held_nm: float = math.nan  # by the puck when it was noticed
    peak_nm: float = math.nan  # held by the puck afterwards
    zero_ms: float = math.nan  # from the notice until the puck holds nothing
    whole: bool = False  # a row for every tick until the notice, but those missed
    words: str | None = None


def held(device: PuckDevice) -> list[tuple[int, float]]:
    """When the puck's torque changed, ns, and to what, N·m; idle it holds none."""
    steps, driven, torque = [], False, 0.0
    for time_ns, name, value in device.emulator.settings:
        if name == "MODE":  # a reset says so, too
            driven = value == 2
        elif name == "T":
            torque = PUCK.torque(value)
        if not driven:
            torque = 0.0
        steps.append((time_ns, torque))
    return steps


def outcome(injected: InjectedFault, n_stretches: int = 1) -> Outcome:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OverrunWarning)
        done, device, _ = presented(injected, n_stretches=n_stretches)
    facts, columns = done.recording.facts, done.recording.columns
    if facts["fault_kind"] is None:
        return Outcome(kind=None, whole=whole(columns["time_s"], facts))
    started_ns = device.emulator.faults.started_ns
    assert started_ns is not None
    begun_ns = started_ns + round(injected.start_s * 1e9)
    fault_ns = round(float(facts["fault_time_s"] or 0.0) * 1e9)
    noticed_ns = presentation_began(device) + fault_ns
    steps = held(device)
    before = [torque for time_ns, torque in steps if time_ns <= noticed_ns]
    after = [step for step in steps if step[0] > noticed_ns]
    torques = [abs(before[-1]), *(abs(torque) for _, torque in after)]
    zeros = [time_ns for time_ns, torque in after if torque == 0.0]
    if before[-1] == 0.0:
        zeros.append(noticed_ns)
    gone = torques[-1] == 0.0
    return Outcome(
        kind=str(facts["fault_kind"]),
        noticed_ms=(noticed_ns - begun_ns) * 1e-6,
        held_nm=torques[0],
        peak_nm=max(torques),
        zero_ms=(min(zeros) - noticed_ns) * 1e-6 if gone else math.nan,
        whole=whole(columns["time_s"], facts),
        words=None if facts["fault"] is None else str(facts["fault"]),
    )


def presentation_began(device: PuckDevice) -> int:
    """When the loop began, ns: 0.26 ms before its first torque takes effect."""
    torques = [s.time_ns for s in device.emulator.settings if s.name == "T"]
    # T = 0 to wake, T = 0, 1, 0 to activate: the fifth is the loop's first, sent
    # after a reading of 150 µs and taken after 110 µs.
    return torques[4] - 260_000


def whole(times: np.ndarray, facts: dict) -> bool:
    # Rows for every tick that was run, in order, up to the end or the fault
    end = facts["fault_time_s"]
    rows = times if end is None else times[times < float(end) - 1e-9]
    n_ticks = round((float(rows[-1]) - float(rows[0])) * 1000) + 1
    n_lost = int(facts["n_missed_replies"]) + int(facts["n_missed_ticks"])
    return bool(np.all(np.diff(times) > 0.0)) and n_ticks - rows.size <= n_lost


def short(kind: FaultKind, duration_s: float, **more) -> InjectedFault:
    return fault(kind, CATCH, end_s=CATCH + duration_s, **more)


LOST = "missed-replies"

# name, fault, kind it is expected to be; None where it is let pass
FAULTS: list[tuple[str, InjectedFault, str | None]] = [
    ("one request lost", short("dropped-requests", 0.0005), None),
    ("requests lost for 20 ms", short("dropped-requests", 0.02), LOST),
    ("every third request lost", fault("dropped-requests", CATCH, every=3), LOST),
    ("one reply lost", short("dropped-replies", 0.001), None),
    ("every fourth reply lost", fault("dropped-replies", CATCH, every=4), LOST),
    ("every tenth reply lost", fault("dropped-replies", CATCH, every=10), None),
    ("replies lost for 20 ms", short("dropped-replies", 0.02), LOST),
    ("replies lost for good", fault("dropped-replies", CATCH), LOST),
    ("one torque lost", short("dropped-torques", 0.001), None),
    ("torques lost for 60 ms", short("dropped-torques", 0.06), "lost-torques"),
    ("torques lost for good", fault("dropped-torques", CATCH), "lost-torques"),
    ("one reply late by 1.5 ms", short("late-replies", 0.001), None),
    ("replies late by 1.5 ms", fault("late-replies", CATCH), LOST),
    ("replies late by 3 ms", fault("late-replies", CATCH, size=0.003), LOST),
    ("replies twice", fault("duplicated-replies", CATCH), None),
    ("a reply short by a byte", short("short-replies", 0.001), "bad-frame"),
    ("frames of others", fault("foreign-frames", CATCH), None),
    ("five error frames", short("error-frames", 0.005), None),
    ("error frames for good", fault("error-frames", CATCH), "error-frames"),
    ("bus off for 20 ms", short("bus-off", 0.02), "bus-off"),
    ("bus off for good", fault("bus-off", CATCH), "bus-off"),
    ("encoder frozen", fault("frozen-encoder", CATCH), "frozen"),
    ("encoder jumps 200 counts", fault("jumping-encoder", CATCH, size=200), "jump"),
    ("encoder loses whole turns", fault("wrapping-encoder", CATCH), "jump"),
    ("idled from outside", fault("idled", CATCH + 0.0012), "idled"),
    ("supply fails for a moment", fault("reset", CATCH), LOST),
    ("cable out for 50 ms", short("unplugged", 0.05), LOST),
    ("cable out for good", fault("unplugged", CATCH), LOST),
]  # fmt: skip
OUT_OF_REACH = {"bus off for good", "cable out for good"}
"""Nothing goes to the puck any more: no software can take its torque back."""


def row(name: str, made: Outcome) -> str:
    zero = "never" if made.kind and math.isnan(made.zero_ms) else cell(made.zero_ms, 0)
    cells = [
        name,
        made.kind or "let pass",
        cell(made.noticed_ms, 1),
        cell(made.held_nm, 1),
        cell(made.peak_nm, 1),
        zero,
        "yes" if made.whole else "no",
    ]
    return "| " + " | ".join(cells) + " |"


LATER = [(*one, stretch) for stretch in range(1, N_STRETCHES + 1) for one in FAULTS]
ON_THE_LIMIT = "every tenth reply lost"  # 10 of 100 pass, 11 do not


@pytest.mark.parametrize(
    ("name", "injected", "kind", "stretch"),
    [
        *(pytest.param(*one, None, id=one[0]) for one in FAULTS),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in LATER[10::33]),
        *(pytest.param(*one, marks=pytest.mark.long) for one in LATER),
    ],
)
def test_a_fault_of_the_bus(
    name: str, injected: InjectedFault, kind: str | None, stretch: int | None
) -> None:
    later = 0.0 if stretch is None else later_s(stretch)
    begin, end = injected.start_s + later, injected.end_s + later
    put = replace(injected, start_s=begin, end_s=end)
    made = outcome(put, 1 if stretch is None else N_STRETCHES)
    if stretch is None:
        assert row(name, made) in PAGE.read_text(encoding="utf-8")
    elif name == ON_THE_LIMIT and made.kind == LOST:
        return
    assert made.kind == kind
    assert made.whole
    if kind is None:
        return
    assert made.peak_nm <= made.held_nm
    # In a catch the torque stands, and to lose it makes no difference
    assert made.noticed_ms <= (31.0 if stretch is None else 60.0)
    if name in OUT_OF_REACH:
        assert math.isnan(made.zero_ms)
        assert made.words is not None
        assert "SWITCH ITS SUPPLY OFF" in made.words
    else:
        assert made.zero_ms <= 205.0


class Asked(FaultyDevice):
    """One without faults of its own, which passes on who asks for the puck's state."""

    def _check(self) -> None:
        self.inner.check()


def session(injected: InjectedFault, folder: Path) -> SessionOutcome:
    """Run a session on emulated pucks, the first of which has a fault."""
    faults = [(injected,)]

    def opener(_name: str, *, hand, options, **others) -> Device:
        assert options == SimulatedOptions()  # the study's own device
        made = puck_options(hand, emulator={"faults": faults.pop() if faults else ()})
        return open_device("puck", hand=hand, options=made, **others)

    # the loop begins some ms after the torque mode, from which the faults are timed
    at_s = round(injected.start_s - 0.01, 3)
    first = Injection(name="", at_s=at_s, expected=None, wrap=Asked)
    return session_outcome(first, folder, opener)


QUICK = {"bus off for 20 ms", "cable out for 50 ms", "supply fails for a moment"}
# The first of each kind: what a session does then depends on the kind alone
FIRST = {kind: name for name, _, kind in reversed(FAULTS)}.values()


def tier(name: str) -> list[pytest.MarkDecorator]:
    if name in QUICK:
        return []
    often = name in FIRST or name in OUT_OF_REACH
    return [pytest.mark.slow if often else pytest.mark.long]


@pytest.mark.parametrize(
    ("name", "injected", "kind"),
    [pytest.param(*one, marks=tier(one[0])) for one in FAULTS],
)
def test_after_a_fault_of_the_bus_the_session_goes_on(
    name: str, injected: InjectedFault, kind: str | None, tmp_path: Path
) -> None:
    made = session(injected, tmp_path / "study")
    assert made.kind == kind
    assert made.intact
    once = ["presented", "grade"]
    again = ["presented", "fault", *once]
    assert made.events == ["session", *(again if kind else once), "complete"]
    (line,) = re.findall(rf"(?m)^\| {re.escape(name)} \| .*$", PAGE.read_text("utf-8"))
    assert line.endswith("| yes |")  # the rest is `test_a_fault_of_the_bus`'s


kinds = st.sampled_from(sorted({f.kind for _, f, _ in FAULTS}))


@st.composite
def fault_sequences(draw) -> tuple[InjectedFault, ...]:
    """Up to four faults; each alone ends before the device gives up letting go."""
    made = []
    for _ in range(draw(st.integers(1, 4))):
        start_s = draw(st.floats(0.01, 1.2))
        made.append(
            InjectedFault(
                kind=draw(kinds),
                start_s=start_s,
                end_s=start_s + draw(st.floats(0.0005, 0.08)),
                every=draw(st.integers(1, 4)),
            )
        )
    return tuple(made)


def assert_invariants(faults: tuple[InjectedFault, ...]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OverrunWarning)
        done, device, _ = presented(*faults)
    facts, columns = done.recording.facts, done.recording.columns
    assert (facts["ended"] == "fault") == (facts["fault"] is not None)
    assert np.all(np.diff(columns["time_s"]) > 0.0)
    assert all(np.all(np.isfinite(column)) for column in columns.values())
    assert np.abs(columns["command_torque_nm"]).max() <= 20.0
    told = {abs(s.value) for s in device.emulator.settings if s.name == "T"}
    assert max(told) <= 20.0 / PUCK.torque_step + 1
    if "SWITCH ITS SUPPLY OFF" in str(facts["fault"]):
        return  # one after the other they left no way to the puck: that is said
    assert held(device)[-1][1] == 0.0
    assert device.emulator.mode == 0
    assert n_memory_writes(device.emulator) == 0


few = settings(deadline=None, max_examples=8)
many = settings(few, max_examples=16, suppress_health_check=[HealthCheck.too_slow])


@pytest.mark.parametrize(
    "count",
    [
        few,
        pytest.param(many, marks=pytest.mark.slow),
        pytest.param(settings(many, max_examples=1000), marks=pytest.mark.long),
    ],
    ids=lambda count: str(count.max_examples),
)
def test_sequences_of_faults_leave_no_torque(count: settings) -> None:
    worst = (short("bus-off", 0.0625), fault("reset", CATCH))
    count(example(worst)(given(fault_sequences())(assert_invariants)))()


if __name__ == "__main__":
    for name, injected, _ in FAULTS:
        with tempfile.TemporaryDirectory() as folder:
            goes_on = session(injected, Path(folder) / "study").resumes
        print(row(name, outcome(injected)), "yes |" if goes_on else "no |")
