"""What the studies in this folder share: running the program, and writing what came out with where it was made."""
import csv
import dataclasses
import datetime
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
RESULTS = ROOT / "perf" / "results"
NO_TIME = "not run: out of time"

sys.path.append(str(ROOT / "cases"))
from python_with import need  # noqa: E402, F401 (the studies use it)


def program():
    """The program to study: CORPUSCLE, or the one that setup.sh built."""
    path = pathlib.Path(os.environ.get("CORPUSCLE", ROOT / "build/openmp/corpuscle"))
    if not path.exists():
        sys.exit(f"{path} does not exist: run ./setup.sh first, or set CORPUSCLE")
    return path


def study_program(name):
    """One of this folder's own programs, built beside the one to study if it is not there yet (half a minute)."""
    path = program().parent / "perf" / name
    if not path.exists():
        built = subprocess.run(["cmake", "--build", program().parent, "--target", name], capture_output=True, text=True)
        if built.returncode or not path.exists():
            sys.exit(f"{path} does not exist and cannot be built:\n{(built.stdout + built.stderr)[-2000:]}")
    return path


@dataclasses.dataclass
class Run:
    """Outcome of one run. `code` is the exit code, None if it was stopped for time; `report` is empty unless it is 0."""
    code: int
    wall_s: float
    report: dict
    history: list
    message: str
    folder: pathlib.Path

    @property
    def done(self):
        return self.code == 0


class Limit:
    """When a study has to come to its end: runs that get no time, or not enough, are named on its page."""

    def __init__(self, minutes):
        self.stop_at = time.time() + 60 * minutes

    @property
    def left_s(self):
        return self.stop_at - time.time()

    def allows(self, seconds=0.0):
        return self.left_s > seconds

    @staticmethod
    def no_run(folder=None):
        """In place of a run for which there is no time left."""
        return Run(None, 0.0, {}, [], NO_TIME, folder)


def add_limit(parser, minutes):
    parser.add_argument("--minutes", type=float, default=minutes,
                        help="start no run after this, stop one that takes longer, and write the page with what there is")


def run(case, overrides=None, folder=None, threads=1, ranks=1, timeout_s=None, options=(), bound=None, path=None):
    """Run `case` (a path, or the text of a case) with {"section.key": value} overrides in `folder`.

    `bound`: whether threads keep to their cores; `path`: of another program than program().
    """
    folder = pathlib.Path(folder or tempfile.mkdtemp(prefix="corpuscle_"))
    folder.mkdir(parents=True, exist_ok=True)
    if "\n" in str(case):
        file = folder / "case.toml"
        file.write_text(case)
    else:
        file = ROOT / "cases" / case if (ROOT / "cases" / str(case)).exists() else pathlib.Path(case)
    command = [str(path or program()), "run", str(file), "--out", str(folder), *options]
    if "--restart" not in options and str(path or program()) == str(program()):
        command.append("--overwrite")  # another program may be one from before there was such an option
    for key, value in (overrides or {}).items():
        command += ["--set", f"{key}={toml(value)}"]
    # Threads that are bound would be bound to the same cores as those of other runs beside this one.
    bound = ranks == 1 and threads > 1 if bound is None else bound
    environment = dict(os.environ, OMP_NUM_THREADS=str(threads), OMP_PROC_BIND=toml(bound))
    if ranks > 1:
        environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        command = ["mpirun", "-n", str(ranks), "--oversubscribe"] + command
    start = time.time()
    try:
        result = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=timeout_s)
        code, text = result.returncode, result.stdout + result.stderr
    except subprocess.TimeoutExpired as stopped:
        code, text = None, f"stopped after {timeout_s:.3g} s"
    wall = time.time() - start
    report, history = {}, []
    if (folder / "report.json").exists():
        report = json.loads((folder / "report.json").read_text())
    if (folder / "history.csv").exists():
        with open(folder / "history.csv") as file:
            history = [{k: float(v) if v not in ("", None) else float("nan") for k, v in row.items()}
                       for row in csv.DictReader(file)]
    errors = [line for line in text.splitlines() if "error" in line and not line.startswith("errors:")]
    message = text if code is None else errors[-1] if errors and code != 0 else ""
    return Run(code, wall, report, history, message, folder)


def toml(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    return str(value)


def reference(name):
    """Rows of a table of references/, whose first lines, behind #, say where it is from; numbers where they are numbers."""
    def value(text):
        try:
            return float(text)
        except ValueError:
            return text or None
    with open(ROOT / "perf" / "references" / f"{name}.csv") as file:
        return [{k: value(v) for k, v in row.items()} for row in csv.DictReader(line for line in file if line[0] != "#")]


def provenance():
    """Where and with what a study was made."""
    def output(*command):
        try:
            return subprocess.run(command, capture_output=True, text=True, cwd=ROOT).stdout.strip()
        except OSError:
            return ""
    model = ""
    if pathlib.Path("/proc/cpuinfo").exists():
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "")
    dirty = "-dirty" if output("git", "status", "--porcelain", "--untracked-files=no") else ""
    return {"date": datetime.date.today().isoformat(), "git": output("git", "rev-parse", "--short=12", "HEAD") + dirty,
            "machine": f"{model or platform.processor()}, {os.cpu_count()} cores", "system": platform.system(),
            "load_at_start": round(os.getloadavg()[0], 2)}


def write_csv(path, rows):
    """Rows are dictionaries; columns are the union of their keys, in order of appearance."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)


def write_json(path, rows, **more):
    pathlib.Path(path).write_text(json.dumps({**provenance(), **more, "rows": rows}, indent=1) + "\n")


def pareto(points):
    """Indices of (cost, error) pairs that no other beats in both, cheapest first."""
    front, best = [], float("inf")
    for n in sorted(range(len(points)), key=lambda n: points[n]):
        if points[n][1] < best:
            front.append(n)
            best = points[n][1]
    return front


def save_figure(figure, stem):
    """Both kinds of picture: SVG for zooming, PNG for pages that do not show it."""
    figure.savefig(f"{stem}.svg")
    figure.savefig(f"{stem}.png", dpi=120)


def markdown_table(rows, columns):
    def cell(value):
        return f"{value:.3g}" if isinstance(value, float) else str(value)
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    return "\n".join(lines + ["| " + " | ".join(cell(row.get(c, "")) for c in columns) + " |" for row in rows])
