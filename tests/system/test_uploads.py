"""Uploads that go on where they broke: over reset connections, killed coordinators and half-open lines."""

import hashlib
import os
import socket
import struct
import subprocess

import pytest
import steam
from breaking_proxy import BreakingProxy
from local_farm import PATIENCE, bin_dir, wait_until

SCENE = steam.scene(samples=2)
SIDE = 112  # 5.4 MiB of grid


def write_grid(path):
    path.write_bytes(steam.grid([v / 256 for v in os.urandom(SIDE ** 3)]))


def digest(data):
    return hashlib.sha256(data).hexdigest()


class Line:
    """A connection to the coordinator that a test may break as it likes."""

    def __init__(self, farm):
        self.farm = farm
        self.sock = socket.create_connection(("127.0.0.1", farm.http), 60)

    def begin_part(self, data, first, total_sent):
        """Announces all from `first` on and sends only `total_sent` bytes of it."""
        self.sock.sendall((f"PUT /api/v1/blobs/{digest(data)} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {self.farm.token}\r\n"
                           f"Content-Range: bytes {first}-{len(data) - 1}/{len(data)}\r\nContent-Length: {len(data) - first}\r\n\r\n").encode()
                          + data[first:first + total_sent])

    def reset(self):
        self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.sock.close()


def probe(farm, data):
    """(status, Upload-Offset)"""
    with socket.create_connection(("127.0.0.1", farm.http), 60) as sock:
        sock.sendall((f"HEAD /api/v1/blobs/{digest(data)} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {farm.token}\r\n"
                      "Connection: close\r\n\r\n").encode())
        head = b"".join(iter(lambda: sock.recv(4096), b"")).decode()
    fields = dict(line.split(": ", 1) for line in head.split("\r\n")[1:] if ": " in line)
    return int(head.split()[1]), int(fields["Upload-Offset"])


def put_rest(farm, data, first):
    with socket.create_connection(("127.0.0.1", farm.http), 60) as sock:
        line = Line.__new__(Line)
        line.farm, line.sock = farm, sock
        line.begin_part(data, first, len(data))
        return int(sock.recv(4096).split()[1])


def test_the_cli_goes_on_where_its_connections_broke(farm, tmp_path):
    (tmp_path / "scene.xml").write_text(SCENE)
    write_grid(tmp_path / "steam.vol")
    size = (tmp_path / "steam.vol").stat().st_size
    with BreakingProxy(farm.http, breaks=[1_500_000, 1_000_000, 70_000]) as proxy:
        done = subprocess.run([bin_dir() / "lightshaft", "submit", tmp_path / "scene.xml", "--to", proxy.url],
                              env=dict(os.environ, LIGHTSHAFT_TOKEN=farm.token), capture_output=True, text=True, timeout=PATIENCE)

    assert done.returncode == 0, done.stderr
    assert len(proxy.sent) >= 4, "the first three connections were broken"
    # From the start each time it would be 2.5 MB more; only what the broken ends had in their buffers comes again.
    assert sum(proxy.sent) < size + 500_000
    assert farm.job(done.stdout.strip())["state"] in ("queued", "running")


def test_an_upload_goes_on_after_the_coordinator_was_killed(farm):
    data = os.urandom(3_000_000)
    line = Line(farm)
    line.begin_part(data, 0, 1_000_000)
    wait_until(lambda: probe(farm, data)[1] > 0, "some of it is kept")

    farm.restart_coordinator()

    status, offset = probe(farm, data)
    assert status == 404 and 0 < offset <= 1_000_000
    assert put_rest(farm, data, offset) == 201
    assert probe(farm, data) == (200, len(data))


def test_an_upload_goes_on_while_the_old_connection_still_seems_to_live(farm):
    data = os.urandom(2_000_000)
    half_open = Line(farm)
    half_open.begin_part(data, 0, 600_000)
    wait_until(lambda: probe(farm, data)[1] > 0, "some of it is kept")

    # While what the old connection had sent still comes in, a part that begins before it is a conflict. That has an end.
    status = 409
    while status == 409:
        status = put_rest(farm, data, probe(farm, data)[1])
    assert status == 201

    half_open.sock.sendall(data[600_000:600_100])  # it wakes, and harms nothing
    half_open.reset()
    assert probe(farm, data) == (200, len(data))


def test_a_reset_connection_keeps_what_came(farm):
    data = os.urandom(1_000_000)
    line = Line(farm)
    line.begin_part(data, 0, 300_000)
    wait_until(lambda: probe(farm, data)[1] >= 262_144, "a chunk is kept")
    line.reset()

    # What the coordinator still reads of the broken connection may come in between question and part: then it says 409.
    wait_until(lambda: put_rest(farm, data, probe(farm, data)[1]) == 201, "the rest is taken")
    assert probe(farm, data) == (200, len(data))


@pytest.mark.parametrize("first, expected", [(0, 409), (900_000, 409)])
def test_a_part_that_does_not_go_on_is_refused(farm, first, expected):
    data = os.urandom(1_000_000)
    line = Line(farm)
    line.begin_part(data, 0, 500_000)
    wait_until(lambda: 0 < probe(farm, data)[1] < 900_000, "some of it is kept")
    line.reset()

    assert put_rest(farm, data, first) == expected
