"""Clients that are slow, idle, or read nothing: they are disconnected, and delay nobody else."""

import select
import socket
import time

from attack_kit import Bystander, LocalFarm, NO_ANSWER, SCENE, UNLIMITED, group, still_serves, submit


def connect(farm, text=b"", receive_buffer=None):
    sock = socket.socket()
    if receive_buffer:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    sock.settimeout(NO_ANSWER)
    sock.connect(("127.0.0.1", farm.http))
    sock.sendall(text)
    return sock


def seconds_until_closed(socks, drip=None, every=0.5, bystander=None):
    """When each was closed by the other side, in seconds from now; None where it was not. `drip` is sent to each again and again."""
    began, open_now, closed = time.monotonic(), {s.fileno(): (i, s) for i, s in enumerate(socks)}, [None] * len(socks)
    waiting = select.poll()
    for fd in open_now:
        waiting.register(fd, select.POLLIN | select.POLLHUP | select.POLLERR)
    while open_now and time.monotonic() - began < NO_ANSWER:
        for fd, _ in waiting.poll(every * 1000):
            index, sock = open_now[fd]
            try:
                ended = not sock.recv(1 << 16)
            except OSError:
                ended = True
            if ended:
                closed[index] = time.monotonic() - began
                waiting.unregister(fd)
                del open_now[fd]
        if drip:
            for _, sock in open_now.values():
                try:
                    sock.send(drip)
                except OSError:
                    pass
        if bystander:
            bystander.asks()
    return closed


def cut(record, label, closed, limit):
    """The limits are of SECURITY.md; what comes on top is for a busy machine and the steps in which this looks."""
    record.attempt(label, all(c is not None and c < limit + 10 for c in closed), f"closed after {sorted(closed, key=lambda c: c or 1e9)[-3:]} s, allowed {limit} s")


def slow_heads_and_bodies(record, farm, bob, limit_head, limit_body):
    mallory = farm.token_of("mallory")
    head = f"POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {mallory}\r\nContent-Type: application/xml\r\nContent-Length: "
    record.row = "heads and bodies a byte at a time, bodies that stop after a burst"
    for label, begin, drip, limit in (("heads, a byte every half second", b"GET /healthz HTTP/1.1\r\nHost: x\r\nX-Drip: ", b"a", limit_head), ("heads that stop", b"GET / HT", None, limit_head),
                                      ("bodies, a byte every half second", (head + "100000\r\n\r\n").encode(), b" ", limit_body), ("bodies that stop after 8 MB", (head + "9000000\r\n\r\n").encode() + b" " * 8_000_000, None, limit_body),
                                      ("chunks, a byte every half second", (head.replace("Content-Length: ", "Transfer-Encoding: chunked") + "\r\n\r\n1\r\na\r\n").encode(), b"1\r\n \r\n", limit_body)):
        socks = [connect(farm, begin) for _ in range(8)]
        closed = seconds_until_closed(socks, drip, bystander=bob)
        for i, c in enumerate(closed):
            cut(record, f"{label}, {i}", [c], limit)
        for sock in socks:
            sock.close()


def waits_of(record, bob, label):
    record.row = "another user meanwhile: no request refused, none longer than a second"
    record.attempt(label, bob.served(), f"{bob.told()}; {bob.refused[:2]}")


@group("Slow and idle clients, with short limits", quick=True, whole=False)
def short_limits(record, folder):
    flags = ("--http-header-seconds", "1", "--http-body-grace-seconds", "1")
    with LocalFarm(folder, flags=(*UNLIMITED, *flags)) as farm:
        bob = Bystander(farm)
        slow_heads_and_bodies(record, farm, bob, 1, 1)
        record.row = "afterwards"
        still_serves(record, farm, bob.token)


@group("Slow and idle clients")
def slow(record, folder):
    with LocalFarm(folder, flags=UNLIMITED) as farm:
        bob = Bystander(farm)
        slow_heads_and_bodies(record, farm, bob, 10, 15)
        waits_of(record, bob, "beside slow heads and bodies")

        record.row = "600 connections that say nothing, and others after them"
        idle = [connect(farm) for _ in range(600)]
        idler = Bystander(farm, "carol")
        for _ in range(20):
            idler.asks()
        record.attempt("a new connection displaces a silent one", idler.served(), f"{idler.told()} {idler.refused[:1]}")
        for sock in idle:
            sock.close()

        record.row = "readers that read nothing of a large answer"
        farm.add_worker()
        job = submit(farm, farm.token, SCENE, spp=2, size="2048x2048")
        farm.wait_for_job(job)
        mallory = farm.token_of("mallory")
        theirs = submit(farm, mallory, SCENE, spp=2, size="2048x2048")
        farm.wait_for_job(theirs)
        for what in ("image.exr", "pixels?rect=0,0,1024,1024", "report.html", "image.png"):
            socks = [connect(farm, f"GET /api/v1/jobs/{theirs}/{what} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {mallory}\r\n\r\n".encode(), receive_buffer=2048) for _ in range(30)]
            reader = Bystander(farm, f"dave-{what[:5]}")
            for _ in range(20):
                reader.asks()
            record.attempt(f"30 of {what} beside another user", reader.served(), f"{reader.told()} {reader.refused[:1]}")
            for sock in socks:
                sock.close()
        record.row = "afterwards"
        still_serves(record, farm, bob.token)
