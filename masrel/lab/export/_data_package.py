"""A data package of Frictionless: tables with types, keys and what they may hold.

Table Schema and Data Package, version 1, https://specs.frictionlessdata.io.
"""

import re
from collections.abc import Iterator

from masrel.lab.export._dataset import (
    MISSING,
    Dataset,
    DataTable,
    Variable,
    csv_bytes,
    json_bytes,
)
from masrel.lab.export._samples import sample_rows, sample_variables
from masrel.lab.recording import read_recording

_TYPES = {"text": "string", "whole": "integer", "number": "number", "list": "string"}


def data_package_files(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    """Yield the files of a data package with their places."""
    resources = []
    for table in dataset.tables:
        place = f"ratings/{table.name}.csv"
        resources.append(_resource(table.name, place, table.title, _schema(table)))
        yield place, table.as_csv()
    for recording in dataset.recordings:
        samples = read_recording(recording.path)
        columns = sample_variables(samples)
        name = f"{recording.session}_{recording.rater}_{recording.name}"
        place = f"recordings/{name}.csv"
        schema = {"fields": [_field(v) for v in columns], "missingValues": [MISSING]}
        what = f"{recording.name}, {recording.rater} in {recording.session}"
        entry = _resource(_name(name), place, f"Recording {what}", schema)
        resources.append({**entry, "rate_hz": samples.facts["rate_hz"]})
        rows = sample_rows(samples, absent=MISSING)
        yield place, csv_bytes([[column.name for column in columns], *rows])
    yield from dataset.files.items()
    package = {
        "profile": "data-package",
        "name": _name(dataset.protocol.study.id),
        "title": dataset.protocol.study.title,
        "description": dataset.description,
        "resources": resources,
    }
    yield "datapackage.json", json_bytes(package)


def _name(text: str) -> str:
    return re.sub("[^a-z0-9._-]", "-", text.lower())


def _resource(
    name: str, place: str, title: str, schema: dict[str, object]
) -> dict[str, object]:
    return {
        "name": name,
        "path": place,
        "title": title,
        "profile": "tabular-data-resource",
        "format": "csv",
        "encoding": "utf-8",
        "schema": schema,
    }


def _schema(table: DataTable) -> dict[str, object]:
    schema: dict[str, object] = {
        "fields": [_field(variable) for variable in table.variables],
        "missingValues": [table.nothing],
    }
    if table.keys:
        schema["primaryKey"] = list(table.keys)
    if table.name != "raters":
        schema["foreignKeys"] = [
            {
                "fields": "rater",
                "reference": {"resource": "raters", "fields": "rater"},
            }
        ]
    return schema


def _field(variable: Variable) -> dict[str, object]:
    field: dict[str, object] = {
        "name": variable.name,
        "title": variable.title,
        "type": _TYPES[variable.kind],
    }
    if variable.unit:
        field["unit"] = variable.unit
    if variable.levels:
        field["constraints"] = {"enum": list(variable.levels)}
    return field
