"""What the loop writes during a presentation."""

import math
from array import array

import numpy as np
from numpy.typing import NDArray

from masrel.hess.limits import DeviceLimits
from masrel.hess.spool import N_COLUMNS, Spool

__all__ = ["Samples", "n_samples", "recorded_columns"]

Columns = dict[str, NDArray[np.float64]]


def n_samples(n_ticks: int, rate_hz: int, limits: DeviceLimits) -> int:
    """Return how many samples so many ticks can leave."""
    return n_ticks + math.ceil(limits.ramp_time * rate_hz) + 3


class Samples:
    """Columns allocated before the presentation, filled by index during it."""

    __slots__ = (
        "_angle",
        "_command",
        "_model",
        "_parts",
        "_phase",
        "_time",
        "_velocity",
        "_words",
        "n",
    )

    def __init__(self, capacity: int, spool: Spool | None = None) -> None:
        n_words = 1 + N_COLUMNS * capacity
        if spool is None:
            words: memoryview[float] = memoryview(array("d", bytes(8 * n_words)))
        else:
            words = spool.words
        self._words = words
        starts = range(1, n_words, max(capacity, 1))
        self._parts = [words[start : start + capacity] for start in starts]
        self._time, self._angle, self._velocity = self._parts[:3]
        self._model, self._command, self._phase = self._parts[3:]
        self.n = 0

    def add(
        self,
        time_s: float,
        angle: float,
        velocity: float,
        model_torque: float,
        command_torque: float,
        phase: int,
    ) -> None:
        """Write one sample; the columns must not be full."""
        n = self.n
        self._time[n] = time_s
        self._angle[n] = angle
        self._velocity[n] = velocity
        self._model[n] = model_torque
        self._command[n] = command_torque
        self._phase[n] = phase
        self.n = self._words[0] = n + 1  # last, so that what is counted is whole

    def replace_command(self, command_torque: float) -> None:
        """Write another torque into the last sample; nothing when there is none."""
        if self.n:
            self._command[self.n - 1] = command_torque

    @property
    def last_time_s(self) -> float:
        """Time of the last sample, s; minus infinity when there is none."""
        return self._time[self.n - 1] if self.n else -math.inf

    def columns(self) -> Columns:
        """Return copies of what was written, in the units of a recording."""
        # -> (n,)
        written = np.empty((N_COLUMNS, self.n))
        for row, part in zip(written, self._parts, strict=True):
            row[:] = part[: self.n]
        return recorded_columns(written)

    def close(self) -> None:
        """Let go of a spool's memory, so that it can be closed; nothing is left."""
        for part in self._parts:
            part.release()


def recorded_columns(written: NDArray[np.float64]) -> Columns:
    """Name what the loop wrote, in the units of a recording."""
    # written (6, n) -> (n,)
    time_s, angle, velocity, model, command, phase = written
    return {
        "time_s": time_s.copy(),
        "angle_deg": np.degrees(angle),
        "velocity_deg_s": np.degrees(velocity),
        "model_torque_nm": model.copy(),
        "command_torque_nm": command.copy(),
        "phase": phase.copy(),
    }
