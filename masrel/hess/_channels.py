"""What is wrong with what a device's channels gave during a presentation.

Looked at once it is over: the loop does not act on channels, and a presentation has
its grade without them. In: the columns. Out: facts.
"""

import numpy as np
from numpy.typing import NDArray

from masrel.hess._spool import Columns
from masrel.recording import MEASURED_TORQUE, RAMPS, Channel, _Fact

_FAULT = RAMPS.index("fault")

# A sensor is stuck, or at the end of its range, that gives one number to the last bit
# for so long while the torque that is sent changes by so much; what it is still on its
# way to at the end of that time does not count.
_STUCK_S = 0.1
_STUCK_NM = 1.0
_LAG_S = 0.01


def channel_facts(columns: Columns, channels: tuple[Channel, ...]) -> dict[str, _Fact]:
    """Return how many numbers each channel missed, and in words what failed."""
    if not channels:
        return {}
    read = columns["ramp"] != _FAULT  # the ramp after a fault has no readings
    n_read = int(np.count_nonzero(read))
    facts: dict[str, _Fact] = {}
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
    worst = max(
        (
            (float(np.ptp(sent[first:last])), first, last)
            for first, last in _long_runs(time, columns[name])
        ),
        default=(0.0, 0, 0),
    )
    change, first, last = worst
    if change <= _STUCK_NM:
        return []
    return [
        f"{name}: stays at {columns[name][first]:.2f} N·m for "
        f"{time[last] - time[first]:.2f} s while the torque that is sent changes by "
        f"{change:.2f} N·m"
    ]


def _long_runs(
    time: NDArray[np.float64], values: NDArray[np.float64]
) -> list[tuple[int, int]]:
    # first sample of each long run of equal numbers, and where its last moment begins
    starts = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    lasts = np.append(starts, values.size)[1:] - 1
    runs = []
    for first, last in zip(starts.tolist(), lasts.tolist(), strict=True):
        if time[last] - time[first] >= _STUCK_S:
            shorter = np.searchsorted(time, time[last] - _LAG_S, side="right")
            runs.append((first, int(shorter)))
    return runs
