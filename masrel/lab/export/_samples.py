"""The samples of a recording as described columns of text."""

import gzip
from collections.abc import Iterator

import numpy as np

from masrel.lab.export._dataset import Kind, Variable
from masrel.lab.recording import PHASES, RAMPS, RECORDING_COLUMNS, Recording

_TITLES = {
    "time_s": "Time since the presentation began",
    "angle_deg": "Angle of the elbow, 0 in full flexion",
    "velocity_deg_s": "Angular velocity, as the controller estimates it",
    "model_torque_nm": "Torque that the model asks for",
    "command_torque_nm": "Torque that was commanded",
    "phase": "Phase: " + ", ".join(f"{i} {name}" for i, name in enumerate(PHASES)),
    "ramp": "Why the torque is not the law's: "
    + ", ".join(f"{i} {name}" for i, name in enumerate(RAMPS)),
    "stretch": "Stretch that goes on, 0 before, between and after",
}
_UNITS = {"_deg_s": "deg/s", "_deg": "deg", "_nm": "N*m", "_mv": "mV", "_s": "s"}
_CODES = ("phase", "ramp", "stretch")


def sample_variables(recording: Recording) -> tuple[Variable, ...]:
    """Describe the columns of a recording, those of its channels last."""
    channels = tuple(channel.column for channel in recording.channels)
    return tuple(
        Variable(
            name=name,
            title=_TITLES.get(name, "Measured beside the angle"),
            kind=_kind(name),
            unit=next((u for end, u in _UNITS.items() if name.endswith(end)), ""),
        )
        for name in (*RECORDING_COLUMNS, *channels)
    )


def _kind(name: str) -> Kind:
    return "whole" if name in _CODES else "number"


def sample_rows(recording: Recording, *, absent: str) -> Iterator[list[str]]:
    """Yield every sample as texts that give its numbers back to the last bit."""
    columns = [recording.columns[v.name].tolist() for v in sample_variables(recording)]
    whole = [variable.kind == "whole" for variable in sample_variables(recording)]
    for row in zip(*columns, strict=True):
        yield [
            absent if np.isnan(value) else str(int(value)) if is_whole else repr(value)
            for value, is_whole in zip(row, whole, strict=True)
        ]


def gzipped(text: str) -> bytes:
    """Return a text in UTF-8, compressed, the same bytes every time."""
    return gzip.compress(text.encode(), 6, mtime=0)
