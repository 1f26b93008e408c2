"""Which processors the server, its work and the control loop of a session have."""

import asyncio
import os
import sys
from pathlib import Path

import pytest

from tests.lab.serve.desks import Page, n_sampled, small_study
from tests.lab.serve.served import sessions_of
from tests.lab.serve.test_server import Running

if sys.platform != "linux":
    pytest.skip("processors as Linux has them", allow_module_level=True)


def processor_of(process: int) -> int:
    """The one that a process was last on."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return int(fields[36])


def test_the_server_keeps_off_the_processor_of_the_loop(tmp_path: Path) -> None:
    study = small_study(tmp_path / "study", quick=True)
    allowed = os.sched_getaffinity(0)
    of_loop = {max(allowed)}
    others = allowed - of_loop or allowed  # all share a single one

    async def run() -> None:
        async with Running(study.root) as server:
            desk = server.desk
            assert os.sched_getaffinity(0) == others
            job = await asyncio.create_subprocess_exec("sleep", "60")
            assert os.sched_getaffinity(job.pid) == others
            job.kill()
            await job.wait()
            await desk.start("R1", "test")
            page = Page(desk)
            await page.until("ready")
            (session,) = sessions_of(study)
            assert os.sched_getaffinity(session) == allowed
            await page.answer(desk.state())
            await n_sampled(desk, 10)
            if os.sched_getscheduler(session) == os.SCHED_FIFO:
                assert processor_of(session) in of_loop
            await desk.leave()

    asyncio.run(run())
    assert os.sched_getaffinity(0) == allowed
