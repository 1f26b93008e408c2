"""Time stamps by a service that the study does not run."""

from pathlib import Path

import pytest

from masrel.errors import ParameterError
from masrel.lab.verification import read_stamp, request_stamp
from tests.lab.authority import authority


def test_a_stamp_is_of_its_bytes_by_its_authority_and_of_its_time(
    tmp_path: Path,
) -> None:
    file = tmp_path / "kept.txt"
    file.write_text("an anchor", encoding="utf-8")
    assert read_stamp(file) is None
    with authority(tmp_path / "one") as (service, root):
        time = request_stamp(file, service)
    assert read_stamp(file, root) == time
    with authority(tmp_path / "other") as (_, other):
        pass
    with pytest.raises(ParameterError, match=r"needed a time stamp by .*other"):
        read_stamp(file, other)
    file.write_text("another anchor", encoding="utf-8")
    with pytest.raises(ParameterError, match="stamp of these bytes, got another"):
        read_stamp(file, root)
    for wrong in (service, "http://[", "ftp://localhost"):  # which is no more there
        with pytest.raises(ParameterError, match="stamp: "):
            request_stamp(file, wrong)
