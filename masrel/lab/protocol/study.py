"""Where the files of a study are, and copying a bundled study as a new one."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import masrel
from masrel._files import is_part, write_files
from masrel.errors import ParameterError

_OPENED = "opened"
"""Folder of schedules that were sealed, with their models."""


@dataclass(frozen=True, slots=True)
class _StudyFile:
    """A file or folder of a study, by its path from the study's folder."""

    path: str
    __doc__: str

    def __get__(self, study: "StudyPaths", owner: object) -> Path:
        return study.root / self.path


@dataclass(frozen=True, slots=True)
class StudyPaths:
    """The folder of a study and the place of every file in it.

    Attributes
    ----------
    root : Path
        The study's folder.

    Examples
    --------
    >>> StudyPaths(Path("elbow")).sheet_file("R1", "test").as_posix()
    'elbow/schedules/test_R1_sheet.csv'
    """

    root: Path

    protocol = _StudyFile("protocol.toml", "The protocol file.")
    schedules = _StudyFile(
        "schedules", "The folder of drawn schedules and raters' sheets."
    )
    ratings_file = _StudyFile(
        "ratings/ratings.csv", "The table of ratings made from the session logs."
    )
    answers_file = _StudyFile(
        "ratings/answers.csv",
        "The table of answers to questionnaires made from the logs.",
    )
    published_answers_file = _StudyFile(
        "ratings/published_answers.csv",
        "Answers published elsewhere, or that fit what is.",
    )
    published_file = _StudyFile(
        "ratings/published.csv", "Ratings published elsewhere, when the study has some."
    )
    in_person_file = _StudyFile(
        "ratings/in_person.csv",
        "Grades given in person to the subjects behind the models.",
    )
    claims_file = _StudyFile(
        "ratings/claims.csv",
        "What a paper prints of the agreement, when the study was published.",
    )
    analysis_file = _StudyFile("analysis.json", "The analysis, in full precision.")
    report = _StudyFile("report", "The folder of the report.")
    conduct_file = _StudyFile(
        "conduct.jsonl", "The log of what happened beside the sessions."
    )
    merged_conduct = _StudyFile(
        "conduct",
        "The folder of such logs of the studies that this one was merged from.",
    )
    raters_file = _StudyFile(
        "ratings/raters.csv", "The table of raters that goes with that of ratings."
    )
    secret_file = _StudyFile(
        ".key/secret.txt",
        "The secret that decides orders and codes; its folder is its owner's alone.",
    )
    serve_key_file = _StudyFile(
        ".key/serve.txt",
        "The key that cookies of `masrel serve` are signed with; it stays there.",
    )
    published_secret_file = _StudyFile(
        "published_secret.txt", "The same secret once everybody may know it."
    )
    calibrations = _StudyFile(
        "calibrations", "The folder of what was measured on the device."
    )
    training = _StudyFile(
        "training",
        "The folder of training logs and recordings; no rating of the study.",
    )
    rehearsals = _StudyFile(
        "rehearsals",
        "The folder of logs and recordings of rehearsals; no rating of the study.",
    )
    sheets = _StudyFile(
        "sheets", "The folder of sheets to print, and of files to type them into."
    )

    @property
    def sessions(self) -> Path:  # which a rehearsal has elsewhere
        """The folder of session logs and recordings."""
        return self.root / "sessions"

    def logs(self) -> list[Path]:
        """Return the session logs that are there, whosever they are."""
        return sorted(path for path in self.sessions.glob("*.jsonl") if path.is_file())

    def conduct_logs(self) -> list[Path]:
        """Return the logs of conduct that are there: of the merged studies, its own."""
        merged = sorted(self.merged_conduct.glob("*.jsonl"))
        return [*merged, *(f for f in [self.conduct_file] if f.exists())]

    def schedule_file(self, rater: str, session: str) -> Path:
        """Return the file of one rater's schedule; it names the models."""
        return self.schedules / f"{session}_{rater}.csv"

    def opened_file(self, rater: str, session: str) -> Path:
        """Return the file of a sealed schedule with its models, once they are known."""
        return self.schedules / _OPENED / f"{session}_{rater}.csv"

    def sheet_file(self, rater: str, session: str) -> Path:
        """Return the file of one rater's blinded sheet."""
        return self.schedules / f"{session}_{rater}_sheet.csv"

    def typed_file(self, rater: str, session: str) -> Path:
        """Return the file into which one rater's printed sheet is typed."""
        return self.sheets / f"{session}_{rater}.csv"

    def log_file(self, rater: str, session: str) -> Path:
        """Return the file of one rater's session log."""
        return self.sessions / f"{session}_{rater}.jsonl"

    def training_log_file(self, rater: str) -> Path:
        """Return the file of the log of one rater's training."""
        return self.training / f"{rater}.jsonl"


# What a bundled study may hold; nothing drawn, run or computed in it is copied
_BUNDLED = (
    "README.md",
    "ratings/published.csv",
    "ratings/published_answers.csv",
    "ratings/in_person.csv",
    "published_secret.txt",
    "protocol.toml",  # last: a folder that has one is a study
)


def template_names() -> tuple[str, ...]:
    """Return the names of the bundled studies.

    Returns
    -------
    tuple of str
        In alphabetical order.

    Examples
    --------
    >>> template_names()
    ('hess2012', 'small', 'tone', 'two-sites')
    """
    return tuple(sorted(file.parent.name for file in _home().glob("*/protocol.toml")))


def copy_template(name: str, destination: Path) -> None:
    """Copy a bundled study into a new or empty folder, its protocol last.

    A copy that was killed leaves no protocol, and the same call again completes it.

    Parameters
    ----------
    name : str
        One of :func:`template_names`.
    destination : Path
        The new study's folder; made when it does not exist.

    Raises
    ------
    ParameterError
        If there is no such study, or `destination` is a file or holds anything.
    OSError
        If the system refuses a folder or file.
    """
    if name not in template_names():
        known = ", ".join(template_names())
        raise ParameterError(f"study: needed one of {known}, got {name!r}")
    # Contents only: an installed file may be read-only, a study is edited.
    sources = {destination / part: _home() / name / part for part in _BUNDLED}
    contents = {to: of.read_bytes() for to, of in sources.items() if of.is_file()}
    _check_new_folder(destination, contents)
    write_files(contents, within=destination)


def _check_new_folder(destination: Path, contents: Mapping[Path, bytes]) -> None:
    """Refuse a folder that holds anything beside what a killed copy has left."""
    if not destination.exists():
        return
    if not destination.is_dir():
        raise ParameterError(f"{destination}: needed a new or empty folder, got a file")
    begun = not StudyPaths(destination).protocol.exists()  # which a copy writes last
    folders = {path.parent for path in contents if begun and path.parent.is_dir()}
    held = [
        path.name
        for inside in sorted(folders | {destination})
        for path in sorted(inside.iterdir())
        if path not in folders
        and not is_part(path)
        and not (begun and path in contents and path.read_bytes() == contents[path])
    ]
    if held:
        raise ParameterError(
            f"{destination}: needed a new or empty folder, got one that holds {held[0]}"
            + (f" and {len(held) - 1} more" if len(held) > 1 else "")
        )


def _home() -> Path:
    # A wheel carries the studies inside the package, the repository beside it.
    package = Path(masrel.__file__).parent
    inside = package / "studies"
    return inside if inside.is_dir() else package.parent / "studies"
