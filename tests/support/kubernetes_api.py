"""KubernetesApi: a real kube-apiserver with its etcd, on free ports and in one folder; and a node for it, which runs the pods of
workers as processes of this machine."""

import base64
import json
import os
import pathlib
import re
import secrets
import shutil
import signal
import subprocess
import threading

from local_farm import ROOT, Process, wait_until
from slurm_cluster import free_ports


OVERLAYS = sorted(path.name for path in (ROOT / "deploy/kubernetes/overlays").iterdir())


class KubernetesApi:
    def __init__(self, folder, bin):
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.etcd_port, peer, self.port = free_ports(3)
        self.token = secrets.token_hex(16)
        (self.folder / "tokens.csv").write_text(f"{self.token},admin,1,system:masters\n")
        (self.folder / "tokens.csv").chmod(0o600)
        subprocess.run(["openssl", "genrsa", "-out", self.folder / "accounts.key", "2048"], check=True, capture_output=True)
        etcd = f"http://127.0.0.1:{self.etcd_port}"
        peers = f"http://127.0.0.1:{peer}"
        self.daemons = [Process("etcd", [shutil.which("etcd"), "--data-dir", self.folder / "etcd", "--listen-client-urls", etcd, "--advertise-client-urls", etcd,
                                         "--listen-peer-urls", peers, "--initial-advertise-peer-urls", peers, "--initial-cluster", f"default={peers}",
                                         "--unsafe-no-fsync"], self.folder / "etcd.log")]
        self.daemons.append(Process("kube-apiserver", [
            bin / "kube-apiserver", "--etcd-servers", etcd, "--secure-port", self.port, "--bind-address", "127.0.0.1", "--cert-dir", self.folder / "certificates",
            "--token-auth-file", self.folder / "tokens.csv", "--authorization-mode", "RBAC", "--service-cluster-ip-range", "10.0.0.0/24",
            "--service-account-issuer", "https://kubernetes.default.svc", "--service-account-key-file", self.folder / "accounts.key",
            "--service-account-signing-key-file", self.folder / "accounts.key", "--disable-admission-plugins", "ServiceAccount",
            "--endpoint-reconciler-type", "none", "--watch-cache=true"], self.folder / "kube-apiserver.log"))
        self.config = self.folder / "config"
        certificate = self.folder / "certificates/apiserver.crt"
        self.config.write_text(json.dumps({
            "apiVersion": "v1", "kind": "Config", "current-context": "test",
            "clusters": [{"name": "test", "cluster": {"server": f"https://127.0.0.1:{self.port}", "certificate-authority": str(certificate)}}],
            "users": [{"name": "admin", "user": {"token": self.token}}],
            "contexts": [{"name": "test", "context": {"cluster": "test", "user": "admin", "namespace": "lightshaft"}}]}))
        self.environment = dict(os.environ, KUBECONFIG=str(self.config), PATH=f"{bin}:{os.environ['PATH']}")
        wait_until(lambda: self.ready() or not all(d.alive() for d in self.daemons), "the API server is ready")
        assert all(d.alive() for d in self.daemons), self.logs()
        self.kubectl("create", "namespace", "lightshaft")

    def ready(self):
        asked = subprocess.run(["kubectl", "get", "--raw", "/readyz"], env=self.environment, capture_output=True, text=True)
        return asked.stdout == "ok"

    def logs(self):
        return "\n".join(d.output()[-3000:] for d in self.daemons)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        for daemon in reversed(self.daemons):
            daemon.terminate()

    def kubectl(self, *words, input=None, check=True):
        done = subprocess.run(["kubectl", *map(str, words)], env=self.environment, input=input, capture_output=True, text=True)
        assert not check or done.returncode == 0, f"kubectl {' '.join(map(str, words))}: {done.stderr}"
        return done.stdout if check else done

    def get(self, *words):
        return json.loads(self.kubectl("get", *words, "--output=json"))

    def pods(self):
        return self.get("pods")["items"]

    def patch_status(self, pod, status):
        self.kubectl("patch", "pod", pod, "--subresource=status", "--type=merge", "--patch", json.dumps({"status": status}), check=False)


class Node:
    """Does for the pods of workers what kubelet does, as far as a worker can tell: mounts their Secrets, starts them, says when they
    run and end, sends SIGTERM to one that is to go, SIGKILL after its grace period, and then removes it. Its containers are
    processes of this machine. There is no scheduler: it takes all pods."""

    def __init__(self, api, folder, program):
        self.api, self.folder, self.program = api, pathlib.Path(folder), program
        self.folder.mkdir(parents=True, exist_ok=True)
        self.running = {}
        self.signalled = {}  # of pods that are to go: the timer of their SIGKILL
        self.open = True
        self.thread = threading.Thread(target=self.work)
        self.thread.start()

    def close(self):
        self.open = False
        self.thread.join()
        for process in self.running.values():
            process.kill()
        for timer in self.signalled.values():
            timer.cancel()

    def work(self):
        while self.open:
            asked = self.api.kubectl("get", "pods", "--output=json", check=False)
            if asked.returncode != 0:
                continue
            pods = {pod["metadata"]["name"]: pod for pod in json.loads(asked.stdout)["items"]}
            for name, pod in pods.items():
                self.look_at(name, pod)
            for name in self.running.keys() - pods.keys():  # deleted by force
                self.running.pop(name).kill()

    def look_at(self, name, pod):
        going = pod["metadata"].get("deletionTimestamp")
        if name not in self.running:
            if going:
                self.remove(name)
            elif pod["status"]["phase"] == "Pending":
                self.start(name, pod)
            return
        process = self.running[name]
        if not process.alive():
            self.running.pop(name)
            if going:
                self.remove(name)
            else:
                self.api.patch_status(name, {"phase": "Succeeded" if process.popen.returncode == 0 else "Failed"})
        elif going and name not in self.signalled:
            process.signal(signal.SIGTERM)
            self.signalled[name] = threading.Timer(pod["metadata"]["deletionGracePeriodSeconds"], process.signal, [signal.SIGKILL])
            self.signalled[name].start()

    def start(self, name, pod):
        container, home = pod["spec"]["containers"][0], self.folder / name
        (home / "cache").mkdir(parents=True)
        places = {"/cache": home / "cache"}
        volumes = {v["name"]: v for v in pod["spec"].get("volumes", [])}
        for mount in container.get("volumeMounts", []):
            if "secret" in volumes[mount["name"]]:
                places[mount["mountPath"]] = self.mount(volumes[mount["name"]]["secret"]["secretName"], home / mount["name"])
        args = [re.sub("|".join(map(re.escape, places)), lambda found: str(places[found[0]]), word) for word in container["args"]]
        # The API server gives only pods of a node time to end.
        binding = {"apiVersion": "v1", "kind": "Binding", "metadata": {"name": name}, "target": {"apiVersion": "v1", "kind": "Node", "name": "here"}}
        self.api.kubectl("create", "--raw", f"/api/v1/namespaces/lightshaft/pods/{name}/binding", "--filename=-", input=json.dumps(binding))
        self.running[name] = Process(name, [self.program, *args], home / "log")
        started = pod["metadata"]["creationTimestamp"]
        self.api.patch_status(name, {"phase": "Running", "startTime": started})

    def mount(self, secret, folder):
        folder.mkdir()
        for key, value in self.api.get("secret", secret)["data"].items():
            (folder / key).touch(0o600)
            (folder / key).write_bytes(base64.b64decode(value))
        return folder

    def remove(self, name):
        if name in self.signalled:
            self.signalled.pop(name).cancel()
        self.api.kubectl("delete", "pod", name, "--grace-period=0", "--force", check=False)


def put_deployment(api, farm):
    """A Deployment of workers as deploy/kubernetes/base has it, as far as processes of this machine can be its pods; and its Secret."""
    labels = {"app.kubernetes.io/name": "lightshaft", "app.kubernetes.io/component": "worker"}
    args = [f"--coordinator=127.0.0.1:{farm.grpc}", "--token-file=/secrets/join-token", "--cache=/cache", "--threads=1"]
    pod = {"containers": [{"name": "worker", "image": "lightshaft-worker", "args": args, "resources": {"requests": {"cpu": "1"}},
                           "volumeMounts": [{"name": "secrets", "mountPath": "/secrets"}]}],
           "volumes": [{"name": "secrets", "secret": {"secretName": "lightshaft-join-token"}}]}
    deployment = {"apiVersion": "apps/v1", "kind": "Deployment", "metadata": {"name": "worker"},
                  "spec": {"replicas": 0, "selector": {"matchLabels": labels}, "template": {"metadata": {"labels": labels}, "spec": pod}}}
    secret = {"apiVersion": "v1", "kind": "Secret", "metadata": {"name": "lightshaft-join-token"}, "stringData": {"join-token": farm.join_token}}
    for thing in (secret, deployment):
        api.kubectl("apply", "--server-side", "--force-conflicts", "--filename=-", input=json.dumps(thing))


def render(folder):
    """The manifests that kustomize makes of a folder, as text."""
    return subprocess.run(["kubectl", "kustomize", ROOT / "deploy/kubernetes" / folder], check=True, capture_output=True, text=True).stdout
