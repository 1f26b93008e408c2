"""The files that ``masrel trace`` writes: JSON, samples as CSV, and a figure."""

import csv
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, TextIO

import click
from tqdm import tqdm

from masrel.cli.folders import check_folders
from masrel.cli.options import grouped
from masrel.cli.trace_figure import VIEWS, check_figure, write_figure
from masrel.cli.trace_scene import Scene
from masrel.errors import ParameterError

__all__ = ["TRACE_COLUMNS", "Files", "file_options", "write_files"]

TRACE_COLUMNS = ("time_s", "angle_deg", "velocity_deg_s", "torque_nm", "phase")

MOST_SAMPLES = 5_000_000
"""Rows of a CSV file: at 1 kHz 83 minutes, and some 400 MB."""

_PATH = click.Path(path_type=Path)
_N_AT_ONCE = 10_000  # rows between two signs of progress


@dataclass(frozen=True, slots=True, kw_only=True)
class Files:
    """Which files are asked for."""

    rate_hz: float | None  # samples a second of the CSV file; None for 1000
    csv_file: Path | None  # where samples go
    json_file: str | None  # where JSON goes; "-" is the screen
    figure: Path | None  # where a figure goes
    view: str | None  # what it shows; None for "angle"

    def __post_init__(self) -> None:
        if self.rate_hz is not None and self.csv_file is None:
            raise ParameterError("--rate-hz: goes with --csv, whose samples it spaces")
        if self.rate_hz is not None and not math.isfinite(self.rate_hz):
            raise ParameterError(f"--rate-hz: needs a finite rate, got {self.rate_hz}")
        if self.view is not None and self.figure is None:
            raise ParameterError(
                "--view: goes with --figure, whose contents it chooses"
            )
        if self.csv_file == Path("-"):
            raise ParameterError("--csv: needs the name of a file, got -")

    def check(self, scenes: Sequence[Scene]) -> None:
        """Check that the files can be made, before anything is computed for them."""
        check_folders(csv=self.csv_file, json=self.json_file, figure=self.figure)
        if self.figure is not None:
            check_figure(self.figure, self.view or VIEWS[0], scenes)


file_options = grouped(
    "files",
    Files,
    click.option(
        "--rate-hz", type=click.FloatRange(min=0.0, min_open=True),
        help="Samples a second of --csv.  [default: 1000]",
    ),
    click.option("--csv", "csv_file", type=_PATH, help="Write the samples here."),
    click.option(
        "--json", "json_file",
        help="Write events and outputs as JSON here; - for the screen.",
    ),
    click.option("--figure", type=_PATH, help="Draw this file: .png, .svg or .pdf."),
    click.option(
        "--view", type=click.Choice(VIEWS),
        help="What --figure shows: torque by angle or time, the catches, or one of "
        "them.  [default: angle]",
    ),
)  # fmt: skip
"""The options of files, given to a command as one argument `files`."""


def write_files(
    files: Files,
    scenes: Sequence[Scene],
    documents: Sequence[dict[str, Any]],
    *,
    quiet: bool,
) -> None:
    """Write what was asked for; JSON for the screen is printed."""
    if files.csv_file is not None:
        rate_hz = 1000.0 if files.rate_hz is None else files.rate_hz
        n_rows = _n_samples(documents, rate_hz)
        with files.csv_file.open("w", encoding="utf-8", newline="") as out:
            _write_samples(
                out,
                scenes,
                rate_hz,
                tqdm(total=n_rows, desc="samples", delay=1.0, disable=quiet or None),
            )
    if files.figure is not None:
        write_figure(scenes, files.view or VIEWS[0], files.figure)
    if files.json_file is not None:
        whole = documents[0] if len(scenes) == 1 else {"scenes": list(documents)}
        text = json.dumps(whole, indent=1, allow_nan=False)
        if files.json_file == "-":
            click.echo(text)
        else:
            Path(files.json_file).write_text(text + "\n", "utf-8")


def _n_samples(documents: Sequence[dict[str, Any]], rate_hz: float) -> int:
    durations = [made["phases"][-1]["end_s"] for made in documents]
    n_samples = sum(durations) * rate_hz + len(durations)
    if not n_samples <= MOST_SAMPLES:
        raise ParameterError(
            f"--csv: needs at most {MOST_SAMPLES} samples, got {n_samples:.4g}: "
            f"{sum(durations):.4g} s at {rate_hz:g} Hz; --rate-hz makes them fewer"
        )
    return int(n_samples)


def _write_samples(
    out: TextIO, scenes: Sequence[Scene], rate_hz: float, bar: "tqdm[Any]"
) -> None:
    # what the controller commands; several scenes are told apart by columns
    several = len(scenes) > 1
    out.write("# simulated: true\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow((*(("model", "speed_deg_s") if several else ()), *TRACE_COLUMNS))
    with bar:
        for scene in scenes:
            names = (scene.model, scene.speed_deg_s) if several else ()
            rows = _rows(scene, rate_hz)
            while block := list(islice(rows, _N_AT_ONCE)):
                writer.writerows((*names, *row) for row in block)
                bar.update(len(block))


def _rows(scene: Scene, rate_hz: float) -> Iterator[tuple[object, ...]]:
    import numpy as np

    from masrel.elbow import trace
    from masrel.recording import PHASES

    made = trace(scene.parameters, scene.motion, rate_hz=rate_hz)
    columns = (
        made.time,
        np.degrees(made.angle),
        np.degrees(made.velocity),
        made.torque,
    )
    for start in range(0, made.time.size, _N_AT_ONCE):
        block = slice(start, start + _N_AT_ONCE)
        phases = [PHASES[code] for code in made.phase[block].tolist()]
        yield from zip(*(c[block].tolist() for c in columns), phases, strict=True)
