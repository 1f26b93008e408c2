"""A tablet that loses the network, at every screen."""

import pytest

from tests.lab.serve.browser.stages import Stage
from tests.lab.serve.browser.test_rater_flows import ALL
from tests.lab.serve.browser.visitors import LOST


@pytest.mark.parametrize(
    "long_at",  # for 10 s; for a moment elsewhere
    [
        pytest.param(("grade",), marks=pytest.mark.slow),
        pytest.param(ALL, marks=pytest.mark.long),
    ],
    ids=["at one screen", "at every screen"],
)
def test_a_tablet_without_network_says_so_and_goes_on_by_itself(
    stage: Stage, long_at: tuple[str, ...]
) -> None:
    rater = stage.session()
    rater.tolerated = LOST
    seen = []
    while (shown := rater.wait_for(*ALL)) != "over":
        if shown in seen and shown != "question":
            rater.go_until(*set(ALL) - {*seen, "presenting"})
            continue
        seen.append(shown)
        rater.context.set_offline(True)
        rater.page.get_by_text("No connection to the laptop").wait_for()
        with rater.shown_anew():
            heading = rater.page.query_selector("#screen h1")
            if shown != "presenting":
                rater.act()  # what is tapped now is sent when the network is back
            rater.page.wait_for_timeout(10_000 if shown in long_at else 300)
            # a presentation ends by itself, of which Chromium still lets the page hear
            is_shown = heading.evaluate("it => it.isConnected")
            assert is_shown or shown == "presenting", "nobody can have answered"
            rater.context.set_offline(False)
        rater.page.get_by_text("No connection to the laptop").wait_for(state="detached")
    assert set(seen) == set(ALL) - {"over"}
    assert stage.is_complete()
