# SPDX-License-Identifier: MIT
"""The report of a session in a headless browser: the player, the plots, a phone, and script that slips in."""

import unittest

import browser
import numpy as np
import trephine as t
from test_report import EVIL, InFolder, made
from trephine import report


@unittest.skipUnless(browser.CHROMIUM, "Chromium is not installed")
class InBrowser(InFolder):
    HELP = """const now = () => document.getElementById("now").value;
    const drawn = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const wait = (ms) => new Promise((done) => setTimeout(done, ms)).then(drawn);
    const pixels = () => { const c = document.querySelector("canvas");
      return c.getContext("2d").getImageData(0, 0, c.width, c.height).data; };
    const differ = (a, b) => { let n = 0; for (let i = 0; i < a.length; i += 4)
      n += a[i] !== b[i] || a[i + 1] !== b[i + 1] || a[i + 2] !== b[i + 2]; return n / (a.length / 4); };
    const key = (on, name) => on.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true }));
    const to = async (time) => { const s = document.getElementById("time"); s.value = time;
      s.dispatchEvent(new Event("input")); await drawn(); return pixels(); };
    await drawn();
    """

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.browser = browser.Browser()
        cls.addClassCleanup(cls.browser.close)

    def shown(self, path=None, of=None, **window):
        page = browser.Page(of or self.browser, path or self.page, **window)
        self.addCleanup(page.close)
        return page

    def frame(self, script, path=None, of=None, **window):
        """What a script returns in a page that says nothing on the console and asks for nothing."""
        page = self.shown(path, of, **window)
        result = page.run(self.HELP + script)
        self.assertEqual((page.console(), page.requests()), ([], []))
        return result

    def test_the_player_moves_the_tool(self):
        without = browser.Browser("--disable-3d-apis")
        self.addCleanup(without.close)
        for of in (self.browser, without):
            with self.subTest(without=of is without):
                seen = self.frame(
                    """const first = await to(0.2), other = await to(1.0), again = await to(0.2);
                    return { moved: differ(first, other), same: differ(first, again), now: now(),
                      canvases: document.querySelectorAll("canvas").length,
                      filled: differ(first, new Uint8ClampedArray(first.length)) };""",
                    of=of,
                )
                self.assertEqual((seen["canvases"], seen["same"]), (2, 0))
                self.assertTrue(0.003 < seen["moved"] < 0.3, seen)
                self.assertGreater(seen["filled"], 0.2)
                self.assertIn("0.20 s of 3.00 s · stroke 1 of 3", seen["now"])

    def test_the_address_sets_the_time(self):
        for time, stroke in (("0.50", "stroke 1 of 3"), ("1.25", "stroke 2 of 3")):
            self.assertRegex(self.frame("return now();", f"{self.page}#t={time}"), rf"^{time} s of 3.00 s · {stroke}")

    def test_keys_and_buttons(self):
        seen = self.frame(
            """await to(0.1); const times = [];
            for (const k of ["l", "l", "l", "j"]) { key(document.body, k); times.push(parseFloat(now())); }
            document.getElementById("back").click(); times.push(parseFloat(now()));
            const still = await to(0.5), canvas = document.querySelector("canvas");
            key(canvas, "ArrowLeft"); await wait(400); const turned = differ(still, pixels());
            key(canvas, "0"); await wait(400); const back = differ(still, pixels());
            document.getElementById("hides").click(); await wait(100); const hidden = differ(still, pixels());
            key(document.body, " "); const word = document.getElementById("play").textContent;
            await wait(600); key(document.body, " "); const played = parseFloat(now());
            return { times, turned, back, hidden, word, played, tabs: canvas.tabIndex, name: canvas.ariaLabel,
              text: document.getElementById("time").getAttribute("aria-valuetext") };"""
        )
        np.testing.assert_allclose(seen["times"], [1, 2, 2, 1, 0], atol=0.05)
        self.assertGreater(seen["turned"], 0.05)
        self.assertEqual(seen["back"], 0)
        self.assertGreater(seen["hidden"], 0.003)
        self.assertEqual((seen["word"], seen["tabs"]), ("Pause", 0))
        self.assertTrue(0.6 < seen["played"] <= 3, seen)
        self.assertIn("Before, with structures", seen["name"])
        self.assertIn("s of 3.00 s", seen["text"])

    def test_plots_are_drawn_and_seek(self):
        seen = self.frame(
            """const charts = [...document.querySelectorAll(".chart svg")], box = charts[0].getBoundingClientRect();
            charts[0].setPointerCapture = () => {};
            charts[0].dispatchEvent(new PointerEvent("pointerdown", { clientX: box.left + box.width / 2, bubbles: true }));
            return { charts: charts.length, time: parseFloat(now()), words: charts[0].textContent,
              areas: charts.map((c) => c.querySelectorAll(".area").length),
              strokes: charts[0].querySelectorAll(".stroke").length,
              over: charts[0].querySelectorAll(".over").length, broken: document.body.innerHTML.includes("NaN") };"""
        )
        self.assertEqual((seen["charts"], seen["strokes"], seen["broken"]), (4, 3, False))
        self.assertAlmostEqual(seen["time"], 1.5, delta=0.1)
        self.assertIn("event 7", seen["words"])
        self.assertIn("tool 2", seen["words"])
        self.assertTrue(all(seen["areas"]), seen)
        self.assertGreater(seen["over"], 0)

    def test_a_phone_does_not_scroll_sideways(self):
        for width in (390, 320):
            seen = self.frame("return [document.documentElement.scrollWidth, innerWidth];", width=width)
            self.assertEqual(seen, [width, width])

    def test_other_sessions_open(self):
        path, page = self.folder + "/empty.log", self.folder + "/empty.html"
        t.SessionLog(path).close()
        report.write(path, page)
        self.assertIn("no ticks", self.frame("return now();", path=page))
        report.write(self.path, page)
        self.assertTrue(self.frame("const a = await to(0.2); return [differ(a, await to(1.0)) > 0.001];", path=page)[0])

    def test_script_that_slips_in_does_not_run(self):
        _, page = made(self.folder, "evil", names=[EVIL], title=EVIL)
        self.assertEqual(self.frame("return [document.title, document.scripts.length, document.querySelectorAll('b').length];",
                                    path=page), [EVIL, 2, 0])  # fmt: skip
        shown = self.shown()
        result = shown.run(
            self.HELP
            + """const added = document.createElement("script"), image = document.createElement("img");
            added.textContent = "window.ran = true"; image.src = "https://example.org/a.png";
            document.body.append(added, image);
            await wait(200); return [window.ran === undefined, image.naturalWidth];"""
        )
        self.assertEqual(result, [True, 0])
        self.assertIn("Content Security Policy", str(shown.console()))


if __name__ == "__main__":
    unittest.main()
