"""The samples of a presentation, and what is made of them: recording, facts, fault.

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
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from masrel._files import make_folder
from masrel.errors import ParameterError, RecordingError
from masrel.lab._study_files import (
    MAX_RECORDING,
    Fact,
    no_follow,
    parse_json,
    read_regular,
)
from masrel.lab.recording import (
    MEASURED_TORQUE,
    RAMPS,
    RECORDING_COLUMNS,
    Channel,
    Recording,
    _channels_of,
    _Floats,
    _main_stretch,
)

Columns = dict[str, _Floats]

_N_COLUMNS = len(RECORDING_COLUMNS)
_N_COLUMNS_ONCE = 6  # before the column `ramp`, and before they said how many
_COMMAND, _RAMP = map(RECORDING_COLUMNS.index, ("command_torque_nm", "ramp"))
_HEADER = 4096  # bytes for the facts, a page
_WORD = 8  # bytes of a float64

_FAULT = RAMPS.index("fault")

# A sensor is stuck, or at the end of its range, that gives one number to the last bit
# for so long while the torque that is sent changes by so much; what it is still on its
# way to at the end of that time does not count.
_STUCK_S = 0.1
_STUCK_NM = 1.0
_LAG_S = 0.01


class Samples:
    """Columns allocated before the presentation, filled by index during it."""

    # In memory, or in a file that stays where it is when they are closed

    def __init__(
        self,
        capacity: int,
        channels: Sequence[Channel] = (),
        *,
        file: Path | None = None,
        facts: dict[str, Fact] | None = None,
    ) -> None:
        self.channels = tuple(channels)
        self.n = 0
        n_columns = _N_COLUMNS + len(channels)
        # How many samples there are, and after it column by column
        n_values = 1 + n_columns * capacity
        layout: dict[str, object] = {"capacity": capacity, "n_columns": n_columns}
        if channels:
            layout["channels"] = [asdict(channel) for channel in channels]
        header = json.dumps({**(facts or {}), **layout}).encode()
        if len(header) > _HEADER:
            raise ParameterError(
                f"channels: need names that fit into {_HEADER} bytes, "
                f"got {len(channels)} channels"
            )
        self._map = _laid_down(file, header, _HEADER + _WORD * n_values)
        self._values = values = memoryview(self._map)[_HEADER:].cast("d")
        starts = range(1, n_values, max(capacity, 1))
        self._columns = [values[start : start + capacity] for start in starts]
        self._written = self._columns[:_N_COLUMNS]
        self._measured = self._columns[_N_COLUMNS:]
        for column in self._measured:  # so that rows without a reading have no values
            column[:] = array("d", [math.nan]) * capacity

    def add(self, row: tuple[float, ...]) -> None:
        """Write one sample, a number for each column; they must not be full."""
        # Unpacked, for a loop over the columns would take twice as long
        n = self.n
        time, angle, velocity, model, command, phase, ramp, stretch = self._written
        time[n], angle[n], velocity[n], model[n] = row[:4]
        command[n], phase[n], ramp[n], stretch[n] = row[4:]
        self.n = self._values[0] = n + 1  # last, so that what is counted is complete

    def measure(self, values: Sequence[float]) -> None:
        """Write what the channels gave into the row that `add` writes next."""
        # Raises ValueError or TypeError where there is not a number for each.
        for column, value in zip(self._measured, values, strict=True):
            column[self.n] = value

    def change_last(self, command_torque: float, ramp: int) -> None:
        """Write another torque and its ramp into the last sample, if there is one."""
        if self.n:
            self._columns[_COMMAND][self.n - 1] = command_torque
            self._columns[_RAMP][self.n - 1] = ramp

    @property
    def last_time_s(self) -> float:
        """Time of the last sample, s; minus infinity when there is none."""
        return self._columns[0][self.n - 1] if self.n else -math.inf

    def columns(self) -> Columns:
        """Return copies of what was written, in the units of a recording."""
        written = np.array([column[: self.n] for column in self._columns])
        return recorded_columns(written, self.channels)

    def close(self) -> None:
        """Let go of the memory, and of the file."""
        for view in (*self._columns, self._values):
            view.release()
        self._map.close()


def _laid_down(file: Path | None, header: bytes, n_bytes: int) -> mmap.mmap:
    # All of it, in memory or on disk, before anything moves
    if file is None:
        return mmap.mmap(-1, n_bytes)
    make_folder(file.parent)
    try:
        with open(file, "w+b", opener=no_follow) as opened:
            opened.write(header.ljust(_HEADER))
            opened.write(bytes(n_bytes - _HEADER))  # not sparse: the space is taken
            opened.flush()
            return mmap.mmap(opened.fileno(), n_bytes)
    except OSError as error:
        file.unlink(missing_ok=True)  # nothing was sampled
        error.filename = str(file)  # a full disk does not say which file it was
        raise


def recorded_columns(written: _Floats, channels: Sequence[Channel] = ()) -> Columns:
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


def _from_the_onset(stretch: _Floats, velocity: _Floats) -> _Floats:
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
class Fault:
    """What stopped a presentation.

    Attributes
    ----------
    kind : str
        One word: a limit such as ``"torque"``, ``"frozen"`` or ``"overrun"``,
        ``"no-answer"``, ``"device"``, ``"model"``, ``"controller"`` or
        ``"emergency-stop"``.
    message : str
        What was needed and what came.
    time_s : float
        When it was noticed, s since the presentation began.
    torque_nm : float
        The torque that the device held then, N·m.
    """

    kind: str
    message: str
    time_s: float
    torque_nm: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Presented:
    """One presentation, as it went.

    Attributes
    ----------
    recording : Recording
        Every tick that was run; its facts repeat the fields below.
    fault : Fault or None
        What stopped it; None when nothing did.
    n_missed_ticks : int
        Ticks skipped because the loop came too late for them.
    """

    recording: Recording
    fault: Fault | None
    n_missed_ticks: int


def cut_off(spool: Path) -> Presented | None:
    """Read what a presentation left whose process died.

    Parameters
    ----------
    spool : Path
        The file that `run_presentation` kept its samples in.

    Returns
    -------
    Presented or None
        Its recording, with a fault that says so; None when it had not begun.

    Raises
    ------
    RecordingError
        If it is not such a file.
    """
    data = read_regular(spool, most=MAX_RECORDING + _HEADER)
    if len(data) < _HEADER + _WORD or not data[:_HEADER].strip():
        return None  # it died while it allocated the file
    try:
        facts = parse_json(data[:_HEADER])
        if not isinstance(facts, dict):
            raise TypeError(f"no facts but {facts}")
        channels = _channels_of(facts.pop("channels", []))
        written = _written(facts, data)
        columns = recorded_columns(written, channels)
    except (ValueError, KeyError, TypeError) as error:
        raise RecordingError(
            f"{spool}: needs the samples of a presentation that was cut off, got "
            f"something else ({error}); move it away to go on"
        ) from error
    time_s = columns["time_s"]
    if not time_s.size:
        return None  # not one sample, whether the file is complete or not
    fault = Fault(
        kind="process",
        message="process: needs one that keeps its recording, this one ended before",
        time_s=float(time_s[-1]),
        torque_nm=float(columns["command_torque_nm"][-1]),
    )
    # What is missing between the first and the last tick; nobody counted why
    n_due = round(float(np.ptp(time_s)) * float(facts["rate_hz"] or 0))
    return as_presented(
        columns,
        {**facts, "scheduling": None},
        channels=channels,
        ended="fault",
        fault=fault,
        grip_lost=None,
        n_missed_ticks=max(0, n_due + 1 - time_s.size),  # a ramp adds rows
        n_missed_replies=None,
    )


def _written(facts: dict[str, Fact], data: bytes) -> _Floats:
    # -> (n_columns, n): the samples, as the loop wrote them; `facts` without what is of
    # the file. Raises ValueError, KeyError or TypeError where it is no such file.
    capacity, rate_hz = facts.pop("capacity"), facts["rate_hz"]
    n_columns = int(facts.pop("n_columns", _N_COLUMNS_ONCE) or 0)
    if "speed_threshold" in facts:  # as it was once
        once = float(facts.pop("speed_threshold") or 0.0)
        facts["speed_threshold_deg_s"] = math.degrees(once)
    if not isinstance(capacity, int) or capacity < 1:
        raise ValueError(f"a capacity of {capacity}")
    for fact in (rate_hz, facts["speed_threshold_deg_s"]):
        if not isinstance(fact, int | float):
            raise TypeError(f"{fact!r} where a number should be")
    n = float(np.frombuffer(data, np.float64, count=1, offset=_HEADER)[0])
    if not (n.is_integer() and 0.0 <= n <= capacity):
        raise ValueError(f"{n:g} samples where {capacity} fit in")
    columns = np.zeros((max(n_columns, _N_COLUMNS), int(n)))
    columns[RECORDING_COLUMNS.index("stretch")] = 1.0  # as without such a column
    if n:
        count, offset = n_columns * capacity, _HEADER + _WORD
        values = np.frombuffer(data, np.float64, count=count, offset=offset)
        columns[:n_columns] = values.reshape(n_columns, capacity)[:, : int(n)]
    return columns


def as_presented(
    columns: Columns,
    facts: dict[str, Fact],
    *,
    channels: tuple[Channel, ...] = (),
    ended: str,
    fault: Fault | None,
    grip_lost: bool | None,
    n_missed_ticks: int,
    n_missed_replies: int | None,
) -> Presented:
    """Add what is known of a presentation once it is over; None for what is not."""
    facts = {
        **facts,
        "n_missed_ticks": n_missed_ticks,
        "n_missed_replies": n_missed_replies,
        "fault": fault.message if fault else None,
        "fault_kind": fault.kind if fault else None,
        "fault_time_s": fault.time_s if fault else None,
        "fault_torque_nm": fault.torque_nm if fault else None,
        "ended": ended,
        "grip_lost": grip_lost,
        **_channel_facts(columns, channels),
    }
    recording = Recording(columns=columns, facts=facts, channels=channels)
    felt = _main_stretch(recording)
    of_the_stretch: dict[str, Fact] = {
        "phases": "" if felt is None else ", ".join(felt.phases),
        "catch_angle_deg": None if felt is None else felt.catch_angle_deg,
        "mean_speed_deg_s": None if felt is None else felt.mean_speed_deg_s,
    }
    return Presented(
        recording=replace(recording, facts={**facts, **of_the_stretch}),
        fault=fault,
        n_missed_ticks=n_missed_ticks,
    )


def _channel_facts(columns: Columns, channels: tuple[Channel, ...]) -> dict[str, Fact]:
    # how many numbers each channel missed, and in words what failed: looked at once it
    # is over, for the loop does not act on channels
    if not channels:
        return {}
    read = columns["ramp"] != _FAULT  # the ramp after a fault has no readings
    n_read = int(np.count_nonzero(read))
    facts: dict[str, Fact] = {}
    faults = []
    for channel in channels:
        name = channel.column
        n_missing = int(np.count_nonzero(np.isnan(columns[name][read])))
        facts[f"n_missing_{name}"] = n_missing
        if n_missing:
            faults.append(f"{name}: no number in {n_missing} of {n_read} samples")
    if MEASURED_TORQUE in channels:
        faults += _stuck({name: column[read] for name, column in columns.items()})
    facts["channel_faults"] = "; ".join(faults) or None
    return facts


def _stuck(columns: Columns) -> list[str]:
    # where the torque sensor stays while the torque does not
    time, sent = columns["time_s"], columns["command_torque_nm"]
    name = MEASURED_TORQUE.column
    starts = np.flatnonzero(np.diff(columns[name], prepend=np.nan) != 0.0).tolist()
    worst = (0.0, 0, 0)  # change, N·m, in samples from one to before another
    for first, after in pairwise([*starts, time.size]):  # a run of equal numbers
        ends_s = time[after - 1]
        if ends_s - time[first] >= _STUCK_S:
            last = int(np.searchsorted(time, ends_s - _LAG_S, side="right"))
            worst = max(worst, (float(np.ptp(sent[first:last])), first, last))
    change, first, last = worst
    if change <= _STUCK_NM:
        return []
    return [
        f"{name}: stays at {columns[name][first]:.2f} N·m for "
        f"{time[last] - time[first]:.2f} s while the torque that is sent changes by "
        f"{change:.2f} N·m"
    ]
