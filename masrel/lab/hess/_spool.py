"""The samples of a presentation, in memory or in a file that outlives the process.

What the loop writes into a mapped file is in the system's hands at once, so that a
process that is killed in the middle of a presentation leaves every sample up to that
moment. The whole file is allocated before the first tick: a full disk is noticed before
anything moves.
"""

import json
import math
import mmap
from array import array
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from masrel._files import make_folder
from masrel.errors import ParameterError, RecordingError
from masrel.lab._bounded_files import MAX_RECORDING, parse_json, read_regular
from masrel.lab._durable_files import no_follow
from masrel.lab.hess.limits import DeviceLimits
from masrel.lab.recording import RECORDING_COLUMNS, Channel, _channels_of, _Fact

Columns = dict[str, NDArray[np.float64]]

_N_COLUMNS = len(RECORDING_COLUMNS)
_N_COLUMNS_ONCE = 6  # before the column `ramp`, and before they said how many
_HEADER = 4096  # bytes for the facts, a page
_WORD = 8  # bytes of a float64


def n_samples(n_ticks: int, rate_hz: int, limits: DeviceLimits) -> int:
    """Return how many samples so many ticks can leave."""
    ramps_s = limits.end_ramp_time + limits.ramp_time
    return n_ticks + math.ceil(ramps_s * rate_hz) + 4


class Spool:
    """The file, open for the samples of one presentation."""

    __slots__ = ("_map", "values")

    def __init__(
        self,
        path: Path,
        capacity: int,
        facts: dict[str, _Fact],
        channels: Sequence[Channel] = (),
    ) -> None:
        n_columns = _N_COLUMNS + len(channels)
        layout: dict[str, object] = {"capacity": capacity, "n_columns": n_columns}
        if channels:
            layout["channels"] = [asdict(channel) for channel in channels]
        header = json.dumps({**facts, **layout}).encode()
        if len(header) > _HEADER:
            raise ParameterError(
                f"channels: need names that fit into {_HEADER} bytes, "
                f"got {len(channels)} channels"
            )
        n_bytes = _HEADER + _WORD * (1 + n_columns * capacity)
        make_folder(path.parent)
        try:
            with open(path, "w+b", opener=no_follow) as file:
                file.write(header.ljust(_HEADER))
                file.write(bytes(n_bytes - _HEADER))  # not sparse: the space is taken
                file.flush()
                self._map = mmap.mmap(file.fileno(), n_bytes)
        except OSError as error:
            path.unlink(missing_ok=True)  # nothing was sampled
            error.filename = str(path)  # a full disk does not say which file it was
            raise
        self.values = memoryview(self._map)[_HEADER:].cast("d")

    def close(self) -> None:
        """Let go of the file; it stays where it is."""
        self.values.release()
        self._map.close()


class Samples:
    """Columns allocated before the presentation, filled by index during it."""

    __slots__ = (
        "_angle",
        "_columns",
        "_command",
        "_measured",
        "_model",
        "_phase",
        "_ramp",
        "_stretch",
        "_time",
        "_values",
        "_velocity",
        "channels",
        "n",
    )

    def __init__(
        self,
        capacity: int,
        spool: Spool | None = None,
        channels: Sequence[Channel] = (),
    ) -> None:
        self.channels = tuple(channels)
        # How many samples there are, and after it column by column
        n_values = 1 + (_N_COLUMNS + len(channels)) * capacity
        if spool is None:
            values: memoryview[float] = memoryview(array("d", bytes(8 * n_values)))
        else:
            values = spool.values
        self._values = values
        starts = range(1, n_values, max(capacity, 1))
        self._columns = [values[start : start + capacity] for start in starts]
        self._time, self._angle, self._velocity = self._columns[:3]
        self._model, self._command, self._phase = self._columns[3:6]
        self._ramp, self._stretch = self._columns[6:_N_COLUMNS]
        self._measured = self._columns[_N_COLUMNS:]
        for column in self._measured:  # so that rows without a reading have no values
            column[:] = array("d", [math.nan]) * capacity
        self.n = 0

    def add(
        self,
        time_s: float,
        angle: float,
        velocity: float,
        model_torque: float,
        command_torque: float,
        phase: int,
        stretch: int,
    ) -> None:
        """Write one sample; the columns must not be full."""
        n = self.n
        self._time[n] = time_s
        self._angle[n] = angle
        self._velocity[n] = velocity
        self._model[n] = model_torque
        self._command[n] = command_torque
        self._phase[n] = phase
        self._stretch[n] = stretch
        self.n = self._values[0] = n + 1  # last, so that what is counted is complete

    def measure(self, values: Sequence[float]) -> None:
        """Write what the channels gave into the row that `add` writes next."""
        # Raises ValueError or TypeError where there is not a number for each.
        n = self.n
        for column, value in zip(self._measured, values, strict=True):
            column[n] = value

    def flag(self, ramp: int) -> None:
        """Say of the last sample that its torque is on a ramp."""
        if self.n:
            self._ramp[self.n - 1] = ramp

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
        written = np.empty((len(self._columns), self.n))
        for row, column in zip(written, self._columns, strict=True):
            row[:] = column[: self.n]
        return recorded_columns(written, self.channels)

    def close(self) -> None:
        """Let go of a spool's memory, so that it can be closed; nothing is left."""
        for column in self._columns:
            column.release()


def recorded_columns(
    written: NDArray[np.float64], channels: Sequence[Channel] = ()
) -> Columns:
    """Return what the loop wrote by name, in the units of a recording."""
    # written (n_columns, n) -> (n,)
    time_s, angle, velocity, model, command, phase, ramp, stretch, *measured = written
    columns = {
        "time_s": time_s.copy(),
        "angle_deg": np.degrees(angle),
        "velocity_deg_s": np.degrees(velocity),
        "model_torque_nm": model.copy(),
        "command_torque_nm": command.copy(),
        "phase": phase.copy(),
        "ramp": ramp.copy(),
        "stretch": _from_the_onset(stretch, velocity),
    }
    for channel, values in zip(channels, measured, strict=True):
        # What is infinite is no measurement either
        columns[channel.column] = np.where(np.isfinite(values), values, np.nan)
    return columns


def _from_the_onset(
    stretch: NDArray[np.float64], velocity: NDArray[np.float64]
) -> NDArray[np.float64]:
    # stretch, velocity (n,) -> (n,): the loop knows that the arm is stretched when it
    # has gone some way; a stretch began where the arm began to go it
    complete = stretch.copy()
    for start in np.flatnonzero(np.diff(stretch, prepend=0.0) > 0.0).tolist():
        onset = start
        while onset and complete[onset - 1] == 0.0 and velocity[onset - 1] > 0.0:
            onset -= 1
        complete[onset:start] = stretch[start]
    return complete


@dataclass(frozen=True, slots=True, kw_only=True)
class Spooled:
    """What a presentation that never ended left."""

    columns: NDArray[np.float64]  # (n_columns, n): its samples, as the loop wrote them
    channels: tuple[Channel, ...]
    facts: dict[str, _Fact]  # what was known before the first


def read_spool(path: Path) -> Spooled | None:
    """Return the samples that a dead process left; None when it left none."""
    data = read_regular(path, most=MAX_RECORDING + _HEADER)
    if len(data) < _HEADER + _WORD or not data[:_HEADER].strip():
        return None  # it died while it allocated the file
    try:
        return _spooled(parse_json(data[:_HEADER]), data)
    except (ValueError, KeyError, TypeError) as error:
        raise RecordingError(
            f"{path}: needs the samples of a presentation that was cut off, got "
            f"something else ({error}); move it away to go on"
        ) from error


def _spooled(facts: dict[str, _Fact], data: bytes) -> Spooled | None:
    # Raises ValueError, KeyError or TypeError where it is no such file.
    if not isinstance(facts, dict):
        raise TypeError(f"no facts but {facts}")
    capacity, rate_hz = facts.pop("capacity"), facts["rate_hz"]
    channels = _channels_of(facts.pop("channels", []))
    n_columns = int(facts.pop("n_columns", _N_COLUMNS_ONCE) or 0)
    if "speed_threshold" in facts:  # as it was once
        once = float(facts.pop("speed_threshold") or 0.0)
        facts["speed_threshold_deg_s"] = math.degrees(once)
    threshold = facts["speed_threshold_deg_s"]
    if not isinstance(capacity, int) or capacity < 1:
        raise ValueError(f"a capacity of {capacity}")
    for fact in (rate_hz, threshold):
        if not isinstance(fact, int | float):
            raise TypeError(f"{fact!r} where a number should be")
    n = float(np.frombuffer(data, np.float64, count=1, offset=_HEADER)[0])
    if n == 0.0:
        return None  # not one sample, whether the file is complete or not
    if not (n.is_integer() and 0.0 < n <= capacity):
        raise ValueError(f"{n:g} samples where {capacity} fit in")
    values = np.frombuffer(
        data, np.float64, count=n_columns * capacity, offset=_HEADER + _WORD
    )
    columns = np.zeros((max(n_columns, _N_COLUMNS), int(n)))
    columns[RECORDING_COLUMNS.index("stretch")] = 1.0  # as without such a column
    columns[:n_columns] = values.reshape(n_columns, capacity)[:, : int(n)]
    return Spooled(columns=columns, channels=channels, facts=facts)
