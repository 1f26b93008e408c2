"""Sessions in real time with a server and without: lateness, taps, emergency stops.

Lateness follows from the recordings alone, so that nothing is measured in the loop.
``docs.make.benchmarks.serving`` makes the page of it.
"""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from numpy.typing import NDArray

from masrel.lab.protocol import StudyPaths
from masrel.lab.recording import RAMPS, read_recording
from tests.lab.serve.pages import Role, SampleTail, Served, small_study

PERIOD_S = 1e-3
TAPPED_AFTER_S = 0.3  # a stop is tapped so long after the arm began to move
STRETCH_S = 3.2  # there and back, of the template's hand
Values = NDArray[np.float64]


@dataclass
class Lateness:
    """How late ticks came, s, and how many did not come at all, second by second."""

    late: list[Values] = field(default_factory=list)
    missed: list[int] = field(default_factory=list)

    def add(self, study: StudyPaths) -> None:
        """Take in every recording of a study."""
        for file in study.sessions.glob("*/*.npz"):
            recording = read_recording(file)
            time_s = recording.columns["time_s"][: recording.n_presented]
            tick = np.floor(time_s / PERIOD_S + 1e-9)
            # each tick is due when the one that came before it is over
            late = time_s[1:] - (tick[:-1] + 1.0) * PERIOD_S
            n_missed = np.diff(tick) - 1.0
            starts = np.flatnonzero(np.diff(np.floor(time_s[1:]), prepend=0.0))
            self.late += np.split(late, starts)
            self.missed += [int(part.sum()) for part in np.split(n_missed, starts)]

    @property
    def all(self) -> Values:
        """Of every tick, s."""
        return np.concatenate(self.late)

    def resampled(
        self, share: float, rng: np.random.Generator, n: int = 1000
    ) -> tuple[Values, Values]:
        """Draw the seconds anew -> a quantile, s, and missed ticks of each draw."""
        # by seconds, for late ticks come in bursts -> (n,), (n,)
        n_seconds, late = len(self.late), self.all
        order = np.argsort(late)
        second = np.repeat(np.arange(n_seconds), [part.size for part in self.late])
        late, second = late[order], second[order]
        quantiles, missed = np.empty(n), np.empty(n)
        for draw in range(n):
            drawn = rng.integers(n_seconds, size=n_seconds)
            times = np.bincount(drawn, minlength=n_seconds)
            below = np.cumsum(times[second])
            quantiles[draw] = late[np.searchsorted(below, share * below[-1])]
            missed[draw] = times @ self.missed
        return quantiles, missed


def long_study(root: Path, seconds: float) -> StudyPaths:
    """One whose presentations go on for so long in all."""
    n_stretches = round(seconds / 4 / STRETCH_S)
    many = f"stretches = {n_stretches}\ntime_limit_s = 600.0\n"
    lenient = "missed_ticks_limit = 100000\nmissed_replies_limit = 20\n"
    return small_study(
        root,
        "",
        ("stretches = 1\n", many if n_stretches > 1 else "stretches = 1\n"),
        ("missed_ticks_limit = 20\n", lenient + "jump_limit_deg = 5.0\n"),
    )


def by_masrel_run(study: StudyPaths) -> None:
    """Run the session without a server."""
    command = [sys.executable, "-W", "ignore", "-m", "masrel", "run", str(study.root)]
    options = "--rater R1 --session test --grades simulated --clock real --quiet"
    subprocess.run([*command, *options.split()], check=True)


class Tablet:
    """A rater's page in a browser, and how long each of its answers took."""

    def __init__(self, browser: httpx.Client) -> None:
        self.browser = browser
        self.took_s: dict[str, list[float]] = {}

    def state(self) -> dict[str, Any]:
        """What is shown."""
        while True:
            with contextlib.suppress(httpx.TransportError):
                answer = self.browser.get("/rater/state")
                if answer.status_code == 200:
                    return dict(answer.json())
            time.sleep(0.05)

    def tap(self, path: str, body: dict[str, Any]) -> dict[str, Any]:
        """Send what a tap sends -> what is shown when the answer is there."""
        began = time.perf_counter()
        answer = self.browser.post(path, json=body)
        took_s = time.perf_counter() - began
        answer.raise_for_status()
        screen = next(iter(body.get("answer", {"stop": None})))
        self.took_s.setdefault(screen, []).append(took_s)
        return dict(answer.json()["state"])

    def session(self, during: Callable[["Tablet"], None] | None = None) -> None:
        """Answer until the session is over; something may happen in presentations."""
        answers: dict[str, dict[str, Any]] = {
            "ready": {"begin": True},
            "grade": {"grade": "2", "stretch": None},
            "fault": {"skip": "stopped"},
        }
        state = self.state()
        while state["screen"] != "over":
            if state["ask"] is None:
                if state["screen"] == "presenting" and during is not None:
                    during(self)
                time.sleep(0.06)  # a rater sees it by the stream; it costs less
                state = self.state()
                continue
            body = {"ask": state["ask"], "answer": answers[state["screen"]]}
            state = self.tap("/rater/answer", body)
        if state["how"] != "complete":
            raise SystemExit(f"the session is over: {state['how']}")


@contextmanager
def streamed(browser: httpx.Client, role: Role) -> Iterator[None]:
    """Keep a page's stream of events open, as its browser does."""
    response = browser.send(
        browser.build_request("GET", f"/{role}/events", timeout=60.0), stream=True
    )

    def read() -> None:
        with contextlib.suppress(httpx.HTTPError, httpx.StreamError):
            for _ in response.iter_raw():
                pass

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    try:
        yield
    finally:
        response.close()
        reader.join(5.0)


@contextmanager
def flooded(browser: httpx.Client, rate_hz: float) -> Iterator[list[int]]:
    """Send a rater's requests at a rate, from a process of its own -> how many."""
    host, _, port = str(browser.base_url.netloc.decode()).partition(":")
    cookies = "; ".join(f"{name}={text}" for name, text in browser.cookies.items())
    sent: list[int] = []
    command = [sys.executable, "-m", "tests.benchmarks.bench_serve", host, port]
    with subprocess.Popen(
        [*command, cookies, str(rate_hz)], stdout=subprocess.PIPE, text=True
    ) as client:
        try:
            yield sent
        finally:
            client.send_signal(signal.SIGTERM)
            sent.append(int(client.communicate()[0] or 0))


def flood(host: str, port: int, cookies: str, rate_hz: float) -> None:
    """Ask for a rater's state at a rate until SIGTERM, and print how often."""
    signals: list[int] = []  # an Event would wait for its own lock
    signal.signal(signal.SIGTERM, lambda number, _: signals.append(number))
    request = (
        f"GET /rater/state HTTP/1.1\r\nHost: {host}:{port}\r\nCookie: {cookies}\r\n\r\n"
    ).encode()
    n_sent, began = 0, time.monotonic()
    with socket.create_connection((host, port)) as connection:
        reader = threading.Thread(target=_drain, args=(connection,), daemon=True)
        reader.start()
        while not signals:
            time.sleep(0.005)
            n_due = int((time.monotonic() - began) * rate_hz) - n_sent
            connection.sendall(request * n_due)
            n_sent += n_due
    print(n_sent)


def _drain(connection: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while connection.recv(1 << 16):
            pass


def memory_mb(process: int) -> float:
    """What a process has in memory, MB."""
    n_pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return n_pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@dataclass
class Serving:
    """A session with both pages open, as it was served."""

    tablet: Tablet
    memory_mb: tuple[float, float] = (0.0, 0.0)  # of the server, before and after
    n_sent: int = 0  # requests of a flood


def by_the_browser(
    study: StudyPaths,
    *,
    during: Callable[[Tablet], None] | None = None,
    flood_hz: float = 0.0,
) -> Serving:
    """Run the session with a server, a rater's page and a coordinator's."""
    served = Served(study)
    process = served.start()
    try:
        with contextlib.ExitStack() as stack:
            rater = stack.enter_context(closing(served.browser("rater")))
            coordinator = stack.enter_context(closing(served.browser("coordinator")))
            serving = Serving(Tablet(rater))
            stack.enter_context(streamed(rater, "rater"))
            stack.enter_context(streamed(coordinator, "coordinator"))
            before, sent = memory_mb(process), [0]
            with contextlib.ExitStack() as load:
                if flood_hz:
                    another = stack.enter_context(closing(served.browser()))
                    sent = load.enter_context(flooded(another, flood_hz))
                serving.tablet.session(during)
            serving.memory_mb = before, memory_mb(process)
            serving.n_sent = sum(sent)
            return serving
    finally:
        served.close()


class Stops:
    """Emergency stops tapped while the arm moves, and when its torque began to ramp."""

    def __init__(self, study: StudyPaths, took_s: list[float]) -> None:
        self._study = study
        self._took_s = took_s

    def __call__(self, tablet: Tablet) -> None:
        """Tap a stop where samples are taken, and wait until all is over."""
        for partial in self._study.sessions.glob("*/*.partial"):
            with contextlib.suppress(FileNotFoundError, ValueError):  # being allocated
                self._stop(tablet, partial)

    def _stop(self, tablet: Tablet, partial: Path) -> None:
        with closing(SampleTail(partial)) as tail:
            # when the loop began, by the clock of this process: no row is read before
            # it is written
            began_s, until_s = np.inf, time.monotonic() + TAPPED_AFTER_S
            while (now_s := time.monotonic()) < until_s or began_s == np.inf:
                for time_s in tail.new_rows("time_s", every=1000)["time_s"]:
                    began_s = min(began_s, time.monotonic() - time_s)
                time.sleep(0.0005)
        tablet.tap("/rater/stop", {})
        while tablet.state()["screen"] == "presenting":
            time.sleep(0.02)
        recording = read_recording(partial.with_suffix(".npz"))
        is_ramp = recording.columns["ramp"] == RAMPS.index("fault")
        if is_ramp.any():
            first_s = float(recording.columns["time_s"][is_ramp][0])
            self._took_s.append(began_s + first_s - now_s)


def quantile_ms(values_s: Sequence[float] | Values, share: float) -> float:
    """A quantile, ms."""
    return float(np.quantile(np.asarray(values_s), share)) * 1e3


if __name__ == "__main__":
    flood(sys.argv[1], int(sys.argv[2]), sys.argv[3], float(sys.argv[4]))
