"""`lightshaft up` and `lightshaft join`: a farm that one command starts, and that ends with it."""

import base64
import contextlib
import hashlib
import http.client
import http.server
import json
import os
import pathlib
import re
import select
import signal
import socket
import ssl
import subprocess
import sys
import threading
import urllib.parse
import urllib.request

import pytest
from local_farm import PATIENCE, ROOT, bin_dir, wait_until

sys.path.insert(0, str(ROOT / "python" / "src"))
from lightshaft_command import enrolment, programs  # noqa: E402

BLURS = bin_dir().parent / "fake_oidn" / "blurs.so"  # in place of Open Image Denoise

SCENE = """<scene version="3.0.0">
  <integrator type="volpath"/>
  <shape type="sphere"><bsdf type="diffuse"/></shape>
  <emitter type="point"><point name="position" x="2" y="2" z="-2"/><rgb name="intensity" value="30"/></emitter>
  <sensor type="perspective"><transform name="to_world"><lookat origin="0, 1, -7" target="0, 0, 0" up="0, 1, 0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="2"/></sampler>
    <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/></film></sensor>
</scene>"""


def processes_that_name(folder):
    """The ids of all processes whose arguments name the folder."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and str(folder).encode() in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
        except OSError:
            pass  # it has ended meanwhile
    return found


class Command:
    """A `lightshaft up` or `join` at work."""

    def __init__(self, program, *words, output, environment=None, folder=None):
        self.output = output
        with output.open("wb") as out:
            self.process = subprocess.Popen([program, *map(str, words)], stdin=subprocess.DEVNULL, stdout=out, stderr=out, cwd=folder,
                                            env={**os.environ, **(environment or {})}, start_new_session=True)  # fmt: skip

    def text(self):
        return self.output.read_text(errors="replace")

    def said(self, pattern):
        """What it prints that matches, once it does."""

        def look():
            found = re.search(pattern, self.text())
            assert found or self.process.poll() is None, f"it ended without {pattern!r}:\n{self.text()}"
            return found

        return wait_until(look, f"{pattern!r} is printed")

    def interrupt(self):
        self.process.send_signal(signal.SIGINT)

    def ends(self, code=0):
        assert self.process.wait(timeout=PATIENCE) == code, self.text()


OF_LIGHTSHAFT = object()  # the scene that a start without --first-scene renders


class Up(Command):
    def __init__(self, folder, *words, program=None, scene=None, browser=None, environment=None):
        self.data = folder / "state"
        if scene is None:
            scene = folder / "scene.xml"
            scene.write_text(SCENE)
        super().__init__(program or bin_dir() / "lightshaft", "up", "--data", self.data, "--threads", 1,
                         *([] if scene is OF_LIGHTSHAFT else ["--first-scene", scene]), *words,
                         *([] if browser else ["--no-browser"]), output=folder / "up.txt", folder=folder,
                         environment={**({"BROWSER": f"{browser} %s", "DISPLAY": ":0"} if browser else {}), **(environment or {})})  # fmt: skip
        self.url, self.token = self.said(r"dashboard: *(\S+)/#token=(\w+)").groups()

    def ask(self, path, change=None):
        request = urllib.request.Request(self.url + path, headers={"Authorization": f"Bearer {self.token}"})
        if change:
            request.method, request.data = "PATCH", json.dumps(change).encode()
            request.add_header("Content-Type", "application/json")
        authority = self.data / "coordinator" / "tls" / "ca.pem"
        trust = ssl.create_default_context(cafile=authority) if self.url.startswith("https") else None
        with urllib.request.urlopen(request, context=trust, timeout=PATIENCE) as answer:
            return json.loads(answer.read() or "null")

    def connected(self):
        try:
            return [worker for worker in self.ask("/api/v1/workers")["workers"] if worker["state"] == "connected"]
        except OSError:
            return []  # the coordinator is being started again

    def jobs(self):
        return self.ask("/api/v1/jobs")["jobs"]

    def child(self, program):
        """The id of the process that it runs now."""
        for pid in processes_that_name(self.data):
            try:
                if pathlib.Path(f"/proc/{pid}/exe").readlink().name == program:
                    return pid
            except OSError:
                pass
        return None

    def code(self):
        return self.said(r"--code (\S+)")[1]


@pytest.fixture
def leaves_nothing(tmp_path):
    """Ends what a failed test leaves behind."""
    yield
    for pid in processes_that_name(tmp_path):
        if pid != os.getpid():
            os.kill(pid, signal.SIGKILL)


def join(folder, code, host="127.0.0.1", program=None):
    return Command(program or bin_dir() / "lightshaft", "join", host, "--data", folder / "other", "--threads", 1, "--code", code, output=folder / "join.txt")


def check_a_farm_of_two_machines(folder, program=None, scene=None):
    """From the first start to the first picture, a second machine, the end, and a second start."""
    up = Up(folder, "--lan", program=program, scene=scene)
    up.said("first picture, .* after the start")
    other = join(folder, up.code(), program=program)
    wait_until(lambda: len(up.connected()) == 2, "a second worker has joined")
    assert (up.data / "first" / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert [job["state"] for job in up.jobs()] == ["done"]
    assert up.code().encode() not in pathlib.Path(f"/proc/{other.process.pid}/cmdline").read_bytes()

    other.interrupt()
    other.ends()
    wait_until(lambda: len(up.connected()) == 1, "the second worker has left")
    up.interrupt()
    up.ends()
    assert processes_that_name(folder) == []

    again = Up(folder, "--lan", program=program, scene=scene)
    assert (again.token, again.code()) == (up.token, up.code())
    wait_until(again.connected, "the worker is there")
    assert [job["state"] for job in again.jobs()] == ["done"], "the state stayed, and no second picture is rendered"
    again.interrupt()
    again.ends()
    assert processes_that_name(folder) == []


def test_a_farm_of_two_machines(tmp_path, leaves_nothing):
    check_a_farm_of_two_machines(tmp_path)


def test_a_first_scene_with_warnings_is_rendered(tmp_path, leaves_nothing):
    scene = tmp_path / "warned.xml"
    scene.write_text(SCENE.replace("volpath", "bdpt"))

    up = Up(tmp_path, scene=scene)

    assert not up.said("(?m)^(the )?first picture")[1], up.text()
    assert len(up.jobs()) == 1
    up.interrupt()
    up.ends()


def test_a_first_scene_that_is_refused_is_shown_with_the_reason(tmp_path, leaves_nothing):
    scene = tmp_path / "broken.xml"
    scene.write_text("<scene")

    up = Up(tmp_path, scene=scene)

    up.said(r"(?m)^the first picture failed: .*\n.*broken\.xml")
    up.interrupt()
    up.ends()


def test_a_python_without_numpy_is_told_as_the_reason_why_there_is_no_first_picture(tmp_path, leaves_nothing):
    subprocess.run(["/usr/bin/python3", "-m", "venv", "--without-pip", tmp_path / "bare"], check=True)
    python = tmp_path / "bare" / "bin" / "python3"

    up = Up(tmp_path, scene=OF_LIGHTSHAFT, environment={"LIGHTSHAFT_PYTHON": str(python)})

    up.said(rf"(?m)^the first picture failed: .*\n.*NumPy, which {python} does not have: install python3-numpy")
    up.interrupt()
    up.ends()


@pytest.mark.parametrize("library", [BLURS, "/no/such/library"])
def test_the_first_picture_is_denoised_where_that_can_be_and_else_it_is_said_what_is_missing(tmp_path, leaves_nothing, library):
    up = Up(tmp_path, environment={"LIGHTSHAFT_OIDN": str(library)})
    up.said("first picture, .* after the start")

    (job,) = up.jobs()

    assert job["denoise"] == (library == BLURS)
    assert ("Open Image Denoise is missing, so noise will be visible in the first picture; to install it: deploy/install-denoiser.sh" in up.text()) != job["denoise"]
    layer = "&layer=denoised" if job["denoise"] else ""
    request = urllib.request.Request(f"{up.url}/api/v1/jobs/{job['id']}/image.png?exposure=0{layer}", headers={"Authorization": f"Bearer {up.token}"})
    with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
        assert (up.data / "first" / "picture.png").read_bytes() == answer.read()
    up.interrupt()
    up.ends()


def test_the_denoiser_of_its_own_wheel_is_found_unless_another_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("LIGHTSHAFT_OIDN", "/another")
    programs.find_denoiser()
    assert os.environ["LIGHTSHAFT_OIDN"] == "/another"
    monkeypatch.delenv("LIGHTSHAFT_OIDN")
    programs.find_denoiser()
    assert "LIGHTSHAFT_OIDN" not in os.environ, "this Python has no pyoidn"

    library = tmp_path / "pyoidn" / "lib.linux" / "libOpenImageDenoise.so.2.3.4"
    library.parent.mkdir(parents=True)
    library.touch()
    (tmp_path / "pyoidn" / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("LIGHTSHAFT_OIDN", "")  # so that it is restored
    monkeypatch.delenv("LIGHTSHAFT_OIDN")
    programs.find_denoiser()
    assert os.environ["LIGHTSHAFT_OIDN"] == str(library)


def test_killed_programs_are_started_again_where_they_were(tmp_path, leaves_nothing):
    up = Up(tmp_path)
    wait_until(up.connected, "the worker has joined")

    for program in ("worker", "coordinator"):
        old = up.child(f"lightshaft-{program}")
        os.kill(old, signal.SIGKILL)
        up.said(f"the {program} ended by signal 9 .SIGKILL. and is restarted")
        wait_until(lambda: up.child(f"lightshaft-{program}") not in (None, old), f"there is a new {program}")
        wait_until(up.connected, f"a worker is connected, at the same address, after the {program} was killed")

    up.interrupt()
    up.ends()
    assert processes_that_name(tmp_path) == []


def test_drained_workers_stay_away(tmp_path, leaves_nothing):
    up = Up(tmp_path, "--lan")
    own = wait_until(up.connected, "the worker has joined")[0]
    other = join(tmp_path, up.code())
    wait_until(lambda: len(up.connected()) == 2, "a second worker has joined")

    for worker in up.connected():
        up.ask(f"/api/v1/workers/{worker['id']}", {"state": "draining"})

    up.said("the worker was drained and has ended")
    other.said("the worker was drained by the farm")
    other.ends()
    up.interrupt()
    up.ends()
    assert "is restarted" not in up.text() + other.text()

    again = Up(tmp_path, "--lan")
    assert wait_until(again.connected, "a new start has a worker")[0]["id"] != own["id"]
    again.interrupt()
    again.ends()


def test_nothing_is_left_when_it_is_killed_itself(tmp_path, leaves_nothing):
    up = Up(tmp_path)
    wait_until(up.connected, "the worker has joined")

    up.process.kill()

    wait_until(lambda: processes_that_name(tmp_path) == [], "all its processes have ended")


def test_what_cannot_be_written_on_a_full_disk_does_not_keep_it_from_starting(tmp_path, leaves_nothing):
    home = tmp_path / "state" / "coordinator"
    home.mkdir(parents=True)
    (tmp_path / "state" / "in-use").symlink_to("/dev/full")
    (home / "ports.json.new").mkdir()  # so that the coordinator cannot write ports.json
    (tmp_path / "state" / "first").mkdir()
    (tmp_path / "state" / "first" / "doctor.json").mkdir()

    up = Up(tmp_path)

    up.said("the first picture failed: .*doctor.json")
    wait_until(up.connected, "the worker has joined")
    assert not (home / "ports.json").exists()
    up.interrupt()
    up.ends()


def test_nohup_keeps_it_when_the_terminal_closes(tmp_path, leaves_nothing):
    kept = tmp_path / "kept"
    kept.write_text(f'#!/bin/sh\nexec nohup {bin_dir() / "lightshaft"} "$@"\n')
    kept.chmod(0o755)
    up = Up(tmp_path, program=kept)
    wait_until(up.connected, "the worker has joined")

    up.process.send_signal(signal.SIGHUP)
    os.kill(up.child("lightshaft-worker"), signal.SIGKILL)

    up.said("the worker ended by signal 9 .SIGKILL. and is restarted")
    up.interrupt()
    up.ends()


def test_a_second_interrupt_ends_what_does_not_end(tmp_path, leaves_nothing):
    up = Up(tmp_path)
    wait_until(up.connected, "the worker has joined")
    os.kill(up.child("lightshaft-worker"), signal.SIGSTOP)

    up.interrupt()
    up.said("stopping")
    up.interrupt()

    up.ends()
    assert processes_that_name(tmp_path) == []


def opened(folder):
    """A farm whose browser is a script, and the address that this was started with."""
    browser, seen = folder / "browser", folder / "seen"
    browser.write_text(f'#!/bin/sh\necho "$1" > {seen}.unfinished; mv {seen}.unfinished {seen}\n')
    browser.chmod(0o755)
    up = Up(folder, browser=browser)
    return up, urllib.parse.urlsplit(wait_until(lambda: seen.exists() and seen.read_text().strip(), "the browser is started"))


def test_a_browser_is_led_to_the_dashboard_once_and_its_arguments_hold_no_token(tmp_path, leaves_nothing):
    up, address = opened(tmp_path)

    answers = []
    for _ in range(2):
        connection = http.client.HTTPConnection(address.hostname, address.port, timeout=PATIENCE)
        try:
            connection.request("GET", address.path)
            answer = connection.getresponse()
            answers.append((answer.status, answer.getheader("Location")))
        except OSError:
            answers.append("closed")

    assert up.token not in address.geturl()
    assert answers[0] == (302, f"{up.url}/#token={up.token}") and answers[1] in ((404, None), "closed")
    up.interrupt()
    up.ends()


def test_no_proxy_sees_the_farms_token(tmp_path, leaves_nothing):
    with socket.create_server(("127.0.0.1", 0)) as proxy:
        address = f"http://127.0.0.1:{proxy.getsockname()[1]}"
        up = Up(tmp_path, environment={"http_proxy": address, "no_proxy": "farm.example", "NO_PROXY": ""})

        said = up.said("(?m)^(the )?first picture")

        assert not said[1], up.text()
        assert "no_proxy=farm.example,127.0.0.1" in up.said("export .*")[0]
        proxy.setblocking(False)
        with pytest.raises(BlockingIOError):
            proxy.accept()
    up.interrupt()
    up.ends()


def test_no_python_file_of_the_current_folder_is_run(tmp_path, leaves_nothing):
    for name in ("webbrowser", "subprocess", "argparse", "http"):
        (tmp_path / f"{name}.py").write_text(f"import pathlib\npathlib.Path({str(tmp_path / 'run')!r}).touch()\nraise SystemExit(1)\n")
    (tmp_path / "browser").write_text(f'#!/bin/sh\n: > {tmp_path / "started"}\n')
    (tmp_path / "browser").chmod(0o755)

    up = Up(tmp_path, browser=tmp_path / "browser")

    wait_until(lambda: (tmp_path / "started").exists() or (tmp_path / "run").exists(), "something is started")
    assert not (tmp_path / "run").exists()
    up.interrupt()
    up.ends()


@pytest.mark.skipif(os.getuid() != 0, reason="only root can ask as another user")
def test_only_the_user_whose_browser_it_is_is_led_to_the_dashboard(tmp_path, leaves_nothing):
    up, address = opened(tmp_path)
    ask = f"import http.client as c; a = c.HTTPConnection('{address.hostname}', {address.port}); a.request('GET', '{address.path}'); print(a.getresponse().headers)"

    other = subprocess.run(["/usr/bin/python3", "-c", ask], user=65534, group=65534, extra_groups=[], capture_output=True, text=True, timeout=PATIENCE)
    with socket.create_connection((address.hostname, address.port), timeout=PATIENCE):  # and one that says nothing
        own = subprocess.run(["/usr/bin/python3", "-c", ask], capture_output=True, text=True, timeout=PATIENCE)

    assert up.token not in other.stdout and ("RemoteDisconnected" in other.stderr or "ConnectionReset" in other.stderr)
    assert up.token in own.stdout
    up.interrupt()
    up.ends()


def failure(*words, code=1):
    done = subprocess.run([bin_dir() / "lightshaft", *map(str, words)], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == code and "Traceback" not in done.stderr, done.stdout + done.stderr
    return done.stderr


@pytest.mark.parametrize("words, complaint", [
    (("--port", 99999), "99999"), (("--threads", -3), "threads"), (("--threads", 0), "threads"), (("--name", "farm.example"), "--lan")])  # fmt: skip
def test_options_that_cannot_be_are_refused(tmp_path, words, complaint):
    assert complaint in failure("up", "--data", tmp_path / "state", "--no-browser", *words, code=2)
    assert not (tmp_path / "state").exists()


def test_a_name_that_no_host_can_have_is_refused_as_such(tmp_path):
    code = str(enrolment.Code(1, bytes(32), "00" * 32))

    said = failure("join", "a" * 64 + ".example", "--data", tmp_path / "other", "--code", code)

    assert "no farm answers at" in said


def test_a_folder_in_use_is_refused_with_who_has_it(tmp_path, leaves_nothing):
    up = Up(tmp_path)

    said = failure("up", "--data", up.data, "--no-browser")

    assert f"{up.data} is in use (process {up.process.pid}, {up.url}/)" in said and "--data" in said
    up.interrupt()
    up.ends()


def test_a_port_that_was_asked_for_and_is_taken_is_named(tmp_path, leaves_nothing):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]

        said = failure("up", "--data", tmp_path / "state", "--no-browser", "--port", port)

    assert f"port {port} cannot be used" in said and "--port" in said
    assert processes_that_name(tmp_path) == []


def test_a_coordinator_that_cannot_start_is_shown_with_its_words(tmp_path, leaves_nothing):
    (tmp_path / "state").mkdir()
    (tmp_path / "state" / "coordinator").write_text("no folder")

    said = failure("up", "--data", tmp_path / "state", "--no-browser")

    assert "the coordinator did not start" in said and str(tmp_path / "state" / "coordinator") in said
    assert processes_that_name(tmp_path) == []


def changed(code, byte):
    raw = bytearray(base64.urlsafe_b64decode(code + "=" * (-len(code) % 4)))
    raw[byte] ^= 1
    return base64.urlsafe_b64encode(bytes(raw)).decode().rstrip("=")


def test_a_wrong_code_is_refused_before_the_token_is_shown(tmp_path, leaves_nothing):
    up = Up(tmp_path, "--lan")
    wait_until(up.connected, "the worker has joined")
    code = up.code()

    said = {name: failure("join", "127.0.0.1", "--data", tmp_path / "other", "--code", wrong)
            for name, wrong in (("cut", code[:-4]), ("other farm", changed(code, 2)), ("other token", changed(code, -1)))}  # fmt: skip

    assert "copy the whole line" in said["cut"]
    assert "is not the one that printed this code" in said["other farm"]
    assert "does not accept this code" in said["other token"]
    assert len(up.connected()) == 1
    up.interrupt()
    up.ends()
    assert "no farm answers at 127.0.0.1" in failure("join", "127.0.0.1", "--data", tmp_path / "other", "--code", code)


def openssl(*words):
    subprocess.run(["openssl", *map(str, words)], check=True, capture_output=True)


def authority(folder, padded):
    """A certificate that signs others, whose base64 ends with padding if asked: then lenient readers stop at its end."""
    for k in range(200):  # signatures, and so certificates, are of several lengths
        openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-subj", "/CN=" + k % 3 * "a" + "b", "-days", 2,
                "-keyout", folder / "ca.key", "-out", folder / "ca.pem")  # fmt: skip
        if ("=" in (folder / "ca.pem").read_text()) == padded:
            return (folder / "ca.pem").read_text()
    raise AssertionError("no certificate has such a length")


class ManInTheMiddle(http.server.ThreadingHTTPServer):
    """Answers as a farm, with a certificate of its own authority, and shows that one behind the farm's."""

    def __init__(self, folder, farms):
        own = authority(folder, padded=False)
        openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-subj", "/CN=x", "-keyout", folder / "key.pem", "-out", folder / "asked.pem")
        (folder / "names").write_text("subjectAltName=IP:127.0.0.1")
        openssl("x509", "-req", "-in", folder / "asked.pem", "-CA", folder / "ca.pem", "-CAkey", folder / "ca.key", "-set_serial", 7, "-days", 2,
                "-extfile", folder / "names", "-out", folder / "cert.pem")  # fmt: skip
        self.tokens = tokens = []

        class Answer(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                tokens.extend(self.headers.get_all("Authorization", []))
                body = (farms + own).encode() if self.path == "/authority" else b'{"port": 1, "certificate": "", "key": ""}'
                self.send_response(200)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *words):
                pass

        super().__init__(("127.0.0.1", 0), Answer)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(folder / "cert.pem", folder / "key.pem")
        self.socket = context.wrap_socket(self.socket, server_side=True)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def handle_error(self, *words):
        pass  # a client that does not trust it goes away


def test_who_shows_the_farms_authority_and_its_own_behind_it_gets_no_token(tmp_path):
    (tmp_path / "middle").mkdir()
    farms = authority(tmp_path, padded=True)
    with ManInTheMiddle(tmp_path / "middle", farms) as middle:
        digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(farms)).digest()
        code = base64.urlsafe_b64encode(middle.server_port.to_bytes(2, "big") + digest + bytes(32)).decode().rstrip("=")

        said = failure("join", "127.0.0.1", "--data", tmp_path / "other", "--code", code)

        middle.shutdown()
    assert middle.tokens == []
    assert "certificate does not fit" in said


def closed(call):
    """Whether the other side has ended the call, which sends it one more byte."""
    try:
        call.send(b"x")
        return call.recv(1) == b""
    except ssl.SSLWantReadError:
        return False
    except OSError:
        return True


def test_strangers_who_hold_the_joining_port_do_not_keep_a_machine_away_for_ever(tmp_path, leaves_nothing):
    up = Up(tmp_path, "--lan")
    wait_until(up.connected, "the worker has joined")
    raw = base64.urlsafe_b64decode(up.code() + "==")
    trusting = ssl.create_default_context()
    trusting.check_hostname, trusting.verify_mode = False, ssl.CERT_NONE
    with contextlib.ExitStack() as open_calls:

        def call():
            stranger = socket.create_connection(("127.0.0.1", int.from_bytes(raw[:2], "big")), timeout=PATIENCE)
            return open_calls.enter_context(trusting.wrap_socket(stranger))

        calls = [call() for _ in range(enrolment.MOST_CALLS)]

        with pytest.raises(OSError):  # sent away
            call()
        for stranger in calls:
            stranger.settimeout(0)
        drips = 0
        while not any(map(closed, calls)):
            # Each goes on and on with a byte, sooner than an answer's patience ends.
            select.select(calls, [], [], enrolment.PATIENCE / 4)
            drips += 1
            assert drips < 30, "a call may go on as long as it sends something"
        wait_until(lambda: join_once(tmp_path, up.code()), "a machine can join again")
    up.interrupt()
    up.ends()


def join_once(folder, code):
    """Whether a machine could join just now; it leaves again."""
    other = join(folder, code)
    wait_until(lambda: other.process.poll() is not None or "this machine renders for" in other.text(), "it joins or gives up")
    if other.process.poll() is not None:
        return False
    other.interrupt()
    other.ends()
    return True


def test_the_doctor_says_where_python_is_missing(tmp_path):
    done = subprocess.run([bin_dir() / "lightshaft", "doctor", "--json"], env={**os.environ, "PATH": str(tmp_path)}, capture_output=True, text=True)
    checks = {check["name"]: check for check in json.loads(done.stdout)["checks"]}
    assert checks["python"]["status"] == "warning" and "Python 3.11" in checks["python"]["advice"]

    refused = subprocess.run([bin_dir() / "lightshaft", "up"], env={**os.environ, "PATH": str(tmp_path)}, capture_output=True, text=True)
    assert refused.returncode == 1 and "Python 3.11" in refused.stderr


def test_the_advice_names_the_denoiser_that_the_package_asks_for():
    pinned = re.search(r'denoise = \["(pyoidn==[^"]+)"\]', (ROOT / "python/pyproject.toml").read_text())[1]
    assert pinned in (ROOT / "python/src/lightshaft_command/first_picture.py").read_text()
