"""Folders of several sites put together: copied, never changed, verified."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from masrel._files import make_folder, write_files
from masrel.errors import ParameterError, ScheduleError
from masrel.lab._bounded_files import MAX_RECORDING, read_regular
from masrel.lab._durable_files import new_folder
from masrel.lab._event_log import line_hashes, utc_now
from masrel.lab.conduct._study_log import append_event
from masrel.lab.merging._site_protocols import check_protocols, merged_protocol
from masrel.lab.paper._printing import has_answers
from masrel.lab.protocol import Protocol, StudyPaths, protocol_hash, read_protocol
from masrel.lab.schedule import read_schedule
from masrel.lab.schedule._secret import find_secret
from masrel.lab.verification import verify_study


@dataclass(frozen=True, slots=True, kw_only=True)
class MergedStudy:
    """What was merged.

    Attributes
    ----------
    study : StudyPaths
        The new folder.
    protocol : Protocol
        Its protocol.
    n_files : int
        Files in it.
    """

    study: StudyPaths
    protocol: Protocol
    n_files: int


def merge_studies(
    studies: Sequence[StudyPaths],
    destination: Path,
    *,
    now: Callable[[], datetime] = utc_now,
) -> MergedStudy:
    """Put the sites of one study together in a new folder.

    Parameters
    ----------
    studies : sequence of StudyPaths
        Two or more folders. Their protocols may differ in their raters alone, their
        schedules are drawn from one secret, and no rater has a session in two of them.
    destination : Path
        The new study's folder; new or empty.
    now : callable, optional
        Gives the time of day for the log of conduct, aware.

    Returns
    -------
    MergedStudy
        All raters, schedules, sheets that were typed, logs and recordings of sessions,
        trainings and rehearsals, and logs of conduct, byte for byte. No secret is
        copied, nor what was made of the logs.

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
    check_protocols(studies, protocols)
    _check_secrets(studies)
    owners = _owners(studies, protocols)
    for study in studies:
        _check_record(study, study.root)
    files = _files(studies, protocols, owners)
    with new_folder(destination) as part:
        merged = StudyPaths(part)
        _write(merged, files, merged_protocol(studies))
        protocol = read_protocol(merged.protocol)
        for fields in _merged_logs(studies, protocols, part):
            append_event(merged, protocol, "merged", fields, now=now)
        _check_record(merged, destination)
    study = StudyPaths(destination)
    return MergedStudy(study=study, protocol=protocol, n_files=len(files) + 2)


def _check_destination(studies: Sequence[StudyPaths], destination: Path) -> None:
    if len(studies) < 2:
        raise ParameterError(f"studies: needed two or more, got {len(studies)}")
    if len({study.root.resolve() for study in studies}) < len(studies):
        raise ParameterError("studies: needed different folders, got one twice")
    if destination.exists() and (
        not destination.is_dir() or any(destination.iterdir())
    ):
        raise ParameterError(f"{destination}: needed a new or empty folder")
    if not destination.resolve().parent.is_dir():
        raise ParameterError(f"{destination}: needed a folder to make it in, got none")
    for study in studies:
        if destination.resolve().is_relative_to(study.root.resolve()):
            raise ParameterError(
                f"{destination}: needed a folder outside {study.root}, which is merged"
            )


def _check_secrets(studies: Sequence[StudyPaths]) -> None:
    first: tuple[Path, str | None] | None = None
    for place, commitment in _commitments(studies):
        if first is None:
            first = place, commitment
        elif commitment != first[1]:
            raise ScheduleError(
                f"{place}: commitment: needed that of {first[0]}, {first[1]}, got "
                f"{commitment}: sites of one study are drawn from one secret"
            )


def _commitments(studies: Sequence[StudyPaths]) -> Iterator[tuple[Path, str | None]]:
    for study in studies:
        for file in sorted(study.schedules.glob("*.csv")):
            if not file.name.endswith("_sheet.csv"):
                yield file, read_schedule(file).commitment
        secret = find_secret(study)
        if secret is not None:
            yield study.secret_file, secret.commitment


def _owners(
    studies: Sequence[StudyPaths], protocols: Sequence[Protocol]
) -> dict[str, StudyPaths]:
    # the study that has sessions of a rater, who has them in no other
    first: dict[str, tuple[StudyPaths, Path]] = {}
    for study, protocol in zip(studies, protocols, strict=True):
        for session in protocol.sessions:
            for rater in session.raters:
                log = study.log_file(rater, session.id)
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
    broken = [
        finding
        for finding in verify_study(study).findings
        if finding.weight == "broken" and not _is_made_anew(study, finding.path)
    ]
    if broken:
        message = broken[0].message.replace(str(study.root), str(shown_as))
        more = f" and {len(broken) - 1} more" if len(broken) > 1 else ""
        raise ParameterError(
            f"{shown_as}: needed a record that is whole, got one that masrel verify "
            f"finds broken: {message}{more}"
        )


def _is_made_anew(study: StudyPaths, path: Path) -> bool:
    # what is not copied may be of before the last event
    tables = (study.ratings_file, study.answers_file, study.raters_file)
    return path in (*tables, study.analysis_file) or path.is_relative_to(study.report)


def _files(
    studies: Sequence[StudyPaths],
    protocols: Sequence[Protocol],
    owners: Mapping[str, StudyPaths],
) -> dict[str, Path]:
    # what is copied, by its path below the new folder
    files: dict[str, Path] = {}
    for study, protocol in zip(studies, protocols, strict=True):
        # a schedule that another site drew too is that of the site that followed it
        others = {
            file
            for session in protocol.sessions
            for rater in session.raters
            if owners.get(rater, study) != study
            for file in (
                study.schedule_file(rater, session.id),
                study.sheet_file(rater, session.id),
                study.typed_file(rater, session.id),
            )
        }
        for file in _files_of(study, protocol):
            if file not in others:
                _add(files, file.relative_to(study.root).as_posix(), file)
    for name, log in (*_rehearsals(studies), *_conduct_logs(studies)):
        _add(files, name, log)
    return files


def _files_of(study: StudyPaths, protocol: Protocol) -> Iterator[Path]:
    for folder in (study.schedules, study.sessions, study.training):
        yield from _inside(folder)
    yield from (study.root / model.file for model in protocol.models if model.file)
    typed = (path for path in study.sheets.glob("*.csv") if has_answers(path))
    yield from sorted(typed)
    sources = (study.published_file, study.published_answers_file, study.in_person_file)
    yield from (file for file in sources if file.exists())


def _inside(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.rglob("*")) if not path.is_dir()]


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


def _add(files: dict[str, Path], name: str, file: Path) -> None:
    other = files.setdefault(name, file)
    if other != file and _content(other) != _content(file):
        raise ParameterError(f"{file}: needed what {other} holds, got other bytes")


def _content(file: Path) -> bytes:
    return read_regular(file, most=MAX_RECORDING)


def _conduct_logs(studies: Sequence[StudyPaths]) -> Iterator[tuple[str, Path]]:
    # the log of each folder under the folder's name, those merged before as they are
    used: set[str] = set()
    for study in studies:
        for log in study.conduct_logs():
            name = log.name if log != study.conduct_file else _name(study, used)
            used.add(name)
            yield f"conduct/{name}", log


def _name(study: StudyPaths, used: set[str]) -> str:
    name, number = study.root.resolve().name, 1
    while f"{name}.jsonl" in used or (study.merged_conduct / f"{name}.jsonl").exists():
        number += 1
        name = f"{study.root.resolve().name}-{number}"
    return f"{name}.jsonl"


def _merged_logs(
    studies: Sequence[StudyPaths], protocols: Sequence[Protocol], part: Path
) -> Iterator[dict[str, str | int | None]]:
    # what is recorded of every folder, and of every log that came with it
    names = {log: name for name, log in _conduct_logs(studies)}
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


def _write(merged: StudyPaths, files: dict[str, Path], protocol: bytes) -> None:
    # For their owner alone from the start, however open the sources are: schedules and
    # recordings name the models, and logs say who did what and why.
    folders = {merged.root / parent for name in files for parent in Path(name).parents}
    for folder in sorted(folders):
        make_folder(folder, mode=0o700)
    for name, file in files.items():
        content = {merged.root / name: _content(file)}
        write_files(content, within=merged.root, mode=0o600)
    write_files({merged.protocol: protocol}, mode=0o600)
