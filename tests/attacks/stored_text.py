"""Markup and control characters in everything that is stored and shown again: names of jobs and workers, users, tags, reasons."""

import html.parser
import json
import os
import shutil
import subprocess
import unicodedata
from urllib.parse import quote

from attack_kit import LocalFarm, TINY, UNLIMITED, ask, group, shown, still_serves, submit
from devtools import Browser, chromium_path
from forged_worker import ForgedWorker, pb
from local_farm import HttpError

FIRES = "document.title='stolen'"
TEXTS = ['<img src=x onerror="{}">', "<script>{}</script>", "<svg/onload={}>", "'\"><script>{}</script>", "</script><script>{}</script>", "<iframe srcdoc='<script>parent.{}</script>'>", "javascript:{}", "<a href=javascript:{}>x</a>", "&lt;img src=x onerror={}&gt;", "${{{}}}",
         "{{{{constructor.constructor('{}')()}}}}", "<math><mtext><style><img src=x onerror={}></style></mtext></math>", "\u202e<b>{}</b>", "\x1b]0;{}\x07", "\x9b31m{}", "a\r\nSet-Cookie: x={}", "]]><script>{}</script>", "<!--<script>{}</script>"]


class Elements(html.parser.HTMLParser):
    """The elements of a page with what fires in them."""

    def __init__(self, text):
        super().__init__()
        self.fires, self.within = [], None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.within = tag
        if any(name.startswith("on") or "stolen" in (value or "") and name in ("href", "src", "srcdoc", "action") for name, value in attributes):
            self.fires.append(tag)

    def handle_data(self, data):
        if self.within == "script" and "stolen" in data:
            self.fires.append("script")

    def handle_endtag(self, tag):
        self.within = None


@group("Stored text and the dashboard")
def stored_text(record, folder):
    with LocalFarm(folder, flags=UNLIMITED) as farm:
        farm.add_worker()
        farm.wait_for_workers(1)
        texts = [text.format(FIRES) for text in TEXTS]
        jobs, forged = [], []
        record.row = "names of jobs, tags and users: refused, or stored as they are and given as JSON that no browser takes for a page"
        for text in texts:
            answer = ask(farm, "POST", f"/api/v1/jobs?spp=2&name={quote(text)}", farm.token, TINY, "application/xml")
            record.attempt(f"job {text[:30]!r}", answer.status in (201, 400) and not any("x=" in v for k, v in answer.headers.items() if k == "set-cookie"), shown(answer))
            if answer.status == 201:
                jobs.append(json.loads(answer.body)["id"])
            answer = ask(farm, "POST", f"/api/v1/jobs?spp=2&tags={quote(text)}", farm.token, TINY, "application/xml")
            record.attempt(f"tag {text[:30]!r}", answer.status in (201, 400), shown(answer))
            answer = ask(farm, "POST", "/api/v1/tokens", farm.token, json.dumps({"role": "submit", "user": text}))
            record.attempt(f"user {text[:30]!r}", answer.status in (201, 400), shown(answer))
            if answer.status == 201:
                jobs.append(submit(farm, json.loads(answer.body)["token"], TINY, spp=2))
        for job in jobs:
            try:
                farm.wait_for_job(job)
            except HttpError as error:
                record.attempt(job, False, error)
        record.row = "names, platforms, tags, activities and reasons of workers"
        for text in texts:
            worker = ForgedWorker(farm, name=text[:128], tags=[text[:64]], platform=text, build=text)
            forged.append(worker)
            worker.send(progress=pb.Progress(activity=text))
            welcome = worker.hears("welcome", 5)
            record.attempt(repr(text[:30]), welcome is not None or worker.ended(5) != "", "neither welcomed nor refused")
        record.row = "what is given again: types, no sniffing, no control characters, strict policy"
        for path in ("/api/v1/jobs", "/api/v1/workers", "/api/v1/tokens", "/metrics", *[f"/api/v1/jobs/{j}{p}" for j in jobs for p in ("", "/log", "/report", "/tiles", "/convergence.csv")]):
            answer = ask(farm, "GET", path, farm.token)
            kind = answer.headers.get("content-type", "")
            safe = not kind.startswith(("text/html", "image/svg", "text/xml", "application/xml")) and answer.headers.get("x-content-type-options") == "nosniff"
            record.attempt(path, answer.status in (200, 409) and safe and b"\x1b" not in answer.body, f"{kind} {shown(answer)}")
        for job in jobs:
            answer = ask(farm, "GET", f"/api/v1/jobs/{job}/report.html", farm.token)
            policy = answer.headers.get("content-security-policy", "")
            record.attempt(f"report.html of {job}", answer.status == 200 and not Elements(answer.text()).fires and "default-src 'none'" in policy.replace("default-src 'self'", "default-src 'none'") and "unsafe-inline" not in policy.partition("script-src")[2].partition(";")[0], f"{policy} {shown(answer)}")
        record.row = "the coordinator's log has no control characters"
        log = (farm.folder / "coordinator.log").read_bytes()
        record.attempt("ESC, CSI, override of direction, bell", not any(mark in log for mark in (b"\x1b", b"\xc2\x9b", "\u202e".encode(), b"\x07")), log[-200:])

        record.row = "the command line, which prints them on a terminal, has no control characters"
        environment = dict(os.environ, LIGHTSHAFT_URL=farm.url(), LIGHTSHAFT_TOKEN=farm.token)
        for arguments in (["jobs"], ["workers"], ["token", "list"], *[[command, j] for command in ("show", "log") for j in jobs]):
            out = subprocess.run([farm.bin / "lightshaft", *arguments], env=environment, capture_output=True, text=True)
            strange = [c for c in out.stdout + out.stderr if unicodedata.category(c) in ("Cc", "Cf") and c not in "\n\t"]
            record.attempt(" ".join(arguments), out.returncode == 0 and not strange, f"{strange} {out.stderr}")

        if not chromium_path() or not shutil.which("chromium"):
            record.left_out.append("pages in a browser: Chromium is not installed")
        else:
            record.row = "the dashboard and reports in Chromium: nothing runs, no element of theirs, no dialog"
            with Browser() as browser:
                page = browser.open(f"{farm.url()}/#token={farm.token}")
                page.wait("document.querySelector('.link.live')")
                for route, ready in (("#/jobs", "main"), ("#/workers", "main"), *[(f"#/jobs/{j}", "main h1") for j in jobs[:len(texts)]], *[(f"#/view/{j}", "main") for j in jobs[:3]]):
                    page.evaluate(f"void (location.hash = {route!r})")
                    page.wait(f"document.querySelector({ready!r})")
                    page.evaluate("new Promise(requestAnimationFrame).then(() => new Promise(requestAnimationFrame))")
                    strange = page.count("main img[src=x], main script, main iframe, main [onclick], main [onerror], main [onload], main math, main a[href^=javascript]")
                    record.attempt(route, strange == 0 and page.evaluate("document.title") != "stolen", f"{strange} elements, title {page.evaluate('document.title')}")
                for job in jobs:
                    page.go(f"{farm.url()}/api/v1/jobs/{job}/report.html")
                    record.attempt(f"report of {job}", page.evaluate("document.title") != "stolen" and page.count("img[src=x], iframe, [onerror], [onload]") == 0, page.evaluate("document.title"))
                record.attempt("no dialog", not [m for m, _ in page.events() if m == "Page.javascriptDialogOpening"], "")
                page.close()
        for worker in forged:
            worker.__exit__()
        record.row = "afterwards"
        still_serves(record, farm, farm.token)
