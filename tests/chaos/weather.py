"""A network of its own for workers, whose every packet passes through this program: it can lose, delay, double, reorder and damage
them, or let them pass one way only, without either side being told. Two TUN devices, one of them in a network namespace, and a
thread that carries packets between them; root, iproute2 and /dev/net/tun are needed, and nothing of the kernel's traffic control."""

import dataclasses
import fcntl
import heapq
import os
import pathlib
import random
import selectors
import shutil
import struct
import subprocess
import threading
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
MTU = 1500


class Skip(Exception):
    """This machine has not what the storm needs; says what."""


def as_root(*command):
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True).stdout


def need_root(what):
    if os.geteuid() != 0:
        raise Skip(f"{what} needs root")


@dataclasses.dataclass(frozen=True)
class Weather:
    loss: float = 0  # share of the packets; 1: a cut
    delay: float = 0  # seconds
    jitter: float = 0  # seconds more, at most: later packets overtake
    doubled: float = 0
    damaged: float = 0  # one bit flipped
    deaf: bool = False  # what workers send is lost, what they are sent arrives


class Network:
    """Give `inside` to LocalFarm.add_worker(within=...), and `host` to LocalFarm(host=...)."""

    count = 0

    def __init__(self, seed):
        need_root("a network namespace")
        if not shutil.which("ip") or not pathlib.Path("/dev/net/tun").exists():
            raise Skip("a network namespace needs iproute2 and /dev/net/tun")
        Network.count += 1
        tag, number = f"{os.getpid() % 100000}", Network.count % 100
        subnet = f"10.{100 + os.getpid() % 100}.{number}"
        self.host, self.name = f"{subnet}.1", f"lschaos{tag}-{number}"
        self.inside = ("ip", "netns", "exec", self.name)
        self._dice = random.Random(seed)
        self._weather, self._fds, self._made = Weather(), [], False
        try:
            as_root("ip", "netns", "add", self.name)
            self._made = True
            outer, inner = f"lso{tag}{number}", f"lsi{tag}{number}"
            self._fds = [self._tun(outer), self._tun(inner)]
            as_root("ip", "addr", "add", f"{self.host}/24", "dev", outer)
            as_root("ip", "link", "set", outer, "up")
            as_root("ip", "link", "set", inner, "netns", self.name)
            as_root(*self.inside, "ip", "addr", "add", f"{subnet}.2/24", "dev", inner)
            for device in (inner, "lo"):
                as_root(*self.inside, "ip", "link", "set", device, "up")
        except (OSError, subprocess.CalledProcessError) as error:
            self.__exit__()
            raise Skip(f"no network namespace here: {getattr(error, 'stderr', '') or error}".strip()) from None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    @staticmethod
    def _tun(name):
        fd = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
        fcntl.ioctl(fd, TUNSETIFF, struct.pack("16sH", name.encode(), IFF_TUN | IFF_NO_PI))
        return fd

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if hasattr(self, "_thread"):
            self._ended.set()
            self._thread.join()
        for fd in self._fds:
            os.close(fd)
        if self._made:
            subprocess.run(["ip", "netns", "del", self.name], capture_output=True)

    def weather(self, **what):
        """From now on; nothing said: fine."""
        self._weather = Weather(**what)

    def _carry(self):
        outer, inner = self._fds
        waiting, number = [], 0  # (due, number, to, packet)
        with selectors.DefaultSelector() as ready:
            for fd in self._fds:
                ready.register(fd, selectors.EVENT_READ)
            while not self._ended.is_set():
                pause = min(0.05, max(0, waiting[0][0] - time.monotonic())) if waiting else 0.05
                for key, _ in ready.select(pause):
                    w, packet = self._weather, os.read(key.fd, MTU + 100)
                    if self._dice.random() < w.loss or (w.deaf and key.fd == inner):
                        continue
                    if self._dice.random() < w.damaged:
                        packet = bytearray(packet)
                        packet[self._dice.randrange(20, len(packet))] ^= 1 << self._dice.randrange(8)
                    for _ in range(2 if self._dice.random() < w.doubled else 1):
                        due = time.monotonic() + w.delay + w.jitter * self._dice.random()
                        heapq.heappush(waiting, (due, number, inner if key.fd == outer else outer, bytes(packet)))
                        number += 1
                while waiting and waiting[0][0] <= time.monotonic():
                    _, _, to, packet = heapq.heappop(waiting)
                    try:
                        os.write(to, packet)
                    except OSError:
                        pass  # full, or down: lost as on a wire
