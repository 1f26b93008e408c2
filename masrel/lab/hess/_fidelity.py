"""How near the torque that a device gives comes to the one that is asked for.

In: recordings of stretches, and of a loop in real time. Out: how far two torques are
apart, how late one follows the other, and how late ticks are.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from masrel.lab.hess._calibration import mean_of
from masrel.lab.recording import ESTIMATED_TORQUE, MEASURED_TORQUE, Recording

# Which torque is rendered, and which it is compared with. A sensor between motor and
# arm reads what the hand feels but for the arm; a board's own estimate is of its motor.
_COMPARED = {
    MEASURED_TORQUE: "model_torque_nm",
    ESTIMATED_TORQUE: "command_torque_nm",
}
_DELAYS_S = (-0.005, 0.05)


def rendered(recording: Recording) -> dict[str, float]:
    """Compare the torque of a stretch with the one that was asked for.

    Nothing is known of a device that neither measures nor estimates its torque.
    """
    channel = next((each for each in _COMPARED if each in recording.channels), None)
    if channel is None:
        return {}
    columns = {n: c[: recording.n_presented] for n, c in recording.columns.items()}
    time, felt = columns["time_s"], columns[channel.column]
    goal = columns[_COMPARED[channel]]
    difference = felt - goal
    velocity = np.radians(columns["velocity_deg_s"])
    friction = np.column_stack(
        [velocity, np.sign(velocity), np.gradient(velocity, time)]
    )
    rows = np.isfinite(felt)

    def square(delay: float) -> float:
        # What neither the torque sent so much earlier nor (7) explains
        sent = np.interp(time - delay, time, columns["command_torque_nm"])
        left = (felt - sent)[rows]
        moved = np.linalg.lstsq(friction[rows], left, rcond=None)[0]
        return float(np.sum((left - friction[rows] @ moved) ** 2))

    best = minimize_scalar(square, bounds=_DELAYS_S, method="bounded")
    return {
        "rmse_nm": math.sqrt(float(np.nanmean(difference**2))),
        "max_nm": float(np.nanmax(np.abs(difference))),
        "delay_ms": 1e3 * float(best.x),
        "peak_nm": float(np.abs(goal).max()),
    }


def compare_models(
    stretches: Sequence[Mapping[str, Any]],
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Return what the stretches of each model say together, and that in lines."""
    models: dict[str, dict[str, Any]] = {}
    lines = []
    for model in dict.fromkeys(each["model"] for each in stretches):
        of = [each for each in stretches if each["model"] == model and len(each) > 2]
        if not of:
            return {}, ["torque: the device neither measures nor estimates it"]
        rmse, delay = (mean_of([e[key] for e in of]) for key in ("rmse_nm", "delay_ms"))
        largest = max(each["max_nm"] for each in of)
        percent = 100.0 * rmse.value / max(each["peak_nm"] for each in of)
        models[model] = {"rmse_nm": rmse, "max_nm": largest, "percent_of_peak": percent}
        models[model]["delay_ms"] = delay
        lines.append(
            f"{model}: RMSE {rmse.value:.3f} [{rmse.low:.3f}, {rmse.high:.3f}] N·m, "
            f"{percent:.1f} % of the peak; at most {largest:.2f} N·m; "
            f"{delay.value:.2f} [{delay.low:.2f}, {delay.high:.2f}] ms late"
        )
    return models, lines


def lateness_ms(recordings: Sequence[Recording], rate_hz: int) -> NDArray[np.float64]:
    """Return how late each tick was, beside the promptest of its recording, ms."""
    times_ns = (np.rint(1e9 * each.columns["time_s"]) for each in recordings)
    late_ns = [np.mod(each, 1e9 / rate_hz) for each in times_ns]
    return 1e-6 * np.concatenate([each - each.min() for each in late_ns])
