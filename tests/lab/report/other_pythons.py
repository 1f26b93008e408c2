"""Whether reports are the same bytes under other interpreters.

``python -m tests.lab.report.other_pythons INTERPRETER…`` builds the published study's
report and a simulated one, in all formats, with this interpreter and with each of those
named, and ends with 1 if a byte differs. An interpreter needs what masrel needs, and
pypandoc_binary, in the same versions: another one may draw another picture.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import masrel
from masrel.lab.protocol import copy_template

FORMATS = ("html", "markdown", "latex", "docx")
LIBRARIES = ("numpy", "scipy", "pandas", "matplotlib", "pillow", "jinja2")
VERSIONS = f"""
import platform
from importlib.metadata import version
print(platform.python_version())
for name in {LIBRARIES} + ("pypandoc_binary",):
    print(name, version(name))
"""


def run(interpreter: str, *call: str) -> str:
    """What an interpreter prints, with this masrel."""
    root = str(Path(masrel.__file__).parents[1])
    done = subprocess.run(
        [interpreter, *call],
        env={**os.environ, "PYTHONPATH": root, "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"{interpreter}: {done.stderr.strip().splitlines()[-1]}")
    return done.stdout


def built(interpreter: str, study: Path, folder: Path) -> dict[str, bytes]:
    """The files of a study's report, by name."""
    formats = [part for form in FORMATS for part in ("--format", form)]
    options = ["-o", str(folder), "--cache", f"{folder}-cache", "--quiet", *formats]
    run(interpreter, "-P", "-m", "masrel", "report", str(study), *options)
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def differences(interpreters: list[str], folder: Path) -> list[str]:
    """A line for every file that another interpreter writes otherwise."""
    published = folder / "published"
    copy_template("hess2012", published)
    demo = ("demo", str(folder / "demo"), "--study", "small", "--quiet")
    run(sys.executable, "-P", "-m", "masrel", *demo)
    lines = []
    for study in (published, folder / "demo" / "study"):
        first = built(sys.executable, study, folder / f"{study.name}-here")
        for nth, interpreter in enumerate(interpreters):
            other = built(interpreter, study, folder / f"{study.name}-{nth}")
            names = sorted({*first, *other})
            lines += [
                f"{interpreter}: {study.name}/{name} differs"
                for name in names
                if first.get(name) != other.get(name)
            ]
            print(f"{interpreter}: {study.name}, {len(names)} files")
    return lines


def main(interpreters: list[str]) -> int:
    """Compare, print what differs, and return the exit code."""
    if not interpreters:
        raise SystemExit("needs interpreters to compare with, such as python3.12")
    here, *libraries = run(sys.executable, "-P", "-c", VERSIONS).splitlines()
    for interpreter in interpreters:
        version, *there = run(interpreter, "-P", "-c", VERSIONS).splitlines()
        if there != libraries:
            lacking = ", ".join(sorted({*libraries} - {*there}))
            raise SystemExit(f"{interpreter}: needs {lacking}, as Python {here} has")
        print(f"{interpreter}: Python {version}, beside {here}")
    with tempfile.TemporaryDirectory() as folder:
        lines = differences(interpreters, Path(folder))
    print("\n".join(lines) or "the same bytes")
    return int(bool(lines))


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
