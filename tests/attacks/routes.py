"""Every route of the OpenAPI document without a right token, with odd bodies and with odd queries; and requests that pages of other sites can make a browser send."""

import json

from attack_kit import LocalFarm, TINY, UNLIMITED, ask, exchange, group, sane, shown, still_serves, submit
from authorisation import ROUTES

# One value of every kind that parsers of numbers, names, lists and expressions get wrong.
ODD_VALUES = ["", " ", "0", "-0", "-1", "+1", "1e309", "-1e309", "nan", "inf", "0x10", "1.5", "٣", "2147483648", "4294967296", "9223372036854775808", "18446744073709551616",
              "9" * 400, "%00", "%0d%0aX-Evil:%201", "%ff%fe", "..%2f..%2fetc%2fpasswd", "/etc/passwd", "file:///etc/passwd", "http://127.0.0.1:1/", "a" * 5000, "%F0%9F%92%A5", "%E2%80%AE",
              "'%22><script>", "true", "null", "[]", "{}", "1,1", "0,0,0,0", "-1,-1,99999,99999", "1-1000000000", "1x1", "99999999x99999999", "key=2,key=3", "=", ",", ";", "%25s%25n", "__proto__"]
ODD_BODIES = [b"", b" ", b"null", b"true", b"0", b'""', b"[]", b"{}", b"{", b"}", b'{"a":', b'{"a":1}', b'{"a":1,"a":2}', b"[" * 17 + b"]" * 17, b"[" * 100_000, b'{"a":' * 5000 + b"1" + b"}" * 5000,
              b"1e999", b'{"spp":1e999}', b'{"spp":-1}', b'{"spp":"1"}', b'{"spp":null}', b'{"state":"done"}', b'{"state":[]}', b'{"priority":1e9}', b'{"priority":99999999999999999999}',
              b'{"token":1}', b'{"token":""}', b'{"token":null}', b'{"role":"root"}', b'{"role":"submit","user":"\\u0000"}', b'{"role":"submit","user":"a\\nb"}', b'{"role":"submit","user":"' + b"u" * 5000 + b'"}',
              b'{"digests":[1]}', b'{"digests":["x"]}', b'{"digests":{}}', b'{"scene":"x"}', b'{"scene":null,"assets":[]}', b'{"scene":"' + b"0" * 64 + b'","assets":{"../../a":"' + b"0" * 64 + b'"},"spec":{}}',
              b'{"spec":[]}', b'{"fps":0,"rate":-1}', b'{"fps":1e308}', b'{"view":"/etc/passwd"}', b'{"mix":"key=nan"}', b'{"focus":[0,0,0,0]}', b'{"focus":{"x":-1}}', b'{"focus":[1e300,1,2,3]}',
              b'{"focus":[-5,-5,99999,99999]}', b'\xff\xfe', b'\xef\xbb\xbf{}', b'{"a":"\xff"}', b'{"a":"\\ud800"}', b"\0" * 100, b"{}" * 10, b"NaN", b"<a/>", b"a=1&b=2", b" " * 70_000]
ODD_TYPES = ("application/json", "text/plain", "application/xml", "application/octet-stream", "")


def requests_of(document, job):
    """(method, path with this job, names of its query's parameters, whether it has a body)"""
    def resolve(node):
        while "$ref" in node:
            at = document
            for part in node["$ref"][2:].split("/"):
                at = at[part]
            node = at
        return node

    for path, item in document["paths"].items():
        shared = item.get("parameters", [])
        for method, operation in item.items():
            if method != "parameters":
                parameters = [resolve(p) for p in shared + operation.get("parameters", [])]
                concrete = path.replace("{id}", job).replace("{token}", "none").replace("{worker}", "none").replace("{announcement}", "none").replace("{sha256}", "0" * 64)
                yield method.upper(), concrete, [p["name"] for p in parameters if p["in"] == "query"], "requestBody" in operation


def tokens_on_every_route(record, farm, operations):
    record.row = "every route without a token, with a wrong one, and with a worker's"
    for method, path, _, _ in operations:
        entry = next(e for name, e in ROUTES.items() if matches(name, method, path))
        for caller, token in (("none", None), ("wrong", "0" * 64), ("join", farm.join_token)):
            answer = ask(farm, method, path, token, b"{}" if method in ("POST", "PATCH", "PUT") else None)
            # /healthz and the like are open, and so is the address where a token becomes a session
            expected = {entry[caller]} if (method, path) != ("POST", "/api/v1/session") else {400, 401, 403, 422}
            record.attempt(f"{method} {path}, {caller}", answer.status in expected, shown(answer))


def matches(name, method, path):
    wanted, shape = name.split()
    ours, theirs = path.split("/"), shape.split("/")
    return wanted.upper() == method and len(ours) == len(theirs) and all(b == a or b.startswith("{") for a, b in zip(ours, theirs))


def odd_bodies(record, farm, operations):
    record.row = "odd bodies: JSON that is none, too deep, of other types, of other media types"
    for method, path, _, has_body in operations:
        bodies = ODD_BODIES if has_body else ODD_BODIES[:6]
        for i, body in enumerate(bodies):
            for kind in ODD_TYPES if i < 12 and has_body else ODD_TYPES[:1]:
                if method == "DELETE" and path.count("/") == 4 or "events" in path:
                    continue  # would end the job; has no body
                answer = ask(farm, method, path, farm.token, body, kind)
                record.attempt(f"{method} {path} {kind} {body[:30]!r}", sane(answer), shown(answer))


def odd_queries(record, farm, operations):
    record.row = "odd queries: every parameter of every route with 45 odd values, strange and doubled names"
    for method, path, names, _ in operations:
        if method == "DELETE" or path in ("/api/v1/session",):
            continue
        body = (TINY.encode(), "application/xml") if (method, path) == ("POST", "/api/v1/jobs") else (b"{}", "application/json") if method in ("POST", "PATCH", "PUT") else (None, "")
        made = []
        for name in [*names, "nothing", "__proto__", "frame%00", names[0] + "=1&" + names[0] if names else "a=1&a"]:
            for value in ODD_VALUES:
                answer = ask(farm, method, f"{path}?{name}={value}", farm.token, *body)
                record.attempt(f"{method} {path}?{name}={value[:40]}", sane(answer) and "x-evil" not in answer.headers and b"root:x:" not in answer.body, shown(answer))
                if answer.status == 201 and path.startswith("/api/v1/jobs"):
                    made.append(json.loads(answer.body)["id"])
        for job in made:
            ask(farm, "DELETE", f"/api/v1/jobs/{job}", farm.token)


def odd_paths(record, farm, job):
    record.row = "path traversal and ids that are none, in every route with an id"
    escapes = ["..", "%2e%2e", "..%2f..%2ftoken", "%2e%2e%2f%2e%2e%2ftoken", "..%5c..%5ctoken", "....//....//token", "%00", ".%00", "/etc/passwd", "%2fetc%2fpasswd", job + "%00", job + "/..", job + "%2f..",
               job + ".", job + " ", job.upper(), "a" * 5000, "-1", "0", "'%20or%201=1--", "*", "%25", job + "/0", job + ":0", job + "@0"]
    for escape in escapes:
        for path in ("/{}", "/js/{}", "/api/v1/jobs/{}", "/api/v1/jobs/{}/image.png", "/api/v1/jobs/{}/report", "/api/v1/jobs/{}/video.mp4", "/api/v1/blobs/{}", "/api/v1/tokens/{}", "/api/v1/workers/{}"):
            answer = ask(farm, "GET", path.format(escape), farm.token)
            secret = farm.token.encode() in answer.body or farm.join_token.encode() in answer.body or b"root:x:" in answer.body
            record.attempt(path.format(escape)[:60], sane(answer) and not secret, shown(answer))


def other_sites(record, farm):
    record.row = "cookies, other sites, rebound names, tokens in the address"
    opened = ask(farm, "POST", "/api/v1/session", None, json.dumps({"token": farm.token}))
    cookie = opened.headers.get("set-cookie", "").split(";")[0]
    name, _, value = cookie.partition("=")
    host = f"127.0.0.1:{farm.http}"

    def post(*fields, address=host):
        data = "\r\n".join(["POST /api/v1/blobs/missing HTTP/1.1", f"Host: {address}", f"Cookie: {cookie}", "Connection: close", "Content-Type: application/json", "Content-Length: 14", *fields])
        answers, *_ = exchange(farm.http, data.encode() + b'\r\n\r\n{"digests":[]}')
        return answers[0].status if answers else 0

    own = f"Origin: http://{host}"
    record.attempt("the coordinator's own page", post(own) == 200, "the session does not work at all")
    # https of the same name is no other site: a proxy that ends TLS has the browser's pages under that name.
    for label, *fields in (("another site", "Origin: http://evil.example"), ("no origin",), ("the origin null", "Origin: null"), ("another port", f"Origin: http://127.0.0.1:{farm.http + 1}"),
                           ("its name as a part of another", f"Origin: http://{host}.evil.example"), ("its name as a user", f"Origin: http://{host}@evil.example"),
                           ("two origins", own, "Origin: http://evil.example"), ("another origin first", "Origin: http://evil.example", own),
                           ("a list of origins", f"Origin: http://{host}, http://evil.example"), ("cross-site by the browser's word", own, "Sec-Fetch-Site: cross-site"),
                           ("same-site by the browser's word", own, "Sec-Fetch-Site: same-site")):
        status = post(*fields)
        record.attempt(label, status in (400, 403), status)
    preflight = ask(farm, "OPTIONS", "/api/v1/jobs", headers=("Origin: http://evil.example", "Access-Control-Request-Method: POST", "Access-Control-Request-Headers: authorization"))
    record.attempt("no CORS for a preflight", not any(h.startswith("access-control") for h in preflight.headers), preflight.headers)
    simple = ask(farm, "GET", "/api/v1/jobs", farm.token, headers=("Origin: http://evil.example",))
    record.attempt("no CORS for an answer", not any(h.startswith("access-control") for h in simple.headers), simple.headers)
    flipped = value[:-1] + ("0" if value[-1:] != "0" else "1")
    for label, tampered in (("empty", ""), ("cut", value[:-4]), ("changed", flipped), ("longer", value + "00"), ("doubled", value + "." + value), ("of zeros", "0" * len(value)),
                            ("without its signature", value.split(".")[0]), ("with another role", value.replace("admin", "Admin").replace("submit", "admin") + "x"), ("endless", "a" * 8000)):
        answer = ask(farm, "GET", "/api/v1/jobs", headers=(f"Cookie: {name}={tampered}",))
        record.attempt(f"a cookie {label}", answer.status in (401, 431), shown(answer))
    for where in (f"/api/v1/jobs?token={farm.token}", f"/api/v1/jobs?access_token={farm.token}", f"/api/v1/jobs#token={farm.token}"):
        answer = ask(farm, "GET", where)
        record.attempt("a token in the address", answer.status in (400, 401), shown(answer))
    for label, value in (("Basic", f"Basic {farm.token}"), ("no word", farm.token), ("twice", f"Bearer {farm.token}\r\nAuthorization: Bearer {'0' * 64}"), ("wrong one first", f"Bearer {'0' * 64}\r\nAuthorization: Bearer {farm.token}"),
                         ("with a NUL", f"Bearer {farm.token}\0"), ("upper case", f"Bearer {farm.token.upper()}x"), ("prefix", f"Bearer {farm.token[:-1]}"), ("longer", f"Bearer {farm.token}0"), ("of 15 KB", "Bearer " + "a" * 15000)):
        answer = ask(farm, "GET", "/api/v1/jobs", headers=(f"Authorization: {value}",))
        record.attempt(f"an authorisation {label}", answer.status in (400, 401, 431), shown(answer))


def new_routes(record, farm):
    """Odd values for deep images, views, mixes, meters, videos, focused regions and jobs that wait for others."""
    record.row = "views, mixes, deep images, meters, videos, focus and after: values made for them"
    lamp = TINY.replace("</scene>", '<emitter type="point"><string name="light_group" value="key"/><rgb name="intensity" value="1"/></emitter></scene>')
    lit = submit(farm, farm.token, lamp, spp=4, aov="light_groups", deep=2)
    farm.wait_for_job(lit)
    base = f"/api/v1/jobs/{lit}"
    tries = [f"{base}/{route}?mix={mix}" for route in ("mix", "image.png", "image.exr") for mix in
             ("key=1", "key=-1", "key=1e39", "key=1e308", "key=nan", "key=inf", "key=1:2", "key=1:2:3:4", "key=", "=1", "key", "none=1", "key=1,key=1", "key=" + "9" * 300, ",".join(f"g{i}=1" for i in range(2000)),
              "key=0", "other=0", "media=0", "key=1:nan:1", "%00=1", "key=1%00", "key==1", "key=0x1p1023")]
    tries += [f"{base}/image.png?view={v}" for v in ("none", "..", "%2e%2e%2fa", "", "%00", "a" * 3000, "ACES%201.0%20SDR-video", "'", "sRGB%0d%0aX-Evil:1")]
    tries += [f"/api/v1/views/cube?view={v}" for v in ("none", "..", "", "%00", "a" * 3000, "/etc/passwd", "sRGB%0d%0aX-Evil:1")]
    tries += [f"{base}/image.png?exposure={v}" for v in ("1e38", "-1e38", "nan", "inf", "1e400", "-200", "200", "")]
    tries += [f"{base}/pixels?layer={layer}&level={level}&rect={rect}" for layer in ("", "none", "RGB_key", "..") for level in ("0", "4", "31", "63", "-1", "64", "999") for rect in
              ("0,0,1,1", "0,0,16,16", "0,0,0,0", "15,15,17,17", "-1,-1,1,1", "0,0,2147483647,2147483647", "2147483647,0,-2147483648,1", "1,1,0,0", "0,0,1e3,1")]
    tries += [f"{base}/{route}" for route in ("deep.exr", "meters", "video", "video.mp4", "layers", "deep.exr?frame=0", "deep.exr?frame=-1", "meters?frame=99999999999")]
    for path in tries:
        answer = ask(farm, "GET", path, farm.token)
        record.attempt(path.replace(lit, "ID")[:90], sane(answer) and "x-evil" not in answer.headers and b"root:x:" not in answer.body and answer.seconds < 15, shown(answer))
    waiting = submit(farm, farm.token, TINY, spp=2, size="64x64", after=lit)
    for after in (waiting, f"{lit},{lit}", ",".join([lit] * 5000), "none", f"{lit},none", ",", f"{lit}%00"):
        answer = ask(farm, "POST", f"/api/v1/jobs?spp=2&after={after}", farm.token, TINY, "application/xml")
        record.attempt(f"after={after[:20]}", sane(answer), shown(answer))
    for change in ({"after": [waiting]}, {"focus": [0, 0, 1, 1]}, {"focus": [0, 0, 10 ** 12, 1]}, {"focus": [1, 1, 0, 0]}, {"focus": ["a"]}, {"focus": [.5] * 4}, {"focus": [0] * 10_000}, {"spp": 2 ** 63}, {"mix": {"key": [1] * 10_000}}):
        answer = ask(farm, "PATCH", f"/api/v1/jobs/{waiting}", farm.token, json.dumps(change))
        record.attempt(f"PATCH {str(change)[:40]}", sane(answer), shown(answer))
    for spec in ({"mix": "key=2"}, {"mix": "key=nan"}, {"mix": 5}, {"deep": 10 ** 9}, {"deep": -1}, {"spp": 2, "size": "0x0"}, {"after": [lit] * 5000}, {"frames": "1-9999999999"}):
        answer = ask(farm, "POST", f"{base}/again", farm.token, json.dumps(spec))
        record.attempt(f"again {str(spec)[:40]}", sane(answer), shown(answer))
    for frames, fps in (("1-3", "0"), ("1-3", "-1"), ("1-3", "1e308"), ("1-3", "nan"), ("3-1", "24"), ("1-3x0", "24"), ("1,1,1", "24"), ("-5--1", "24")):
        answer = ask(farm, "POST", f"/api/v1/jobs?spp=2&frames={frames}&fps={fps}", farm.token, TINY, "application/xml")
        record.attempt(f"frames={frames} fps={fps}", sane(answer), shown(answer))
    points = lambda n, text: TINY.replace('<sensor type="perspective">', f'<sensor type="irradiancemeter" id="m"><string name="points" value="{(text + "; ") * n}"/></sensor><sensor type="perspective">')  # noqa: E731
    for label, scene in (("a meter without points", points(0, "")), ("NaN as a point", points(1, "nan 0 0 0 0 1")), ("a direction of length zero", points(1, "0 0 0 0 0 0")), ("five numbers", points(1, "0 0 0 0 0")),
                         ("100,000 points", points(100_000, "0 0 0 0 0 1")), ("a million points", points(1_000_000, "0 0 0 0 0 1")), ("points at 1e38", points(1, "1e38 1e38 1e38 0 0 1")),
                         ("a light group named by markup", lamp.replace('"key"', '"&lt;img src=x&gt;"')), ("a light group of 60 KB", lamp.replace('"key"', '"' + "g" * 60_000 + '"')),
                         ("2,000 light groups", TINY.replace("</scene>", "".join(f'<emitter type="point"><string name="light_group" value="g{i}"/></emitter>' for i in range(2000)) + "</scene>"))):
        answer = ask(farm, "POST", "/api/v1/jobs?spp=2&aov=light_groups", farm.token, scene, "application/xml")
        record.attempt(label, sane(answer), shown(answer))
        if answer.status == 201:
            ask(farm, "DELETE", f"/api/v1/jobs/{json.loads(answer.body)['id']}", farm.token)


@group("Routes, tokens, bodies, queries")
def routes(record, folder):
    with LocalFarm(folder, flags=UNLIMITED) as farm:
        farm.add_worker(fake=False)
        farm.wait_for_workers(1)
        job = submit(farm, farm.token, TINY, spp=4, aov="albedo,depth")
        farm.wait_for_job(job)
        operations = list(requests_of(farm.get("/api/v1/openapi.json"), job))
        record.row = "the document and the table of rights have the same routes"
        record.attempt("as many", len(operations) == len(ROUTES), f"{len(operations)} of the document, {len(ROUTES)} of the table")
        tokens_on_every_route(record, farm, operations)
        odd_paths(record, farm, job)
        other_sites(record, farm)
        new_routes(record, farm)
        odd_bodies(record, farm, operations)
        odd_queries(record, farm, operations)
        record.row = "afterwards"
        still_serves(record, farm, farm.token)
        record.attempt("a job is rendered", farm.pixels(submit(farm, farm.token, TINY, spp=4)), "")


@group("Routes and tokens, the fast ones", quick=True, whole=False)
def fast_routes(record, folder):
    with LocalFarm(folder, flags=UNLIMITED) as farm:
        farm.add_worker()
        job = submit(farm, farm.token, TINY, spp=4)
        farm.wait_for_job(job)
        tokens_on_every_route(record, farm, list(requests_of(farm.get("/api/v1/openapi.json"), job)))
        odd_paths(record, farm, job)
        other_sites(record, farm)
        still_serves(record, farm, farm.token)
