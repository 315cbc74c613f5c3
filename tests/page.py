#!/usr/bin/env python3
"""The page of a run, as `corpuscle report` makes it: whole, right, and of one file; in a browser where there is one.

    tests/page.py PROGRAM
"""
import html.parser
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
VOID = {"meta", "img", "br"}


class Page(html.parser.HTMLParser):
    """Tags that close in the order in which they open, what is fetched, and the text."""

    def __init__(self):
        super().__init__()
        self.open, self.fetched, self.text, self.images = [], [], "", 0

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ("src", "href") and not value.startswith("data:"):
                self.fetched.append(value)
        self.images += tag == "img"
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()

    def handle_data(self, data):
        self.text += data


def start(*command, code=0):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == code, f"{command}: {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout + done.stderr


def look(browser, file):
    """The page's text after the browser has laid it out, and the pictures that it has decoded."""
    shown = file.with_name("shown.html")
    script = ("<script>addEventListener('load', () => { document.title = [...document.images].filter(i => i.naturalWidth > 100).length + ' of ' + "
              "document.images.length + ' seen, ' + document.body.offsetHeight; });</script>")
    shown.write_text(file.read_text().replace("</body>", script + "</body>"))
    dom = subprocess.run([browser, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", f"file://{shown}"], capture_output=True, text=True,
                         timeout=120).stdout
    return re.search(r"<title>(\d+) of (\d+) seen, (\d+)</title>", dom)


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        case = work / "case.toml"
        text = (ROOT / "cases" / "two_cells.toml").read_text()
        case.write_text(re.sub(r'^title = .*$', 'title = "<b>Two</b> & \\\\"cells\\\\""', text, flags=re.M))
        start(program, "run", case, "--out", work / "out", "--set", "time.end_us=40", "--set", "output.every_us=20")
        said = start(program, "report", work / "out")
        file = work / "out" / "report.html"
        assert str(file) in said, said
        page = Page()
        page.feed(file.read_text())
        report = json.loads((work / "out" / "report.json").read_text())
        assert not page.open and not page.fetched, (page.open, page.fetched)
        assert "http" not in re.sub(r"data:[^\"]*", "", file.read_text())
        for word in ['<b>Two</b> & "cells"', "Done", "energy_balance", "volume_drift", "cell_1_centroid_x_um", "corpuscle 0.", report["machine"]["processor"],
                     "Histories", "transfer", "step_us = "]:
            assert word in page.text, word
        assert f"{report['quantities']['cell_0_area_um2']:.4g}" in page.text
        assert page.images >= 2, page.images
        for warning in report["warnings"]:
            assert warning["message"] in page.text
        # What cannot be: no results, no folder that can be written in.
        assert "no report.json" in start(program, "report", work, code=2)
        assert "cannot be written" in start(program, "report", work / "out", "--out", work / "nowhere" / "page.html", code=2)
        damaged = work / "damaged"
        damaged.mkdir()
        for text in ("[]", "{}", '{"case": "a", "errors": 3}', "{", "\0"):
            (damaged / "report.json").write_text(text)
            assert "is damaged" in start(program, "report", damaged, code=2)
        start(program, "report", work / "out", "--out", work / "page.html")
        assert (work / "page.html").read_text() == file.read_text()
        browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
        if browser:
            seen = look(browser, file)
            assert seen and seen.group(1) == seen.group(2) == str(page.images) and int(seen.group(3)) > 1000, seen
    print(f"page: {page.images} pictures, " + (f"seen in {browser}" if browser else "no browser here to look at it with"))


if __name__ == "__main__":
    main()
