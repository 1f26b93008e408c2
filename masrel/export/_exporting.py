"""Write a study in a form that others read."""

import shutil
import tempfile
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from masrel._files import make_folder, write_files
from masrel.errors import ParameterError
from masrel.export._bids import bids_files
from masrel.export._data_package import data_package_files
from masrel.export._dataset import Dataset, gather_dataset
from masrel.export._psych_ds import psych_ds_files
from masrel.export._ro_crate import ro_crate_files
from masrel.protocol import Protocol, StudyPaths

_Files = Callable[[Dataset], Iterator[tuple[str, bytes]]]

_FORMS: dict[str, _Files] = {
    "bids": bids_files,
    "psych-ds": psych_ds_files,
    "datapackage": data_package_files,
    "ro-crate": ro_crate_files,
}

EXPORT_FORMS = tuple(_FORMS)
"""Names of the forms of an export."""


def export_study(
    study: StudyPaths,
    protocol: Protocol,
    form: str,
    folder: Path,
    *,
    include: Collection[str] = (),
    progress: Callable[[str], object] | None = None,
) -> tuple[str, ...]:
    """Write a study in a form that archives and other programs read.

    Parameters
    ----------
    study : StudyPaths
        Where the study is; it has ratings.
    protocol : Protocol
        Its protocol.
    form : {"bids", "psych-ds", "datapackage", "ro-crate"}
        A data set of BIDS or Psych-DS, a data package of Frictionless, or an RO-Crate.
    folder : Path
        The folder to make; it must not exist, or be empty. It has its name once it is
        whole.
    include : collection of {"notes", "logs"}
        What else to export: notes on raters; logs, in which people and their reasons
        stand.
    progress : callable, optional
        Called with the place of each file once it is written.

    Returns
    -------
    tuple of str
        What was left out.

    Raises
    ------
    ParameterError
        If `form` or a name in `include` is unknown, the folder is there already, ids
        cannot be told apart in the form, or tomli-w is needed and is not installed.
    RatingsError, SessionLogError, ScheduleError
        If the study's ratings cannot be read.
    OSError
        If a file cannot be written; there is no such folder then.
    """
    if form not in _FORMS:
        raise ParameterError(f"form: needed one of {', '.join(_FORMS)}, got {form!r}")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ParameterError(f"{folder}: needed a new or empty folder, got another")
    dataset = gather_dataset(study, protocol, include)
    make_folder(folder.parent)
    part = Path(tempfile.mkdtemp(prefix=".masrel-", suffix=".part", dir=folder.parent))
    try:
        for place, content in _FORMS[form](dataset):
            write_files({part / place: content})
            if progress is not None:
                progress(place)
        part.chmod(0o755)
        part.rename(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return dataset.left_out
