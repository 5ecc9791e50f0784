"""deploy/docker-compose.yml as far as it can be read without Docker; tests/compose/run.sh really runs it."""

import re

import pytest
from local_farm import ROOT

yaml = pytest.importorskip("yaml")

COMPOSE = yaml.safe_load((ROOT / "deploy" / "docker-compose.yml").read_text())
SERVICES = COMPOSE["services"]


@pytest.mark.parametrize("name", SERVICES)
def test_every_service_is_confined(name):
    service = SERVICES[name]

    assert service["read_only"] and service["user"] == "10001:10001" and service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert service["restart"] == ("no" if name == "secrets" else "unless-stopped")
    assert not service.get("privileged")


def test_only_localhost_sees_a_port_and_workers_reach_the_coordinator_alone():
    published = [port for service in SERVICES.values() for port in service.get("ports", [])]

    assert len(published) == 1 and published[0].startswith("127.0.0.1:")
    assert SERVICES["worker"]["networks"] == ["farm"] and COMPOSE["networks"]["farm"]["internal"]
    assert "farm" not in SERVICES["redis"]["networks"] and COMPOSE["networks"]["store"]["internal"]


def test_secrets_are_written_by_one_service_and_the_authority_is_seen_by_no_other():
    def mounts(name):
        return {v.split(":")[0]: v for v in SERVICES[name]["volumes"]}

    for name in ("redis", "coordinator", "worker"):
        secret = [v for volume, v in mounts(name).items() if volume.endswith("secrets")]
        assert len(secret) == 1 and secret[0].endswith(":ro"), name
        assert "authority" not in mounts(name)


def test_every_volume_network_and_target_is_there():
    targets = set(re.findall(r"^FROM base AS (\w+)$", (ROOT / "deploy" / "Dockerfile").read_text(), re.M))
    for service in SERVICES.values():
        assert {v.split(":")[0] for v in service["volumes"]} <= set(COMPOSE["volumes"])
        assert set(service.get("networks", [])) <= set(COMPOSE["networks"])
        assert service.get("build", {}).get("target", "redis") in targets


def test_a_hungry_worker_ends_neither_redis_nor_the_coordinator():
    worker = SERVICES["worker"]
    variable = re.fullmatch(r"\$\{(\w+):-(\d+)g\}", worker["mem_limit"])

    assert variable and int(variable[2]) >= 2 and variable[1] in (ROOT / "docs" / "guide" / "operations.md").read_text()
    assert worker["memswap_limit"] == worker["mem_limit"], "no swap besides"
    assert worker["oom_score_adj"] > max(SERVICES[name].get("oom_score_adj", 0) for name in ("redis", "coordinator"))
    # Docker's client of docker-compose 1.29 takes an int only, and a variable's value is text.
    assert isinstance(worker["pids_limit"], int) and worker["pids_limit"] > 256, "as many threads as a worker may have, and more"


def test_the_engine_gets_every_folder_that_the_build_needs():
    lists = (ROOT / "CMakeLists.txt").read_text().partition("if(LIGHTSHAFT_TESTS)")[0]
    needed = {folder.partition("/")[0] for folder in re.findall(r"^add_subdirectory\((\S+)\)", lists, re.M)}
    given = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    assert {"core", "worker", "coordinator"} <= needed
    assert needed <= given, f".dockerignore keeps {needed - given} from the engine"
