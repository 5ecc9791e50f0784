"""SshServer: a real sshd of this machine on a free port, that lets in one key; and the configuration for its clients."""

import getpass
import os
import pathlib
import shutil
import subprocess

from local_farm import Process, wait_until
from slurm_cluster import free_ports

SSHD = shutil.which("sshd", path="/usr/sbin:/usr/bin")


def missing():
    return [] if SSHD and shutil.which("ssh") else ["sshd or ssh"]


class SshServer:
    def __init__(self, folder, machines):
        """`machines`: names under which the clients' configuration knows this machine."""
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        (self.port,) = free_ports(1)
        for key in ("host", "user"):
            subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", self.folder / key], check=True)
        shutil.copy(self.folder / "user.pub", self.folder / "authorized")
        host_key = (self.folder / "host.pub").read_text().split()[:2]
        (self.folder / "known").write_text(f"[127.0.0.1]:{self.port} {' '.join(host_key)}\n")
        (self.folder / "sshd.conf").write_text(
            f"Port {self.port}\nListenAddress 127.0.0.1\nHostKey {self.folder}/host\nPidFile none\nStrictModes no\nUsePAM no\n"
            f"AuthorizedKeysFile {self.folder}/authorized\nPasswordAuthentication no\nKbdInteractiveAuthentication no\n"
            f"AllowUsers {getpass.getuser()}\nPermitRootLogin prohibit-password\nMaxStartups 100\n")
        self.config = self.folder / "client.conf"
        self.config.write_text(f"Host {' '.join(machines)}\n HostName 127.0.0.1\n Port {self.port}\n IdentityFile {self.folder}/user\n"
                               f" IdentitiesOnly yes\n UserKnownHostsFile {self.folder}/known\n StrictHostKeyChecking yes\n")
        if os.getuid() == 0:
            # folder that sshd requires for privilege separation
            pathlib.Path("/run/sshd").mkdir(mode=0o755, exist_ok=True)
        self.sshd = Process("sshd", [SSHD, "-D", "-e", "-f", self.folder / "sshd.conf"], self.folder / "sshd.log")
        wait_until(lambda: "listening on" in self.sshd.output() or not self.sshd.alive(), "sshd listens")
        assert self.sshd.alive(), self.sshd.output()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.sshd.terminate()
