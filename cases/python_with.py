"""Go on under a Python that has the modules a script needs.

The first python3 on the path is often pyenv's, conda's or a virtual environment's, while setup.sh installs h5py, numpy and
matplotlib for the system's.
"""
import importlib
import os
import shutil
import subprocess
import sys

STARTED_BY = "CORPUSCLE_PYTHON_OF"  # process in which this has been tried: a new program in it has the same number


def lacking(modules):
    """Those of `modules` that cannot be imported here; importing them is what the script does next anyway."""
    missing = []
    for name in modules:
        try:
            importlib.import_module(name)
        except ImportError:
            missing.append(name)
    return missing


def others():
    """Python programs other than this one, most likely ones first."""
    folders = ["/usr/bin", *os.environ.get("PATH", "").split(os.pathsep), "/usr/local/bin", "/opt/homebrew/bin"]
    found = dict.fromkeys(shutil.which("python3", path=folder) for folder in folders if folder)
    return [python for python in found if python and python != sys.executable]


def need(*modules):
    """Return if this Python has `modules`; else start the script anew under one that has, or end with what to do."""
    missing = lacking(modules)
    if not missing:
        return
    script = os.path.basename(sys.argv[0])
    if os.environ.get(STARTED_BY) != str(os.getpid()):
        # What points one Python to its modules leads another astray.
        environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONHOME", "PYTHONPATH")}
        environment[STARTED_BY] = str(os.getpid())
        for python in others():
            test = subprocess.run([python, "-c", "import " + ", ".join(modules)], env=environment, capture_output=True)
            if test.returncode == 0:
                sys.stdout.flush(), sys.stderr.flush()
                os.execve(python, [python, *sys.argv], environment)
    sys.exit(f"{script}: no Python found here has {', '.join(modules)} ({sys.executable} lacks {', '.join(missing)}). Install "
             "them with\n    sudo apt-get install python3-h5py python3-numpy python3-matplotlib     (what setup.sh does)\nor\n"
             f"    {sys.executable} -m pip install {' '.join(missing)}")
