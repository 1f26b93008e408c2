"""What one presentation leaves: columns sampled by the control loop, and facts.

A recording is two files side by side: ``NAME.npz`` with the columns, units in
their names, and ``NAME.json`` with the facts and the SHA-256 of the first.
"""

import io
import json
import re
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from masrel._files import write_files
from masrel._input import refuse
from masrel.errors import ParameterError, RecordingError
from masrel.lab._study_files import (
    MAX_RECORDING,
    MAX_SMALL,
    Fact,
    check_format,
    parse_json,
    read_regular,
    sha256_of,
)

__all__ = [
    "ESTIMATED_TORQUE",
    "MEASURED_TORQUE",
    "PHASES",
    "RAMPS",
    "RECORDING_COLUMNS",
    "Channel",
    "Phase",
    "Recording",
    "Stretch",
    "read_recording",
    "stretches",
    "write_recording",
]

Phase = Literal["pre-catch", "catch", "post-catch"]
"""Part of a stretch that a joint is in."""

PHASES: tuple[Phase, ...] = ("pre-catch", "catch", "post-catch")
"""Names of the phases; their positions are the codes in the column `phase`."""

RAMPS = ("none", "post-catch", "end", "fault")
"""Why a torque is not the law's: it is on its way from the end of a catch or
post-catch, from that of the presentation, or from a fault. Positions are the codes in
the column `ramp`."""

RECORDING_COLUMNS = (
    "time_s",  # since the presentation began
    "angle_deg",  # as the encoder reads it
    "velocity_deg_s",  # as the controller estimates it
    "model_torque_nm",  # what the joint model asks for
    "command_torque_nm",  # what was sent: model, friction compensation, limits
    "phase",  # position in PHASES
    "ramp",  # position in RAMPS
    "stretch",  # which one goes on: 1, 2, ...; 0 before, between and after
)
"""Columns of a recording, in their order."""

_FORMAT = 1  # version of the files of a recording; facts without one are of version 1

_FIRST_COLUMNS = frozenset(RECORDING_COLUMNS[:6])  # those of every recording

_CATCH, _END, _FAULT = PHASES.index("catch"), RAMPS.index("end"), RAMPS.index("fault")
_USUAL_THRESHOLD_DEG_S = 20.0  # before recordings said what theirs was

_Floats = NDArray[np.float64]
_Columns = Mapping[str, _Floats]

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

ESTIMATED_TORQUE = Channel(name="estimated_torque", unit="nm")
"""The same, as an amplifier estimates it from its current."""

# How many times the torque that it is sent a device may give, at least and at most.
_TORQUE_GAINS = (0.9, 1.1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """The columns and facts of one presentation.

    Attributes
    ----------
    columns : mapping of str to ndarray, shape (n_samples,)
        One array per name of `RECORDING_COLUMNS`, all of one length, read-only. Where
        `ramp` is left out, as it once was, it follows from the fault; where `stretch`
        is, all before the end is one stretch.
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

    columns: Mapping[str, _Floats] = field(compare=False, repr=False)
    facts: Mapping[str, Fact]
    channels: tuple[Channel, ...] = ()

    def __post_init__(self) -> None:
        measured = {channel.column for channel in self.channels}
        others = set(self.columns) - measured
        is_whole = _FIRST_COLUMNS <= others <= set(RECORDING_COLUMNS)
        if not is_whole or not measured <= set(self.columns):
            names = (*RECORDING_COLUMNS, *sorted(measured))
            raise RecordingError(
                f"a recording needs the columns {', '.join(names)}, "
                f"got {', '.join(sorted(self.columns)) or 'none'}"
            )
        if len(others) < len(RECORDING_COLUMNS):  # made before it had all of them
            object.__setattr__(self, "columns", _completed(self.columns, self.facts))
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
        return int(np.count_nonzero(self.columns["ramp"] < _END))


def _completed(columns: _Columns, facts: Mapping[str, Fact]) -> _Columns:
    # Before recordings had these columns, faults alone had a ramp, and all before the
    # end was one stretch.
    fault_s = facts.get("fault_time_s")
    begins_s = fault_s if isinstance(fault_s, float) else np.inf
    ramp = np.where(columns["time_s"] >= begins_s, float(_FAULT), 0.0)
    columns = {"ramp": ramp, **columns}
    return {"stretch": (columns["ramp"] < _END).astype(np.float64), **columns}


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """One stretch of a presentation, as it was sampled.

    Attributes
    ----------
    number : int
        1 for the first of the presentation.
    onset_s, end_s : float
        First and last sample at which it went on, s since the presentation began.
    mean_speed_deg_s : float or None
        Angle travelled over time, from where the arm reached ν_th to the first catch:
        v̄ of (2) and Table V. Without a catch to the last sample at ν_th or above.
        None when the arm was never so fast, or a fault came before the catch.
    catch_angle_deg, catch_time_s : float or None
        Where and when the first catch began; None without one.
    peak_torque_nm : float
        Largest torque that the joint model asked for, N·m.
    residual_torque_nm : float or None
        Torque that it asked for in the last sample of that catch, N·m; None without.
    phases : tuple of str
        The phases in the order they came.
    reached_threshold : bool
        Whether the arm was extended at ν_th or faster.

    References
    ----------
    .. [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
       equations (2) and (3). https://doi.org/10.1109/TNSRE.2012.2195330
    """

    number: int
    onset_s: float
    end_s: float
    mean_speed_deg_s: float | None
    catch_angle_deg: float | None
    catch_time_s: float | None
    peak_torque_nm: float
    residual_torque_nm: float | None
    phases: tuple[Phase, ...]
    reached_threshold: bool


def stretches(recording: Recording) -> tuple[Stretch, ...]:
    """Return what each stretch of a presentation was, from its columns.

    Parameters
    ----------
    recording : Recording
        The presentation; ν_th is its fact ``speed_threshold_deg_s``, 20 deg/s where a
        recording was made before there was such a fact.

    Returns
    -------
    tuple of Stretch
        In the order they were made; empty when the arm was never stretched.

    Examples
    --------
    >>> import numpy as np
    >>> columns = {name: np.zeros(4) for name in RECORDING_COLUMNS}
    >>> columns["time_s"] = np.array([0.0, 0.1, 0.2, 0.3])
    >>> columns["angle_deg"] = np.array([30.0, 33.0, 39.0, 45.0])
    >>> columns["velocity_deg_s"] = np.array([0.0, 60.0, 60.0, 60.0])
    >>> columns["stretch"] = np.array([0.0, 1.0, 1.0, 1.0])
    >>> (stretch,) = stretches(Recording(columns=columns, facts={}))
    >>> stretch.onset_s, stretch.end_s, round(stretch.mean_speed_deg_s, 6)
    (0.1, 0.3, 60.0)
    """
    number = recording.columns["stretch"]
    changes = np.flatnonzero(np.diff(number)) + 1
    return tuple(
        _stretch(recording, start, end)
        for start, end in pairwise([0, *changes.tolist(), recording.n_samples])
        if start < end and number[start] > 0.0
    )


def _stretch(recording: Recording, start: int, end: int) -> Stretch:
    # What the samples from one to before another are
    columns = {name: column[start:end] for name, column in recording.columns.items()}
    threshold = recording.facts.get("speed_threshold_deg_s")
    if threshold is None:
        threshold = _USUAL_THRESHOLD_DEG_S
    moving = columns["velocity_deg_s"] >= float(threshold)
    time_s, torque = columns["time_s"], columns["model_torque_nm"]
    catches = np.flatnonzero(columns["phase"] == _CATCH)
    catch = int(catches[0]) if catches.size else None  # where the first one began
    # One that was stopped before its catch has no mean speed of its own.
    was_stopped = recording.facts.get("fault") is not None
    has_speed = catch is not None or not (was_stopped and end >= recording.n_presented)
    return Stretch(
        number=int(columns["stretch"][0]),
        onset_s=float(time_s[0]),
        end_s=float(time_s[-1]),
        mean_speed_deg_s=(
            _mean_speed_deg_s(columns, moving, catch) if has_speed else None
        ),
        catch_angle_deg=None if catch is None else float(columns["angle_deg"][catch]),
        catch_time_s=None if catch is None else float(time_s[catch]),
        peak_torque_nm=float(torque.max()),
        residual_torque_nm=None if catch is None else _residual(columns, catch),
        phases=_phases(columns),
        reached_threshold=bool(moving.any()),
    )


def _main_stretch(recording: Recording) -> Stretch | None:
    # What the facts of a presentation are of: the first of many stretches that reached
    # ν_th, or the first of all; where there was one, all of it, rests and all
    made = stretches(recording)
    if len(made) > 1:
        return next((one for one in made if one.reached_threshold), made[0])
    n_rows = recording.n_presented  # what the law did under the ramp, nobody felt
    return _stretch(recording, 0, n_rows) if n_rows else None


def _residual(columns: _Columns, catch: int) -> float:
    # Torque of the model in the last sample of a catch, N·m
    others = np.flatnonzero(columns["phase"][catch:] != _CATCH)
    end = catch + int(others[0]) if others.size else columns["phase"].size
    return float(columns["model_torque_nm"][end - 1])


def _phases(columns: _Columns) -> tuple[Phase, ...]:
    # Their names in the order they came
    codes = columns["phase"].astype(np.int64)
    changes = np.flatnonzero(np.diff(codes)) + 1
    return tuple(PHASES[codes[index]] for index in (0, *changes))


def _mean_speed_deg_s(
    columns: _Columns, moving: NDArray[np.bool_], last: int | None
) -> float | None:
    # Angle travelled over time, deg/s, from the onset to the first catch: v̄ of (2). An
    # arm that was slower than ν_th in between has begun anew. Without a catch, from the
    # first to the last sample at ν_th or above; None without extension.
    if last is not None:
        slower = np.flatnonzero(~moving[:last])
        onset = int(slower[-1]) + 1 if slower.size else 0
    else:
        fast = np.flatnonzero(moving)
        onset, last = (int(fast[0]), int(fast[-1])) if fast.size else (0, 0)
    if last <= onset:
        return None
    travel = columns["angle_deg"][last] - columns["angle_deg"][onset]
    return float(travel / (columns["time_s"][last] - columns["time_s"][onset]))


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
    refuse(
        (path.suffix != ".npz", f"{path}: the file of a recording must end in .npz"),
        (
            path.exists(),
            f"{path}: needs a new file, a recording is never overwritten; move it away",
        ),
        error=RecordingError,
    )
    channels = [channel.column for channel in recording.channels]
    ordered = {n: recording.columns[n] for n in (*RECORDING_COLUMNS, *channels)}
    archive = io.BytesIO()
    # Floats are never pickled; numpy 2.0 takes `allow_pickle` for a column.
    np.savez_compressed(archive, **ordered)  # type: ignore[arg-type]
    checksum = sha256_of(archive.getbuffer())
    document: dict[str, object] = {
        **recording.facts,
        "format": _FORMAT,
        "sha256": checksum,
    }
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
        facts = parse_json(read_regular(facts_path, most=MAX_SMALL))
    except ValueError as error:
        raise RecordingError(f"{facts_path}: not JSON ({error})") from error
    if not isinstance(facts, dict) or "sha256" not in facts:
        raise RecordingError(f"{facts_path}: needs an object with the key sha256")
    version = facts.pop("format", 1)
    check_format(facts_path, version, newest=_FORMAT, error=RecordingError)
    data = read_regular(path, most=MAX_RECORDING)
    checksum = sha256_of(data)
    if facts.pop("sha256") != checksum:
        raise RecordingError(
            f"{path}: is not the file whose checksum {facts_path} holds"
        )
    columns = _read_columns(path, data)
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


def _read_columns(path: Path, data: bytes) -> dict[str, NDArray[Any]]:
    """Return the arrays of an npz archive, if they are not too large."""
    if data.startswith(b"\x93NUMPY"):
        raise RecordingError(
            f"{path}: not an archive of columns (one array without a name)"
        )
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as members:
            n_bytes = sum(member.file_size for member in members.infolist())
        if n_bytes > MAX_RECORDING:
            raise ValueError(f"its columns are larger than {MAX_RECORDING} bytes")
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except _DAMAGES as error:
        raise RecordingError(f"{path}: not an archive of columns ({error})") from error


_DAMAGES = (
    *(ValueError, EOFError, OSError, zipfile.BadZipFile, zlib.error),
    *(RuntimeError, NotImplementedError),  # encrypted, packed in another way
    MemoryError,  # a column that says it is longer than the file
)
