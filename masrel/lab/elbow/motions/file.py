"""Motions from files: what `masrel fit` reads too, or a recording of the loop."""

from pathlib import Path

from masrel.errors import ParameterError
from masrel.lab.elbow.identification._reading import read_angles
from masrel.lab.elbow.motions._recorded import Interpolation, Recorded

__all__ = ["read_motion"]


def read_motion(path: Path, *, interpolation: Interpolation = "pchip") -> Recorded:
    r"""Read a motion from a file.

    Parameters
    ----------
    path : Path
        CSV with a line of names, separated by comma, semicolon or tab, or npz with an
        array a column, of which time and angle are read (``time_s``, ``angle_deg``; ms,
        us and rad too); lines before the names that begin with # are passed over. Or
        one of the two files of a `masrel.lab.recording.Recording`.
    interpolation : {"pchip", "linear"}, optional
        What happens between samples.

    Returns
    -------
    Recorded
        The motion.

    Raises
    ------
    RecordingError
        If there is no such file, a column is absent or without a unit, or a value is
        not a number; the message names file, line and column.
    ParameterError
        If the samples are no motion; as of `Recorded`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "motion.csv"
    ...     _ = path.write_text("time_s,angle_deg\n0,30\n1,90\n")
    ...     read_motion(path).duration
    1.0
    """
    if path.suffix.lower() == ".json":  # beside the columns
        path = path.with_suffix(".npz")
    time, angle = read_angles(path)
    try:
        return Recorded(time=time, angle=angle, interpolation=interpolation)
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from error
