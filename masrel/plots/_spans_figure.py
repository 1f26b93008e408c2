"""Where observers mark spans in a document, label by label."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from masrel.plots._style import BLUE, ORANGE, Picture


def spans_picture(
    spans: Sequence[tuple[str, str | None, int, int]], length: int | None, document: str
) -> Picture:
    """Return spans (observer, label, begin, length) as bars, one row per observer."""
    # one without a label says that somebody looked
    observers = sorted({who for who, *_ in spans})
    labels = sorted({label for _, label, *_ in spans if label})
    rows = [f"{label}: {who}" for label in labels for who in observers]

    def draw(axes: Axes) -> None:
        for who, label, begin, size in spans:
            place = rows.index(f"{label}: {who}") if label else 0
            colour = (BLUE, ORANGE)[place // len(observers) % 2]  # by turns
            axes.barh(place, size, 0.7, begin, color=colour)
        axes.set(
            yticks=range(len(rows)), yticklabels=rows, xlabel=f"place in {document}"
        )
        axes.set(ylim=(len(rows) - 0.4, -0.6), xlim=(0, length))

    return Picture(6.4, 0.7 + 0.2 * len(rows), draw)
