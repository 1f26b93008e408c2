"""What a recording says of the movement: its phases, its catch, its mean speed."""

import math

import numpy as np
from numpy.typing import NDArray

from masrel.recording import PHASES

__all__ = ["catch_angle_deg", "mean_speed_deg_s", "movement_facts", "phase_sequence"]

Columns = dict[str, NDArray[np.float64]]

_CATCH = PHASES.index("catch")


def movement_facts(
    columns: Columns, speed_threshold: float, stopped: bool
) -> dict[str, str | float | None]:
    """Return what a recording's facts say of the movement."""
    caught = catch_angle_deg(columns)
    whole = not stopped or caught is not None
    return {
        "phases": ", ".join(phase_sequence(columns)),
        "catch_angle_deg": caught,
        "mean_speed_deg_s": (
            mean_speed_deg_s(columns, speed_threshold) if whole else None
        ),
    }


def phase_sequence(columns: Columns) -> tuple[str, ...]:
    """Return the names of the phases in the order they came."""
    codes = columns["phase"].astype(np.int64)
    if codes.size == 0:
        return ()
    changes = np.flatnonzero(np.diff(codes)) + 1
    return tuple(PHASES[codes[index]] for index in (0, *changes))


def catch_angle_deg(columns: Columns) -> float | None:
    """Return the angle where the first catch began."""
    caught = np.flatnonzero(columns["phase"] == _CATCH)
    return float(columns["angle_deg"][caught[0]]) if caught.size else None


def mean_speed_deg_s(columns: Columns, speed_threshold: float) -> float | None:
    """Return the mean speed before the catch, as Table V reports it."""
    # Angle travelled over time, deg/s, from the onset to the first catch: v̄ of (2). An
    # arm that was slower than ν_th in between has begun anew. Without a catch, from the
    # first to the last sample at ν_th or above; None without extension.
    moving = columns["velocity_deg_s"] >= math.degrees(speed_threshold)
    caught = np.flatnonzero(columns["phase"] == _CATCH)
    if caught.size:
        last = int(caught[0])
        slower = np.flatnonzero(~moving[:last])
        onset = int(slower[-1]) + 1 if slower.size else 0
    else:
        fast = np.flatnonzero(moving)
        onset, last = (int(fast[0]), int(fast[-1])) if fast.size else (0, 0)
    if last <= onset:
        return None
    travel = columns["angle_deg"][last] - columns["angle_deg"][onset]
    return float(travel / (columns["time_s"][last] - columns["time_s"][onset]))
