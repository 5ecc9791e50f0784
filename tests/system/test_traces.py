"""Traces: what coordinator and workers tell a collector of a job's life, and that no collector disturbs a farm."""

import collections
import json
import os
import socket
import time
import urllib.request

import pytest
from local_farm import PATIENCE, SCENE, LocalFarm, refused_coordinator, wait_until
from trace_collector import TraceCollector

SPEC = dict(spp=24, seed=5)
PARENT = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"
BELOW_A_LEASE = {"load scene", "render unit", "encode partial", "send partial", "check partial", "store partial"}


def traced_farm(folder, collector, **options):
    return LocalFarm(folder, environment=collector.environment, **options)


def add_workers(farm, collector, count, *flags):
    return [farm.add_worker(*flags, environment=collector.environment) for _ in range(count)]


def end(farm):
    """All programs end and send the spans that still wait."""
    for process in farm.workers + [farm.coordinator]:
        assert process.terminate() == 0, process.output()


def submit_below(farm, traceparent):
    request = urllib.request.Request(f"{farm.url()}/api/v1/jobs?spp=24&seed=5", data=SCENE.encode(), method="POST", headers={
        "Authorization": f"Bearer {farm.token}", "Content-Type": "application/xml", "traceparent": traceparent})
    return json.loads(urllib.request.urlopen(request, timeout=PATIENCE).read())["id"]


def check_tree(spans, outside=""):
    """One job, and everything else is below it and within the times of its parent."""
    by_id = {s.id: s for s in spans}
    assert len(by_id) == len(spans), "no id comes twice"
    assert len({s.trace for s in spans}) == 1
    roots = [s for s in spans if s.parent not in by_id]
    assert [(s.name, s.parent) for s in roots] == [("job", outside)]
    for s in spans:
        assert s.start <= s.end, s
        if s is roots[0]:
            continue
        parent = by_id[s.parent]
        assert parent.start <= s.start, (s, parent)
        # A receiver is told of a job's end after it has ended; a worker may go on with units that another one has done.
        lost = any(key == "lightshaft.lost" for key, _ in parent.attributes)
        assert s.end <= parent.end or lost or s.name == "deliver webhook", (s, parent)
    return roots[0]


def test_the_spans_of_a_job_over_coordinator_and_workers_form_one_tree(tmp_path):
    with TraceCollector() as collector, TraceCollector() as receiver, traced_farm(
            tmp_path, collector, flags=["--webhook", f"http://127.0.0.1:{receiver.server_port}/hook"]) as farm:
        workers = add_workers(farm, collector, 2)
        job = farm.submit(SCENE, **SPEC)
        farm.pixels(job)
        units = farm.job(job)["units_total"]
        wait_until(lambda: any(s.attribute("lightshaft.event") == "job.done" for s in collector.spans("deliver webhook")), "its end is told")
        metrics = farm.request("GET", "/metrics").decode()
        secrets = [farm.token, farm.join_token, (farm.data / "webhook-secret").read_text().strip(), str(tmp_path), "/hook"]
        end(farm)
        spans = collector.spans()
        root = check_tree(spans)

        assert root.events == ("running", "done") and root.attribute("lightshaft.state") == "done"
        assert root.attribute("lightshaft.job") == job
        count = collections.Counter(s.name for s in spans)
        assert count["admit scene"] == count["write image"] == count["job"] == 1
        assert count["fold"] == units
        assert all(count[name] >= units for name in ("render unit", "encode partial", "send partial", "check partial", "store partial"))
        assert 1 <= count["load scene"] == count["build world"] <= 2
        assert count["fetch blob"] == count["load scene"], "the scene's text is its only file"
        names = {s.id: s.name for s in spans}
        for s in spans:
            assert s.service == ("lightshaft-worker" if s.name in BELOW_A_LEASE - {"check partial", "store partial"} | {"fetch blob", "build world"}
                                 else "lightshaft-coordinator")
            assert (names.get(s.parent) == "lease") == (s.name in BELOW_A_LEASE), s
        leases = collector.spans("lease")
        assert sum(s.attribute("lightshaft.results") for s in leases) == count["check partial"]
        assert {s.attribute("lightshaft.worker") for s in leases} <= {w.name for w in workers}
        rendered = sum(s.attribute("lightshaft.core_seconds") for s in collector.spans("render unit"))
        assert 0 < root.attribute("lightshaft.core_seconds") <= rendered * (1 + 1e-9), "a unit may be rendered twice, but it counts once"

        # Each path, header and body as OTLP asks for, and nothing secret in them
        for path, headers, body in collector.requests:
            assert path == "/v1/traces" and headers["Content-Type"] == "application/json" and headers["x-key"] == "the key"
            assert not [secret for secret in secrets if secret in body.decode()]
        assert 'lightshaft_trace_spans_total{result="taken"}' in metrics
        # The receiver gets the span of its delivery
        told = {headers["traceparent"].split("-")[2] for _, headers, _ in receiver.requests}
        assert told == {s.id for s in collector.spans("deliver webhook")}


def test_a_job_belongs_to_the_trace_of_the_request_that_submits_it(tmp_path):
    with TraceCollector() as collector, traced_farm(tmp_path, collector) as farm:
        add_workers(farm, collector, 1)
        farm.pixels(submit_below(farm, PARENT))
        end(farm)

        root = check_tree(collector.spans(), outside="b7ad6b7169203331")
        assert root.trace == "0af7651916cd43dd8448eb211c80319c"


def test_a_caller_that_records_nothing_and_a_header_that_is_none(tmp_path):
    with TraceCollector() as collector, traced_farm(tmp_path, collector) as farm:
        add_workers(farm, collector, 1)
        farm.pixels(submit_below(farm, PARENT[:-1] + "0"))
        farm.pixels(submit_below(farm, PARENT.replace("-", "+") * 9))
        end(farm)

        root = check_tree(collector.spans())
        assert root.trace != "0af7651916cd43dd8448eb211c80319c"


def test_after_kill_9_the_next_coordinator_continues_the_trace(tmp_path):
    with TraceCollector() as collector, traced_farm(tmp_path, collector) as farm:
        add_workers(farm, collector, 2, "--fake-delay", "200")
        job = farm.submit(SCENE, spp=200, seed=5)
        farm.wait_for_progress(job, 12)
        wait_until(lambda: collector.spans("fold"), "spans of the first coordinator have come")
        before = {s.id for s in collector.spans()}
        killed = time.time_ns()
        farm.restart_coordinator()
        farm.pixels(job)
        end(farm)
        spans = collector.spans()

    assert len({s.trace for s in spans}) == 1
    root, = [s for s in spans if s.name == "job"]
    assert root.start < killed < root.end and root.id not in before
    assert root.events[0] == "restored" and root.events[-1] == "done"
    ids = {s.id for s in spans}
    assert len(ids) == len(spans)
    folds = [s for s in spans if s.name == "fold"]
    assert {s.parent for s in folds} == {root.id} and any(s.id in before for s in folds) and any(s.start > killed for s in folds)
    # Lost are the spans that the killed process had not sent: of leases, whose children its workers have sent.
    lost = [s for s in spans if s.parent not in ids and s is not root]
    assert all(s.name in BELOW_A_LEASE and s.start < killed for s in lost), lost


@pytest.mark.parametrize("answer", ["hang", "gone", (503, b"busy"), (200, b'{"partialSuccess":{"rejectedSpans":"99999999","errorMessage":"\x1b[2J"}}'),
                                    (200, b"\x00\xff" * 200_000), (400, b"<html>")], ids=["hang", "gone", "busy", "partial", "garbage", "refused"])
def test_no_collector_disturbs_a_job(tmp_path, expected, answer):
    with TraceCollector(answer if answer != "gone" else (200, b"")) as collector:
        if answer == "gone":
            with socket.socket() as free:
                free.bind(("127.0.0.1", 0))
                collector.environment["OTEL_EXPORTER_OTLP_ENDPOINT"] = f"http://127.0.0.1:{free.getsockname()[1]}"
        with traced_farm(tmp_path, collector) as farm:
            add_workers(farm, collector, 2)
            assert farm.pixels(farm.submit(SCENE, **SPEC)) == expected
            if answer != "gone":
                wait_until(lambda: collector.requests, "spans are sent")
            end(farm)
            for process in farm.workers + [farm.coordinator]:
                assert process.output().count("collector of traces") <= 1
                assert "\x1b" not in process.output()


def test_without_an_address_nothing_is_traced(farm):
    farm.add_worker()
    farm.pixels(farm.submit(SCENE, **SPEC))
    assert "lightshaft_trace" not in farm.request("GET", "/metrics").decode()


def test_a_wrong_variable_is_said_at_the_start(tmp_path):
    said = refused_coordinator(tmp_path, code=2, env=dict(os.environ, OTEL_EXPORTER_OTLP_ENDPOINT="collector:4318"))
    assert "OTEL_EXPORTER_OTLP_ENDPOINT 'collector:4318'" in said
