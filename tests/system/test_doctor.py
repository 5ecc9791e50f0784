"""`lightshaft doctor` on this machine, with a real farm, a stopped one, a wrong token, and a clock that is off."""

import json
import os
import shutil
import socket
import sys

import pytest
from cli_kit import lightshaft
from local_farm import LocalFarm, bin_dir
from stub_coordinator import StubCoordinator

SECRET = "a-token-that-nobody-may-see"


def clean_environment(**more):
    return {**{k: v for k, v in os.environ.items() if not k.startswith("LIGHTSHAFT_") or k in ("LIGHTSHAFT_BIN", "LIGHTSHAFT_CLI")}, **more}


def doctor(*arguments, code, **variables):
    """{name of the check: [its findings]} of the run; it ends with `code` and never prints the token."""
    done = lightshaft("doctor", "--json", *arguments, code=code, env=clean_environment(**variables))
    assert variables.get("LIGHTSHAFT_TOKEN", SECRET) not in done.stdout + done.stderr
    answer = json.loads(done.stdout)
    assert set(answer) == {"status", "checks"}
    found = {}
    for check in answer["checks"]:
        assert set(check) == {"name", "subject", "status", "what", "advice"}
        assert check["status"] in ("ok", "warning", "problem") and check["what"]
        assert check["advice"] or check["status"] == "ok"
        found.setdefault(check["name"], []).append(check)
    assert (answer["status"] == "problem") == (code == 1)
    return found


def statuses(found, name):
    return [check["status"] for check in found[name]]


@pytest.fixture
def stub():
    with StubCoordinator() as stub:
        stub.answers[("GET", "/healthz")] = [(200, b"ok\n")]
        stub.answers[("GET", "/readyz")] = [(200, b"ready\n")]
        stub.answers[("GET", "/api/v1/session")] = [(200, {"role": "read", "user": "", "version": "0.0.1"})]
        stub.answers[("GET", "/api/v1/workers")] = [(200, {"workers": []})]
        yield stub


def test_this_machine_is_checked_without_a_farm(tmp_path):
    cache = tmp_path / "not" / "there"

    found = doctor("--cache", cache, code=0)

    assert {"processor", "memory", "cores", "open-files", "sandbox", "openvdb", "denoiser", "redis", "python", "cache", "farm"} == set(found)
    assert statuses(found, "openvdb") == ["ok"] and found["cache"][0]["subject"] == str(cache)
    assert list(tmp_path.iterdir()) == [], "looking changes nothing"


def test_a_folder_that_is_a_file_is_a_problem(tmp_path):
    (tmp_path / "file").write_text("")

    assert statuses(doctor("--data", tmp_path / "file", code=1), "data") == ["problem"]


def test_a_missing_helper_is_a_problem(tmp_path, monkeypatch):
    shutil.copy2(bin_dir() / "lightshaft", tmp_path)
    monkeypatch.setenv("LIGHTSHAFT_CLI", str(tmp_path / "lightshaft"))

    found = doctor(code=1)

    assert statuses(found, "openvdb") == ["problem"] and "lightshaft-vdb" in found["openvdb"][0]["advice"]


def test_a_farm_that_renders_is_found_good_and_a_stopped_one_is_not(tmp_path):
    with LocalFarm(tmp_path / "farm") as farm:
        farm.add_worker(fake=False)
        farm.wait_for_workers(1)
        url = f"http://127.0.0.1:{farm.http}"

        good = doctor("--farm", url, code=0, LIGHTSHAFT_TOKEN=farm.token)
        wrong = doctor("--to", url, code=1, LIGHTSHAFT_TOKEN=SECRET)
        joining = doctor("--to", url, code=1, LIGHTSHAFT_TOKEN=(farm.data / "join-token").read_text().strip())
        none = doctor(code=1, LIGHTSHAFT_URL=url)
        people = lightshaft("doctor", "--farm", url, env=clean_environment(LIGHTSHAFT_TOKEN=farm.token)).stdout

    assert [statuses(good, name) for name in ("farm", "tls", "clock", "token", "version", "workers-port", "workers", "numeric-class")] == [["ok"]] * 8
    assert "admin" in good["token"][0]["what"] and good["farm"][0]["subject"] == url
    assert statuses(wrong, "farm") == ["ok"] and statuses(wrong, "token") == ["problem"]
    assert "does not know" in wrong["token"][0]["what"]
    assert statuses(joining, "token") == ["problem"] and "submit" in joining["token"][0]["advice"]
    assert statuses(none, "token") == ["problem"] and "--token-file" in none["token"][0]["advice"]
    assert "problems: 0" in people and farm.token not in people
    stopped = doctor("--farm", url, code=1, LIGHTSHAFT_TOKEN=farm.token)
    assert statuses(stopped, "farm") == ["problem"] and "clock" not in stopped and "firewall" in stopped["farm"][0]["advice"]


def test_tls_is_checked_with_the_farms_own_authority(tmp_path):
    with LocalFarm(tmp_path / "farm", tls=True) as farm:
        url, authority = f"https://127.0.0.1:{farm.http}", farm.data / "tls" / "ca.pem"

        trusted = doctor("--farm", url, "--ca", authority, code=0, LIGHTSHAFT_TOKEN=farm.token)
        strange = doctor("--farm", url, code=1, LIGHTSHAFT_TOKEN=farm.token)

    assert statuses(trusted, "tls") == ["ok"] and "encrypted" in trusted["tls"][0]["what"]
    assert statuses(trusted, "workers") == ["warning"], "none is there"
    assert statuses(strange, "farm") == ["problem"] and "--ca" in strange["farm"][0]["advice"]


# The tolerance is a minute, and 15 minutes are a problem. The stub's answer comes in less than the five minutes by which each
# case keeps away from these limits.
@pytest.mark.parametrize("lead, code, status, word", [
    (0, 0, "ok", "agrees"), (480, 0, "warning", "ahead of"), (-480, 0, "warning", "behind"), (3600, 1, "problem", "ahead of"), (-3600, 1, "problem", "behind")])
def test_a_clock_that_is_off_is_found(stub, lead, code, status, word):
    stub.clock_lead = lead

    found = doctor("--farm", stub.url, code=code, LIGHTSHAFT_TOKEN=SECRET)

    assert statuses(found, "clock") == [status] and word in found["clock"][0]["what"]


def test_versions_and_states_of_workers_are_warned_of(stub):
    worker = {"name": "old", "state": "connected", "activity": "", "build": "0.0.0", "numeric_class": "ab", "fake": False}
    stub.answers[("GET", "/api/v1/workers")] = [(200, {"workers": [worker, {**worker, "name": "ill\x1b[2J", "state": "sick"}, 7, {}]})]

    found = doctor("--farm", stub.url, code=0, LIGHTSHAFT_TOKEN=SECRET)

    assert statuses(found, "version") == ["warning"] and "0.0.1" in found["version"][0]["what"]
    assert "old" in found["worker-versions"][0]["what"]
    assert any("ill" in check["what"] for check in found["workers"])
    assert "\x1b" not in lightshaft("doctor", "--farm", stub.url, env=clean_environment(LIGHTSHAFT_TOKEN=SECRET)).stdout


@pytest.mark.parametrize("named", ["0.0.0.0:{}", "[::]:{}", "localhost:{}", "127.0.0.1:{}"])
def test_the_workers_port_is_tried_where_the_coordinator_names_it(stub, named):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        stub.answers[("GET", "/api/v1/workers")] = [(200, {"workers": [], "join": {"address": named.format(port), "tls": False}})]
        (open_port,) = doctor("--farm", stub.url, code=0, LIGHTSHAFT_TOKEN=SECRET)["workers-port"]
    (closed,) = doctor("--farm", stub.url, code=0, LIGHTSHAFT_TOKEN=SECRET)["workers-port"]

    assert open_port["status"] == "ok" and f":{port} can be reached" in open_port["what"]
    assert closed["status"] == "warning" and "Connection refused" in closed["what"] and f"let port {port} pass" in closed["advice"]


@pytest.mark.parametrize("named", ["", "nowhere", "host:99999", "\x1b[2J:1"])
def test_an_address_that_is_none_is_not_tried(stub, named):
    stub.answers[("GET", "/api/v1/workers")] = [(200, {"workers": [], "join": {"address": named}})]

    assert "workers-port" not in doctor("--farm", stub.url, code=0, LIGHTSHAFT_TOKEN=SECRET)


def test_the_port_for_joining_is_tried():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = f"127.0.0.1:{listener.getsockname()[1]}"
        (open_port,) = doctor("--join", address, code=0)["joining-port"]
    (closed,) = doctor("--join", address, code=1)["joining-port"]
    wrong = lightshaft("doctor", "--join", "127.0.0.1", code=2, env=clean_environment())

    assert open_port["status"] == "ok" and open_port["subject"] == address
    assert closed["status"] == "problem" and "Connection refused" in closed["what"] and "lightshaft up --lan" in closed["advice"]
    assert "--join '127.0.0.1' is no HOST:PORT" in wrong.stderr


def test_a_python_without_numpy_is_warned_of_where_up_needs_it(tmp_path):
    python = tmp_path / "python3"
    python.write_text('#!/bin/sh\nexec "%s" -S "$@"\n' % sys.executable)  # -S: without the folders of packages
    python.chmod(0o755)

    (without,) = doctor(code=0, PATH=f"{tmp_path}:{os.environ['PATH']}")["python"]

    assert without["status"] == "warning" and "has no NumPy" in without["what"] and "first picture" in without["advice"]


def test_only_questions_are_asked_and_no_password_is_shown(stub):
    address = stub.url.replace("http://", "http://me:hush-hush@")

    shown = lightshaft("doctor", "--farm", address + "," + address.replace("http", "ftp"), code=2, env=clean_environment())
    found = doctor("--farm", address + ",http://me:hush-hush@127.0.0.1:1", code=1, LIGHTSHAFT_TOKEN=SECRET)

    assert "hush" not in shown.stdout + shown.stderr + json.dumps(found)
    assert [check["status"] for check in found["farm"]] == ["ok", "problem"], "each address is checked"
    assert {method for method, _ in stub.requests} == {"GET"}


def test_a_proxy_that_the_environment_names_is_said(stub):
    behind = {"http_proxy": "http://me:hush-hush@127.0.0.1:9", "LIGHTSHAFT_TOKEN": SECRET}

    (farm,) = doctor("--farm", stub.url, code=1, **behind)["farm"]
    jobs = lightshaft("jobs", "--to", stub.url, code=1, env=clean_environment(**behind)).stderr
    direct = doctor("--farm", stub.url, code=0, no_proxy="127.0.0.1", **behind)["farm"]
    itself = doctor("--farm", "http://farm.example:80", code=1, http_proxy=stub.url, LIGHTSHAFT_TOKEN=SECRET)["farm"]

    for said in (farm["what"], jobs):
        assert "cannot be reached through the proxy http://127.0.0.1:9 of the variable http_proxy" in said and "no_proxy" in said
        assert "hush" not in said
    assert [check["status"] for check in direct] == ["ok"] and "proxy" not in direct[0]["what"]
    assert any(f"through the proxy {stub.url} of the variable http_proxy" in check["what"] for check in itself)


def test_what_is_no_coordinator_is_said(stub):
    stub.answers[("GET", "/healthz")] = [(200, b"<html>")]

    assert "something other than a coordinator" in doctor("--farm", stub.url, code=1, LIGHTSHAFT_TOKEN=SECRET)["farm"][0]["what"]


def test_a_farm_that_is_not_ready_is_a_problem(stub):
    stub.answers[("GET", "/readyz")] = [(503, {"detail": "not ready: the disk is full"})]

    assert "disk is full" in doctor("--farm", stub.url, code=1, LIGHTSHAFT_TOKEN=SECRET)["farm"][0]["what"]
