# SPDX-License-Identifier: MIT
"""A headless Chromium for the tests of pages, by its debugging protocol over a pair of pipes."""

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
_PATIENCE = 100  # of an answer [s]: a machine may be busy


class Browser:
    """A browser that reaches no network; `close` ends it."""

    def __init__(self, *options):
        self.profile = tempfile.TemporaryDirectory()
        there, self.write_end = os.pipe()
        self.read_end, back = os.pipe()
        command = [CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", "--no-first-run"]
        command += ["--host-resolver-rules=MAP * ~NOTFOUND", "--user-data-dir=" + self.profile.name, *options]
        # The browser reads from descriptor 3 and writes to descriptor 4.
        command = ["sh", "-c", f'exec "$@" 3<&{there} 4>&{back}', "sh", *command]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen(command, pass_fds=(there, back), **quiet)
        os.close(there)
        os.close(back)
        self.bytes, self.number, self.events = b"", 0, []

    def close(self):
        self.call("Browser.close")
        self.process.wait(_PATIENCE)
        os.close(self.write_end)
        os.close(self.read_end)
        self.profile.cleanup()

    def call(self, method, session=None, **parameters):
        """The result of a command; events that come before are kept."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters, **({"sessionId": session} if session else {})}
        os.write(self.write_end, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.receive()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def receive(self):
        """The next message; an event is also kept."""
        end = time.monotonic() + _PATIENCE
        while b"\0" not in self.bytes:
            ready, _, _ = select.select([self.read_end], [], [], max(0, end - time.monotonic()))
            more = os.read(self.read_end, 1 << 20) if ready else b""
            if not more:
                raise RuntimeError("the browser does not answer")
            self.bytes += more
        message, self.bytes = self.bytes.split(b"\0", 1)
        message = json.loads(message)
        if "method" in message:
            self.events.append(message)
        return message


class Page:
    """A file in a window of its own."""

    def __init__(self, browser, path, width=1100, height=900, dark=False):
        self.browser = browser
        self.target = browser.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = browser.call("Target.attachToTarget", targetId=self.target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)
        theme = "dark" if dark else "light"
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
        self.call("Page.navigate", url=f"file://{path}")
        while not self.events("Page.loadEventFired"):
            browser.receive()

    def close(self):
        self.browser.call("Target.closeTarget", targetId=self.target)

    def call(self, method, **parameters):
        return self.browser.call(method, self.session, **parameters)

    def events(self, *methods):
        """Parameters of the page's events of these kinds."""
        of_page = [e for e in self.browser.events if e.get("sessionId") == self.session]
        return [e["params"] for e in of_page if e["method"] in methods]

    def console(self):
        """What the console would show."""
        return self.events("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded")

    def requests(self):
        """Addresses that were asked for, besides the file itself and data within it."""
        urls = [event["request"]["url"] for event in self.events("Network.requestWillBeSent")]
        return [url for url in urls if not url.startswith(("file:", "data:"))]

    def run(self, script):
        """What the body of an async function returns."""
        script = f"(async () => {{ {script} }})()"
        answer = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(str(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def picture(self, path):
        """Saves what the window shows as PNG."""
        data = self.call("Page.captureScreenshot", format="png")["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))
