"""Settings above the limits of a user, by every route that takes settings."""

import hashlib
import io
import json
import zipfile

from attack_kit import LocalFarm, TINY, UNLIMITED, ask, group, shown, still_serves, submit


def bundle(spec):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("a.xml", TINY)
        archive.writestr("job.json", spec)
    return out.getvalue()


@group("Limits of a user", quick=True)
def limits(record, folder):
    with LocalFarm(folder, flags=(*UNLIMITED, "--film-memory", "4G")) as farm:
        token = farm.token_of("mallory")
        scene = TINY.encode()
        digest = hashlib.sha256(scene).hexdigest()
        assert ask(farm, "PUT", f"/api/v1/blobs/{digest}", token, scene, "application/octet-stream").status == 201

        def priorities():
            return [j["priority"] for j in json.loads(ask(farm, "GET", "/api/v1/jobs?limit=500", token).body)["jobs"]]

        record.row = "a priority above one's own: query, JSON, bundle, change, again, doubled keys, frames"
        waiting = submit(farm, token, TINY, spp=2)
        for label, method, path, body, kind in (
                ("query", "POST", "/api/v1/jobs?priority=1", scene, "application/xml"),
                ("query twice", "POST", "/api/v1/jobs?priority=0&priority=1", scene, "application/xml"),
                ("query twice, turned round", "POST", "/api/v1/jobs?priority=1&priority=0", scene, "application/xml"),
                ("JSON", "POST", "/api/v1/jobs", json.dumps({"scene": digest, "assets": {}, "spec": {"priority": 1}}), "application/json"),
                ("JSON twice", "POST", "/api/v1/jobs", f'{{"scene":"{digest}","assets":{{}},"spec":{{"priority":0,"priority":1}}}}', "application/json"),
                ("bundle", "POST", "/api/v1/jobs", bundle('{"priority": 1}'), "application/zip"),
                ("bundle and query", "POST", "/api/v1/jobs?priority=1", bundle('{"priority": 0}'), "application/zip"),
                ("change", "PATCH", f"/api/v1/jobs/{waiting}", '{"priority": 1}', "application/json"),
                ("change as merge-patch", "PATCH", f"/api/v1/jobs/{waiting}", '{"priority": 100}', "application/merge-patch+json"),
                ("change twice", "PATCH", f"/api/v1/jobs/{waiting}", '{"priority": 0, "priority": 1}', "application/json"),
                ("again", "POST", f"/api/v1/jobs/{waiting}/again", '{"priority": 1}', "application/json"),
                ("frames", "POST", "/api/v1/jobs?frames=1-2&priority=1", scene, "application/xml"),
                ("a real number", "PATCH", f"/api/v1/jobs/{waiting}", '{"priority": 0.9999999999}', "application/json"),
                ("beyond 32 bits", "PATCH", f"/api/v1/jobs/{waiting}", '{"priority": 4294967297}', "application/json")):
            answer = ask(farm, method, path, token, body, kind)
            record.attempt(label, answer.status < 500 and answer.status > 0 and max(priorities()) <= 0, f"{shown(answer)}; {max(priorities())}")

        record.row = "settings out of range: each refused with a sentence, by query, JSON and bundle"
        refused = [("spp", v) for v in (0, -2, 2 ** 31, 2 ** 64, 1e300)] + [("size", v) for v in ("0x0", "1x0", "100000x100000", "65536x65536", "-1x5", "5", "axb", "1e3x1")] + \
                  [("frames", v) for v in ("1-100001", "0-4294967296", "5-1", "a", "1-", "-", "1,2,,3")] + [("time", v) for v in (0, -1, 1e300, "nan", "inf")] + [("target_error", v) for v in (0, -1, "nan", "inf")] + \
                  [("seed", v) for v in (-1, 2 ** 64, "x")] + [("tags", v) for v in ("a" * 5000, ",".join(f"t{i}" for i in range(1000)))] + [("max_workers", v) for v in (-1, 2 ** 40)] + [("max_units", -1), ("memory", -1), ("memory", 2 ** 64)] + \
                  [("deep", v) for v in (-1, 10 ** 9)] + [("aov", v) for v in ("none", "albedo," * 1000, "a" * 5000)] + [("fps", v) for v in (0, -1, "nan")] + [("integrator", "none"), ("techniques", "none"), ("mix", "none=1"), ("color_space", "none")] + \
                  [("exr_compression", "none-such"), ("exr_parts", "none-such"), ("numeric_class", "x" * 5000), ("define", "=" * 100), ("after", "none"), ("reference", "none"), ("target_layer", "none"), ("owner", "root"), ("user", "root"), ("id", "mine")]
        for name, value in refused:
            for label, path, body, kind in (("query", f"/api/v1/jobs?{name}={value}", scene, "application/xml"),
                                            ("JSON", "/api/v1/jobs", json.dumps({"scene": digest, "assets": {}, "spec": {name: value}}), "application/json"),
                                            ("bundle", "/api/v1/jobs", bundle(json.dumps({name: value})), "application/zip")):
                answer = ask(farm, "POST", path, token, body, kind)
                record.attempt(f"{name}={str(value)[:30]} by {label}", answer.status in (400, 403, 404, 409, 413, 414, 507), shown(answer))
                if answer.status == 201:
                    ask(farm, "DELETE", f"/api/v1/jobs/{json.loads(answer.body)['id']}", token)

        record.row = "memory for images: what does not fit is refused, and another user's fits"
        codes = []
        for _ in range(12):
            answer = ask(farm, "POST", "/api/v1/jobs?spp=2&size=4096x4096", token, scene, "application/xml")
            codes.append(answer.status)
        record.attempt("large images one after another", codes[-1] == 507 and set(codes) <= {201, 507}, codes)
        bob = ask(farm, "POST", "/api/v1/jobs?spp=2&size=2048x2048", farm.token_of("bob"), scene, "application/xml")
        record.attempt("another user", bob.status == 201, shown(bob))
        still_serves(record, farm, token)
