"""Run the pages, and write what they print into them.

``python -m docs.make.pages [PAGE ...]`` rewrites the output that pages show, all of
them unless some are named. ``tests/docs/test_pages.py`` compares a page with that.

A page is run from top to bottom in a new folder that has a copy of ``studies`` and of
the data files of the tutorials:

- blocks of Python in one namespace. What they print stands in ``# prints`` comments
  (``...`` for any line), or after the word "prints" in a block of text;
- lines that begin with ``$``. What they print, errors included, stands below them, and
  a line of ``...`` for any lines, ``…`` in a line for any text;
- a block below a paragraph that ends in "`name`:" is the file of that name.

A comment in the line before a block says what a reader need not see: ``<!-- not run:
needs a CAN bus -->``; what is typed at the prompts of a command, ``<!-- typed: Enter,
1+, stop -->``; or the module that is run in the place of the block, for a command that
waits for browsers, ``<!-- instead: docs.make.tapped … -->``. Whatever else could
be run is an error.
"""

import contextlib
import glob
import io
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from unittest import mock

from masrel.cli import main

ROOT = Path(__file__).parents[2]
SHOWN_ONLY = {"", "text", "toml", "{eval-rst}"}  # formulas, excerpts of files
PROGRAMS = re.compile(r"(>>>|\S*(masrel|python3?|pip|git|sudo)) ")
PRINTS = re.compile(r"# prints\b.*")


class PageError(Exception):
    """A block that is neither run nor marked as one that is not."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """What stands between two fences."""

    page: str
    number: int  # of its first line, from 0
    language: str
    lines: list[str]
    marker: str  # the comment in the line before
    lead: str  # the last line of the text before

    @property
    def exempt(self) -> str | None:
        """Why the block is not run, if it is not."""
        kind, _, reason = self.marker.partition(": ")
        return reason if kind == "not run" and reason else None

    @property
    def has_commands(self) -> bool:
        return any(line.startswith("$ ") for line in self.lines)

    @property
    def is_output(self) -> bool:
        """Whether it is what the block of Python before it prints."""
        return self.language == "text" and self.lead == "prints"

    @property
    def file(self) -> str | None:
        """The name of the file whose content it is."""
        name = re.search(r"`([\w./]+)`:$", self.lead)
        return name[1] if name else None

    @property
    def typed(self) -> list[str]:
        kind, _, answers = self.marker.partition(": ")
        words = answers.split(", ") if kind == "typed" else []
        return ["" if word == "Enter" else word for word in words]

    @property
    def instead(self) -> list[str]:
        """The module, and its arguments, that is run in the place of the block."""
        kind, _, words = self.marker.partition(": ")
        return shlex.split(words) if kind == "instead" else []

    def error(self, what: str) -> PageError:
        return PageError(f"{self.page}, line {self.number}: {what}")


def pages() -> list[Path]:
    """Return every page of the documentation."""
    docs = (ROOT / "docs").rglob("*.md")
    templates = ROOT / "docs" / "make"
    below = sorted(page for page in docs if not page.is_relative_to(templates))
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *below]


def read(text: str, page: str = "page") -> list[Block]:
    """Return the blocks of a page, each of a kind that is known."""
    blocks = list(_fenced(text.splitlines(), page))
    for block in blocks:
        _check(block)
    return blocks


def _fenced(lines: Sequence[str], page: str) -> Iterator[Block]:
    opening = None
    for number, line in enumerate(lines):
        if not re.match(r"\s*(```|~~~)", line):
            continue
        if opening is None:
            opening = number
            continue
        before = ["", *filter(None, lines[:opening])]
        above = lines[opening - 1] if opening else ""
        comment = re.fullmatch(r"<!-- (.*) -->", above)
        yield Block(
            page=page,
            number=opening + 1,
            language=lines[opening].removeprefix("```"),
            lines=list(lines[opening + 1 : number]),
            marker=comment[1] if comment else "",
            lead=before[-2 if comment else -1],
        )
        opening = None
    if opening is not None:
        raise PageError(f"{page}, line {opening + 1}: needs the end of a block")


def _check(block: Block) -> None:
    if block.exempt or block.language == "python":
        return
    if block.has_commands and block.language == "":
        if not block.lines[0].startswith("$ "):
            raise block.error("needs a command in its first line")
    elif block.language not in SHOWN_ONLY:
        raise block.error(
            f"needs no language and lines that begin with $, or <!-- not run: REASON "
            f"--> before it, in a block of {block.language!r}"
        )
    elif any(PROGRAMS.match(line) for line in block.lines):
        raise block.error("needs $ before a command, or to be marked as not run")


def renewed(text: str, page: str = "page", folder: Path | None = None) -> str:
    """Run a page; return it with what it prints now, and keep its files in a folder."""
    lines = text.splitlines()
    blocks = read(text, page)
    for block, new in reversed(list(zip(blocks, run(blocks, folder), strict=True))):
        lines[block.number : block.number + len(block.lines)] = new
    return "\n".join(lines) + "\n"


def run(blocks: Sequence[Block], kept: Path | None = None) -> Iterator[list[str]]:
    """Run blocks in a new folder; yield the lines of each as they should be."""
    with _new_folder() as folder:
        yield from _run(blocks)
        if kept is not None:
            shutil.copytree(folder, kept)


@contextlib.contextmanager
def _new_folder() -> Iterator[str]:
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("error")
        shutil.copytree(ROOT / "studies", "studies")
        for file in (ROOT / "docs" / "tutorials").glob("*.csv"):
            shutil.copy(file, folder)
        try:
            yield folder
        finally:
            if pyplot := sys.modules.get("matplotlib.pyplot"):  # it keeps every figure
                pyplot.close("all")


def _run(blocks: Sequence[Block]) -> Iterator[list[str]]:
    # in the folder that it is called in
    namespace: dict[str, object] = {"__name__": "__main__"}
    printed: list[str] = []
    for block, follower in pairwise([*blocks, None]):
        if block.exempt:
            yield block.lines
        elif block.language == "python":
            printed = _printed(block, namespace)
            is_below = follower is not None and follower.is_output
            yield block.lines if is_below else _commented(block.lines, printed)
        elif block.is_output:
            yield printed
        elif block.instead:
            _run_module(*block.instead)
            yield block.lines
        elif block.has_commands:
            yield list(_answered(block))
        else:
            if block.file:
                Path(block.file).write_text("\n".join(block.lines) + "\n", "utf-8")
            yield block.lines


def _run_module(module: str, *arguments: str) -> None:
    with (
        contextlib.redirect_stdout(io.StringIO()),
        mock.patch.object(sys, "argv", [module, *arguments]),
    ):
        runpy.run_module(module, run_name="__main__")


def _printed(block: Block, namespace: dict[str, object]) -> list[str]:
    # In front of it as many lines as in the page, so that an error names the right one
    code = "\n" * block.number + "\n".join(block.lines)
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(compile(code, block.page, "exec"), namespace)
    return _rows(output.getvalue())


def _commented(lines: Sequence[str], printed: Sequence[str]) -> list[str]:
    """Return lines of Python with what they print in their comments, or ``...``."""
    texts = iter(printed)
    new = []
    for line in lines:
        if not PRINTS.search(line):
            new.append(line)
        elif (text := next(texts, None)) is not None:
            open_ended = line.endswith("# prints ...")
            new.append(line if open_ended else PRINTS.sub("", line) + _comment(text))
        elif bare := PRINTS.sub("", line).rstrip():
            new.append(bare)
    return [*new, *map(_comment, texts)]


def _comment(text: str) -> str:
    return f"# prints {text}".rstrip()


def _answered(block: Block) -> Iterator[str]:
    """Yield the commands of a block, each with what it prints."""
    starts = [n for n, line in enumerate(block.lines) if line.startswith("$ ")]
    answers = "".join(f"{word}\n" for word in block.typed)
    for start, end in zip(starts, [*starts[1:], len(block.lines)], strict=True):
        first = start + 1
        while block.lines[first - 1].endswith("\\"):
            first += 1
        command = block.lines[start:first]
        yield from command
        line = "\n".join(command).removeprefix("$ ")
        yield from _elided(block.lines[first:end], output(line, answers))


def output(command: str, answers: str = "") -> list[str]:
    """Return what a command prints, on stdout and stderr as they come."""
    program, *words = shlex.split(command)
    arguments = [name for word in words for name in (sorted(glob.glob(word)) or [word])]
    if program == "masrel":
        return _rows(_masrel(arguments, answers))
    done = subprocess.run(
        [sys.executable if program == "python" else program, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        input=answers,
        encoding="utf-8",
        check=False,
    )
    return _rows(done.stdout)


def _masrel(arguments: Sequence[str], answers: str) -> str:
    """Call the command line in this process, which spares its imports."""
    output = io.StringIO()
    with (
        contextlib.redirect_stdout(output),
        contextlib.redirect_stderr(output),
        mock.patch.object(sys, "stdin", _Typed(answers)),
        mock.patch.object(sys, "argv", ["masrel", *arguments]),
        # click names the program after the package of the main module, if it has one
        mock.patch.object(sys.modules["__main__"], "__package__", None),
        contextlib.suppress(SystemExit),
    ):
        main()
    return output.getvalue()


class _Typed(io.StringIO):
    """Answers that are seen when they are read, as at a terminal."""

    def readline(self, size: int | None = -1, /) -> str:
        line = super().readline(-1 if size is None else size)
        sys.stdout.write(line)
        return line


def _rows(output: str) -> list[str]:
    return [line.rstrip() for line in output.splitlines()]


def _elided(shown: Sequence[str], printed: Sequence[str]) -> list[str]:
    """Return what is shown if it is what was printed, or the latter cut as it was."""
    pattern = "".join(
        r"(?:.*\n)*" if line == "..." else re.escape(line).replace("…", ".*") + r"\n"
        for line in shown
    )
    if re.fullmatch(pattern, "".join(f"{line}\n" for line in printed)):
        return list(shown)
    if "..." not in shown:
        return list(printed)
    n_first = list(shown).index("...")
    n_last = list(reversed(shown)).index("...")
    return [*printed[:n_first], "...", *printed[len(printed) - n_last :]]


def _rewrite(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    new = renewed(text, str(page))
    page.write_text(new, encoding="utf-8")
    print(f"{page}: {'as it was' if new == text else 'rewritten'}")


if __name__ == "__main__":
    for path in [Path(name) for name in sys.argv[1:]] or pages():
        _rewrite(path)
