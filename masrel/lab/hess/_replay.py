"""A device that plays a recording back: the same readings, for any controller."""

import copy
import math
from dataclasses import dataclass

import numpy as np

from masrel.errors import DeviceError
from masrel.lab.hess._clock import Clock
from masrel.lab.hess._signals import VelocityEstimate
from masrel.lab.hess.device import BackendOptions, Device, DeviceSetup, Reading
from masrel.lab.recording import Recording


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayOptions(BackendOptions):
    """What `open_device` needs to play a recording back.

    Attributes
    ----------
    recording : Recording
        A recording of any device.
    """

    recording: Recording


class ReplayDevice(Device):
    """Give the readings of a recording one after the other, and take any torque."""

    # Every reading puts a simulated clock forward to the time of the recorded one; on a
    # real clock it waits for it, and the time between reading and tick is what the
    # machine makes of it. Of a gap in the recording all ticks but one are missed again.
    # After a fault the recording holds no readings any more, and so it ends there.

    name = "replay"
    simulated = is_replay = True

    def __init__(self, recording: Recording, *, clock: Clock) -> None:
        columns = recording.columns
        # Rows from a fault on are the torque being taken back, without readings.
        noticed_s, n_readings = recording.facts.get("fault_time_s"), recording.n_samples
        if isinstance(noticed_s, float):
            n_readings = int(np.searchsorted(columns["time_s"], noticed_s))
        times = columns["time_s"][:n_readings]
        if n_readings == 0 or np.any(np.diff(times) <= 0.0) or times[0] < 0.0:
            raise DeviceError(
                "replay: needs a recording with readings whose times grow from 0, "
                f"got {n_readings} readings"
            )
        self._clock = clock
        times_ns = [round(time * 1e9) for time in times.tolist()]
        angles = _as_read(
            [time_ns * 1e-9 for time_ns in times_ns],
            columns["angle_deg"][:n_readings].tolist(),
            columns["velocity_deg_s"][:n_readings].tolist(),
        )
        self.channels = recording.channels
        # What the channels gave, reading by reading
        rows = (columns[each.column][:n_readings].tolist() for each in self.channels)
        values = list(zip(*rows, strict=True)) or [()] * n_readings
        self._readings = map(Reading, times_ns, angles, values)  # times from 0 on
        self._start_ns: int | None = None

    def _start(self) -> None:
        """Nothing to take hold of."""

    def _read(self) -> Reading:
        if self._start_ns is None:
            self._start_ns = self._clock.now_ns()
        reading = next(self._readings, None)
        if reading is None:
            raise DeviceError("replay: the recording has no more readings")
        time_ns = self._start_ns + reading.time_ns
        self._clock.sleep_until_ns(time_ns)
        return reading._replace(time_ns=time_ns)

    def _send(self, torque_nm: float) -> None:
        """Move nothing: what the arm did is recorded."""

    def _stop(self) -> None:
        """Nothing to let go of."""


def build(setup: DeviceSetup) -> ReplayDevice:
    """Make a device that plays a recording back."""
    options = setup.options
    if not isinstance(options, ReplayOptions):
        got = "none" if options is None else type(options).__name__
        raise DeviceError(f"replay: needs options of type ReplayOptions, got {got}")
    return ReplayDevice(options.recording, clock=setup.clock)


def _as_read(
    times_s: list[float], angles_deg: list[float], velocities_deg_s: list[float]
) -> list[float]:
    # The angles as they were read, rad: to the last bit, where the speed beside them
    # was estimated from them. A recording keeps angles in degrees, and from radians to
    # degrees and back a float may end one last bit aside. One last bit of an angle is
    # many of a speed over 1 ms, so that the first angle decides on all others.
    rows = list(zip(times_s, angles_deg, velocities_deg_s, strict=True))
    for first in _radians_of(angles_deg[0]):
        angles = _from_the_first(first, rows)
        if len(angles) == len(rows):
            return angles
    return [math.radians(angle) for angle in angles_deg]


def _from_the_first(
    first: float, rows: list[tuple[float, float, float]]
) -> list[float]:
    # As many angles as give the speeds that are recorded
    estimate, angles = VelocityEstimate(), [first]
    estimate.update(rows[0][0], first)
    for time_s, angle_deg, velocity in rows[1:]:
        for angle in _radians_of(angle_deg):
            updated = copy.copy(estimate)
            if _degrees(updated.update(time_s, angle)) == velocity:
                angles.append(angle)
                estimate = updated
                break
        else:
            break
    return angles


def _radians_of(angle_deg: float) -> list[float]:
    # Every float whose degrees are these, the nearest first: a degree is 57 of a
    # radian, so that up to two neighbours may share them.
    nearest = math.radians(angle_deg)
    lower, upper = math.nextafter(nearest, -math.inf), math.nextafter(nearest, math.inf)
    return [angle for angle in (nearest, lower, upper) if _degrees(angle) == angle_deg]


def _degrees(angle: float) -> float:
    return float(np.degrees(angle))  # as the recording was made
