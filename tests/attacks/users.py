"""A user who knows the ids of another user's jobs: every route answers that there is no such job, and no list or stream shows anything of it."""

import hashlib
import json
import socket
import time

from attack_kit import LocalFarm, TINY, UNLIMITED, ask, group, shown, still_serves, submit
from routes import requests_of

MARK = "alices-secret-picture"


def stream_of(farm, token, path, until):
    """What an event stream says until `until()` is true."""
    with socket.create_connection(("127.0.0.1", farm.http), timeout=1) as sock:
        sock.sendall(f"GET {path} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {token}\r\n\r\n".encode())
        data, deadline = bytearray(), time.monotonic() + 30
        while time.monotonic() < deadline:
            try:
                part = sock.recv(1 << 16)
            except TimeoutError:
                part = b" "
            if not part:
                break
            data += part
            if until(data):
                break
        return bytes(data)


@group("Users against users", quick=True)
def users(record, folder):
    with LocalFarm(folder, flags=(*UNLIMITED, "--http-heartbeat-seconds", "0.5")) as farm:
        farm.add_worker()
        alice, bob, rita = farm.token_of("alice"), farm.token_of("bob"), json.loads(farm.request("POST", "/api/v1/tokens", b'{"role": "read", "user": "rita"}'))["token"]
        scene = TINY.replace("</scene>", f"<!-- {MARK} --></scene>")
        done = submit(farm, alice, scene, spp=4, name=MARK + ".xml")
        sequence = submit(farm, alice, scene, spp=4, frames="1-3", name=MARK + "-s.xml")
        farm.wait_for_job(done)
        held = submit(farm, alice, scene, spp=4, size="128x128", name=MARK + "-h.xml", max_workers=1)
        ids = [done, sequence, f"{sequence}-1", held]
        marks = [MARK.encode(), *[i.encode() for i in (done, sequence, held)], b"alice"]

        def clean(answer):
            return not any(mark in answer.body for mark in marks)

        record.row = "every route of a job asked for by another user, by its id and by those of its frames"
        for job in ids:
            for method, path, _, has_body in requests_of(farm.get("/api/v1/openapi.json"), job):
                if job not in path:
                    continue
                for body in ((b"{}", b'{"state": "cancelled"}', b'{"priority": 0}', b'{"focus": [0,0,8,8]}') if has_body else (None,)):
                    for suffix in ("", "?frame=1", "?view=x&mix=key=2&rect=0,0,1,1"):
                        answer = ask(farm, method, path + suffix, bob, body)
                        record.attempt(f"{method} {path} {suffix} {body}", answer.status == 404 and MARK.encode() not in answer.body and b"alice" not in answer.body, shown(answer))
        record.row = "lists, searches, sorting, and streams of another user"
        for query in ("", "?owner=alice", f"?search={MARK}", "?search=", "?state=done", "?sort=owner", "?sort=-name", "?offset=0&limit=500", "?since=0", f"?search={done}", "?owner=", "?owner=*", "?search=%25"):
            answer = ask(farm, "GET", "/api/v1/jobs" + query, bob)
            record.attempt(query, answer.status in (200, 400) and (clean(answer) or query == "?owner=alice" and MARK.encode() not in answer.body), shown(answer))
        for path in ("/api/v1/workers", "/api/v1/session", "/api/v1/views", "/api/v1/tokens", "/metrics", "/api/v1/openapi.json"):
            answer = ask(farm, "GET", path, bob)
            record.attempt(path, MARK.encode() not in answer.body and done.encode() not in answer.body and b"alice" not in answer.body, shown(answer))
        mine = submit(farm, bob, TINY, spp=2, name="of-bob.xml")
        said = stream_of(farm, bob, "/api/v1/events?last_event_id=0", lambda data: mine.encode() in data)
        record.attempt("all events from the beginning", mine.encode() in said and not any(mark in said for mark in marks), said[-300:])
        for job in ids:
            answer = ask(farm, "GET", f"/api/v1/jobs/{job}/events", bob)
            record.attempt("events of one job", answer.status == 404, shown(answer))

        record.row = "jobs of another user by reference: after, again, reference, resubmitted ids"
        digest = hashlib.sha256(b"no such scene").hexdigest()
        for query, body, kind in ((f"?after={held}", TINY, "application/xml"), (f"?after={sequence}-1", TINY, "application/xml"), (f"?reference={done}", TINY, "application/xml"), (f"?reference={digest}", TINY, "application/xml"),
                                  ("", json.dumps({"scene": done, "assets": {}, "spec": {}}), "application/json"), ("", json.dumps({"scene": digest, "assets": {}, "spec": {"after": [held]}}), "application/json")):
            answer = ask(farm, "POST", "/api/v1/jobs" + query, bob, body, kind)
            record.attempt(query or body[:60], 400 <= answer.status < 500 and MARK.encode() not in answer.body and b"alice" not in answer.body, shown(answer))
        answer = ask(farm, "PATCH", f"/api/v1/jobs/{mine}", bob, json.dumps({"after": [held]}))
        record.attempt("a job is made to wait for it", 400 <= answer.status < 500 and b"alice" not in answer.body, shown(answer))

        record.row = "no route has a scene's file, and a reader changes nothing"
        sha = hashlib.sha256(scene.encode()).hexdigest()
        for method in ("GET", "HEAD"):
            answer = ask(farm, method, f"/api/v1/blobs/{sha}", bob)
            record.attempt(f"{method} of a blob", MARK.encode() not in answer.body, shown(answer))
        for method, path, _, has_body in requests_of(farm.get("/api/v1/openapi.json"), held):
            if method in ("POST", "PATCH", "PUT", "DELETE") and "session" not in path and "missing" not in path:
                answer = ask(farm, method, path, rita, b"{}" if has_body else None)
                record.attempt(f"{method} {path} by a reader", answer.status == 403, shown(answer))

        record.row = "afterwards"
        view = farm.wait_for_job(held)
        record.attempt("the jobs are as they were", view["state"] == "done" and view["owner"] == "alice" and view.get("priority", 0) == 0 and not view.get("focus"), view)
        still_serves(record, farm, bob)
