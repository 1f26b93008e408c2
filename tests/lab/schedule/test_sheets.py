"""A schedule file is read back as written, and anything else is refused by line."""

import tempfile
from pathlib import Path

import pytest

from masrel.errors import ScheduleError
from masrel.lab.protocol import StudyPaths
from masrel.lab.schedule.presentation import draw_schedule, read_schedule
from masrel.lab.schedule.sheets import write_schedules
from tests.lab.schedule.studies import SECRET, protocol_of, with_secret

PROTOCOL = protocol_of(models=("A", "B"))
SCHEDULE = draw_schedule(PROTOCOL, "R1", "test", secret=SECRET)


def written() -> list[str]:
    """The lines of the file of `SCHEDULE`."""
    with tempfile.TemporaryDirectory() as folder:
        study = with_secret(StudyPaths(Path(folder)))
        write_schedules(PROTOCOL, study)
        return study.schedule_file("R1", "test").read_text("utf-8").splitlines()


LINES = written()


def test_the_file_is_provenance_then_rows() -> None:
    first, second = SCHEDULE.presentations
    assert LINES == [
        "# format: 1",
        "# study: tiny",
        "# rater: R1",
        "# session: test",
        "# seed: 1",
        "# scheme: random-order",
        f"# protocol_sha256: {SCHEDULE.protocol_sha256}",
        f"# presented_sha256: {SCHEDULE.presented_sha256}",
        f"# masrel_version: {SCHEDULE.masrel_version}",
        f"# commitment: {SCHEDULE.commitment}",
        "position,code,model,repeat",
        f"1,{first.code},{first.model},1",
        f"2,{second.code},{second.model},1",
    ]


@pytest.mark.parametrize(
    ("lines", "ending"),
    # before formats had numbers no file named one
    [(LINES, "\n"), (LINES, "\r\n"), (LINES[1:], "\n")],
)
def test_what_was_written_is_read_back(
    tmp_path: Path, lines: list[str], ending: str
) -> None:
    path = tmp_path / "test_R1.csv"
    path.write_bytes((ending.join(lines) + ending).encode())
    assert read_schedule(path) == SCHEDULE


def problems_of(lines: list[str], folder: Path) -> list[str]:
    path = folder / "test_R1.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(ScheduleError) as caught:
        read_schedule(path)
    return [text.removeprefix(f"{path}: ") for text in str(caught.value).splitlines()]


@pytest.mark.parametrize(
    ("number", "line", "message"),
    [
        (1, "# format: 2", "needed format 1, got 2"),
        (2, None, "needed a line '# study: ...', got none"),
        (2, "# studio: tiny", "line 2: needed '# key: value'"),
        (3, "# study: tiny", "line 3: needed '# key: value'"),
        (5, "# seed: -1", "line 5: needed seed"),
        (7, "# protocol_sha256: 12", "line 7: needed protocol_sha256"),
        (11, "code,position,model,repeat", "line 11: needed columns position,code"),
        (10, "# commitment: no", "line 10: needed commitment"),
        (12, "2,47K,A,1", "line 12: needed position 1, got '2'"),
        (12, "1,../x,A,1", "line 12: needed a code of letters and digits, got '../x'"),
        (12, "1,47K,,1", "line 12: needed the id of a model"),
        (12, "1,47K,A,0", "line 12: needed repeat"),
        (12, "1,47K,A", "line 12: needed 4 cells, got 3"),
        (13, f"2,{SCHEDULE.presentations[0].code},B,1", "line 13: needed codes that"),
    ],
)
def test_a_wrong_line_is_named(
    tmp_path: Path, number: int, line: str | None, message: str
) -> None:
    lines = list(LINES)
    lines[number - 1 : number] = [] if line is None else [line]
    assert any(said.startswith(message) for said in problems_of(lines, tmp_path))


def test_every_wrong_line_is_named_at_once(tmp_path: Path) -> None:
    lines = list(LINES)
    lines[4], lines[11], lines[12] = "# seed: x", "1,47K", "3,48K,B,1"
    places = [said.partition(":")[0] for said in problems_of(lines, tmp_path)]
    assert places == ["line 5", "line 12", "line 13"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "needed a schedule file, got: No such file"),
        (b"", "needed columns position,code,model,repeat, got nothing"),
        (b"\xff\xfe", "needed UTF-8 text"),
        ("\n".join(LINES[:11]).encode(), "needed at least one presentation, got none"),
    ],
)
def test_a_file_that_is_no_schedule_is_refused(
    tmp_path: Path, content: bytes | None, message: str
) -> None:
    path = tmp_path / "x.csv"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ScheduleError, match=message):
        read_schedule(path)
