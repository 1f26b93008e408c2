"""Time stamps of files by a service that the study does not run (RFC 3161)."""

import hashlib
import urllib.request
from datetime import datetime
from http.client import HTTPException
from pathlib import Path
from types import ModuleType
from urllib.error import URLError

from masrel._files import write_file
from masrel.errors import ParameterError
from masrel.lab._study_files import MAX_SMALL, MAX_TABLE, read_regular

_WAIT_S = 30.0  # for the service


def stamp_of(file: Path) -> Path:
    """Return where the time stamp of a file is kept."""
    return file.with_name(f"{file.name}.tsr")


def request_stamp(file: Path, service: str) -> datetime:
    """Have a file stamped, and keep the answer beside it.

    Parameters
    ----------
    file : Path
        What is stamped; the service gets its hash alone.
    service : str
        Address of a service of RFC 3161.

    Returns
    -------
    datetime
        The time that the service says.

    Raises
    ------
    ParameterError
        If the service cannot be reached, or gives no time stamp of the file, or
        rfc3161-client is not installed.
    OSError
        If a file cannot be read or written.
    """
    client = _client()
    data = read_regular(file, most=MAX_TABLE)
    query = (
        client.TimestampRequestBuilder()
        .data(data)
        .hash_algorithm(client.HashAlgorithm.SHA256)
        .build()
    )
    if not service.startswith(("http://", "https://")):
        raise ParameterError(f"stamp: needed an address with http, got {service!r}")
    try:
        request = urllib.request.Request(
            service,
            data=query.as_bytes(),
            headers={"Content-Type": "application/timestamp-query"},
        )
        with urllib.request.urlopen(request, timeout=_WAIT_S) as answer:
            token = answer.read(MAX_SMALL)
    except (OSError, HTTPException, ValueError) as error:  # of the address, or answer
        reason = error.reason if type(error) is URLError else error
        raise ParameterError(f"stamp: {service}: {reason}".strip()) from error
    time = _time_of(token, data, service)
    write_file(stamp_of(file), token)
    return time


def read_stamp(file: Path, authority: Path | None = None) -> datetime | None:
    """Return when a file was stamped, if it was.

    Parameters
    ----------
    file : Path
        What may be stamped.
    authority : Path, optional
        Certificate of the authority, PEM: with it the signature is verified, too.

    Returns
    -------
    datetime or None
        The time that the service said; None where there is no time stamp.

    Raises
    ------
    ParameterError
        If the time stamp is of other bytes, or not by this authority.
    OSError
        If a file cannot be read.
    """
    if not stamp_of(file).is_file():
        return None
    token = read_regular(stamp_of(file), most=MAX_SMALL)
    data = read_regular(file, most=MAX_TABLE)
    time = _time_of(token, data, str(stamp_of(file)))
    if authority is not None:
        from cryptography.x509 import load_pem_x509_certificate

        client = _client()
        root = load_pem_x509_certificate(read_regular(authority, most=MAX_SMALL))
        verifier = client.VerifierBuilder().add_root_certificate(root).build()
        try:
            verifier.verify_message(client.decode_timestamp_response(token), data)
        except client.VerificationError as error:
            raise ParameterError(
                f"{stamp_of(file)}: needed a time stamp by {authority}, got: {error}"
            ) from error
    return time


def _client() -> ModuleType:
    try:
        import rfc3161_client
    except ImportError as error:
        raise ParameterError(
            "stamp: needs rfc3161-client; install it with: pip install 'masrel[anchor]'"
        ) from error
    return rfc3161_client


def _time_of(token: bytes, data: bytes, where: str) -> datetime:
    try:
        answer = _client().decode_timestamp_response(token)
        imprint = answer.tst_info.message_imprint.message
    except (ValueError, AttributeError) as error:
        raise ParameterError(f"{where}: needed a time stamp, got: {error}") from error
    if imprint != hashlib.sha256(data).digest():
        raise ParameterError(
            f"{where}: needed a time stamp of these bytes, got another"
        )
    time: datetime = answer.tst_info.gen_time
    return time
