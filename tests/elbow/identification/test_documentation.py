"""The examples of docs/identification.md print what the page says."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs/identification.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"```\n\$ masrel ([^\n]+)\n(.*?)```", PAGE, flags=re.DOTALL)
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)


def output(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        check=True,
        encoding="utf-8",
        cwd=folder,
    )
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the first example is run: it writes the recordings that a command reads."""
    made: Path = tmp_path_factory.mktemp("page")
    (made / "studies").symlink_to(ROOT / "studies", target_is_directory=True)
    return made


def test_the_examples_and_commands_print_what_the_page_says(folder: Path) -> None:
    assert (len(EXAMPLES), len(COMMANDS)) == (2, 3)
    for example in EXAMPLES:
        said = re.findall(r"# prints (.*)", example)
        assert said
        assert output(folder, "-W", "error", "-c", example).splitlines() == said
    for command, said in COMMANDS:
        words: list[str] = []
        for word in shlex.split(command):
            found = (
                sorted(path.name for path in folder.glob(word)) if "*" in word else []
            )
            words += found or [word]
        assert output(folder, "-m", "masrel", *words) == said
    assert (folder / "S3.toml").is_file()


def test_every_file_the_page_points_to_is_there() -> None:
    targets = re.findall(r"\]\((?!https?://)([^)#]+)", PAGE)
    assert len(targets) >= 8
    assert [name for name in targets if not (ROOT / "docs" / name).exists()] == []


def test_the_table_of_coverage_is_within_what_it_claims() -> None:
    # the slow test measures two of its rows; the page must not say otherwise
    rows = re.findall(r"^\| HM\d, .*?\|((?: [\d.]+ \|)+)$", PAGE, flags=re.MULTILINE)
    assert len(rows) == 5
    shares = [float(value) for row in rows for value in row.strip(" |").split("|")]
    assert len(shares) == 40
    assert all(90.0 <= share <= 98.0 for share in shares)
