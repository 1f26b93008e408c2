"""The joint model as an ODE with events, for `scipy.integrate.solve_ivp`.

The states are the angle, the work and the impulse; integration stops at every event of
Fig. 7 and goes on with the next law. One stretch in extension, without inertia.
"""

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from masrel.lab.elbow import ElbowParameters, Motion

State = np.ndarray
Law = Callable[[float, State], float]


class Ode:
    """A stretch integrated from event to event."""

    def __init__(
        self,
        joint: ElbowParameters,
        motion: Motion,
        *,
        rtol: float,
    ) -> None:
        self.joint, self.motion, self.rtol = joint, motion, rtol
        self.found: dict[str, float] = {}
        self.time, self.state = 0.0, np.array([motion.start, 0.0, 0.0])
        self.stretch()

    def speed(self, t: float) -> float:
        return float(self.motion.velocity(min(t, self.motion.duration)))

    def pre_catch(self, t: float, y: State) -> float:
        rest = self.motion.start
        return self.joint.damping * self.speed(t) + self.joint.stiffness * (y[0] - rest)

    def run(self, law: Law, name: str, condition: Law) -> bool:
        """Integrate until the condition is above 0, or to the end of the motion."""
        if condition(self.time, self.state) > 0.0:
            self.found[name] = self.time
            return True

        def slope(t: float, y: State) -> list[float]:
            tau, speed = law(t, y), self.speed(t)
            return [speed, tau * speed, tau]

        def event(t: float, y: State) -> float:
            return condition(t, y)

        event.terminal, event.direction = True, 1.0  # type: ignore[attr-defined]
        done = solve_ivp(
            slope, (self.time, self.motion.duration), self.state, method="RK45",
            rtol=self.rtol, atol=0.1 * self.rtol, events=event,
        )  # fmt: skip
        self.time, self.state = float(done.t[-1]), done.y[:, -1]
        if done.t_events[0].size:
            self.found[name] = self.time
            return True
        return False

    def stretch(self) -> None:
        threshold = self.joint.speed_threshold
        if not self.run(
            self.pre_catch, "onset", lambda t, _: self.speed(t) - threshold + 1e-15
        ):
            return
        onset, first = self.time, self.state[0]

        def beyond(t: float, y: State) -> float:
            since = t - onset
            mean = (y[0] - first) / since if since > 1e-9 else self.speed(t)
            return y[0] - self.joint.catch_angle(mean)

        if self.run(self.pre_catch, "catch", beyond):
            self.caught()

    def caught(self) -> None:
        joint, angle = self.joint, self.state[0]
        rise = joint.catch_torque_constant * self.speed(self.time)
        base = self.pre_catch(self.time, self.state)
        residual = base + joint.residual_ratio * rise
        until = self.time + joint.peak_duration

        def travelled(_: float, y: State) -> float:
            return y[0] - angle - joint.catch_travel

        def peak_over(t: float, y: State) -> float:
            return max(t - until, travelled(t, y))

        self.run(lambda *_: base + rise, "peak_end", peak_over)
        if not self.run(lambda *_: residual, "catch_end", travelled):
            return
        post = self.state[0]

        def climb(_: float, y: State) -> float:
            return residual + joint.post_catch_stiffness * (y[0] - post)

        slow = joint.speed_threshold - 1e-15
        if self.run(climb, "post_catch_end", lambda t, _: slow - self.speed(t)):
            self.run(self.pre_catch, "never", lambda *_: -1.0)
