"""Drives Debian's Chromium over the DevTools protocol, on a pair of pipes: no port, no driver, no library.

Nothing here sleeps: a condition is watched inside the page, frame by frame, until it holds or its time is up.
"""
import base64
import json
import os
import shutil
import subprocess
import tempfile
import threading

FLAGS = [
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--remote-debugging-pipe",
]
ANSWER_S = int(os.environ.get("LIGHTSHAFT_ANSWER_S", 180))  # far more than a busy machine needs


def chromium_path():
    return os.environ.get("CHROMIUM") or shutil.which("chromium")


class DevToolsError(Exception):
    pass


class Browser:
    """One Chromium with a fresh profile. Use `with Browser() as browser: browser.open(url)`."""

    def __init__(self):
        self._profile = tempfile.mkdtemp(prefix="lightshaft-web-")
        to_read, self._to = os.pipe()
        self._from, from_write = os.pipe()
        # Chromium expects its ends as descriptors 3 and 4; the shell puts them there whatever numbers we got.
        command = f'exec "$@" 3<&{to_read} 4>&{from_write}'
        self._process = subprocess.Popen(
            ["bash", "-c", command, "chromium", chromium_path(), *FLAGS, f"--user-data-dir={self._profile}", "about:blank"],
            pass_fds=(to_read, from_write), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_read)
        os.close(from_write)
        self._changed = threading.Condition()
        self._next_id = 1
        self._answers = {}
        self._events = []  # (session, method, params)
        self._ended = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self):
        return self

    def __exit__(self, *exc):
        self.close()

    def close(self):
        os.close(self._to)  # Chromium ends itself when its pipe is closed
        try:
            self._process.wait(timeout=ANSWER_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(timeout=ANSWER_S)
        os.close(self._from)
        shutil.rmtree(self._profile, ignore_errors=True)

    def _read(self):
        buffer = b""
        while chunk := os.read(self._from, 1 << 16):
            *messages, buffer = (buffer + chunk).split(b"\0")
            with self._changed:
                for message in map(json.loads, messages):
                    if "id" in message:
                        self._answers[message["id"]] = message
                    else:
                        self._events.append((message.get("sessionId"), message["method"], message["params"]))
                self._changed.notify_all()
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def call(self, method, params=None, session=None, timeout=ANSWER_S):
        with self._changed:
            number = self._next_id
            self._next_id += 1
        message = {"id": number, "method": method, "params": params or {}}
        if session:
            message["sessionId"] = session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._to, data):]
        with self._changed:
            if not self._changed.wait_for(lambda: number in self._answers or self._ended, timeout):
                raise DevToolsError(f"no answer to {method} within {timeout} s")
            if number not in self._answers:
                raise DevToolsError(f"Chromium ended during {method}")
            answer = self._answers.pop(number)
        if "error" in answer:
            raise DevToolsError(f"{method}: {answer['error'].get('message')}")
        return answer["result"]

    def events(self, session):
        with self._changed:
            return [(method, params) for of, method, params in self._events if of == session]

    def wait_event(self, session, method, after, timeout=ANSWER_S):
        """Waits for an event beyond the first `after` of this session."""
        def there():
            return any(m == method for m, _ in [(m, p) for s, m, p in self._events if s == session][after:])
        with self._changed:
            if not self._changed.wait_for(lambda: there() or self._ended, timeout):
                raise DevToolsError(f"no {method} within {timeout} s")

    def open(self, url, width=1280, height=900, phone=False, scheme=""):
        """A page of its own, with cookies of its own. `scheme`: light or dark, instead of what the browser says of this system."""
        context = self.call("Target.createBrowserContext")["browserContextId"]
        target = self.call("Target.createTarget", {"url": "about:blank", "browserContextId": context})["targetId"]
        session = self.call("Target.attachToTarget", {"targetId": target, "flatten": True})["sessionId"]
        page = Page(self, target, session, context)
        for domain in ("Page", "Runtime", "Log", "DOM", "Network"):
            page.call(f"{domain}.enable")
        page.call("Emulation.setDeviceMetricsOverride",
                  {"width": width, "height": height, "deviceScaleFactor": 2 if phone else 1, "mobile": phone})
        page.call("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
        page.go(url)
        return page


class Page:
    def __init__(self, browser, target, session, context):
        self._browser, self._target, self._session, self._context = browser, target, session, context

    def call(self, method, params=None, timeout=ANSWER_S):
        return self._browser.call(method, params, self._session, timeout)

    def close(self):
        self._browser.call("Target.closeTarget", {"targetId": self._target})
        self._browser.call("Target.disposeBrowserContext", {"browserContextId": self._context})

    def go(self, url):
        seen = len(self._browser.events(self._session))
        self.call("Page.navigate", {"url": url})
        self._browser.wait_event(self._session, "Page.loadEventFired", seen)

    def evaluate(self, expression, timeout=ANSWER_S):
        """The value of a JavaScript expression; promises are awaited."""
        answer = self.call("Runtime.evaluate", {"expression": expression, "awaitPromise": True, "returnByValue": True, "userGesture": True}, timeout)
        if "exceptionDetails" in answer:
            details = answer["exceptionDetails"]
            raise DevToolsError(details.get("exception", {}).get("description") or details["text"])
        return answer["result"].get("value")

    def wait(self, condition, timeout=ANSWER_S):
        """Until the JavaScript expression is truthy; its value then."""
        script = f"""new Promise((resolve, reject) => {{
          const end = performance.now() + {timeout * 1000};
          const look = () => {{
            let value = null;
            try {{ value = ({condition}); }} catch (error) {{ value = null; }}
            if (value) resolve(value);
            else if (performance.now() > end) reject(new Error("never true: " + {json.dumps(condition)} + "\\n\\n" + document.body.innerText.slice(0, 2000)));
            else requestAnimationFrame(look);
          }};
          look();
        }})"""
        return self.evaluate(script, timeout + 15)

    def hold_reply(self, request):
        """Holds the reply to the first request for which the JavaScript expression of `url` and `method` is truthy; once it has come, `window.held` is true."""
        self.evaluate(f"""void (() => {{
          const real = fetch;
          let found = false;
          window.held = false;
          window.released = new Promise((resolve) => {{ window.release = resolve; }});
          window.fetch = async (url, options) => {{
            const method = options?.method ?? "GET";
            const hold = !found && ({request});
            found ||= hold;
            const response = await real(url, options);
            if (hold) {{ window.held = true; await window.released; }}
            return response;
          }};
        }})()""")

    def release_reply(self):
        """Returns when the page has seen the held reply and was drawn again."""
        self.evaluate("window.released.then(() => new Promise(requestAnimationFrame)), window.release()")
        self.evaluate("new Promise(requestAnimationFrame).then(() => new Promise(requestAnimationFrame))")

    def text(self, selector):
        """What a reader sees of the first match, in one line."""
        return self.wait(f"[document.querySelector({json.dumps(selector)}).innerText]")[0].replace("\n", " ").strip()

    def count(self, selector):
        return self.evaluate(f"document.querySelectorAll({json.dumps(selector)}).length")

    def click(self, selector):
        """As a mouse does it: at the middle of the element, which must be what lies there and lie still for two frames."""
        where = self.wait(f"""(() => {{
          const element = document.querySelector({json.dumps(selector)});
          element.scrollIntoView({{block: "center", behavior: "instant"}});
          const box = element.getBoundingClientRect();
          const [x, y] = [box.left + box.width / 2, box.top + box.height / 2];
          const still = window.clickPlace === x + " " + y;
          window.clickPlace = still ? null : x + " " + y;
          return still && !element.disabled && element.contains(document.elementFromPoint(x, y)) && [x, y];
        }})()""")
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", {"type": kind, "x": where[0], "y": where[1], "button": "left", "clickCount": 1})

    def type(self, text):
        self.call("Input.insertText", {"text": text})

    def key(self, key, code=None, virtual=0, text=""):
        base = {"key": key, "code": code or key, "windowsVirtualKeyCode": virtual}
        self.call("Input.dispatchKeyEvent", {"type": "keyDown", "text": text, **base})
        self.call("Input.dispatchKeyEvent", {"type": "keyUp", **base})

    def set_files(self, selector, paths):
        root = self.call("DOM.getDocument")["root"]["nodeId"]
        node = self.call("DOM.querySelector", {"nodeId": root, "selector": selector})["nodeId"]
        self.call("DOM.setFileInputFiles", {"nodeId": node, "files": [os.path.abspath(path) for path in paths]})

    def events(self):
        """(method, params) of all that the browser has told of this page."""
        return self._browser.events(self._session)

    def complaints(self):
        """Errors of scripts, of the console and of the page's policy. A 4xx that a script asked for is no error of the page."""
        out = []
        for method, params in self._browser.events(self._session):
            if method == "Runtime.exceptionThrown":
                details = params["exceptionDetails"]
                out.append(details.get("exception", {}).get("description") or details["text"])
            elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
                out.append(" ".join(str(arg.get("value", arg.get("description"))) for arg in params["args"]))
            elif method == "Log.entryAdded" and params["entry"]["level"] == "error" and params["entry"]["source"] != "network":
                out.append(params["entry"]["text"])
            elif method == "Network.loadingFailed" and params.get("blockedReason"):
                out.append(f"blocked: {params['blockedReason']}")
        return out

    def screenshot(self, path, whole=True, quality=50):
        """Of the whole page, or of what fits the window: a PNG, or a .jpg."""
        form = {"format": "jpeg", "quality": quality} if str(path).endswith(".jpg") else {"format": "png"}
        data = self.call("Page.captureScreenshot", {**form, "captureBeyondViewport": whole})["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))
