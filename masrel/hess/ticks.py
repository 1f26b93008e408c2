"""The ticks of one presentation: pace, and what happens at each of them."""

import math

from masrel.errors import DeviceError
from masrel.hess.clock import Clock
from masrel.hess.controller import Controller
from masrel.hess.device import Device
from masrel.hess.limits import DeviceLimits
from masrel.hess.samples import Samples
from masrel.hess.velocity import VelocityEstimate

__all__ = ["Ticks"]

# A hand that presses against the end stop rests within a few tenths of a degree of
# it; one encoder step makes 0.8 deg/s; 0.1 s is shorter than a person's reaction.
_ARRIVAL_TOLERANCE = math.radians(3.0)
_ARRIVAL_SPEED = math.radians(5.0)
_ARRIVAL_TIME_S = 0.1


class Ticks:
    """The loop proper, in plain numbers: a numpy scalar would cost more than a tick.

    Parameters
    ----------
    device : Device
        An open device.
    controller : Controller
        A controller that has not been stepped.
    clock : Clock
        The clock of the device.
    limits : DeviceLimits
        What the loop lets pass.
    rate_hz : int
        Ticks a second.
    n_ticks : int
        Ticks after which the presentation ends.
    end_angle : float
        Where the stretch is meant to end, rad.

    Attributes
    ----------
    samples : Samples
        One per tick that was run.
    n_missed : int
        Ticks that were skipped.
    """

    __slots__ = (
        "_clock",
        "_controller",
        "_device",
        "_end_angle",
        "_estimate",
        "_latest",
        "_limits",
        "_n_ticks",
        "_period_ns",
        "_start_ns",
        "n_missed",
        "samples",
    )

    def __init__(
        self,
        device: Device,
        controller: Controller,
        clock: Clock,
        limits: DeviceLimits,
        rate_hz: int,
        n_ticks: int,
        end_angle: float,
    ) -> None:
        self._device = device
        self._controller = controller
        self._clock = clock
        self._limits = limits
        self._n_ticks = n_ticks
        self._period_ns = round(1e9 / rate_hz)
        self._end_angle = end_angle - _ARRIVAL_TOLERANCE
        self._estimate = VelocityEstimate()
        self._start_ns = 0
        self._latest: tuple[float, float, float] | None = None
        self.n_missed = 0
        self.samples = Samples(n_ticks + 1)  # one more to mark a fault

    def run(self) -> str:
        """Run ticks until the end, however it comes.

        Returns
        -------
        str
            "arrived" or "max-duration".

        Raises
        ------
        DeviceError
            If the device fails or a limit is exceeded.
        """
        self._start_ns = self._clock.now_ns()
        resting_since = math.inf
        tick = 0
        while tick < self._n_ticks:
            time_s, angle, velocity = self._tick()
            if angle < self._end_angle or abs(velocity) > _ARRIVAL_SPEED:
                resting_since = math.inf
            elif resting_since == math.inf:
                resting_since = time_s
            elif time_s - resting_since >= _ARRIVAL_TIME_S:
                return "arrived"
            tick = self._wait_for(tick + 1)
        return "max-duration"

    def _wait_for(self, tick: int) -> int:
        # Sleeps until the tick is due -> the tick that is due then. Those whose time
        # is over are skipped and counted: sent late, they would come in a burst.
        due_ns = self._start_ns + tick * self._period_ns  # absolute: no drift
        self._clock.sleep_until_ns(due_ns)
        n_skipped = (self._clock.now_ns() - due_ns) // self._period_ns
        if n_skipped <= 0:
            return tick
        self.n_missed += n_skipped
        self._limits.check_missed(self.n_missed)
        return tick + n_skipped

    def _tick(self) -> tuple[float, float, float]:
        # Read, estimate, check, decide, send, record -> time s, angle, speed
        time_ns, angle = self._device.read()
        time_s = (time_ns - self._start_ns) * 1e-9
        if self._latest is not None and time_s <= self._latest[0]:
            raise DeviceError(
                f"reading: needs one newer than the last, of {self._latest[0]:.6f} s, "
                f"got one of {time_s:.6f} s"
            )
        velocity = self._estimate.update(time_s, angle)
        self._latest = latest = (time_s, angle, velocity)
        self._limits.check_motion(angle, velocity)
        controller = self._controller
        torque = controller.step(time_s, angle, velocity)
        self._limits.check_torque(torque)
        self._device.command(torque)
        self.samples.add(
            time_s, angle, velocity, controller.model_torque, torque, controller.phase
        )
        return latest

    def mark_fault(self) -> None:
        """Add a last sample: where the arm was seen last, with zero torque."""
        time_s = (self._clock.now_ns() - self._start_ns) * 1e-9
        if self._latest is None or time_s <= self.samples.last_time_s:
            return
        _, angle, velocity = self._latest
        controller = self._controller
        torque, phase = controller.model_torque, controller.phase
        self.samples.add(time_s, angle, velocity, torque, 0.0, phase)
