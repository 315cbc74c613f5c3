"""Pictures and page of error_vs_time: Pareto fronts, cheapest settings, what is dominated."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

import study

TARGETS = (3, 1, 0.3)
ERROR_MARGIN, TIME_MARGIN = 0.1, 0.2  # closer than this is called equal; times carry the noise of the machine
MARKERS = "osD^v<>Pphd8H"


def points(rows, column):
    """Finished runs whose error is known and above zero. Turning a mesh is no setting: it shows what is chance."""
    return [r for r in rows if r["code"] == 0 and r.get(column) and r["varied"] not in ("reference", "spin_deg")]


def front(rows, column):
    return [rows[n] for n in study.pareto([(r["time_s"], r[column]) for r in rows])]


def describe(problem, row):
    """What differs from the default."""
    differing = [f"{k} {row[k]}" for k, v in problem.default.items() if row[k] != v]
    return ", ".join(differing) or "default"


def figure(problems, rows_of, path):
    panels = [(p, column) for p in problems for column in p.errors if points(rows_of[p.name], column)]
    if not panels:
        return False
    columns = min(3, len(panels))
    lines = -(-len(panels) // columns)
    picture, axes = plt.subplots(lines, columns, figsize=(5 * columns, 4 * lines + 0.8), squeeze=False)
    keys = dict.fromkeys(r["varied"] for p, c in panels for r in points(rows_of[p.name], c))
    keys = [k for k in keys if k not in ("default", "several")] + ["several"]
    styles = {k: {"color": plt.get_cmap("tab20")(n % 20), "marker": MARKERS[n % len(MARKERS)]} for n, k in enumerate(keys)}
    styles["default"] = {"color": "black", "marker": "*", "markersize": 13, "zorder": 5}
    shown = {}
    for axis, (problem, column) in zip(axes.flat, panels):
        draw_panel(axis, problem, column, points(rows_of[problem.name], column), styles, shown)
    for axis in list(axes.flat)[len(panels):]:
        axis.axis("off")
    shown = {k: shown[k] for k in ["default", *keys, "Pareto front", "reference's own error"] if k in shown}
    picture.legend(shown.values(), shown.keys(), loc="lower center", ncols=6, fontsize=8)
    picture.tight_layout(rect=(0, 0.8 / (4 * lines + 0.8), 1, 1))
    study.save_figure(picture, path)
    return True


def draw_panel(axis, problem, column, rows, styles, shown):
    for key, style in styles.items():
        members = [r for r in rows if r["varied"] == key]
        if members:
            shown[key], = axis.plot([r["time_s"] for r in members], [r[column] for r in members], linestyle="none",
                                    alpha=0.85, **{"markersize": 6, **style})
    best = front(rows, column)
    shown["Pareto front"], = axis.plot([r["time_s"] for r in best], [r[column] for r in best], color="black", linewidth=1,
                                       drawstyle="steps-post", zorder=1)
    axis.set_xscale("log"), axis.set_yscale("log")
    for side in (axis.xaxis, axis.yaxis):
        side.set_major_locator(LogLocator(subs=(1, 2, 5)))
        side.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        side.set_minor_formatter(NullFormatter())
    low, high = axis.get_ylim()
    for target in TARGETS:
        axis.axhline(target, color="grey", linewidth=0.6, linestyle=":")
    if floor := problem.floors.get(column):
        shown["reference's own error"] = axis.axhspan(low / 1e3, floor, color="grey", alpha=0.15, linewidth=0)
    axis.set_ylim(low, high)
    axis.set_title(f"{problem.title}: {problem.errors[column]}", fontsize=10)
    axis.set_xlabel("time, s"), axis.set_ylabel("error, %")
    axis.grid(True, which="both", linewidth=0.2)


def cheapest_table(problems, rows_of):
    lines = []
    for problem in problems:
        for column, label in problem.errors.items():
            rows = points(rows_of[problem.name], column)
            line = {"problem": problem.title, "error of": label}
            default = next((r for r in rows if r["varied"] == "default"), None)
            line["default"] = f"{default[column]:.2g} %, {default['time_s']:.1f} s" if default else ""
            for target in TARGETS:
                line[f"{target} %"] = cheapest(problem, rows, column, target)
            lines.append(line)
    return study.markdown_table(lines, list(lines[0])) if lines else ""


def cheapest(problem, rows, column, target):
    good = [r for r in rows if r[column] <= target]
    if not rows:
        return "no run finished"
    if not good:
        return f"not reached: at best {min(r[column] for r in rows):.2g} %"
    best = min(good, key=lambda r: r["time_s"])
    doubt = " (†)" if (problem.floors.get(column) or 0) > target / 3 else ""
    return f"{describe(problem, best)}: {best['time_s']:.1f} s{doubt}"


def standing(row, default, columns):
    """A run against the default in every error: "better", "dominated", "equal" (same error and time) or "trade"."""
    pairs = [(row[c], default[c]) for c in columns if row.get(c) and default.get(c)]
    if not pairs:
        return "unknown"
    more_exact = any(a < (1 - ERROR_MARGIN) * b for a, b in pairs)
    less_exact = any(a > (1 + ERROR_MARGIN) * b for a, b in pairs)
    faster = row["time_s"] < (1 - TIME_MARGIN) * default["time_s"]
    slower = row["time_s"] > (1 + TIME_MARGIN) * default["time_s"]
    if not less_exact and faster or more_exact and not less_exact and not slower:
        return "better"
    if not more_exact and slower or less_exact and not more_exact and not faster:
        return "dominated"
    return "trade" if more_exact or less_exact else "equal"


def judge(problems, rows_of):
    """[problem, key, value, standing] of every run that differs from the default in one key."""
    entries = []
    for problem in problems:
        rows = [r for r in rows_of[problem.name] if r["code"] == 0]
        default = next((r for r in rows if r["varied"] == "default"), None)
        for row in rows if default else []:
            if row["varied"] not in ("default", "several", "reference", "spin_deg"):
                entries.append((problem, row["varied"], describe(problem, row), standing(row, default, problem.errors)))
    return entries


def limits(problem, rows, column):
    """What lowers the default's error when refined alone, and by how much."""
    default = next((r for r in rows if r["varied"] == "default" and r["code"] == 0 and r.get(column)), None)
    if not default:
        return ""
    effects = []
    for key in problem.sweeps():
        finer = [r for r in points(rows, column) if r["varied"] == key and r["place"] > problem.default_place(key) >= 0]
        if finer and key != "spin_deg":
            best = max(finer, key=lambda r: r["place"])
            effects.append((best[column] / default[column] - 1, describe(problem, best), best))
    down = sorted((e for e in effects if e[0] < -0.03), key=lambda e: e[0])
    up = [e for e in effects if e[0] > 0.03]
    text = f"*{problem.errors[column].capitalize()}*: default {default[column]:.3g} % in {default['time_s']:.1f} s. "
    text += ("It falls with " + ", ".join(f"{d} (to {r[column]:.3g} %, {r['time_s']:.1f} s)" for _, d, r in down) + ". "
             if down else "No single setting made finer lowers it by more than 3 %. ")
    if up:
        text += "It rises with " + ", ".join(f"{d} (to {r[column]:.3g} %)" for _, d, r in up) + \
                ": errors cancel at the default, or the reference shares its setting. "
    same = [r for r in points(rows, column)
            if r[column] <= 1.05 * default[column] and r["time_s"] < (1 - ERROR_MARGIN) * default["time_s"]]
    if same:
        best = min(same, key=lambda r: r["time_s"])
        text += f"The default's error (within 5 %) at the least time: {describe(problem, best)}, {best['time_s']:.1f} s. "
    else:
        text += "No faster setting has the default's error. "
    return text


def paragraph(problem, rows):
    text = f"### {problem.title}\n\n{problem.what}\n\n"
    if not rows:
        return text + "No run finished.\n"
    text += "\n".join("- " + limits(problem, rows, column) for column in problem.errors if points(rows, column)) + "\n"
    for kind, label in (("better", "Better than the default"), ("dominated", "Dominated by the default")):
        found = [d for p, _, d, s in judge([problem], {problem.name: rows}) if s == kind]
        if found:
            text += f"- {label}: " + "; ".join(found) + ".\n"
    text += "".join(f"- {note}\n" for note in problem.notes)
    for column, floor in problem.floors.items():
        if floor:
            text += f"- The reference's own uncertainty ({problem.errors[column]}): about {floor:.2g} %.\n"
    failed = {}
    for row in rows:
        if row["code"] != 0:
            why = row["message"] or f"exit code {row['code']}"
            failed.setdefault(why if len(why) < 200 else why[:200] + " ...", []).append(describe(problem, row))
    return text + "".join(f"- No result for {'; '.join(who)}: {why}\n" for why, who in failed.items())


def everywhere(problems, rows_of):
    """Single settings and how they stand in each problem where they were tried."""
    table = {}
    for problem, key, text, state in judge(problems, rows_of):
        if key not in ("nodes", "vertices", "cells", "steps", "nodes_per_diameter", "spacing_um", "step_us"):
            table.setdefault(text, {"setting": text})[problem.name.split("_")[0]] = state
    names = [p.name.split("_")[0] for p in problems]
    always = [t for t, r in table.items() if {v for k, v in r.items() if k != "setting"} == {"dominated"}]
    lines = sorted(table.values(), key=lambda r: r["setting"])
    return (study.markdown_table(lines, ["setting"] + names) if lines else "", always)


def page(problems, rows_of, header, has_figure):
    table, always = everywhere(problems, rows_of)
    text = f"# Error against wall time\n\n{header}\n\n"
    text += "![Error against wall time](error_vs_time.png)\n\n" if has_figure else ""
    text += ("Each symbol is one run; its kind says what differs from the default (star). The line is the Pareto front. Dotted: "
             "3, 1 and 0.3 %. Shaded: below the uncertainty of the reference.\n\n## Cheapest setting for 3 %, 1 %, 0.3 %\n\n")
    text += cheapest_table(problems, rows_of) + "\n\nSettings not named are the default's. (†): the reference's own " \
            "uncertainty is above a third of the target.\n\n## Problem by problem\n\n"
    text += "\n".join(paragraph(p, rows_of[p.name]) for p in problems)
    if table:
        text += f"\n## Settings that differ from the default alone\n\nBetter or dominated: in time and every error of the " \
                f"problem, differences below {100 * TIME_MARGIN:.0f} % in time and " \
                f"{100 * ERROR_MARGIN:.0f} % of the error not counted.\n\n{table}\n\nDominated wherever tried: " \
                f"{'; '.join(always) or 'none'}.\n"
    return text
