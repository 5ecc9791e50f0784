"""SlurmCluster: a real Slurm of one machine, with its own munged, slurmctld and slurmd, on free ports and in one folder.

Two partitions share the machine: jobs of `urgent` preempt those of `low`, which Slurm then requeues.
"""

import getpass
import os
import pathlib
import shutil
import socket
import subprocess

from local_farm import Process, wait_until

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scontrol", "scancel")


def missing():
    """The programs of Slurm that are not installed here."""
    return [p for p in PROGRAMS if not shutil.which(p, path=os.environ["PATH"] + ":/usr/sbin")]


def free_ports(count):
    listening = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [s.getsockname()[1] for s in listening]
    for s in listening:
        s.close()
    return ports


CONF = """ClusterName=lightshaft
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CryptoType=crypto/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
ReturnToService=1
SlurmdParameters=config_overrides
SlurmdTimeout=30
KillWait=10
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_interval=2,bf_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
JobRequeue=1
NodeName={host} NodeAddr=127.0.0.1 CPUs=4 Boards=1 SocketsPerBoard=1 CoresPerSocket=4 ThreadsPerCore=1 State=UNKNOWN
PartitionName=low Nodes={host} Default=YES PriorityTier=1 OverSubscribe=NO MaxTime=60 State=UP
PartitionName=urgent Nodes={host} PriorityTier=10 OverSubscribe=NO PreemptMode=OFF MaxTime=60 State=UP
"""


class SlurmCluster:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        for name in ("", "state", "spool", "munge"):
            (self.folder / name).mkdir(mode=0o700, parents=True, exist_ok=True)
        controller, node = free_ports(2)
        self.host = socket.gethostname().split(".")[0]
        conf = self.folder / "slurm.conf"
        conf.write_text(CONF.format(host=self.host, controller=controller, node=node, user=getpass.getuser(), folder=self.folder))
        self.environment = dict(os.environ, SLURM_CONF=str(conf), PATH=os.environ["PATH"] + ":/usr/sbin")
        self.daemons = []
        try:
            self.start_all()
        except BaseException:
            self.stop_all()
            raise

    def start_all(self):
        key = self.folder / "munge/key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        munge = self.folder / "munge"
        self.munged = self.start("munged", "--foreground", "--force", f"--key-file={key}", f"--socket={self.folder}/munge.socket",
                                 f"--pid-file={munge}/pid", f"--log-file={munge}/log", f"--seed-file={munge}/seed")
        wait_until(lambda: (self.folder / "munge.socket").exists(), "munged listens")
        self.controller = self.start("slurmctld", "-D")
        self.node = self.start("slurmd", "-D")
        self.wait_for_node("idle")

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if self.controller.alive():
            self.run("scancel", "--me", check=False)
            wait_until(lambda: not self.jobs(), "all jobs have ended")
        self.stop_all()

    def stop_all(self):
        for daemon in reversed(self.daemons):
            daemon.terminate()

    def start(self, program, *arguments):
        daemon = Process(program, [shutil.which(program, path=self.environment["PATH"]), *arguments], self.folder / f"{program}.log", self.environment)
        self.daemons.append(daemon)
        return daemon

    def stop_controller(self):
        """As a restart of its service does: it saves its state. After kill -9, Slurm goes on with a state of some seconds before."""
        self.controller.terminate()
        self.daemons.remove(self.controller)

    def start_controller(self):
        self.controller = self.start("slurmctld", "-D")

    def run(self, *words, check=True):
        return subprocess.run(words, env=self.environment, capture_output=True, text=True, check=check).stdout

    def state(self):
        return self.run("sinfo", "--noheader", "--format=%T", "--partition=low", check=False).strip()

    def wait_for_node(self, state):
        wait_until(lambda: self.state().startswith(state), f"the node is {state}")

    def jobs(self):
        """[(id, state)] of jobs that have not ended."""
        lines = self.run("squeue", "--noheader", "--array", "--format=%i %T", check=False).splitlines()
        return [tuple(line.split()) for line in lines]
