"""The simulated arm by the package and by scipy's solver, on one stretch.

The commands of one presentation of HM3 are put to the same arm and hand; the arm's
turns, sticking, breaking away and end stop are located as events.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    SimulatedClock,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.lab.hess._simulated import Plant, PlantParameters

START, END = radians(30.0), radians(146.0)
ARM = PlantParameters()
INERTIA = ARM.friction.inertia + ARM.arm_inertia
VISCOUS, COULOMB = ARM.friction.viscous, ARM.friction.coulomb
TICK = 0.001

Values = NDArray[np.float64]


def hand() -> SimulatedHand:
    return SimulatedHand(start=START, end=END, mean_speed=radians(92.0))


def commands() -> list[float]:
    """What was sent in each tick of one presentation, N·m."""
    clock = SimulatedClock()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with open_device("simulated", clock=clock, hand=hand()) as device:
        shown = run_presentation(
            device, controller, clock=clock, limits=DeviceLimits()
        ).recording
    return [float(torque) for torque in shown.columns["command_torque_nm"]]


def quantized(torque: float) -> float:
    return math.floor(torque / ARM.torque_step + 0.5) * ARM.torque_step


def felt(moved: SimulatedHand, time_s: float, angle: float, velocity: float) -> float:
    intended, speed = moved.intended(time_s)
    return moved.stiffness * (intended - angle) + moved.damping * (speed - velocity)


def chosen(torques: list[float], step_ns: int) -> Values:
    """The plant of the package -> what the hand feels at each tick, N·m."""
    parameters = PlantParameters(step_ns=step_ns)
    moved, plant = hand(), None
    plant = Plant(moved, parameters)
    out = np.empty(len(torques))
    for tick, torque in enumerate(torques):
        plant.advance(tick * 1_000_000)
        out[tick] = plant.hand_torque
        plant.command(torque, tick * 1_000_000)
    return out


@dataclass
class Arm:
    """The arm between two changes, as scipy's solver wants it."""

    moved: SimulatedHand
    slide: int = 0
    at_stop: bool = False
    target: float = 0.0  # what the motor is on its way to, N·m

    def net(self, time_s: float, y: Values) -> float:
        """All torques on the arm but Coulomb friction, N·m."""
        angle, velocity, motor = y
        net = felt(self.moved, time_s, angle, velocity) - motor - VISCOUS * velocity
        if self.at_stop:
            net += ARM.stop_stiffness * (ARM.range_end - angle)
            net -= ARM.stop_damping * velocity
        return net

    def slope(self, time_s: float, y: Values) -> list[float]:
        lag = (self.target - y[2]) / ARM.lag_time
        if self.slide == 0:
            return [0.0, 0.0, lag]
        return [y[1], (self.net(time_s, y) - self.slide * COULOMB) / INERTIA, lag]

    def events(self) -> tuple[Callable[[float, Values], float], ...]:
        """It turns, it breaks away, it meets or leaves the end stop."""

        def turn(_time_s: float, y: Values) -> float:
            return y[1] * self.slide if self.slide else 1.0

        def breaks(time_s: float, y: Values) -> float:
            return -1.0 if self.slide else abs(self.net(time_s, y)) - COULOMB

        def stop(_time_s: float, y: Values) -> float:
            return y[0] - ARM.range_end

        for event, direction in (
            (turn, -1),
            (breaks, 1),
            (stop, -1 if self.at_stop else 1),
        ):
            event.terminal, event.direction = True, direction
        return turn, breaks, stop

    def change(self, time_s: float, y: Values) -> None:
        """Stick, or slide to where it is pushed."""
        y[1] = 0.0
        net = self.net(time_s, y)
        holds = abs(net) <= COULOMB * (1.0 - 1e-12)
        self.slide = 0 if holds else (1 if net > 0.0 else -1)


def by_solve_ivp(torques: list[float], method: str, rtol: float) -> Values:
    """scipy's solver between two changes of the command, with events."""
    arm, state = Arm(hand()), np.array([START, 0.0, 0.0])
    out = np.empty(len(torques))
    for tick, torque in enumerate(torques):
        now = tick * TICK
        out[tick] = felt(arm.moved, now, state[0], state[1])
        state = _until(arm, state, now, now + ARM.delay, method, rtol)
        arm.target = quantized(torque)
        state = _until(arm, state, now + ARM.delay, now + TICK, method, rtol)
    return out


def _until(
    arm: Arm, state: Values, start: float, end: float, method: str, rtol: float
) -> Values:
    while start < end - 1e-15:
        made = solve_ivp(
            arm.slope,
            (start, end),
            state,
            method=method,
            rtol=rtol,
            atol=1e-3 * rtol,
            events=arm.events(),
        )
        state, start = made.y[:, -1].copy(), float(made.t[-1])
        if made.status != 1:
            break
        if made.t_events[2].size:
            arm.at_stop = not arm.at_stop
        if made.t_events[0].size or made.t_events[1].size:
            arm.change(start, state)
    return state
