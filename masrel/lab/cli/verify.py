"""``masrel verify``: whether the record of a study is whole."""

import dataclasses
import sys
from collections import Counter
from collections.abc import Iterable, Mapping
from operator import attrgetter
from pathlib import Path

import click

from masrel.cli._options import (
    STDOUT,
    OutputOptions,
    output_options,
    write_json,
)
from masrel.cli._paths import InputFile
from masrel.errors import ParameterError
from masrel.lab._study_files import read_once
from masrel.lab.cli._study_options import echo_stamp, stamp_option, warnings_as_notes
from masrel.lab.protocol import StudyPaths
from masrel.lab.verification import (
    Anchor,
    Finding,
    SessionRecord,
    Verification,
    anchor_findings,
    anchors_of,
    read_anchors,
    read_stamp,
    verify_study,
    write_anchors,
)


@click.command("verify")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--anchor",
    "anchor_file",
    type=click.Path(path_type=Path, dir_okay=False),
    help="File of hashes kept outside the study. The logs are compared with it; if it "
    "does not exist, it is created.",
)
@stamp_option
@click.option(
    "--authority",
    type=InputFile(path_type=Path),
    help="Certificate (PEM) of the service that stamped the file of hashes.",
)
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints nothing '
    "else."
)
@read_once()
def verify(
    study: Path,
    anchor_file: Path | None,
    stamp: str | None,
    authority: Path | None,
    output: OutputOptions,
) -> None:
    """Check every file of STUDY against the file it was made from.

    Protocol, schedules, logs and recordings of sessions, trainings and rehearsals,
    tables, analysis and report are checked. Prints the progress of each session, what
    is wrong, and an anchor for each log: a hash that, if kept elsewhere, shows that its
    lines were not rewritten.

    A finding is broken, stale or a doubt. Broken: no state of the record could look
    like this or produce this; the exit code is 2. Stale: the file was made from an
    earlier state of the record, or from something that no log keeps, and the command
    that makes it again is named; the exit code is 1 if nothing is broken. Doubt: there
    may be an innocent reason; the exit code is 0, as without findings.
    """
    if not study.is_dir():
        raise ParameterError(f"{study}: needed the folder of a study, got none")
    paths = StudyPaths(study)
    with warnings_as_notes():
        verification = verify_study(paths)
    anchors = anchors_of(paths)
    findings = (*verification.findings, *_anchored(paths, anchor_file, anchors))
    if anchor_file is not None and anchor_file.exists():
        _say_stamp(anchor_file, stamp, authority)
    verification = dataclasses.replace(verification, findings=findings)
    n: Counter[str] = Counter(finding.weight for finding in findings)
    if output.json_file is not None:
        write_json(_document(verification, anchors), output.json_file)
    if output.json_file != STDOUT:
        _show(study, verification, anchors, n)
    sys.exit(2 if n["broken"] else 1 if n["stale"] else 0)


def _anchored(
    study: StudyPaths, file: Path | None, anchors: tuple[Anchor, ...]
) -> Iterable[Finding]:
    if file is None:
        return ()
    if file.resolve().is_relative_to(study.root.resolve()):
        raise ParameterError(
            f"--anchor: needed a file outside {study.root}, got {file}: anybody "
            "who can change the study could change it too"
        )
    if file.exists():
        old = read_anchors(file)
        lines = {each.log: each.line for each in sorted(old, key=attrgetter("line"))}
        newer = sum(lines.get(each.log, 0) < each.line for each in anchors)
        if newer:
            click.echo(
                f"note: {newer} of {len(anchors)} logs have lines that no anchor in "
                f"{file} covers yet; to keep anchors of them too, name "
                "another file with --anchor",
                err=True,
            )
        return anchor_findings(study, old)
    if anchors:
        write_anchors(anchors, file)
        click.echo(f"anchors: {file}", err=True)
    else:
        click.echo(
            f"there is no log to anchor yet, so {file} was not written", err=True
        )
    return ()


def _say_stamp(file: Path, service: str | None, authority: Path | None) -> None:
    echo_stamp(file, service)
    if service is None and (time := read_stamp(file, authority)) is not None:
        by = "" if authority is None else f" by {authority}"
        click.echo(f"{file} was stamped{by}: {time.isoformat()}", err=True)


def _document(
    verification: Verification, anchors: tuple[Anchor, ...]
) -> dict[str, object]:
    document = {
        "is_whole": verification.is_whole,
        **dataclasses.asdict(verification),
    }
    for finding in document["findings"]:
        finding["path"] = str(finding["path"])
    return {**document, "anchors": [dataclasses.asdict(anchor) for anchor in anchors]}


def _line_of(record: SessionRecord, *, is_training: bool) -> str:
    # how far a session, a rehearsal or a training came, which has no schedule
    which = f"{record.session} {record.rater}"
    if record.rehearsal is not None:
        which = f"rehearsal {record.rehearsal} of {which}"
    if record.stage in ("not begun", "unreadable") and not is_training:
        return f"{which}: {record.stage}"
    of = "" if is_training else f" of {record.n_presentations}"
    parts = (
        f"{which}: {record.stage}",
        f"{record.n_graded}{of} graded",
        f"{record.n_skipped} skipped" if record.n_skipped else None,
        f"{record.n_corrections} corrected" if record.n_corrections else None,
        f"{record.n_recordings} recordings",
    )
    return ", ".join(filter(None, parts))


def _show(
    study: Path,
    verification: Verification,
    anchors: tuple[Anchor, ...],
    n: Mapping[str, int],
) -> None:
    for record in (*verification.sessions, *verification.rehearsals):
        click.echo(_line_of(record, is_training=False))
    for record in verification.trainings:
        click.echo(_line_of(record, is_training=True))
    for anchor in anchors:
        click.echo(f"anchor: {anchor}")
    for finding in verification.findings:
        click.echo(f"{finding.weight}: {finding.message}", err=True)
    weights = {"broken": "broken", "stale": "out of date", "doubt": "in doubt"}
    counts = ", ".join(f"{n[key]} {text}" for key, text in weights.items() if n[key])
    if n["broken"] or n["stale"]:
        click.echo(f"masrel: {study}: {counts}", err=True)
    else:
        click.echo(f"{study}: whole{counts and ', '}{counts}.")
