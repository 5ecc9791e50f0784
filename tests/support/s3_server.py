"""A small S3-compatible server of a test's own. It checks every signature (AWS Signature Version 4) by the published
algorithm, written here without a look at any client, and every payload against the digest that was signed."""

import hashlib
import hmac
import http.server
import re
import threading
import urllib.parse

KEY_ID, SECRET, REGION = "TESTKEY", "test/secret+with=signs", "test-region-1"
ENVIRONMENT = {"AWS_ACCESS_KEY_ID": KEY_ID, "AWS_SECRET_ACCESS_KEY": SECRET, "AWS_REGION": REGION}


def sign(key, text):
    return hmac.new(key, text.encode(), hashlib.sha256).digest()


def escape(text, keep):
    return urllib.parse.quote(text, safe=keep)


def canonical_query(query):
    pairs = urllib.parse.parse_qsl(query, keep_blank_values=True)
    return "&".join(f"{escape(k, '-_.~')}={escape(v, '-_.~')}" for k, v in sorted(pairs))


def signature_problem(method, target, headers):
    """Why a request's signature is none; None: it is right."""
    given = headers.get("Authorization", "")
    if not given.startswith("AWS4-HMAC-SHA256 "):
        return "AccessDenied"
    parts = dict(part.strip().split("=", 1) for part in given[len("AWS4-HMAC-SHA256 "):].split(","))
    key_id, day, region, service, end = parts["Credential"].split("/")
    if (key_id, region, service, end) != (KEY_ID, REGION, "s3", "aws4_request"):
        return "InvalidAccessKeyId"
    names = parts["SignedHeaders"].split(";")
    if any(headers[name] is None for name in names):
        return "SignatureDoesNotMatch"
    if names != sorted(names) or not {"host", "x-amz-date", "x-amz-content-sha256"} <= set(names):
        return "AccessDenied"
    if not headers["x-amz-date"].startswith(day):
        return "AccessDenied"
    path, _, query = target.partition("?")
    request = "\n".join([method, escape(urllib.parse.unquote(path), "/-_.~"), canonical_query(query),
                         *(f"{name}:{' '.join(headers[name].split())}" for name in names), "",
                         ";".join(names), headers["x-amz-content-sha256"]])
    scope = f"{day}/{region}/s3/aws4_request"
    text = "\n".join(["AWS4-HMAC-SHA256", headers["x-amz-date"], scope, hashlib.sha256(request.encode()).hexdigest()])
    key = b"AWS4" + SECRET.encode()
    for word in (day, region, "s3", "aws4_request"):
        key = sign(key, word)
    return None if hmac.compare_digest(sign(key, text).hex(), parts["Signature"]) else "SignatureDoesNotMatch"


class S3Server:
    PAGE = 2  # keys in one list, few, so that lists have several pages
    LEAST_PART = 5 << 20  # least bytes of all parts but the last

    def __init__(self, bucket="farm"):
        self.bucket, self.objects = bucket, {}  # key -> bytes
        self.requests = []  # (method, key) of each request
        self.refuse = []  # status codes of the next requests
        self.gate = None  # a threading.Event: objects are sent only while it is set
        self.cut = 0  # number of the next objects whose transfer is cut off in the middle
        self.uploads = {}  # id -> (key, {number: part}) of unfinished uploads in parts
        # number of ends of uploads in parts that are carried out but answered with an error
        self.forget_ends = 0
        self.refuse_ends = 0  # number of ends of uploads in parts that are refused
        self.lock = threading.Lock()
        owner = self

        class Handler(Request):
            server_state = owner

        self.http = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.http.daemon_threads = True
        threading.Thread(target=self.http.serve_forever, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.http.shutdown()
        self.http.server_close()

    def next_refusal(self, command, key):
        """The status to refuse a request with, or None. That a coordinator asks now and then whether the store answers is no request
        that tests count: it is refused like the next one, which stays the next."""
        if key.endswith("/answers"):
            return self.refuse[0] if self.refuse else None
        self.requests.append((command, key))
        return self.refuse.pop(0) if self.refuse else None

    @property
    def endpoint(self):
        return f"http://127.0.0.1:{self.http.server_address[1]}"

    def url(self, prefix="scenes", bucket=None, more=""):
        return f"s3://{bucket or self.bucket}/{prefix}?endpoint={self.endpoint}{more}"


class Request(http.server.BaseHTTPRequestHandler):
    server_state = None
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def answer(self, status, body=b"", **headers):
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def refuse(self, status, code):
        self.answer(status, f"<?xml version='1.0'?><Error><Code>{code}</Code><Message>{code} it is</Message></Error>".encode())

    def serve(self):
        state = self.server_state
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        path, _, query = self.path.partition("?")
        bucket, _, key = urllib.parse.unquote(path).lstrip("/").partition("/")
        with state.lock:
            status = state.next_refusal(self.command, key)
        if status:
            return self.refuse(status, "SlowDown")
        if state.gate and self.command == "GET" and key:
            state.gate.wait(60)
        if problem := signature_problem(self.command, self.path, self.headers):
            return self.refuse(403, problem)
        if bucket != state.bucket:
            return self.refuse(404, "NoSuchBucket")
        signed = self.headers["x-amz-content-sha256"]
        if signed != "UNSIGNED-PAYLOAD" and signed != hashlib.sha256(body).hexdigest():
            return self.refuse(400, "XAmzContentSHA256Mismatch")
        with state.lock:
            return getattr(self, "s3_" + self.command.lower())(state, key, dict(urllib.parse.parse_qsl(query, keep_blank_values=True)), body)

    do_GET = do_PUT = do_POST = do_HEAD = do_DELETE = serve

    def s3_put(self, state, key, query, body):
        if "partNumber" not in query:
            state.objects[key] = body
            return self.answer(200)
        if query["uploadId"] not in state.uploads:
            return self.refuse(404, "NoSuchUpload")
        state.uploads[query["uploadId"]][1][int(query["partNumber"])] = body
        self.answer(200, ETag=self.etag(body))

    @staticmethod
    def etag(body):
        return f'"{hashlib.md5(body).hexdigest()}"'

    def s3_post(self, state, key, query, body):
        if "uploads" in query:
            upload = f"of/{key}+{len(state.requests)}="  # contains characters that an address must escape
            state.uploads[upload] = (key, {})
            return self.answer(200, f"<InitiateMultipartUploadResult><UploadId>{upload}</UploadId></InitiateMultipartUploadResult>".encode())
        if query["uploadId"] not in state.uploads:
            return self.refuse(404, "NoSuchUpload")
        if state.refuse_ends:
            state.refuse_ends -= 1
            return self.refuse(403, "AccessDenied")
        parts = state.uploads[query["uploadId"]][1]
        named = re.findall(r"<PartNumber>(\d+)</PartNumber><ETag>([^<]+)</ETag>", body.decode())
        if [(int(n), tag) for n, tag in named] != [(n, self.etag(part)) for n, part in sorted(parts.items())]:
            return self.refuse(400, "InvalidPart")
        if any(len(part) < state.LEAST_PART for n, part in parts.items() if n < len(parts)):
            return self.refuse(400, "EntityTooSmall")
        state.objects[key] = b"".join(part for _, part in sorted(parts.items()))
        del state.uploads[query["uploadId"]]
        if state.forget_ends:
            state.forget_ends -= 1
            return self.refuse(500, "InternalError")
        self.answer(200, b"<CompleteMultipartUploadResult/>")

    def s3_delete(self, state, key, query, body):
        if "uploadId" in query:
            state.uploads.pop(query["uploadId"], None)
        else:
            state.objects.pop(key, None)
        self.answer(204)

    def s3_head(self, state, key, query, body):
        if key not in state.objects:
            return self.answer(404)
        self.answer(200, state.objects[key], ETag=self.etag(state.objects[key]))

    def s3_get(self, state, key, query, body):
        if not key:
            return self.list_keys(state, query)
        if key not in state.objects:
            return self.refuse(404, "NoSuchKey")
        data = state.objects[key]
        if not state.cut:
            return self.answer(200, data)
        state.cut -= 1
        self.send_response(200)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data[: len(data) // 2])
        self.close_connection = True

    def list_keys(self, state, query):
        keys = sorted(k for k in state.objects if k.startswith(query["prefix"]) and k > query.get("continuation-token", ""))
        page, more = keys[: state.PAGE], len(keys) > state.PAGE
        self.answer(200, ("<ListBucketResult>" + "".join(f"<Contents><Key>{k}</Key></Contents>" for k in page) +
                          (f"<NextContinuationToken>{page[-1]}</NextContinuationToken>" if more else "") + "</ListBucketResult>").encode())
