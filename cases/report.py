#!/usr/bin/env python3
"""One page of a run: python3 cases/report.py RUN_DIR [--out FILE], which `corpuscle report RUN_DIR` starts.

Writes RUN_DIR/report.html: how the run ended, main quantities with their error bars, errors beside times, warnings, blood, pictures, what was
left out, the program and the machine, the case. All is in the one file; nothing is fetched. Needs h5py, numpy and matplotlib, in
this Python or in another one of this machine, for the pictures.
"""

import argparse
import base64
import html
import json
import pathlib
import subprocess
import sys
import tempfile

import python_with

python_with.need("h5py", "matplotlib", "numpy")

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 62rem; padding: 0 1rem; color: #1b1b1b; }
h1 { margin-bottom: 0; } h2 { border-bottom: 1px solid #ccc; margin-top: 2rem; } .sub { color: #555; }
table { border-collapse: collapse; margin: .5rem 0; } td, th { padding: .15rem .7rem .15rem 0; text-align: left; vertical-align: top; }
td.n { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; } tr.bad td { background: #fff0d8; }
.bar { background: #4a7dbd; height: .8rem; display: inline-block; } .ok { color: #176b2c; } .bad { color: #9a4a00; }
img { max-width: 100%; } pre { background: #f6f6f6; padding: .7rem; overflow: auto; }
"""
PICTURES = {"outlines": "Outlines of the cells", "velocity": "Speed on the middle plane", "history": "Histories", "stretching": "Diameters against force",
            "blood": "Blood across the flow, and over time"}


def fail(message):
    """One line, and the exit code of input that is wrong."""
    print(f"report.py: {message}", file=sys.stderr)
    sys.exit(2)


def text_of(value):
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(text_of(one) for one in value)
    return str(value)


def escaped(value):
    return html.escape(text_of(value))


def table(rows, head=()):
    """@param rows  of cells that are HTML; a row that begins with a class name in a tuple's place has it"""
    lines = ["<table>"]
    if head:
        lines.append("<tr>" + "".join(f"<th>{html.escape(name)}</th>" for name in head) + "</tr>")
    for kind, *cells in rows:
        lines.append(f'<tr class="{kind}">' + "".join(cells) + "</tr>")
    return "\n".join([*lines, "</table>"])


def name(value):
    return f"<td>{escaped(value)}</td>"


def number(value):
    return f'<td class="n">{escaped(value)}</td>'


def outcome(report):
    if "broke_down" in report:
        return f'<p class="bad"><b>Broke down</b> {escaped(report["broke_down"])}</p>'
    if "stopped" in report:
        return f'<p class="bad"><b>Stopped</b>: {escaped(report["stopped"])}</p>'
    return f'<p class="ok"><b>Done</b>: {escaped(report["steps"])} steps, {escaped(float(report["simulated_us"]))} us in {escaped(float(report["wall_s"]))} s</p>'


def quantities(report):
    bars = report.get("error_bars", {})
    rows = [("", name(key), number(value), number(bars[key]) if key in bars else "<td></td>") for key, value in report.get("quantities", {}).items()]
    if not rows:
        return ""
    lack = ", ".join(report.get("error_bars_lack", []))
    note = (f'<p class="bad">The bars lack what comes from: {escaped(lack)}</p>' if lack else "") if bars else (
        "<p class=sub>No error bars: run with --estimate-error for some.</p>")
    return "<h2>Quantities at the end</h2>" + table(rows, ("quantity", "value", "error bar" if bars else "")) + note


def errors_and_times(report):
    said = {warning["figure"]: warning["message"] for warning in report.get("warnings", []) if "figure" in warning}
    rows = []
    for key, value in report.get("errors", {}).items():
        if value is None:
            continue
        rows.append(("bad" if key in said else "", name(key), number(value), name(said.get(key, ""))))
    parts = report.get("wall_s_by_part", {})
    most = max([*parts.values(), 1e-300])
    times = [("", name(part), number(seconds), f'<td><span class="bar" style="width:{100 * seconds / most:.0f}px"></span></td>')
             for part, seconds in sorted(parts.items(), key=lambda one: -one[1])]
    good = "" if said or "broke_down" in report else "<p class=ok>None is bad.</p>"
    return ("<h2>Errors</h2>" + table(rows, ("error", "value", "")) + good
            + "<h2>Times</h2>" + table(times, ("part", "s", "")))


def blood(report):
    block = report.get("blood")
    if not block:
        return ""
    rows = [("", name(key), number(value), number(block.get(error)) if (error := error_name(key, block)) else "<td></td>")
            for key, value in block.items() if not isinstance(value, dict) and "error" not in key]
    left = [("", name(key), name(why)) for key, why in block.get("left_out", {}).items()]
    return "<h2>Blood</h2>" + table(rows, ("", "value", "standard error")) + (table(left, ("left out", "why")) if left else "")


def error_name(key, block):
    """The entry of a figure's standard error: the word goes before the unit."""
    for unit in ("_mm_per_s", "_um", ""):
        if unit and not key.endswith(unit):
            continue
        candidate = key[: len(key) - len(unit)] + "_error" + unit
        if candidate in block:
            return candidate
    return ""


def pictures(folder):
    """By plot.py, as data in the page."""
    page = ""
    with tempfile.TemporaryDirectory() as made:
        script = pathlib.Path(__file__).with_name("plot.py")
        done = subprocess.run([sys.executable, str(script), str(folder), "--out", made], capture_output=True, text=True, check=False)
        for key, title in PICTURES.items():
            file = pathlib.Path(made) / f"{key}.png"
            if file.exists():
                data = base64.b64encode(file.read_bytes()).decode()
                page += f'<h2>{title}</h2><img alt="{title}" src="data:image/png;base64,{data}">'
    if not page:
        page = f"<h2>Pictures</h2><p>None: {escaped(done.stderr.strip() or 'the run wrote nothing that could be drawn')}</p>"
    return page


def program(report):
    modules = report.get("modules", {})
    libraries = ", ".join(f"{key} {version}" for key, version in report.get("libraries", {}).items())
    machine = report.get("machine", {})
    rows = [("", name(key), name(value)) for key, value in {
        "program": f"corpuscle {report.get('version', '')}, git {report['git']}", "back end": f"{report['backend']}, {report['ranks']} ranks x {report['threads']} threads",
        "libraries": libraries, "machine": ", ".join(f"{key} {value}" for key, value in machine.items()), "memory": f"{report['peak_rss_mb']:.0f} MB",
        "modules": ", ".join(modules.get("active", [])), "left out": ", ".join(modules.get("left_out", []))}.items() if value]
    told = "".join(f"<li>{escaped(line)}</li>" for line in report.get("told", []))
    return "<h2>Program and machine</h2>" + table(rows) + (f"<p>It said:</p><ul>{told}</ul>" if told else "")


def page_of(folder, report):
    title = report.get("title") or report["case"]
    case = folder / "resolved.toml"
    text = case.read_text(errors="replace") if case.exists() else report.get("resolved_case", "")
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{escaped(title)}</title><style>{STYLE}</style></head><body>
<h1>{escaped(title)}</h1><p class="sub">{escaped(report["case"])}</p>
{outcome(report)}
{blood(report)}
{quantities(report)}
{errors_and_times(report)}
{pictures(folder)}
{program(report)}
<h2>Case</h2><details><summary>every key with its value</summary><pre>{html.escape(text)}</pre></details>
</body></html>
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, help="the page (RUN_DIR/report.html)")
    options = parser.parse_args()
    file = options.folder / "report.json"
    if not file.exists():
        fail(f"{options.folder} holds no report.json: it is no folder of results, or the run goes on or was killed. A run that was killed can be gone on "
             "with from its checkpoint.h5 (corpuscle run CASE --restart DIR); plot.py draws what there is")
    page = options.out or options.folder / "report.html"
    try:
        report = json.loads(file.read_text())
        text = page_of(options.folder, report)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        fail(f"{file} is damaged, or of another program: {type(error).__name__}: {error}")
    try:
        page.write_text(text)
    except OSError as error:
        fail(f"{page} cannot be written: {error}")
    print(page)


if __name__ == "__main__":
    main()
