"""What one presentation leaves: columns sampled by the control loop, and facts.

A recording is two files side by side: ``NAME.npz`` with the columns, units in
their names, and ``NAME.json`` with the facts and the SHA-256 of the first.
"""

import hashlib
import io
import json
import re
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from masrel._files import write_files
from masrel.errors import ParameterError, RecordingError

__all__ = [
    "MEASURED_TORQUE",
    "PHASES",
    "RAMPS",
    "RECORDING_COLUMNS",
    "Channel",
    "Phase",
    "Recording",
    "read_recording",
    "write_recording",
]

Phase = Literal["pre-catch", "catch", "post-catch"]
"""Part of a stretch that a joint is in."""

PHASES: tuple[Phase, ...] = ("pre-catch", "catch", "post-catch")
"""Names of the phases; their positions are the codes in the column `phase`."""

RAMPS = ("none", "post-catch", "end", "fault")
"""Why a torque is not the law's: post-catch, the presentation or a fault has ended it,
and it is on its way from there. Positions are the codes in the column `ramp`."""

RECORDING_COLUMNS = (
    "time_s",  # since the presentation began
    "angle_deg",  # as the encoder reads it
    "velocity_deg_s",  # as the controller estimates it
    "model_torque_nm",  # what the joint model asks for
    "command_torque_nm",  # what was sent: model, friction compensation, limits
    "phase",  # position in PHASES
    "ramp",  # position in RAMPS
)

_Fact = str | int | float | bool | None

_COLUMN_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_LONGEST_NAME = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """What a device measures beside the angle, once per reading.

    Attributes
    ----------
    name : str
        Words in lower case with underscores, such as ``"emg_biceps"``.
    unit : str
        As in names of columns: ``"nm"``, ``"mv"``; empty for a number without one, such
        as a trigger's.

    Raises
    ------
    ParameterError
        If name and unit make no name of a column, or that of a column that every
        recording has.

    Examples
    --------
    >>> Channel(name="emg_biceps", unit="mv").column
    'emg_biceps_mv'
    """

    name: str
    unit: str = ""

    def __post_init__(self) -> None:
        fits = _COLUMN_NAME.fullmatch(self.column) and len(self.column) <= _LONGEST_NAME
        if not fits or self.column in RECORDING_COLUMNS:
            raise ParameterError(
                f"channel: needs a name and a unit of up to {_LONGEST_NAME} lower-case "
                "letters, digits and underscores that no other column has, "
                f"got {self.name!r} in {self.unit!r}"
            )

    @property
    def column(self) -> str:
        """Name of its column in a recording, with the unit."""
        return f"{self.name}_{self.unit}" if self.unit else self.name


MEASURED_TORQUE = Channel(name="measured_torque", unit="nm")
"""Torque with which the device resists extension, as its sensor reads it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """The columns and facts of one presentation.

    Attributes
    ----------
    columns : mapping of str to ndarray, shape (n_samples,)
        One array per name of `RECORDING_COLUMNS`, all of one length, read-only. Where
        `ramp` is left out, as it once was, it follows from the fault.
    facts : mapping of str to str, int, float, bool or None
        What was presented and how: ``simulated``, ``device``, ``model``, ``code``,
        ``rate_hz``, ``n_missed_ticks``, ``fault``, ``mean_speed_deg_s`` and others.
    channels : tuple of Channel, optional
        What the device measured beside the angle; each has a column too, ``nan`` where
        it gave no number.

    Raises
    ------
    RecordingError
        If a column is missing, foreign, or of another length.
    """

    columns: Mapping[str, NDArray[np.float64]] = field(compare=False, repr=False)
    facts: Mapping[str, _Fact]
    channels: tuple[Channel, ...] = ()

    def __post_init__(self) -> None:
        if "ramp" not in self.columns and "time_s" in self.columns:
            ramp = _ramp_without_column(self.columns["time_s"], self.facts)
            object.__setattr__(self, "columns", {**self.columns, "ramp": ramp})
        names = (*RECORDING_COLUMNS, *(channel.column for channel in self.channels))
        if sorted(self.columns) != sorted(names):
            raise RecordingError(
                f"a recording needs the columns {', '.join(names)}, "
                f"got {', '.join(sorted(self.columns)) or 'none'}"
            )
        shapes = {column.shape for column in self.columns.values()}
        if len(shapes) != 1 or len(next(iter(shapes))) != 1:
            raise RecordingError(
                f"columns of a recording need one length, got shapes {sorted(shapes)}"
            )
        for column in self.columns.values():
            column.setflags(write=False)

    @property
    def n_samples(self) -> int:
        """Samples in every column."""
        return int(self.columns["time_s"].size)

    @property
    def n_presented(self) -> int:
        """Samples before the torque was taken away, at the end or after a fault."""
        return int(np.count_nonzero(self.columns["ramp"] < RAMPS.index("end")))


def _ramp_without_column(
    time_s: NDArray[np.float64], facts: Mapping[str, _Fact]
) -> NDArray[np.float64]:
    # (n,) -> (n,): before recordings had the column, faults alone had a ramp
    fault_s = facts.get("fault_time_s")
    ramp = np.zeros(time_s.shape)
    if isinstance(fault_s, float):
        ramp[time_s >= fault_s] = RAMPS.index("fault")
    return ramp


def write_recording(recording: Recording, path: Path) -> str:
    """Write a recording beside its facts, both whole and on disk or not at all.

    Parameters
    ----------
    recording : Recording
        What to write.
    path : Path
        The ``.npz`` file; the facts go to the same name with ``.json``.

    Returns
    -------
    str
        SHA-256 of the ``.npz`` file, in hexadecimal.

    Raises
    ------
    RecordingError
        If `path` does not end in ``.npz``, or is there already: a recording is never
        overwritten.
    OSError
        If the files cannot be written.
    """
    if path.suffix != ".npz":
        raise RecordingError(f"{path}: the file of a recording must end in .npz")
    if path.exists():
        raise RecordingError(
            f"{path}: needs a new file, a recording is never overwritten; move it away"
        )
    channels = [channel.column for channel in recording.channels]
    ordered = {n: recording.columns[n] for n in (*RECORDING_COLUMNS, *channels)}
    archive = io.BytesIO()
    # Floats are never pickled; numpy 2.0 takes `allow_pickle` for a column.
    np.savez_compressed(archive, **ordered)  # type: ignore[arg-type]
    checksum = hashlib.sha256(archive.getbuffer()).hexdigest()
    document: dict[str, object] = {"sha256": checksum, **recording.facts}
    if channels:
        document["channels"] = [asdict(channel) for channel in recording.channels]
    facts = json.dumps(document, indent=1, sort_keys=True, allow_nan=False) + "\n"
    # A recording that is there has its facts: these get their name first.
    write_files({path.with_suffix(".json"): facts, path: archive.getvalue()})
    return checksum


def read_recording(path: Path) -> Recording:
    """Read a recording and check it against its checksum.

    Parameters
    ----------
    path : Path
        The ``.npz`` file; its facts lie beside it with ``.json``.

    Returns
    -------
    Recording
        Columns and facts.

    Raises
    ------
    RecordingError
        If a file is missing, damaged, or not a recording.
    """
    facts_path = path.with_suffix(".json")
    for needed in (path, facts_path):
        if not needed.is_file():
            raise RecordingError(f"{needed}: no such file")
    try:
        facts = json.loads(facts_path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise RecordingError(f"{facts_path}: not JSON ({error})") from error
    if not isinstance(facts, dict) or "sha256" not in facts:
        raise RecordingError(f"{facts_path}: needs an object with the key sha256")
    checksum = hashlib.sha256(path.read_bytes()).hexdigest()
    if facts.pop("sha256") != checksum:
        raise RecordingError(
            f"{path}: is not the file whose checksum {facts_path} holds"
        )
    try:
        with np.load(path, allow_pickle=False) as archive:
            columns = {name: archive[name] for name in archive.files}
    except (ValueError, EOFError, OSError, zipfile.BadZipFile) as error:
        raise RecordingError(f"{path}: not an archive of columns ({error})") from error
    try:
        channels = _channels_of(facts.pop("channels", []))
    except ValueError as error:
        raise RecordingError(f"{facts_path}: {error}") from error
    return Recording(columns=columns, facts=facts, channels=channels)


def _channels_of(plain: object) -> tuple[Channel, ...]:
    # as JSON has them; raises ValueError where they are none
    channels = []
    for entry in plain if isinstance(plain, list) else [plain]:
        match entry:
            case {"name": str(name), "unit": str(unit)}:
                channels.append(Channel(name=name, unit=unit))
            case _:
                raise ValueError(f"channels: needs name and unit of each, got {entry}")
    return tuple(channels)
