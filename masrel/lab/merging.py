"""Sites of one study put together into one folder: copied, never changed, verified.

In: folders of a study that was run at several sites, whose protocols differ in their
raters alone. Out: a new folder with all raters, schedules, logs and recordings,
verified before and after.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any

import msgspec

from masrel._files import write_files
from masrel._input import refuse
from masrel.errors import ParameterError, ProtocolError, ScheduleError
from masrel.lab._event_log import line_hashes
from masrel.lab._study_files import (
    MAX_RECORDING,
    MAX_SMALL,
    new_folder,
    parse_toml,
    read_regular,
    toml_lines,
)
from masrel.lab.conduct._study_log import append_event
from masrel.lab.paper._form import has_answers
from masrel.lab.protocol import (
    Protocol,
    StudyPaths,
    presented_hash,
    protocol_hash,
    read_protocol,
)
from masrel.lab.protocol.content import _content_differences
from masrel.lab.schedule._secret import find_secret
from masrel.lab.schedule.presentation import read_schedule
from masrel.lab.verification import verify_study

__all__ = ["merge_studies"]


def merge_studies(studies: Sequence[StudyPaths], destination: Path) -> StudyPaths:
    """Put the sites of one study together in a new folder.

    Parameters
    ----------
    studies : sequence of StudyPaths
        Two or more folders. Their protocols may differ in their raters alone, their
        schedules are drawn from one secret, and no rater has a session in two of them.
    destination : Path
        The new study's folder; new or empty.

    Returns
    -------
    StudyPaths
        The new folder: all raters, schedules, sheets that were typed, logs and
        recordings of sessions, trainings and rehearsals, calibrations, and logs of
        conduct, byte for byte. No secret is copied, nor what was made of the logs.

    Raises
    ------
    ParameterError
        If there are fewer than two folders, the record of one is not whole, a rater has
        sessions in two, two have another file of one name, or `destination` holds
        anything.
    ProtocolError
        If a protocol cannot be read, or protocols differ in any other key.
    ScheduleError
        If schedules are drawn from different secrets.
    OSError
        If a file cannot be read or written. Nothing is at `destination` then.
    """
    _check_destination(studies, destination)
    protocols = [read_protocol(study.protocol) for study in studies]
    _check_protocols(studies, protocols)
    _check_secrets(studies)
    owners = _owners(studies, protocols)
    for study in studies:
        _check_record(study, study.root)
    names = _conduct_names(studies)
    files = _files(studies, protocols, owners, names)
    with new_folder(destination) as part:
        merged = StudyPaths(part)
        # First: in a study what is private is its owner's alone, however open the
        # sources are.
        write_files({merged.protocol: _merged_protocol(studies)}, mode=0o600)
        for name, file in files.items():
            write_files({part / name: _content(file)}, within=part)
        protocol = read_protocol(merged.protocol)
        for fields in _merged_logs(studies, protocols, names, part):
            append_event(merged, protocol, "merged", fields)
        _check_record(merged, destination)
    return StudyPaths(destination)


def _check_destination(studies: Sequence[StudyPaths], destination: Path) -> None:
    place = destination.resolve()
    refuse(
        (len(studies) < 2, f"studies: needed two or more, got {len(studies)}"),
        (
            len({study.root.resolve() for study in studies}) < len(studies),
            "studies: needed different folders, got one twice",
        ),
        (
            destination.exists()
            and not (destination.is_dir() and not any(destination.iterdir())),
            f"{destination}: needed a new or empty folder",
        ),
        (
            not place.parent.is_dir(),
            f"{destination}: needed a folder to make it in, got none",
        ),
        *(
            (
                place.is_relative_to(study.root.resolve()),
                f"{destination}: needed a folder outside {study.root}, which is merged",
            )
            for study in studies
        ),
    )


def _check_protocols(
    studies: Sequence[StudyPaths], protocols: Sequence[Protocol]
) -> None:
    # refuses protocols that differ in more than which raters take part
    for study, protocol in zip(studies[1:], protocols[1:], strict=True):
        raters = {r.id for r in protocols[0].raters} & {r.id for r in protocol.raters}
        one, another = (_comparable(each, raters) for each in (protocols[0], protocol))
        for key, *values in _content_differences(one, another):
            first, other = (json.dumps(each, ensure_ascii=False) for each in values)
            raise ProtocolError(
                f"{key}: needed the same in all protocols, got {first} in "
                f"{studies[0].protocol} and {other} in {study.protocol}"
            )
        if presented_hash(protocol) != presented_hash(protocols[0]):
            raise ProtocolError(
                f"{study.protocol}: needed what {studies[0].protocol} presents, got "
                "another presented hash"
            )


def _comparable(protocol: Protocol, raters: set[str]) -> dict[str, Any]:
    # content with these raters, without who takes part when
    content: dict[str, Any] = msgspec.to_builtins(protocol)
    for session in content["sessions"]:
        del session["raters"]
    content["raters"] = {r["id"]: r for r in content["raters"] if r["id"] in raters}
    return content


def _check_secrets(studies: Sequence[StudyPaths]) -> None:
    commitments = [
        (file, read_schedule(file).commitment)
        for study in studies
        for file in sorted(study.schedules.glob("*.csv"))
        if not file.name.endswith("_sheet.csv")
    ]
    commitments += [
        (study.secret_file, secret.commitment)
        for study in studies
        if (secret := find_secret(study)) is not None
    ]
    for place, commitment in commitments:
        first, needed = commitments[0]
        if commitment != needed:
            raise ScheduleError(
                f"{place}: commitment: needed that of {first}, {needed}, got "
                f"{commitment}: sites of one study are drawn from one secret"
            )


def _owners(
    studies: Sequence[StudyPaths], protocols: Sequence[Protocol]
) -> dict[str, StudyPaths]:
    # the study that has sessions of a rater, who has them in no other
    first: dict[str, tuple[StudyPaths, Path]] = {}
    for study, protocol in zip(studies, protocols, strict=True):
        for rater, session in protocol.rater_sessions:
            log = study.log_file(rater, session)
            if not log.exists():
                continue
            owner, other = first.setdefault(rater, (study, log))
            if owner != study:
                raise ParameterError(
                    f"rater {rater}: needed sessions in one of the studies, got "
                    f"{other} and {log}"
                )
    return {rater: owner for rater, (owner, _) in first.items()}


def _check_record(study: StudyPaths, shown_as: Path) -> None:
    # what is not copied, but made anew, may be of before the last event
    tables = (study.ratings_file, study.answers_file, study.raters_file)
    broken = [
        finding
        for finding in verify_study(study).findings
        if finding.weight == "broken"
        and finding.path not in (*tables, study.analysis_file)
        and not finding.path.is_relative_to(study.report)
    ]
    if broken:
        message = broken[0].message.replace(str(study.root), str(shown_as))
        more = f" and {len(broken) - 1} more" if len(broken) > 1 else ""
        raise ParameterError(
            f"{shown_as}: needed a record that is whole, got one that masrel verify "
            f"finds broken: {message}{more}"
        )


def _files(
    studies: Sequence[StudyPaths],
    protocols: Sequence[Protocol],
    owners: Mapping[str, StudyPaths],
    names: Mapping[Path, str],
) -> dict[str, Path]:
    # what is copied, by its path below the new folder
    copied: list[tuple[str, Path]] = []
    for study, protocol in zip(studies, protocols, strict=True):
        # a schedule that another site drew too is that of the site that followed it
        others = {
            file
            for rater, session in protocol.rater_sessions
            if owners.get(rater, study) != study
            for file in (
                study.schedule_file(rater, session),
                study.opened_file(rater, session),
                study.sheet_file(rater, session),
                study.typed_file(rater, session),
            )
        }
        sources = (
            study.published_file,
            study.published_answers_file,
            study.in_person_file,
        )
        of_study = [
            *_inside(
                study.schedules, study.sessions, study.training, study.calibrations
            ),
            *(study.root / model.file for model in protocol.models if model.file),
            *(path for path in sorted(study.sheets.glob("*.csv")) if has_answers(path)),
            *(file for file in sources if file.exists()),
        ]
        copied += [
            (file.relative_to(study.root).as_posix(), file)
            for file in of_study
            if file not in others
        ]
    copied += _rehearsals(studies)
    copied += [(name, log) for log, name in names.items()]
    files: dict[str, Path] = {}
    for name, file in copied:
        other = files.setdefault(name, file)
        if other != file and _content(other) != _content(file):
            raise ParameterError(f"{file}: needed what {other} holds, got other bytes")
    return files


def _inside(*folders: Path) -> list[Path]:
    return [
        path
        for folder in folders
        for path in sorted(folder.rglob("*"))
        if not path.is_dir()
    ]


def _rehearsals(studies: Sequence[StudyPaths]) -> Iterator[tuple[str, Path]]:
    # A number that holds another rehearsal of the same rater at a site before is taken:
    # then the next one that no site has.
    folders = [f for s in studies for f in s.rehearsals.glob("*") if f.name.isdecimal()]
    last = max((int(folder.name) for folder in folders), default=0)
    files: dict[str, Path] = {}
    for folder in folders:
        inside = {f.relative_to(folder).as_posix(): f for f in _inside(folder)}
        number = folder.name
        others = {name: files.get(f"{number}/{name}") for name in inside}
        if any(o and _content(o) != _content(inside[n]) for n, o in others.items()):
            last += 1
            number = str(last)
        files |= {f"{number}/{name}": file for name, file in inside.items()}
    for name, file in files.items():
        yield f"{studies[0].rehearsals.name}/{name}", file


def _content(file: Path) -> bytes:
    return read_regular(file, most=MAX_RECORDING)


def _conduct_names(studies: Sequence[StudyPaths]) -> dict[Path, str]:
    # the log of each folder under the folder's name, those merged before as they are
    names: dict[Path, str] = {}
    for study in studies:
        root = study.root.resolve().name
        for log in study.conduct_logs():
            name = f"conduct/{log.name}"
            if log == study.conduct_file:
                numbered = (f"conduct/{root}-{number}.jsonl" for number in count(2))
                name = f"conduct/{root}.jsonl"
                while name in names.values() or (study.root / name).exists():
                    name = next(numbered)
            names[log] = name
    return names


def _merged_logs(
    studies: Sequence[StudyPaths],
    protocols: Sequence[Protocol],
    names: Mapping[Path, str],
    part: Path,
) -> Iterator[dict[str, str | int | None]]:
    # what is recorded of every folder, and of every log that came with it
    for study, protocol in zip(studies, protocols, strict=True):
        logs: list[Path | None] = [*study.conduct_logs()]
        for log in logs or [None]:
            hashes = () if log is None else line_hashes(part / names[log])
            yield {
                "name": study.root.resolve().name,
                "log": None if log is None else names[log],
                "n_lines": len(hashes),
                "sha256": hashes[-1] if hashes else None,
                "protocol_sha256": protocol_hash(protocol),
            }


def _merged_protocol(studies: Sequence[StudyPaths]) -> bytes:
    # the file of a protocol with the raters of all sites
    contents = [read_regular(study.protocol, most=MAX_SMALL) for study in studies]
    first, *others = (parse_toml(content) for content in contents)
    for other in others:
        ids = [rater["id"] for rater in first["raters"]]
        first["raters"] += [r for r in other["raters"] if r["id"] not in ids]
        for session, more in zip(first["sessions"], other["sessions"], strict=True):
            there = session["raters"]
            session["raters"] = [*there, *(r for r in more["raters"] if r not in there)]
    if first == parse_toml(contents[0]):
        return contents[0]
    names = ", ".join(study.root.resolve().name for study in studies)
    head = f"# Merged from the protocols of {names}; their comments are in them."
    return "\n".join([head, *toml_lines(first)]).encode() + b"\n"
