"""Random sequences of faults, presentation after presentation: what always holds.

Hypothesis plans faults of readings, commands, clock, model and people at random times,
presents, and looks at what was sent; then plans more. The run by hand has thousands of
sequences, the slow one a tenth, the usual one enough to see that it works.
"""

import math
import warnings
from math import radians

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from masrel.errors import DeviceError, OverrunWarning
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    EmergencyStop,
    SimulatedClock,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.lab.recording import RAMPS, RECORDING_COLUMNS

from . import faults as f
from .injected import Wrong

START, END = radians(70.0), radians(146.0)  # the catch comes after 0.1 s
DURATION_S = 0.35
LIMITS = DeviceLimits()
PERIOD_S = 0.001

times = st.floats(0.0, DURATION_S)
few = st.sampled_from([1, 2, 3, 5, math.inf])


class Disturbed(SimulatedClock):
    """A clock with gaps, that can press a button."""

    def __init__(self, gaps: dict[float, float], stop: EmergencyStop) -> None:
        super().__init__()
        self.gaps, self.stop = dict(gaps), stop
        self.press_at = math.inf

    def sleep_until_ns(self, deadline_ns: int) -> None:
        super().sleep_until_ns(deadline_ns)
        for at_s in [at for at in self.gaps if deadline_ns >= at * 1e9]:
            super().sleep_until_ns(deadline_ns + round(self.gaps.pop(at_s) * 1e9))
        if deadline_ns >= self.press_at * 1e9:
            self.stop.press("test")


class Faults(RuleBasedStateMachine):
    """Plans faults and presents."""

    n_presented = 0  # with a fault or more, by all machines

    @initialize()
    def begin(self) -> None:
        self.reads: list[f.ReadFault] = []
        self.sends: list[f.SendFault] = []
        self.checks: list = []
        self.gaps: dict[float, float] = {}
        self.press_at = math.inf
        self.wrong: tuple[float, float] | None = None
        self.slip_time: float | None = None

    @rule(at=times, n=few)
    def drop(self, at: float, n: float) -> None:
        self.reads.append(f.dropped(at, n))

    @rule(at=times, every=st.integers(2, 20))
    def drop_some(self, at: float, every: int) -> None:
        self.reads.append(f.dropped(at, every=every))

    @rule(at=times, by=st.floats(0.0, 0.02), n=few)
    def delay(self, at: float, by: float, n: float) -> None:
        self.reads.append(f.late(at, by, n))

    @rule(at=times, n=few)
    def repeat(self, at: float, n: float) -> None:
        self.reads.append(f.repeated(at, n))

    @rule(at=times)
    def freeze(self, at: float) -> None:
        self.reads.append(f.frozen(at + PERIOD_S))

    @rule(at=times, by=st.floats(-60.0, 60.0), n=few)
    def shift(self, at: float, by: float, n: float) -> None:
        self.reads.append(f.shifted(at, radians(by), n))

    @rule(at=times, by=st.sampled_from([math.nan, math.inf, -math.inf]))
    def spoil(self, at: float, by: float) -> None:
        self.reads.append(f.shifted(at, by, 1))

    @rule(at=times, rate=st.floats(-600.0, 600.0))
    def drift(self, at: float, rate: float) -> None:
        self.reads.append(f.drifting(at, radians(rate)))

    @rule(at=times, n=few)
    def refuse(self, at: float, n: float) -> None:
        self.sends.append(f.not_taken(at, n))

    @rule(at=times)
    def idle_from_outside(self, at: float) -> None:
        self.checks.append(f.says(at, f.IDLED))

    @rule(at=times, gap=st.floats(0.0, 0.1))
    def be_late(self, at: float, gap: float) -> None:
        self.gaps[at] = gap

    @rule(at=times)
    def press(self, at: float) -> None:
        self.press_at = min(self.press_at, at)

    @rule(at=times, torque=st.floats(-40.0, 40.0) | st.just(math.nan))
    def go_wrong(self, at: float, torque: float) -> None:
        self.wrong = (at, torque)

    @rule(at=times)
    def slip(self, at: float) -> None:
        self.slip_time = at

    @property
    def has_plans(self) -> bool:
        plans = (self.reads, self.sends, self.checks, self.gaps)
        odd = self.press_at < math.inf or self.wrong or self.slip_time is not None
        return any(plans) or bool(odd)

    def teardown(self) -> None:
        # Hypothesis leaves out some of the rules in every sequence, `present` too
        if hasattr(self, "reads") and self.has_plans:
            self.present("HM3")

    @precondition(lambda self: hasattr(self, "reads"))
    @rule(model=st.sampled_from(sorted(STANDARD_MODELS)))
    def present(self, model: str) -> None:
        try:
            Faults.n_presented += self.has_plans
            self._present(model)
        finally:
            self.begin()

    def _present(self, model: str) -> None:
        stop = EmergencyStop()
        clock = Disturbed(self.gaps, stop)
        clock.press_at = self.press_at
        hand = SimulatedHand(
            start=START, end=END, mean_speed=radians(110.0), slip_time=self.slip_time
        )
        inner = open_device("simulated", clock=clock, hand=hand)
        device = f.FaultyDevice(
            inner, read_fault=self._read, send_fault=self._send, check_fault=self._check
        )
        controller = Controller(STANDARD_MODELS[model], start_angle=START)
        if self.wrong is not None:
            at, torque = self.wrong
            controller._joint = Wrong(controller._joint, at, lambda _: torque)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", OverrunWarning)
            device.open()
            presented = run_presentation(
                device,
                controller,
                clock=clock,
                limits=LIMITS,
                max_duration_s=DURATION_S,
                stop=stop,
            )
        try:
            self._what_was_sent(device, presented)
            self._what_was_kept(presented)
        finally:
            try:
                device.close()
            except DeviceError:
                pass
            inner.close()

    def _read(self, time_s, reading):
        for fault in self.reads:
            reading = fault(time_s, reading)
        return reading

    def _send(self, time_s, torque):
        for fault in self.sends:
            torque = fault(time_s, torque)
        return torque

    def _check(self, time_s):
        for fault in self.checks:
            fault(time_s)

    def _what_was_sent(self, device: f.FaultyDevice, presented) -> None:
        sent = device.commands
        torques = np.array([torque for _, torque in sent])
        assert np.all(np.abs(torques) <= LIMITS.torque)
        # Never a burst: one torque a tick at most, in the ramp too, which has its own
        fault = presented.fault
        over = math.inf if fault is None else fault.time_s
        for start, end in ((0.0, over - 1e-9), (over, math.inf)):
            ticks = [
                math.floor((t - start) / PERIOD_S + 1e-6)
                for t, torque in sent
                if start <= t < end and torque != 0.0
            ]
            assert len(set(ticks)) == len(ticks)
        if fault is None:
            assert device.is_open
            assert sent[-1][1] == 0.0
            return
        # Latched and let go; the torque falls from what was held to zero in time
        assert not device.is_open
        assert math.isfinite(device.let_go_s)
        after = [(t, abs(torque)) for t, torque in sent if t >= fault.time_s - 1e-9]
        falling = [abs(fault.torque_nm), *(torque for _, torque in after)]
        assert falling == sorted(falling, reverse=True)
        lateness = sum(self.gaps.values())  # a machine that is away cannot ramp
        assert device.let_go_s - fault.time_s <= 0.1 + lateness + 1e-9

    def _what_was_kept(self, presented) -> None:
        columns, facts = presented.recording.columns, presented.recording.facts
        assert set(columns) == set(RECORDING_COLUMNS)
        assert np.all(np.diff(columns["time_s"]) > 0.0)
        if presented.fault is not None:
            assert facts["fault"] == presented.fault.message
            assert facts["fault_kind"] == presented.fault.kind
            if columns["time_s"].size:
                assert columns["command_torque_nm"][-1] == 0.0
            return
        assert np.all(np.isfinite(columns["angle_deg"]))
        # Every tick was run, missed, or had no reading
        n_due = round(DURATION_S / PERIOD_S)
        counted = presented.recording.n_samples + presented.n_missed_ticks
        counted += int(facts["n_missed_replies"])
        if facts["ended"] == "max-duration":
            n_ending = np.count_nonzero(columns["ramp"] == RAMPS.index("end"))
            assert n_ending in (0, 100)  # none where nothing is to be taken away
            assert n_due <= counted - n_ending <= n_due + 100


QUICK = settings(
    max_examples=25,
    stateful_step_count=12,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
HUNDREDS = settings(QUICK, max_examples=200, stateful_step_count=20)
THOUSANDS = settings(HUNDREDS, max_examples=2000)


class TestSomeSequences(Faults.TestCase):
    settings = QUICK


class Counted:
    def runTest(self) -> None:  # noqa: N802 - unittest's name
        Faults.n_presented = 0
        super().runTest()
        assert Faults.n_presented >= self.settings.max_examples


@pytest.mark.slow
class TestHundredsOfSequences(Counted, Faults.TestCase):
    settings = HUNDREDS


@pytest.mark.long
class TestThousandsOfSequences(Counted, Faults.TestCase):
    settings = THOUSANDS
