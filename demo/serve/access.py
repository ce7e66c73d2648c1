"""Who may talk to the server: hosts and origins that are asked for, and sizes and rates of what is sent."""

import ipaddress
import socket
from urllib.parse import urlsplit

LOOPBACK = "127.0.0.1"
LARGEST_MESSAGE = 4096  # bytes that a page may send over its socket at once
MOST_MESSAGES = 400  # a second, of one page: input goes out once a picture, and no screen shows so many
LARGEST_DROP = 64 * 2**20  # bytes of all files of a drop
MOST_FILES = 16  # of a drop


def is_own_host(host: str | None, served: str) -> bool:
    """Whether a Host header names this machine: as an address, as localhost, by its name, or as it was told to serve.

    A web page of somebody else's whose name was made to lead here (DNS rebinding) asks for its own name."""
    name = _name_of(host)
    if name is None:
        return False
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return name in {"localhost", served.lower(), socket.gethostname().lower()}
    return True


def is_own_origin(origin: str | None, host: str | None) -> bool:
    """Whether a request comes from our own page, and not from another one that is open in the same browser; programs
    that are no browser say nothing of where they come from."""
    return origin is None or origin in (f"http://{host}", f"https://{host}")


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches a server on a host."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def _name_of(host: str | None) -> str | None:
    """`localhost` of `localhost:8321`; None for what is no host."""
    try:
        return urlsplit(f"//{host}").hostname if host else None
    except ValueError:
        return None
