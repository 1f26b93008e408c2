"""The README begins with the two commands that ``.ci/run`` takes from it."""

from docs.make.pages import ROOT, read


def test_the_first_two_shell_blocks_are_commands_of_one_line() -> None:
    blocks = read((ROOT / "README.md").read_text(encoding="utf-8"))
    commands = [block.lines for block in blocks if block.language == "sh"]
    (main_job,), (tests,) = commands[:2]
    assert main_job.endswith("masrel demo out")
    assert tests.endswith("python -m pytest -n auto")
