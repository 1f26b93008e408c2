"""What the session log keeps of a fault: its name and the last 200 ms before it."""

from dataclasses import dataclass

import numpy as np

from masrel.hess import Presented
from masrel.recording import RECORDING_COLUMNS, Recording

__all__ = ["LAST_S", "FaultRecord", "fault_record"]

LAST_S = 0.2
"""How much of the recording before a fault goes into the log, s."""

_FORMATS = {
    "time_s": "{:.6f}",
    "angle_deg": "{:.4f}",
    "velocity_deg_s": "{:.2f}",
    "model_torque_nm": "{:.4f}",
    "command_torque_nm": "{:.4f}",
    "phase": "{:.0f}",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRecord:
    """A fault as the log has it."""

    kind: str  # what kind of fault, in one word
    message: str  # what was needed and what came
    time_s: float  # when it was noticed, s since the presentation began
    torque_nm: float  # the torque that the device held then, N·m
    # the recording from 200 ms before until the torque was zero, as CSV
    last_200_ms: str


def fault_record(presented: Presented) -> FaultRecord | None:
    """Return what the log keeps of a presentation's fault."""
    fault = presented.fault
    if fault is None:
        return None
    return FaultRecord(
        kind=fault.kind,
        message=fault.message,
        time_s=fault.time_s,
        torque_nm=fault.torque_nm,
        last_200_ms=_last(presented.recording, fault.time_s - LAST_S),
    )


def _last(recording: Recording, since_s: float) -> str:
    columns = recording.columns
    first = int(np.searchsorted(columns["time_s"], since_s))
    lines = [",".join(RECORDING_COLUMNS)]
    for row in range(first, recording.n_samples):
        cells = (
            _FORMATS[name].format(float(columns[name][row]))
            for name in RECORDING_COLUMNS
        )
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"
