"""Addresses of the pages: where a browser finds them, in words and as QR codes."""

import contextlib
import io
import ipaddress
import socket

import segno

# Addresses that are asked nothing: which of its own a computer would call them from
_NETWORKS = ("192.168.255.254", "10.255.255.254", "172.31.255.254", "169.254.255.254")
_ANY = ("0.0.0.0", "::")
_LOOPBACK = ("127.0.0.1", "localhost")


def is_loopback(host: str) -> bool:
    """Return whether only this computer itself can call an address."""
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host.partition("%")[0]).is_loopback
    return False


def hosts(listener: socket.socket, host: str, *, encrypted: bool) -> list[str]:
    """Return by which names and ports a browser may call, the best one first."""
    address, port = listener.getsockname()[:2]
    if address in _ANY:
        names = [*_own_addresses(), *_LOOPBACK]
    elif is_loopback(address):
        names = [host, address, "localhost"]
    else:
        names = [host, address]
    usual = port == (443 if encrypted else 80)  # which browsers leave out
    names = [f"[{name}]" if ":" in name else name.lower() for name in names]
    return [name if usual else f"{name}:{port}" for name in dict.fromkeys(names)]


def _own_addresses() -> list[str]:
    addresses = []
    for network in _NETWORKS:
        with (
            contextlib.suppress(OSError),
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as caller,
        ):
            caller.connect((network, 9))  # sends nothing
            addresses.append(str(caller.getsockname()[0]))
    return [each for each in dict.fromkeys(addresses) if not is_loopback(each)]


def qr_lines(address: str) -> str:
    """Return an address as a QR code for a terminal."""
    lines = io.StringIO()
    segno.make(address, error="l", micro=False).terminal(lines, compact=True)
    return lines.getvalue()


def qr_svg(address: str) -> str:
    """Return an address as a QR code for a page: what its `src` is, dark on light."""
    code = segno.make(address, error="l", micro=False)
    return str(code.svg_data_uri(scale=6, border=3, dark="black", light="white"))
