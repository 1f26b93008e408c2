"""The file of samples of ``masrel joint trace``: what the controller commands."""

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from masrel._files import safe_cell
from masrel.errors import ParameterError
from masrel.lab._durable_files import new_file
from masrel.lab.report._traced_scenes import Scene

_COLUMNS = ("time_s", "angle_deg", "velocity_deg_s", "torque_nm", "phase")
_MAX_SAMPLES = 5_000_000  # rows of a CSV file: at 1 kHz 83 minutes, and some 400 MB
_N_AT_ONCE = 10_000  # rows between two signs of progress


def check_samples(csv_file: Path | None, rate_hz: float | None) -> None:
    """Refuse a rate without a file, and a file that is the screen."""
    if rate_hz is not None and csv_file is None:
        raise ParameterError("--rate-hz: goes with --csv, whose samples it spaces")
    if rate_hz is not None and not math.isfinite(rate_hz):
        raise ParameterError(f"--rate-hz: needs a finite rate, got {rate_hz}")
    if csv_file == Path("-"):
        raise ParameterError("--csv: needs the name of a file, got -")


def write_samples(
    csv_file: Path,
    rate_hz: float,
    scenes: Sequence[Scene],
    documents: Sequence[dict[str, Any]],
    *,
    quiet: bool,
) -> None:
    """Write the samples of scenes; columns name the scene where there are several."""
    n_rows = _n_samples(documents, rate_hz)
    several = len(scenes) > 1
    with (
        new_file(csv_file) as out,
        tqdm(total=n_rows, desc="samples", delay=1.0, disable=quiet or None) as bar,
    ):
        out.write("# simulated: true\n")
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow((*(("model", "speed_deg_s") if several else ()), *_COLUMNS))
        for scene in scenes:
            names = (safe_cell(scene.model), scene.speed_deg_s) if several else ()
            _write_rows(writer, names, scene, rate_hz, bar)


def _n_samples(documents: Sequence[dict[str, Any]], rate_hz: float) -> int:
    durations = [document["phases"][-1]["end_s"] for document in documents]
    n_samples = sum(durations) * rate_hz + len(durations)
    if not n_samples <= _MAX_SAMPLES:
        raise ParameterError(
            f"--csv: needs at most {_MAX_SAMPLES} samples, got {n_samples:.4g}: "
            f"{sum(durations):.4g} s at {rate_hz:g} Hz; --rate-hz makes them fewer"
        )
    return int(n_samples)


def _write_rows(
    writer: Any,  # csv.writer, whose type has no name
    names: tuple[object, ...],
    scene: Scene,
    rate_hz: float,
    bar: "tqdm[Any]",
) -> None:
    import numpy as np

    from masrel.lab import elbow
    from masrel.lab.recording import PHASES

    samples = elbow.trace(scene.joint, scene.motion, rate_hz=rate_hz)
    columns = (
        samples.time,
        np.degrees(samples.angle),
        np.degrees(samples.velocity),
        samples.torque,
    )
    for start in range(0, samples.time.size, _N_AT_ONCE):
        block = slice(start, start + _N_AT_ONCE)
        phases = [PHASES[code] for code in samples.phase[block].tolist()]
        rows = zip(*(c[block].tolist() for c in columns), phases, strict=True)
        writer.writerows((*names, *row) for row in rows)
        bar.update(len(phases))
