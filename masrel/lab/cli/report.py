"""``masrel report``: write the report of a study."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click

from masrel._files import check_inside, refuse_record
from masrel._input import check_option
from masrel._interpreter import collector_off
from masrel.cli._options import (
    STDOUT,
    GroupedHelp,
    OutputOptions,
    echo_notes,
    grouped,
    notes_of_call,
    output_options,
    write_json,
)
from masrel.errors import ParameterError
from masrel.lab._study_files import (
    CUT_OFF,
    MANIFEST,
    MAX_TABLE,
    is_cut_off,
    parse_json,
    read_once,
    read_regular,
    sha256_of,
)
from masrel.lab.cli._gating import GateOptions, conclude, gate_options, verdict_of
from masrel.lab.cli._study_options import ratings_option, read_study, warnings_as_notes
from masrel.lab.report._report_folder import (
    NOTES,
    NUMBERS,
    REFERENCES,
    keep_shown,
    last_shown,
    made_from,
    note_of,
    replace_report,
    report_changes,
)

FORMATS = ("html", "markdown", "latex", "docx")
_LONGEST = 40  # letters of a text in a cell
# They change nothing that is made or said
_OTHER_OPTIONS = (
    *("cache_folder", "check", "junit", "quiet", "json_file"),
    *("against", "no_change", "exact"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _CompareOptions:
    """What a report is compared with, and whether a change is a failure."""

    against: Path | None
    no_change: bool
    exact: bool

    def __post_init__(self) -> None:
        if (self.no_change or self.exact) and self.against is None:
            option = "--no-change" if self.no_change else "--exact"
            raise ParameterError(f"{option}: needs --against, the report to compare")

    def read(self, study: Path) -> dict[str, Any] | None:
        """Return the older analysis of a study; None if nothing is to be compared."""
        if self.against is None:
            return None
        # Imported here, as below: who has a report that is current needs none of it.
        from masrel.lab.analysis._comparison import read_old_analysis
        from masrel.lab.protocol import StudyPaths, read_protocol

        protocol = read_protocol(StudyPaths(study).protocol)
        return read_old_analysis(self.against, protocol.study.id, option="--against")

    def compare(
        self, old: Mapping[str, Any], new: Mapping[str, Any], *, shows: bool
    ) -> dict[str, object]:
        """Return what has changed as a document, and show it unless JSON is printed."""
        from masrel.lab.analysis._comparison import changed_inputs, changes_between
        from masrel.tables._tables import Column, as_text, table_of

        changes = changes_between(old, new, exact=self.exact)
        inputs = changed_inputs(old, new)
        if shows and changes:
            table = table_of(
                "changes",
                f"What has changed since {self.against}",
                (
                    Column(key="of", heading="Of", align="left"),
                    Column(key="field", heading="What", align="left"),
                    Column(key="old", heading="Before", digits=4),
                    Column(key="new", heading="Now", digits=4),
                    Column(key="difference", heading="Difference", digits=4),
                ),
                [
                    {**each, "old": _short(each["old"]), "new": _short(each["new"])}
                    for each in changes
                ],
                in_units=tuple(range(len(changes))),
                notes=inputs,
                data="simulated" * bool(old.get("simulated") or new.get("simulated")),
            )
            click.echo(as_text(table))
        elif shows:
            click.echo(
                "\n".join((f"no number has changed since {self.against}", *inputs))
            )
        return {
            "against": str(self.against),
            "changes": changes,
            "inputs": list(inputs),
        }


def _short(value: str | float | None) -> str | float | None:
    # a reason is a sentence; JSON has the whole of it
    if isinstance(value, str) and len(value) > _LONGEST:
        return f"{value[: _LONGEST - 1]}…"
    return value


_compare_options = grouped(
    "comparing",
    _CompareOptions,
    click.option(
        "--against",
        type=click.Path(path_type=Path),
        metavar="OLD",
        help="List every number that has changed since an older report: its folder, a "
        "study, or an analysis.json.",
    ),
    click.option(
        "--no-change",
        is_flag=True,
        help="With --against: exit with 1 if any number has changed.",
    ),
    click.option(
        "--exact",
        is_flag=True,
        help="With --against: compare to the last digit. Otherwise numbers that differ "
        "by at most 1e-9 of their size, or by 1e-12, count as equal, because "
        "processors and libraries round differently.",
    ),
)


@click.command("report", cls=GroupedHelp)
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    "destination",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder to write into; default: STUDY/report.",
)
@ratings_option
@click.option(
    "--only",
    multiple=True,
    metavar="SECTION",
    help="Report only this section: its text, tables and figures. This replaces the "
    "report in the folder. Repeatable.",
)
@click.option(
    "--format",
    "formats",
    multiple=True,
    type=click.Choice(FORMATS),
    help="Also write this format, in addition to those of the protocol. latex and docx "
    "need pandoc, which the extra masrel[docx] installs. Repeatable.",
)
@click.option(
    "--check",
    is_flag=True,
    help="Write nothing; list the files that would change, and exit with 1 if there "
    "are any.",
)
@gate_options()
@click.option(
    "--include",
    multiple=True,
    metavar="NAME",
    help="Also show something private: who (recorded each event), notes (their texts), "
    "or a field of raters that is not public. Repeatable.",
)
@click.option(
    "--cache",
    "cache_folder",
    type=click.Path(path_type=Path, file_okay=False),
    help=f"Folder that keeps the inputs of the last report; default: STUDY/{NOTES}.",
)
@_compare_options
@output_options(
    json='Write the results of gates, --check and --against as JSON to this file; "-" '
    "writes them to standard output and prints nothing else.",
    raw_csv="Do not put an apostrophe before cells that a spreadsheet would run as "
    "formulas.",
    quiet="Show no progress bar.",
    makes_folder=True,
)
def report(
    study: Path,
    destination: Path | None,
    ratings_file: Path | None,
    only: tuple[str, ...],
    formats: tuple[str, ...],
    check: bool,
    gating: GateOptions,
    include: tuple[str, ...],
    cache_folder: Path | None,
    comparing: _CompareOptions,
    output: OutputOptions,
) -> None:
    """Write the report of STUDY: HTML, Markdown, tables and figures.

    The analysis follows the plan in the protocol; the same inputs give the same bytes.
    If nothing has changed since the last report, nothing is written.
    """
    folder, notes = destination or study / "report", cache_folder or study / NOTES
    for option, place in ((destination, folder), (cache_folder, notes)):
        if option is None:
            check_inside(place, study)
        refuse_record(place / "report.html")  # before anything is computed
    params = click.get_current_context().params
    options = {k: str(v) for k, v in params.items() if k not in _OTHER_OPTIONS}
    hashed = partial(made_from, study, options, ratings_file, (folder, notes))
    old = comparing.read(study)  # which may be what is replaced
    made = hashed()  # a file that comes later is a change
    note = note_of(folder, notes)
    shown, changes = last_shown(note, made, folder), list[str]()
    if shown is not None:
        echo_notes(shown["notes"])
        numbers = read_regular(folder / NUMBERS, most=MAX_TABLE)
    else:
        cut_off = f"note: {folder}: {CUT_OFF}\n" * is_cut_off(folder)
        click.echo(cut_off, err=True, nl=False)
        # most of what libraries and figures make stays in use
        with read_once(), collector_off():
            files, shown = _made(
                study, ratings_file, only, formats, gating, include, output
            )
        numbers = files[NUMBERS]
        if check:
            changes = _changes(files, folder)
        else:
            replace_report(folder, files)
            keep_shown(note, shown, before=made, after=hashed())
    verdict = shown["verdict"]
    prints_json = output.json_file == STDOUT
    click.echo(shown["read"], err=True)
    pages = [folder / name for name in shown["pages"] if name != "report.md"]
    for line in changes if check else pages or [folder / "report.md"]:
        click.echo(line, err=prints_json)
    document: dict[str, Any] = {"gates": verdict["gates"]}
    if check:
        document["check"] = changes
    if old is not None:
        new = parse_json(numbers)
        document |= comparing.compare(old, new, shows=not prints_json)
    if output.json_file is not None:
        write_json(document, output.json_file)
    conclude(verdict, gating)
    if changes or (comparing.no_change and document["changes"]):
        click.get_current_context().exit(1)


def _made(
    study: Path,
    ratings_file: Path | None,
    only: tuple[str, ...],
    formats: tuple[str, ...],
    gating: GateOptions,
    include: tuple[str, ...],
    output: OutputOptions,
) -> tuple[dict[str, bytes], dict[str, Any]]:
    # -> the files of the report, and what is said of it
    # Imported here: who has a report that is current needs none of it.
    from tqdm import tqdm

    from masrel.lab.analysis import analyze
    from masrel.lab.report._conduct import study_conduct
    from masrel.lab.report._document import make_report, section_names
    from masrel.lab.report._material import gather
    from masrel.lab.report._pages import CONVERTED, pandoc_version
    from masrel.lab.verification import anchors_of

    data = read_study(study, ratings_file, allows_sealed=True)
    protocol, ratings = data.protocol, data.ratings
    known = section_names(protocol, is_sealed=ratings.is_sealed)
    for name in only:
        check_option("--only", name, known)
    if CONVERTED & {*protocol.report.formats, *formats}:
        pandoc_version()
    gates = gating.gates(protocol)
    conduct = study_conduct(data.paths, protocol, file=ratings_file, include=include)
    with warnings_as_notes():
        analysis = analyze(
            protocol,
            ratings,
            in_person=data.in_person,
            answers=data.answers,
            excluded=data.excluded,
            changes=data.changes,
        )
    in_person, folder = data.in_person, data.paths.sessions
    material = gather(protocol, ratings, analysis, in_person, folder, conduct)
    bar = tqdm(desc="report", unit=" parts", disable=output.quiet or None)

    def progress(part: str) -> None:
        bar.set_postfix_str(part, refresh=False)
        bar.update()

    with warnings_as_notes(), bar:
        files = make_report(
            material,
            # of what is simulated none, so that it repeats byte for byte
            anchors=() if ratings.simulated else anchors_of(data.paths),
            progress=progress,
            raw_csv=output.raw_csv,
            only=only,
            formats=formats,
        )
    return files, {
        # of what is written, not of what is there: others may write there, too
        "manifest": sha256_of(files[MANIFEST]),
        "notes": notes_of_call(),
        "read": f"read: {data.read}",
        "pages": [
            name
            for name in files
            if "/" not in name and name not in (MANIFEST, NUMBERS, REFERENCES)
        ],
        "verdict": verdict_of(analysis, gates),
    }


def _changes(files: Mapping[str, bytes], folder: Path) -> list[str]:
    changed, stale = report_changes(folder, files)
    return [
        *(
            f"{path}: would {'change' if path.exists() else 'be new'}"
            for path in (folder / name for name in changed)
        ),
        *(f"{path}: would go" for path in stale),
    ]
