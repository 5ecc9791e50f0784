"""See run.sh. Prints a line for each thing that is so, and ends with 1 at the first that is not, with 77 where it cannot run."""

import argparse
import json
import pathlib
import re
import shlex
import signal
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from local_farm import wait_until  # noqa: E402

PACKAGES = ["lightshaft", "lightshaft-coordinator", "lightshaft-vdb", "lightshaft-worker"]
COMPILERS = ["cc", "gcc", "c++", "g++", "clang", "cmake", "ninja", "make"]
SERVICES = {"lightshaft-coordinator": "/var/lib/lightshaft", "lightshaft-worker": "/var/cache/lightshaft-worker"}
UNITS = "/usr/lib/systemd/system"
TOKEN = "/etc/lightshaft/join-token"
MOST_EXPOSED = 25  # of systemd-analyze security: 100 is a service without any confinement
OPTIONS = ["--size", "96x54", "--spp", "8", "--seed", "7"]
PATIENCE = 300
CANNOT_RUN = 77


def so(condition, what):
    print(f"{'ok ' if condition else 'NOT SO'} {what}", flush=True)
    if not condition:
        raise SystemExit(1)


def say_ended(done, what):
    if done.returncode != 0:
        raise SystemExit(f"{what} ended with {done.returncode}\n{done.stdout[-4000:]}{done.stderr[-4000:]}")
    return done.stdout.strip()


def docker(*arguments):
    return subprocess.run(["docker", *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE)


class Container:
    def __init__(self, base, network):
        started = docker("run", "-d", "--network", network, base, "tail", "-f", "/dev/null")
        if started.returncode != 0:
            print(f"the packages are not tested here: no container of {base}: {started.stderr.strip()}", file=sys.stderr)
            raise SystemExit(CANNOT_RUN)
        self.id = started.stdout.strip()

    def remove(self):
        docker("rm", "-f", self.id)

    def run(self, *command, user="root", environment=()):
        settings = [word for entry in environment for word in ("-e", entry)]
        return docker("exec", "--user", user, *settings, self.id, *command)

    def must(self, *command, **more):
        return say_ended(self.run(*command, **more), " ".join(command))

    def read(self, path):
        return self.must("cat", path)

    def has(self, path):
        return self.run("test", "-e", path).returncode == 0

    def put(self, source, target):
        say_ended(docker("cp", source, f"{self.id}:{target}"), f"docker cp {source}")
        self.must("chmod", "-R", "a+rX", target)

    def replace(self, path, text):
        """The file keeps its owner and mode."""
        done = subprocess.run(["docker", "exec", "-i", self.id, "sh", "-c", f"cat > {path}"], input=text, capture_output=True, text=True)
        say_ended(done, f"writing {path}")


def settings_of(unit):
    """The section [Service]: name -> values, in their order."""
    settings, section = {}, ""
    for line in unit.splitlines():
        if line.startswith("["):
            section = line
        elif section == "[Service]" and "=" in line and line[0] not in "#;":
            name, _, value = line.partition("=")
            settings.setdefault(name, []).append(value)
    return settings


class Service:
    """A unit's program, started as systemd would: its user, its environment, its arguments, no capability."""

    def __init__(self, container, name):
        self.container, self.name = container, name
        unit = settings_of(container.read(f"{UNITS}/{name}.service"))
        user, group = unit["User"][0], unit["Group"][0]
        variables = self.variables(unit)
        home = container.must("getent", "passwd", user).split(":")[5]
        environment = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin", "HOME": home, "USER": user, "LOGNAME": user, **variables}
        command = self.expand(unit["ExecStart"][0], variables)
        words = ["setpriv", "--reuid", user, "--regid", group, "--init-groups", "--no-new-privs", "--bounding-set", "-all", "--inh-caps", "-all",
                 "env", "-i", *[f"{key}={value}" for key, value in environment.items()], *command]
        script = f"umask {unit['UMask'][0]}; cd /; echo $$ > /run/{name}.pid; exec {shlex.join(words)}"
        self.log = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(["docker", "exec", container.id, "sh", "-c", script], stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log)

    def variables(self, unit):
        found = {}
        for path in unit.get("EnvironmentFile", []):
            for line in self.container.read(path.removeprefix("-")).splitlines():
                if line and line[0] not in "#;":
                    name, _, value = line.partition("=")
                    found[name] = "".join(shlex.split(value))
        return found

    @staticmethod
    def expand(command, variables):
        """$NAME alone is split into words."""
        words = []
        for word in shlex.split(command):
            words += variables.get(word[1:], "").split() if re.fullmatch(r"\$\w+", word) else [word]
        return words

    def output(self):
        self.log.seek(0)
        return self.log.read()

    def alive(self):
        return self.process.poll() is None

    def terminate(self):
        """SIGTERM; the exit code."""
        self.container.must("sh", "-c", f"kill -TERM $(cat /run/{self.name}.pid)")
        return self.process.wait(PATIENCE)


APT = ["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-q"]


def open_box(base, networks):
    """A container that reaches Debian's archive over one of the networks."""
    for network in networks:
        box = Container(base, network)
        updated = box.run(*APT, "-o", "Acquire::Retries=0", "-o", "Acquire::http::Timeout=20", "update")
        if updated.returncode == 0 and "Failed to fetch" not in updated.stdout + updated.stderr:
            return box
        box.remove()
    print(f"the packages are not tested here: apt-get update fails in a container\n{updated.stderr}", file=sys.stderr)
    raise SystemExit(CANNOT_RUN)


def install(box):
    box.put(ROOT / "build" / "packages", "/packages")
    files = box.must("sh", "-c", "ls /packages/*.deb").split()
    so(sorted(pathlib.Path(f).name.split("_")[0] for f in files) == PACKAGES, f"there are the packages {', '.join(PACKAGES)}")
    box.must(*APT, "install", "-y", "--no-install-recommends", *files)
    so(box.run("dpkg", "--verify", *PACKAGES).stdout == "", "they install with what they depend on")
    found = [name for name in COMPILERS if box.run("sh", "-c", f"command -v {name}").returncode == 0]
    so(not found, f"the container has no compiler {found or ''}")
    for name, folder in SERVICES.items():
        user = settings_of(box.read(f"{UNITS}/{name}.service"))["User"][0]
        so(box.must("stat", "-c", "%U %a", folder) == f"{user} 700" and box.must("getent", "passwd", user).endswith("/nologin"),
           f"{folder} is for {user} alone, who cannot log in")
    linked = box.must("ldd", "/usr/bin/lightshaft-coordinator")
    so(not re.search("embree|openvdb", linked), "the coordinator links neither Embree nor OpenVDB")


PAGES = {"lightshaft": "lightshaft", "lightshaft-coordinator": "lightshaft-coordinator", "lightshaft-worker": "lightshaft-worker"}
COMPLETIONS = {"bash": "bash-completion/completions/lightshaft", "zsh": "zsh/vendor-completions/_lightshaft",
               "fish": "fish/vendor_completions.d/lightshaft.fish"}


def check_help(box):
    """Manual pages are read from the packages: a slim image has dpkg leave them out."""
    for package, program in PAGES.items():
        page = f"./usr/share/man/man1/{program}.1.gz"
        read = box.must("sh", "-c", f"dpkg-deb --fsys-tarfile /packages/{package}_*.deb | tar -xO {page} | gzip -d")
        options = re.findall(r"--[a-z][a-z-]+", box.must(program, "--help", user="nobody"))
        so(read.startswith(".TH") and options and all(o.replace("-", r"\-") in read or o in read for o in options),
           f"{package} has the manual page {program}(1) with the {len(set(options))} options of --help")
    for shell, path in COMPLETIONS.items():
        so(box.read(f"/usr/share/{path}") == box.must("lightshaft", "completion", shell, user="nobody"),
           f"the package has the completion of {shell}")


def pixels(box, report):
    return json.loads(box.read(report))["pixels_sha256"]


def render(box):
    """Those of the command line alone, which reads an OpenVDB file with it."""
    box.must("lightshaft", "render", "/scene/bath.xml", *OPTIONS, "-o", "/tmp/alone.exr", "--report", "/tmp/alone.json", "--quiet", user="nobody")
    return pixels(box, "/tmp/alone.json")


def render_on_farm(box, services):
    data = SERVICES["lightshaft-coordinator"]
    # On free ports: with Docker's host network they are those of the machine.
    box.replace("/etc/default/lightshaft-coordinator", 'OPTIONS="--http 127.0.0.1:0 --grpc 127.0.0.1:0"\n')
    coordinator = Service(box, "lightshaft-coordinator")
    services.append(coordinator)
    wait_until(lambda: box.has(f"{data}/ports.json") or not coordinator.alive(), "the coordinator listens", PATIENCE)
    so(coordinator.alive(), "the coordinator runs as its unit says")
    ports = json.loads(box.read(f"{data}/ports.json"))

    box.must("install", "-D", "-m", "0640", "-g", "lightshaft-worker", f"{data}/join-token", TOKEN)
    box.replace("/etc/default/lightshaft-worker", f'OPTIONS="--coordinator 127.0.0.1:{ports["grpc"]} --threads 1"\n')
    worker = Service(box, "lightshaft-worker")
    services.append(worker)
    farm = [f"LIGHTSHAFT_URL=http://127.0.0.1:{ports['http']}", f"LIGHTSHAFT_TOKEN={box.read(f'{data}/token')}"]
    workers = lambda: json.loads(box.must("lightshaft", "workers", "--json", user="nobody", environment=farm))["workers"]
    joined = wait_until(lambda: workers() or not worker.alive() and [{}], "the worker joins", PATIENCE)
    so(worker.alive() and joined[0].get("fake") is False, f"the worker runs as its unit says, and joins with version {joined[0].get('build')}")
    box.must("lightshaft", "submit", "/scene/bath.xml", *OPTIONS, "--wait", "-o", "/tmp/farm.exr", "--report", "/tmp/farm.json",
             user="nobody", environment=farm)
    so(True, "it renders a job of the command line")
    found = pixels(box, "/tmp/farm.json")
    so(worker.terminate() == 0, "a worker that is stopped drains and ends with 0")
    so(coordinator.terminate() == 0, "a coordinator that is stopped ends with 0")
    return found


def check_units(box):
    """Here, where the programs are, and after the rest, as systemd brings much along."""
    box.must(*APT, "install", "-y", "--no-install-recommends", "systemd")
    for name in SERVICES:
        path = f"{UNITS}/{name}.service"
        verified = box.run("systemd-analyze", "verify", path)
        so(verified.returncode == 0 and name not in verified.stderr, f"systemd-analyze verify finds nothing in {name}.service {verified.stderr}")
        judged = box.run("systemd-analyze", "security", "--offline=yes", f"--threshold={MOST_EXPOSED}", path)
        verdict = judged.stdout.strip().splitlines()[-1:] or [judged.stderr]
        so(judged.returncode == 0, f"systemd-analyze security: {verdict[0].strip()}")


def purge(box):
    box.must(*APT, "purge", "-y", *PACKAGES)
    # The join token is the administrator's.
    left = box.must("find", "/etc", "/usr", "/var/lib", "/var/cache", "-name", "*lightshaft*", "-not", "-path", "/etc/lightshaft")
    so(left == "", f"purged packages leave nothing behind {left}")


def main():
    args = argparse.ArgumentParser()
    args.add_argument("--base", default="debian:bookworm-slim")
    args.add_argument("--network", help="default: bridge, or host where that does not reach Debian's archive")
    options = args.parse_args()
    services = []
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that the container is removed
    box = open_box(options.base, [options.network] if options.network else ["bridge", "host"])
    try:
        install(box)
        with tempfile.TemporaryDirectory(prefix="lightshaft-packages-") as folder:
            make = [sys.executable, "-B", ROOT / "scenes" / "bath" / "make_bath.py", f"{folder}/bath", "--setting", "sketch"]
            subprocess.run(make, check=True, capture_output=True)
            box.put(f"{folder}/bath", "/scene")
        check_help(box)
        alone, farm = render(box), render_on_farm(box, services)
        so(alone == farm, f"the farm's pixels are those of `lightshaft render`: {farm[:16]}")
        check_units(box)
        purge(box)
    except BaseException:
        for service in services:
            print(f"---- {service.name}\n{service.output()[-4000:]}", file=sys.stderr)
        raise
    finally:
        box.remove()


if __name__ == "__main__":
    main()
