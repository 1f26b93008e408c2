"""Values that two analyses do not have in common."""

from typing import Any

from masrel.lab.analysis._comparison import changes_between


def test_the_reason_of_an_interval_is_not_that_of_its_estimate() -> None:
    def analysis(reason: str | None) -> dict[str, Any]:
        interval = {"low": None, "reason": reason}
        estimate = {"value": 1.0, "interval": interval, "reason": None}
        return {"estimates": [{"id": "a", "estimate": estimate, "reason": None}]}

    (change,) = changes_between(analysis(None), analysis("no spread"))
    assert (change.of, change.field) == ("a", "reason")
    assert (change.old, change.new, change.difference) == (None, "no spread", None)
    (flag,) = changes_between({"simulated": False}, {"simulated": True})
    assert flag.difference is None
