"""Nothing in the README is untrue. Its commands are run whole by ``.ci/run``."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def code_blocks(language: str) -> list[str]:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", readme, flags=re.DOTALL)


def test_the_first_two_shell_blocks_are_commands_of_one_line() -> None:
    main_job, tests = (block.strip() for block in code_blocks("sh")[:2])
    assert "\n" not in main_job
    assert main_job.endswith("masrel demo out")
    assert "\n" not in tests
    assert tests.endswith("python -m pytest -n auto")


def test_the_python_example_prints_what_the_readme_says() -> None:
    (example,) = code_blocks("python")
    said = [
        line.split("# prints ")[1]
        for line in example.splitlines()
        if "# prints " in line
    ]
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", example],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert said
    assert done.stdout.splitlines() == said


def test_every_file_the_readme_points_to_is_there() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    targets = re.findall(r"\]\((?!https?://)([^)#]+)", readme)
    assert targets
    assert [name for name in targets if not (ROOT / name).exists()] == []
