"""Write a study in a form that others read."""

from collections.abc import Callable, Collection, Iterator
from datetime import date
from pathlib import Path

from masrel._files import write_files
from masrel.errors import ParameterError
from masrel.lab._durable_files import new_folder
from masrel.lab.export._bids import bids_files
from masrel.lab.export._data_package import data_package_files
from masrel.lab.export._dataset import Dataset, gather_dataset
from masrel.lab.export._psych_ds import psych_ds_files
from masrel.lab.export._ro_crate import ro_crate_files
from masrel.lab.protocol import Protocol, StudyPaths

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
    day: date | None = None,
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
    include : collection of str
        What is private and exported all the same: ``"notes"`` on raters; ``"logs"``, in
        which people and their reasons stand; fields of raters that are not public, by
        their names; questions that are not, as ``"QUESTIONNAIRE.QUESTION"``.
    day : date, optional
        The day of the export, today unless given; an RO-Crate has it.
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
    dataset = gather_dataset(study, protocol, include, day or date.today())
    with new_folder(folder) as part:
        for place, content in _FORMS[form](dataset):
            # what is private stays its owner's alone until it is handed on
            write_files({part / place: content}, mode=0o600 if include else None)
            if progress is not None:
                progress(place)
    return dataset.left_out
