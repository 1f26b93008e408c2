"""What is loaded, seen by looking at the loaded modules of a fresh interpreter."""

import json
import subprocess
import sys

import pytest

HEAVY = {"pandas", "scipy", "statsmodels", "matplotlib", "emcee", "arviz_stats"}


def loaded_after(code: str) -> set[str]:
    """Top-level names of the modules a fresh interpreter holds after `code`."""
    script = (
        "import sys, json, io, contextlib\n"
        "with contextlib.redirect_stdout(io.StringIO()):\n"
        "    try:\n"
        + "".join(f"        {line}\n" for line in code.splitlines())
        + "    except SystemExit:\n        pass\n"
        "print(json.dumps(sorted({name.split('.')[0] for name in sys.modules})))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    return set(json.loads(done.stdout))


@pytest.mark.parametrize(
    "code",
    [
        "import masrel",
        "from masrel.cli import cli\ncli(['--help'])",
        "from masrel.cli import cli\ncli(['--version'])",
    ],
)
def test_the_package_and_its_help_load_nothing_heavy(code: str) -> None:
    assert loaded_after(code) & (HEAVY | {"numpy"}) == set()


@pytest.mark.parametrize("package", ["agreement", "intervals", "lab.elbow", "lab.hess"])
def test_a_library_loads_numpy_at_most(package: str) -> None:
    assert loaded_after(f"import masrel.{package}") & HEAVY == set()


@pytest.mark.parametrize("stage", ["protocol", "schedule", "run"])
def test_a_stage_before_the_ratings_loads_no_pandas(stage: str) -> None:
    assert loaded_after(f"import masrel.lab.{stage}") & HEAVY == set()


def test_one_kappa_loads_numpy_alone() -> None:
    code = (
        "from masrel.agreement import fleiss_kappa\n"
        "fleiss_kappa([['1', '1'], ['1', '2']], categories=['1', '2'])"
    )
    assert loaded_after(code) & HEAVY == set()


def test_an_analysis_loads_no_matplotlib() -> None:
    loaded = loaded_after("import masrel.lab.analysis, masrel.ratings")
    assert loaded & {"matplotlib", "emcee", "statsmodels"} == set()


def test_sub_packages_come_on_first_use() -> None:
    assert "numpy" in loaded_after("import masrel\nmasrel.lab.elbow.STANDARD_MODELS")


@pytest.mark.parametrize(
    "group", ["joint", "record", "paper", "schedule", "status", "train"]
)
def test_a_group_lists_its_commands_without_numpy(group: str) -> None:
    code = f"from masrel.cli import cli\ncli([{group!r}, '--help'])"
    assert loaded_after(code) & HEAVY == set()


def test_the_pages_load_their_server_only_when_they_are_served() -> None:
    libraries = {"starlette", "uvicorn", "segno", "anyio", "jinja2"}
    code = "from masrel.lab.cli import serve\nserve.serve(['--help'])"
    assert loaded_after(code) & (libraries | HEAVY) == set()
    # nor does the process of a session, beside whose loop nothing else runs
    assert loaded_after("import masrel.lab.serve._session_process") & libraries == set()
