"""The part of the page of benchmarks that is of intervals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from docs.make.benchmarks.parts import write_part
from tests.benchmarks.bootstrap import OURS, Comparison
from tests.benchmarks.sidebyside import Timing


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """All that the part tells."""

    comparisons: Sequence[Comparison]
    exact: Sequence[tuple[str, str, Timing]]
    megabytes: Mapping[str, float]


def write_page(
    path: Path, results: Results, versions: Mapping[str, str], machine: str
) -> None:
    """Write the part in Markdown."""
    text = [
        "## Intervals",
        "",
        "`python -m docs.make.benchmarks.intervals` repeats this part: in turn in one "
        "run, medians; ± is the relative half-distance",
        "of the quartiles. Times are processor seconds of one thread, so that other "
        "load counts less; ratios are peer over masrel.",
        "",
        f"{machine}; " + ", ".join(f"{k} {v}" for k, v in versions.items()) + ".",
        "",
        *_bootstrap(results),
        *_exact(results),
        *_memory(results),
    ]
    write_part(path, "intervals", text)


def _bootstrap(results: Results) -> list[str]:
    peers = list(
        dict.fromkeys(peer for line in results.comparisons for peer in line.ratios())
    )
    text = [
        "### Bootstrap, 10 000 resamples drawn",
        "",
        "A percentile interval of items, from ratings, drawn. "
        "`scipy.stats.bootstrap` is given counts, and calls a Python",
        "function of one resample; vectorized, it is of many resamples at once.",
        "",
        "| study | masrel | " + " | ".join(peers) + " |",
        "|---|---|" + "---|" * len(peers),
    ]
    for line in results.comparisons:
        ratios = line.ratios()
        cells = [
            f"{_number(ratios[peer][0])} ± {100 * ratios[peer][1]:.0f} %"
            if peer in ratios
            else "–"
            for peer in peers
        ]
        text.append(f"| {line.name} | {_time(line.times[OURS])} | " + " | ".join(cells))
        text[-1] += " |"
    return [
        *text,
        "",
        "At 10 000 items scipy draws 500 resamples, times 20.",
        "",
    ]


def _exact(results: Results) -> list[str]:
    text = [
        "### Exact bootstrap",
        "",
        "| study | distribution | time |",
        "|---|---|---|",
    ]
    for study, words, timing in results.exact:
        what = words.removeprefix("exact bootstrap distribution, ")
        text.append(f"| {study} | {what} | {_time(timing)} |")
    return [*text, ""]


def _memory(results: Results) -> list[str]:
    shown = ", ".join(f"{kind} {mb:.0f} MB" for kind, mb in results.megabytes.items())
    return [
        "### Memory",
        "",
        "Most at once beside a million items by five raters, bytes, 10 000 resamples "
        f"of items: {shown}.",
        "`tests/intervals/test_costs.py` holds the bootstrap, the jackknife and the "
        "delta method below 50 MB. A million clusters",
        "or rows that nearly all differ take less than 1 GB.",
    ]


def _number(ratio: float) -> str:
    return f"{ratio:.1f}" if ratio < 10 else f"{ratio:,.0f}"


def _time(timing: Timing) -> str:
    units = (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6))
    unit, scale = next((u for u in units if timing.median >= u[1]), units[-1])
    return f"{timing.median / scale:.3g} {unit}"
