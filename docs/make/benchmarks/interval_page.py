"""Benchmarks of intervals as rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from docs.make.evidence import write_tables
from tests.benchmarks.bootstrap import OURS, Comparison
from tests.benchmarks.sidebyside import Timing


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """All that is measured."""

    comparisons: Sequence[Comparison]
    exact: Sequence[tuple[str, str, Timing]]
    megabytes: Mapping[str, float]


def write_page(results: Results) -> None:
    """Write the rows."""
    lines = [*_bootstrap(results), *_exact(results), *_memory(results)]
    write_tables(["bootstrap", "exact_bootstrap", "bootstrap_memory"], lines)


def _bootstrap(results: Results) -> list[str]:
    peers = list(
        dict.fromkeys(peer for line in results.comparisons for peer in line.ratios())
    )
    text = [
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
    ]


def _exact(results: Results) -> list[str]:
    text = [
        "| study | distribution | time |",
        "|---|---|---|",
    ]
    for study, words, timing in results.exact:
        what = words.removeprefix("exact bootstrap distribution, ")
        text.append(f"| {study} | {what} | {_time(timing)} |")
    return [*text, ""]


def _memory(results: Results) -> list[str]:
    rows = [f"| {kind} | {mb:.0f} MB |" for kind, mb in results.megabytes.items()]
    return ["| 10 000 resamples of 1,000,000 × 5 | most memory |", "|---|---|", *rows]


def _number(ratio: float) -> str:
    return f"{ratio:.1f}" if ratio < 10 else f"{ratio:,.0f}"


def _time(timing: Timing) -> str:
    units = (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6))
    unit, scale = next((u for u in units if timing.median >= u[1]), units[-1])
    return f"{timing.median / scale:.3g} {unit}"
