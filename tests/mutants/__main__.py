"""Put in one fault after the other, and run the tests that must fail.

``python -m tests.mutants [WORD ...]`` runs all, or those with a word in their names, on
copies, and writes the results into ``docs/evidence/long_tests.md``.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from queue import SimpleQueue

from docs.make.long_tests import write_mutants
from tests.mutants import ROOT, Fault, faults

WORKERS = 2
TIMEOUT_S = 300
RESULTS = {0: "passed", 1: "failed", 2: "does not run", 124: "no end in time"}
Result = tuple[str, float]  # and seconds of processor time
OF_FAULT = {"passed": "survived", "failed": "killed"}


def copy_to(folder: Path) -> None:
    """Copy every file that is tracked, or would be."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True)
    for name in filter(None, done.stdout.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)


def run_tests(folder: Path, tests: str) -> Result:
    """Run tests of the copy until the first fails, and say what came of it."""
    pytest = [sys.executable, "-m", "pytest", "-x", "-q"]
    pytest += ["-p", "no:randomly", "-p", "no:cacheprovider", tests]
    process = subprocess.Popen(
        ["timeout", "--kill-after=5", str(TIMEOUT_S), *pytest],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    what = RESULTS.get(process.returncode, f"ended with {process.returncode}")
    return what, used.ru_utime + used.ru_stime


def with_fault(folder: Path, fault: Fault) -> Result:
    """Run a fault's tests with the fault in the copy, and put the text back."""
    if misfit := fault.misfit(folder):
        return misfit, 0.0
    file = folder / fault.file
    # Python takes compiled code for current if size and second of the source agree.
    compiled = Path(importlib.util.cache_from_source(str(file)))
    text = file.read_text(encoding="utf-8")
    try:
        file.write_text(text.replace(fault.old, fault.new), encoding="utf-8")
        compiled.unlink(missing_ok=True)
        result, seconds = run_tests(folder, fault.tests)
        return OF_FAULT.get(result, result), seconds
    finally:
        file.write_text(text, encoding="utf-8")
        compiled.unlink(missing_ok=True)


def on_copies(
    runs: dict[str, Callable[[Path], Result]], folders: SimpleQueue[Path]
) -> dict[str, Result]:
    """Run each on a copy that is free; return results by name."""

    def run(name: str) -> tuple[str, Result]:
        folder = folders.get()
        result, seconds = runs[name](folder)
        folders.put(folder)
        print(f"{result:<12} {seconds:6.1f} s  {name}", flush=True)
        return name, (result, seconds)

    with ThreadPoolExecutor(WORKERS) as pool:
        return dict(pool.map(run, runs))


def main(words: list[str]) -> int:
    """Run the faults that were named, or all, and write what came of each."""
    chosen = [
        fault
        for fault in faults()
        if not words or any(word in fault.name for word in words)
    ]
    if not chosen:
        print("No fault has such a name.")
        return 1
    began, folders = time.monotonic(), SimpleQueue[Path]()
    with tempfile.TemporaryDirectory() as temporary:
        for name in map(str, range(WORKERS)):
            copy_to(Path(temporary, name))
            folders.put(Path(temporary, name))
        sound = sorted({fault.tests for fault in chosen if not fault.misfit()})
        passed = on_copies(
            {tests: partial(run_tests, tests=tests) for tests in sound}, folders
        )
        if any(result != "passed" for result, _ in passed.values()):
            print("These tests must pass first.")
            return 1
        results = on_copies(
            {fault.name: partial(with_fault, fault=fault) for fault in chosen}, folders
        )
    seconds = sum(seconds for _, seconds in (*passed.values(), *results.values()))
    print(f"{seconds:.0f} s of processor time in {time.monotonic() - began:.0f} s")
    rows = {f.name: (f.tests, *results[f.name]) for f in chosen}
    print(write_mutants(rows, [fault.name for fault in faults()]))
    return int(any(result != "killed" for result, _ in results.values()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
