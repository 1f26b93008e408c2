"""Where the files of a study are."""

from dataclasses import dataclass
from pathlib import Path

__all__ = ["StudyPaths"]


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

    @property
    def protocol(self) -> Path:
        """The protocol file."""
        return self.root / "protocol.toml"

    @property
    def schedules(self) -> Path:
        """The folder of drawn schedules and raters' sheets."""
        return self.root / "schedules"

    @property
    def sessions(self) -> Path:
        """The folder of session logs and recordings."""
        return self.root / "sessions"

    @property
    def ratings(self) -> Path:
        """The folder of ratings tables."""
        return self.root / "ratings"

    @property
    def ratings_file(self) -> Path:
        """The table of ratings made from the session logs."""
        return self.ratings / "ratings.csv"

    @property
    def published_file(self) -> Path:
        """Ratings published elsewhere, when the study has some."""
        return self.ratings / "published.csv"

    @property
    def in_person_file(self) -> Path:
        """Grades given in person to the subjects behind the models."""
        return self.ratings / "in_person.csv"

    @property
    def analysis_file(self) -> Path:
        """The analysis, in full precision."""
        return self.root / "analysis.json"

    def schedule_file(self, rater: str, session: str) -> Path:
        """Return the file of one rater's schedule; it names the models."""
        return self.schedules / f"{session}_{rater}.csv"

    def sheet_file(self, rater: str, session: str) -> Path:
        """Return the file of one rater's blinded sheet."""
        return self.schedules / f"{session}_{rater}_sheet.csv"

    def log_file(self, rater: str, session: str) -> Path:
        """Return the file of one rater's session log."""
        return self.sessions / f"{session}_{rater}.jsonl"

    def recording_file(self, rater: str, session: str, code: str) -> Path:
        """Return the file of the recording of one presentation."""
        return self.sessions / f"{session}_{rater}" / f"{code}.npz"
