"""Psych-DS: tables in ``data/`` with names of keywords, one description of them all.

Version 1.0.0 of the standard, https://psych-ds.github.io.
"""

from collections.abc import Iterator

import masrel
from masrel.lab.export._bids import label, labels
from masrel.lab.export._dataset import (
    MISSING,
    Dataset,
    Variable,
    csv_bytes,
    json_bytes,
)
from masrel.lab.export._samples import sample_rows, sample_variables
from masrel.lab.recording import read_recording


def psych_ds_files(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    """Yield the files of a Psych-DS data set with their places."""
    protocol = dataset.protocol
    study = f"study-{label(protocol.study.id)}"
    variables = [variable for table in dataset.tables for variable in table.variables]
    for table in dataset.tables:
        yield f"data/{study}_description-{table.name}_data.csv", table.as_csv()
    raters = labels([rater.id for rater in protocol.raters])
    sessions = labels([session.id for session in protocol.sessions])
    for recording in dataset.recordings:
        samples = read_recording(recording.path)
        columns = sample_variables(samples)
        variables += columns
        place = (
            f"{study}_subject-{raters[recording.rater]}"
            f"_session-{sessions[recording.session]}_stimulus-{label(recording.name)}"
        )
        rows = sample_rows(samples, absent=MISSING)
        names = [column.name for column in columns]
        yield f"data/{place}_data.csv", csv_bytes([names, *rows])
    yield from dataset.files.items()
    head = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": protocol.study.title,
        "description": dataset.description,
        "creator": {"@type": "SoftwareApplication", "name": "masrel"},
        "version": masrel.__version__,
        "variableMeasured": [
            _measured(variable) for variable in {v.name: v for v in variables}.values()
        ],
    }
    yield "dataset_description.json", json_bytes(head)


def _measured(variable: Variable) -> dict[str, object]:
    entry: dict[str, object] = {
        "@type": "PropertyValue",
        "name": variable.name,
        "description": variable.title,
    }
    if variable.unit:
        entry["unitText"] = variable.unit
    if variable.levels:
        entry["levels"] = list(variable.levels)
    return entry
