"""RO-Crate: the files of a study as they are, their hashes, and what made which.

Version 1.1 of the standard, https://w3id.org/ro/crate/1.1.
"""

import hashlib
from collections.abc import Iterator
from pathlib import PurePosixPath
from urllib.parse import quote

import masrel
from masrel.lab._bounded_files import MAX_RECORDING, read_regular
from masrel.lab.export._dataset import Dataset, json_bytes

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


def ro_crate_files(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    """Yield the files of an RO-Crate with their places."""
    entries: list[dict[str, object]] = []
    for place, content in _contents(dataset):
        yield place, content
        entries.append(_entry(place, content))
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


def _entry(place: str, content: bytes) -> dict[str, object]:
    return {
        "@id": quote(place),
        "@type": "File",
        "name": place,
        "contentSize": str(len(content)),
        "sha256": hashlib.sha256(content).hexdigest(),
        "encodingFormat": _FORMATS.get(
            PurePosixPath(place).suffix, "application/octet-stream"
        ),
    }


def _metadata(dataset: Dataset, files: list[dict[str, object]]) -> dict[str, object]:
    parts = [{"@id": entry["@id"]} for entry in files]
    made = [part for part in parts if _is_made(str(part["@id"]))]
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


def _is_made(place: str) -> bool:
    return place == "analysis.json" or place.startswith("report/")
