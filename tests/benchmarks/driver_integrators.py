"""The simulated arm by three integrators: time against error, on one stretch.

The commands of one presentation of HM3 are put to the same arm and hand again and
again. What is right is scipy's DOP853 at rtol 1e-12, with the arm's turns, sticking,
breaking away and end stop located as events.
"""

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from masrel.lab.hess import SimulatedHand
from masrel.lab.hess._simulated import Plant, PlantParameters
from tests.lab.hess.rig import START, present, stretching

ARM = PlantParameters()
INERTIA = ARM.friction.inertia + ARM.arm_inertia
VISCOUS, COULOMB = ARM.friction.viscous, ARM.friction.coulomb
TICK = 0.001

Values = NDArray[np.float64]


def commands() -> list[float]:
    """What was sent in each tick of one presentation, N·m."""
    columns = present("HM3").recording.columns
    return [float(torque) for torque in columns["command_torque_nm"]]


def quantized(torque: float) -> float:
    return math.floor(torque / ARM.torque_step + 0.5) * ARM.torque_step


def felt(moved: SimulatedHand, time_s: float, angle: float, velocity: float) -> float:
    intended, speed = moved.intended(time_s)
    return moved.stiffness * (intended - angle) + moved.damping * (speed - velocity)


def chosen(torques: list[float], step_ns: int) -> Values:
    """The plant of the package -> what the hand feels at each tick, N·m."""
    parameters = PlantParameters(step_ns=step_ns)
    moved, plant = stretching(), None
    plant = Plant(moved, parameters)
    out = np.empty(len(torques))
    for tick, torque in enumerate(torques):
        plant.advance(tick * 1_000_000)
        out[tick] = plant.hand_torque
        plant.command(torque, tick * 1_000_000)
    return out


def semi_implicit_euler(torques: list[float], step: float) -> Values:
    """Speed first, then angle; the arm sticks where β can hold it."""
    moved = stretching()
    n = round(TICK / step)
    delay = round(ARM.delay / step)
    decay = math.exp(-step / ARM.lag_time)
    out = np.empty(len(torques))
    angle, velocity, motor, target = START, 0.0, 0.0, 0.0
    pending = 0.0
    for tick, torque in enumerate(torques):
        out[tick] = felt(moved, tick * TICK, angle, velocity)
        for part in range(n):
            if part == delay:
                target = pending
            if part == 0:
                pending = quantized(torque)
                if delay == 0:
                    target = pending
            time_s = tick * TICK + part * step
            motor = target + (motor - target) * decay
            force = felt(moved, time_s, angle, velocity) - motor - VISCOUS * velocity
            if angle > ARM.range_end:
                force += ARM.stop_stiffness * (ARM.range_end - angle)
                force -= ARM.stop_damping * velocity
            free = velocity + step * force / INERTIA
            brake = step * COULOMB / INERTIA
            velocity = math.copysign(max(abs(free) - brake, 0.0), free)
            angle += step * velocity
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
    arm, state = Arm(stretching()), np.array([START, 0.0, 0.0])
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


def timed(run: Callable[[], Values]) -> tuple[float, Values]:
    start = time.thread_time()  # of the processor: others work on this machine, too
    values = run()
    return time.thread_time() - start, values


def measured(
    reference_rtol: float = 1e-12, repeats: int = 5
) -> dict[str, list[tuple[float, float, float]]]:
    """Name -> (setting, seconds per simulated second, largest error N·m)."""
    torques = commands()
    right = by_solve_ivp(torques, "DOP853", reference_rtol)
    found: dict[str, list[tuple[float, float, float]]] = {}

    def add(name: str, setting: float, run: Callable[[], Values], n: int) -> None:
        took, values = min((timed(run) for _ in range(n)), key=lambda pair: pair[0])
        error = float(np.abs(values - right).max())
        found.setdefault(name, []).append(
            (setting, took / (len(torques) * TICK), error)
        )

    for step_ns in (1_000_000, 500_000, 250_000, 125_000, 62_500):
        add(
            "exact step",
            step_ns * 1e-9,
            lambda step_ns=step_ns: chosen(torques, step_ns),
            repeats,
        )
    for step_us in (500, 250, 125, 50, 20, 10, 5):
        add(
            "semi-implicit Euler",
            step_us * 1e-6,
            lambda step_us=step_us: semi_implicit_euler(torques, step_us * 1e-6),
            3,
        )
    for method, rtol in itertools.product(("RK45", "LSODA"), (1e-3, 1e-5, 1e-7, 1e-9)):
        add(
            f"solve_ivp {method}",
            rtol,
            lambda method=method, rtol=rtol: by_solve_ivp(torques, method, rtol),
            1,
        )
    return found


if __name__ == "__main__":
    for name, points in measured().items():
        for setting, seconds, error in points:
            print(f"{name:22} {setting:8.2g}  {seconds:9.5f} s/s  {error:.2e} N·m")
