"""The workers' port while strangers use it up: workers join and render all the same."""

import os
import resource
import select
import socket

import pytest
from http2_frames import CONTINUATION, HEADERS, begin_call, closed_by_peer, connect, frame
from local_farm import LocalFarm, wait_until

SCENE = """<scene version="3.0.0"><integrator type="volpath"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film></sensor>
<emitter type="constant"/><shape type="sphere"/></scene>"""
STRANGER = "127.0.0.2"  # another address than the workers'


def a_worker_joins_and_renders(farm):
    farm.add_worker()
    farm.wait_for_workers(1)
    farm.wait_for_job(farm.submit(SCENE, spp=4))


def open_files(farm):
    return len(os.listdir(f"/proc/{farm.coordinator.popen.pid}/fd"))


def any_closed(connections):
    """True if the other side has closed or answered one of them."""
    return bool(select.select(connections, [], [], 0)[0])


def received(connection):
    """The first bytes that the other side sends; none if it closes the connection."""
    try:
        return connection.recv(65536)
    except ConnectionError:
        return b""


# gRPC's own listener would never accept again (CVE-2023-4785).
@pytest.mark.parametrize("tls", [False, True])
def test_the_port_takes_connections_again_when_files_can_be_opened_again(tmp_path, tls):
    with LocalFarm(tmp_path, tls=tls) as farm:
        pid = farm.coordinator.popen.pid
        before = resource.prlimit(pid, resource.RLIMIT_NOFILE)
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (3, before[1]))
        waiting = [socket.create_connection(("127.0.0.1", farm.grpc)) for _ in range(5)]
        wait_until(lambda: "Too many open files" in farm.coordinator.output(), "the coordinator cannot accept them")

        resource.prlimit(pid, resource.RLIMIT_NOFILE, before)

        a_worker_joins_and_renders(farm)
        for connection in waiting:
            connection.close()


@pytest.mark.parametrize("tls", [False, True])
def test_more_connections_than_files_leave_room_for_workers_and_users(tmp_path, tls):
    with LocalFarm(tmp_path, tls=tls, within=["prlimit", "--nofile=160:160"]) as farm:
        strangers = [socket.create_connection(("127.0.0.1", farm.grpc), source_address=(STRANGER, 0)) for _ in range(300)]
        wait_until(lambda: any_closed(strangers) or open_files(farm) >= 155, "the coordinator has come to its limit")

        a_worker_joins_and_renders(farm)

        assert farm.request("GET", "/readyz") == b"ready\n"
        for connection in strangers:
            connection.close()


@pytest.fixture(scope="module")
def farm(tmp_path_factory):
    with LocalFarm(tmp_path_factory.mktemp("port")) as farm:
        yield farm


def test_a_connection_without_a_hello_is_closed_and_a_workers_is_not(farm):
    farm.add_worker()
    farm.wait_for_workers(1)
    silent = socket.create_connection(("127.0.0.1", farm.grpc), timeout=60, source_address=(STRANGER, 0))
    half = connect(farm.grpc, STRANGER)
    half.sendall(begin_call(1))

    assert closed_by_peer(silent)
    assert closed_by_peer(half), "it has begun a call, and said nothing on it"

    assert [w["state"] for w in farm.get("/api/v1/workers")["workers"]] == ["connected"]


def test_many_calls_before_a_hello_close_the_connection_and_no_worker_is_refused(farm):
    stranger = connect(farm.grpc, "127.0.0.3")
    try:
        for begin in range(0, 16_384, 256):
            stranger.sendall(b"".join(begin_call(2 * i + 1) for i in range(begin, begin + 256)))
    except ConnectionError:
        pass

    assert closed_by_peer(stranger)
    a_worker_joins_and_renders(farm)
    again = socket.create_connection(("127.0.0.1", farm.grpc), timeout=60, source_address=("127.0.0.3", 0))
    assert received(again) == b"", "its address is shut out for a while: gRPC's server would speak first"


# gRPC 1.51 reads such a header for as long as it goes on (CVE-2023-33953).
def test_an_endless_header_closes_the_connection(farm):
    stranger = connect(farm.grpc, "127.0.0.4")
    endless = b"".join(frame(CONTINUATION, 0, 1, b"\x80" * 10) for _ in range(1000))
    sent = 0
    try:
        stranger.sendall(frame(HEADERS, 0, 1, b"\x00\x7f"))  # a name whose length does not end
        while sent < 100 << 20:
            stranger.sendall(endless)
            sent += len(endless)
    except (ConnectionError, TimeoutError):
        pass

    assert sent < 100 << 20
    assert closed_by_peer(stranger)
    a_worker_joins_and_renders(farm)
