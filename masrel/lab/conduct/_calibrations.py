"""Calibrations of a study's device, one file each in ``calibrations/``.

In: what was measured. Out: the file, and the last one of the device of a study. Nothing
is replaced, so that the hash that a recording has stays that of a file.
"""

import hashlib
import re
from collections.abc import Callable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

import msgspec

from masrel._files import write_files
from masrel.errors import ParameterError
from masrel.lab._event_log import utc_now
from masrel.lab._study_files import MAX_SMALL, check_format, read_regular
from masrel.lab.protocol import Protocol, StudyPaths

_FORMAT = 1


class Calibration(msgspec.Struct, frozen=True, kw_only=True):
    """What was measured on a device, when and by whom; units end the names."""

    format: int = _FORMAT
    device: str
    boards: list[dict[str, Any]]  # what amplifiers on the bus say of themselves
    distribution: str  # that drove it, with its version
    who: str
    time_utc: str
    simulated: bool
    gain_from: str | None  # what the gain of torque was measured against
    # each number, and the ends of its interval of 95 %
    values: dict[str, tuple[float, float, float]]

    @property
    def lines(self) -> list[str]:
        """A line for each number."""
        return [
            f"{name} {value:.5g} [{low:.5g}, {high:.5g}]"
            for name, (value, low, high) in self.values.items()
        ]


def write_calibration(study: StudyPaths, calibration: Calibration) -> Path:
    """Write a calibration into a study, and return its file."""
    stem = f"{calibration.device}_{re.sub('[:+]', '', calibration.time_utc)[:17]}"
    file = study.calibrations / f"{stem}.json"
    text = msgspec.json.format(msgspec.json.encode(calibration)) + b"\n"
    write_files({file: text}, within=study.root)
    return file


def last_calibration(
    study: StudyPaths, protocol: Protocol
) -> tuple[Calibration, str] | None:
    """Return the last calibration of a study's device, and the SHA-256 of its file."""
    calibrations = []
    for file in sorted(study.calibrations.glob("*.json")):
        data = read_regular(file, most=MAX_SMALL)
        try:
            calibration = msgspec.json.decode(data, type=Calibration)
        except msgspec.DecodeError as error:
            raise ParameterError(f"{file}: needed a calibration ({error})") from error
        check_format(file, calibration.format, newest=_FORMAT, error=ParameterError)
        if calibration.device == protocol.device.backend:
            calibrations.append((calibration, hashlib.sha256(data).hexdigest()))
    return max(calibrations, key=lambda each: each[0].time_utc, default=None)


def calibration_notes(
    study: StudyPaths,
    protocol: Protocol,
    moves_hardware: Callable[[], bool],
    *,
    now: Callable[[], datetime] = utc_now,
) -> Iterator[str]:
    """Yield that a device was never calibrated, or is used with an old calibration."""
    last, most = last_calibration(study, protocol), protocol.device.calibration_max_days
    name = protocol.device.backend
    if last is None:
        if moves_hardware():
            yield f'device.backend: "{name}" was never calibrated for this study'
        return
    calibration, _ = last
    days = (now() - datetime.fromisoformat(calibration.time_utc)).days
    if most is not None and days > most:
        yield (
            f"device.calibration_max_days ({most}): the calibration of "
            f'"{name}" of {calibration.time_utc[:10]} by {calibration.who} is {days} '
            "days old"
        )
