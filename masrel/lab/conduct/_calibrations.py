"""Calibrations of a study's device, one file each in ``calibrations/``.

In: what was measured. Out: the file, and the last one of the device of a study. Nothing
is replaced, so that the hash that a recording has stays that of a file.
"""

import math
from collections.abc import Callable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import msgspec

from masrel._files import write_files
from masrel.errors import ParameterError
from masrel.lab._event_log import utc_now
from masrel.lab._study_files import MAX_SMALL, check_format, read_regular, sha256_of
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.recording import _TORQUE_GAINS

_FORMAT = 1

# What sessions use, and a calibration must have; a gain of torque it may have
_NEEDED = (
    "encoder_noise_deg",
    "delay_ms",
    "inertia_kg_m2",
    "viscous_nms_rad",
    "coulomb_nm",
)


class Calibration(msgspec.Struct, frozen=True, kw_only=True):
    """What was measured on a device, when and by whom; units end the names."""

    format: int = _FORMAT
    device: str
    boards: list[dict[str, Any]]  # what amplifiers on the bus say of themselves
    distribution: str  # that drove it, with its version
    who: str
    time_utc: Annotated[datetime, msgspec.Meta(tz=True)]
    simulated: bool
    gain_from: str | None  # what the gain of torque was measured against
    # each number, and the ends of its interval of 95 %
    values: dict[str, tuple[float, float, float]]

    def __post_init__(self) -> None:
        # A file may have been edited, and what it says goes to a motor
        absent = [name for name in _NEEDED if name not in self.values]
        if absent:
            raise ValueError(f"values: needs {', '.join(absent)}, too")
        for name, (value, low, high) in self.values.items():
            if not (low <= value <= high and math.isfinite(high - low)):
                raise ValueError(
                    f"values.{name}: needs a number within its interval, got {value} "
                    f"and [{low}, {high}]"
                )
        gain, *_ = self.values.get("torque_gain", (1.0,))
        least, most = _TORQUE_GAINS
        if not least <= gain <= most:
            raise ValueError(f"values.torque_gain: needs {least} to {most}, got {gain}")

    @property
    def lines(self) -> list[str]:
        """A line for each number."""
        return [
            f"{name} {value:.5g} [{low:.5g}, {high:.5g}]"
            for name, (value, low, high) in self.values.items()
        ]


def write_calibration(study: StudyPaths, calibration: Calibration) -> Path:
    """Write a calibration into a study, and return its file."""
    stem = f"{calibration.device}_{calibration.time_utc:%Y-%m-%dT%H%M%S}"
    file = study.calibrations / f"{stem}.json"
    text = msgspec.json.format(msgspec.json.encode(calibration)) + b"\n"
    write_files({file: text}, within=study.root)
    return file


def read_calibrations(study: StudyPaths) -> Iterator[tuple[Calibration, str]]:
    """Yield the calibrations of a study, each with the SHA-256 of its file."""
    for file in sorted(study.calibrations.glob("*.json")):
        data = read_regular(file, most=MAX_SMALL)
        try:
            calibration = msgspec.json.decode(data, type=Calibration)
        except msgspec.DecodeError as error:
            raise ParameterError(f"{file}: needed a calibration ({error})") from error
        check_format(file, calibration.format, newest=_FORMAT, error=ParameterError)
        yield calibration, sha256_of(data)


def calibration_hashes(study: StudyPaths) -> frozenset[str]:
    """Return the SHA-256 of each file of a calibration, whether it is whole or not."""
    files = study.calibrations.glob("*.json")
    return frozenset(sha256_of(read_regular(file, most=MAX_SMALL)) for file in files)


def last_calibration(
    study: StudyPaths, protocol: Protocol, *, simulated: bool
) -> tuple[Calibration, str] | None:
    """Return the last calibration of a study's device, and the SHA-256 of its file.

    What was measured on an emulated device says nothing of hardware, nor the reverse.
    """
    of_device = [
        each
        for each in read_calibrations(study)
        if each[0].device == protocol.device.backend and each[0].simulated == simulated
    ]
    return max(of_device, key=lambda each: each[0].time_utc, default=None)


def calibration_notes(
    study: StudyPaths,
    protocol: Protocol,
    *,
    moves_hardware: bool,
    now: Callable[[], datetime] = utc_now,
) -> Iterator[str]:
    """Yield that a device was never calibrated, or is used with an old calibration."""
    last = last_calibration(study, protocol, simulated=not moves_hardware)
    most = protocol.device.calibration_max_days
    name = protocol.device.backend
    if last is None:
        if moves_hardware:
            yield f'device.backend: "{name}" was never calibrated for this study'
        return
    calibration, _ = last
    days = (now() - calibration.time_utc).days
    if most is not None and days > most:
        yield (
            f"device.calibration_max_days ({most}): the calibration of "
            f'"{name}" of {calibration.time_utc:%Y-%m-%d} by {calibration.who} is '
            f"{days} days old"
        )
