"""Finds the owners of TCP connections on this machine in the kernel's tables."""

import contextlib
import os
import pathlib
import socket
import sys
from collections.abc import Iterator

ESTABLISHED, LISTENS = "01", "0A"


def _rows() -> Iterator[list[str]]:
    for table in ("tcp", "tcp6"):
        with contextlib.suppress(OSError):
            for line in pathlib.Path("/proc/net", table).read_text().splitlines()[1:]:
                yield line.split()


def user_of(here: tuple[str, int], there: tuple[str, int]) -> int | None:
    """Returns the user who owns the IPv4 connection that ends at `here`. Returns None also for a closed
    connection, for which the kernel's entry is wrong."""
    mapped = f"{0:016X}{int.from_bytes(bytes([0, 0, 255, 255]), sys.byteorder):08X}"  # a socket of IPv6 that uses IPv4

    def shown(address: tuple[str, int]) -> str:
        return f"{int.from_bytes(socket.inet_aton(address[0]), sys.byteorder):08X}:{address[1]:04X}"

    for row in _rows():
        if row[3] == ESTABLISHED and [end.removeprefix(mapped) for end in row[1:3]] == [shown(here), shown(there)]:
            return int(row[7])
    return None


def listens(process: int, port: int) -> bool:
    """Returns True if a process of this user accepts connections at a port."""
    own = set()
    for file in pathlib.Path(f"/proc/{process}/fd").glob("*"):
        with contextlib.suppress(OSError):
            own.add(os.readlink(file))
    return any(row[3] == LISTENS and row[1].endswith(f":{port:04X}") and f"socket:[{row[9]}]" in own for row in _rows())
