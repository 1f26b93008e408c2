"""Write a study in a form that others read: as a data set of BIDS, or as it is.

RO-Crate has the files of a study as they are, their hashes, and what made which:
version 1.1 of the standard, https://w3id.org/ro/crate/1.1.
"""

import hashlib
from collections.abc import Callable, Collection, Iterator
from datetime import date
from pathlib import Path, PurePosixPath
from urllib.parse import quote

import masrel
from masrel._files import write_files
from masrel.errors import ParameterError
from masrel.lab._study_files import MAX_RECORDING, new_folder, read_regular
from masrel.lab.export._bids import bids_files
from masrel.lab.export._dataset import Dataset, gather_dataset, json_bytes
from masrel.lab.protocol import Protocol, StudyPaths

EXPORT_FORMS = ("bids", "ro-crate")
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
    form : {"bids", "ro-crate"}
        A data set of BIDS, or an RO-Crate.
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
    if form not in EXPORT_FORMS:
        known = ", ".join(EXPORT_FORMS)
        raise ParameterError(f"form: needed one of {known}, got {form!r}")
    dataset = gather_dataset(study, protocol, include, day or date.today())
    files_of = bids_files if form == "bids" else _ro_crate_files
    with new_folder(folder) as part:
        for place, content in files_of(dataset):
            # what is private stays its owner's alone until it is handed on
            write_files({part / place: content}, mode=0o600 if include else None)
            if progress is not None:
                progress(place)
    return dataset.left_out


_CONTEXT = "https://w3id.org/ro/crate/1.1"
_MASREL = "#masrel"

_FORMATS = {
    ".csv": "text/csv",
    ".html": "text/html",
    ".json": "application/json",
    ".jsonl": "application/jsonl",
    ".md": "text/markdown",
    ".npz": "application/zip",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".toml": "application/toml",
    ".txt": "text/plain",
}


def _ro_crate_files(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    entries: list[dict[str, object]] = []
    for place, content in _contents(dataset):
        yield place, content
        suffix = PurePosixPath(place).suffix
        entries.append(
            {
                "@id": quote(place),
                "@type": "File",
                "name": place,
                "contentSize": str(len(content)),
                "sha256": hashlib.sha256(content).hexdigest(),
                "encodingFormat": _FORMATS.get(suffix, "application/octet-stream"),
            }
        )
    yield "ro-crate-metadata.json", json_bytes(_metadata(dataset, entries))


def _contents(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    root = dataset.paths.root
    yield from dataset.files.items()
    yield "ratings/ratings.csv", dataset.ratings.as_csv()
    if dataset.answers is not None:
        yield "ratings/answers.csv", dataset.answers.as_csv()
    made = [*sorted(dataset.paths.schedules.glob("*.csv"))]
    made += [dataset.paths.analysis_file, *dataset.report]
    for recording in dataset.recordings:
        made += [recording.path, recording.path.with_suffix(".json")]
    for path in made:
        if path.is_file():
            content = read_regular(path, most=MAX_RECORDING)
            yield path.relative_to(root).as_posix(), content


def _metadata(dataset: Dataset, files: list[dict[str, object]]) -> dict[str, object]:
    parts = [{"@id": entry["@id"]} for entry in files]
    of_report = ("analysis.json", "report/")
    made = [part for part in parts if str(part["@id"]).startswith(of_report)]
    root: dict[str, object] = {
        "@id": "./",
        "@type": "Dataset",
        "name": dataset.protocol.study.title,
        "description": dataset.description,
        "license": "Not stated: to be added by the authors.",
        "datePublished": dataset.day.isoformat(),
        "hasPart": parts,
        "mentions": [{"@id": "#analysis"}],
    }
    run = {
        "@id": "#analysis",
        "@type": "CreateAction",
        "name": "Analysis and report by masrel",
        "instrument": {"@id": _MASREL},
        "object": [part for part in parts if part not in made],
        "result": made,
    }
    software = {
        "@id": _MASREL,
        "@type": "SoftwareApplication",
        "name": "masrel",
        "version": masrel.__version__,
    }
    descriptor = {
        "@id": "ro-crate-metadata.json",
        "@type": "CreativeWork",
        "conformsTo": {"@id": _CONTEXT},
        "about": {"@id": "./"},
    }
    terms = {"sha256": "https://w3id.org/ro/terms/workflow-run#sha256"}
    graph = [descriptor, root, run, software, *files]
    return {"@context": [f"{_CONTEXT}/context", terms], "@graph": graph}
