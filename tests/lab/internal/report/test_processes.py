"""Figures are the same ones however many processes draw them."""

import io
import os
import select
import threading
from typing import Any

import numpy as np
import pytest
from PIL import Image
from tqdm import tqdm

from masrel.lab.report._figure_data import GradeCounts
from masrel.lab.report.figures import _processes, draw_all
from masrel.pages._sections import Drawing


@pytest.fixture(autouse=True)
def _no_thread_of_a_bar() -> None:
    """End the thread that a progress bar of another test has left: it would run on."""
    if tqdm.monitor is not None:
        tqdm.monitor.exit()
        tqdm.monitor = None


def drawings(n: int) -> list[Drawing]:
    return [
        Drawing(
            name=f"counts_{nth}",
            caption="",
            alt="",
            content=GradeCounts(
                models=("HM1",), intended=("1",), scale=("0", "1"), counts=((nth, 2),)
            ),
            stamp="published",
        )
        for nth in range(n)
    ]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks processes")
def test_every_process_draws_the_same_bytes() -> None:
    every = drawings(5)
    alone = draw_all(every, processes=1)
    assert len({picture["png"] for picture in alone}) == 5
    assert [draw_all(every, processes=n) for n in (2, 3)] == [alone, alone]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks processes")
def test_what_a_killed_process_leaves_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    every, real, first = drawings(4), _processes.draw, os.getpid()
    alone = draw_all(every, processes=1)
    may_go, at_work = os.pipe()

    def dying(*what: Any, **named: Any) -> Any:
        if os.getpid() != first:
            os.write(at_work, b".")
            os.kill(os.getpid(), 9)
        ready, _, _ = select.select([may_go], [], [], 60.0)
        assert ready, "no other process has taken a figure"
        monkeypatch.setattr(_processes, "draw", real)
        return real(*what, **named)

    monkeypatch.setattr(_processes, "draw", dying)
    assert draw_all(every, processes=2) == alone
    os.close(may_go)
    os.close(at_work)


def test_nothing_is_forked_beside_another_thread(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(os, "fork", None)  # called, it would raise
    is_over = threading.Event()
    thread = threading.Thread(target=is_over.wait)
    thread.start()
    try:
        assert len(draw_all(drawings(4), processes=2)) == 4
    finally:
        is_over.set()
        thread.join()


def test_a_png_says_its_size_and_resolution_as_its_svg_does() -> None:
    picture = draw_all(drawings(1))[0]
    with Image.open(io.BytesIO(picture["png"])) as image:
        image.verify()
    with Image.open(io.BytesIO(picture["png"])) as image:
        inches = np.array(image.size) / np.array(image.info["dpi"])
        assert image.getpixel((0, 0)) == (255, 255, 255, 255)
    words = picture["svg"].decode().partition("<svg ")[2].partition(">")[0]
    points = [
        float(words.partition(f'{side}="')[2].partition("pt")[0])
        for side in ("width", "height")
    ]
    assert inches * 72 == pytest.approx(points, abs=0.2)
