#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Test the host tools at both ends of the versions that they allow (make ends).

For each end: a fresh virtual environment of its Python, the locked packages, the wheel of this checkout, and nothing of
LiteX. There the reference model is compared with cv2.StereoBM, a pair is matched by the command and by the program in
the README, and the environment is weighed.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]
LOCKS    = CHECKOUT / ".ci" / "lock"

#: Largest size of an environment with the host tools, in bytes.
SIZE_LIMIT = 280_000_000

#: Longest time in seconds for one step.
STEP_S = 600

#: Exit status if a package is not to be had because there is no network.
NO_NETWORK = 75

#: Tests that run at both ends, on the installed wheel: against cv2.StereoBM first, then what each of the packages does
#: for the host tools, and the program in the README.
TESTS = ("--ignore=tests/host_tools/core/test_arrays.py", # They need Hypothesis and mcap, which the lock of the ends
         "--ignore=tests/host_tools/core/test_mcap.py",   # leaves out.
         "tests/sim/models",
         "tests/host_tools/core",
         "tests/host_tools/cameras/test_camera_info.py",
         "tests/host_tools/cameras/test_rectify.py",
         "tests/host_tools/cli/test_cli.py",
         "tests/host_tools/cli/test_cli_bench.py",
         "tests/host_tools/devices/test_stereo_bm.py",
         "tests/host_tools/evaluation/test_matchers.py",
         "tests/host_tools/export/test_export_maps.py",
         "tests/host_tools/link/test_transports.py",
         "tests/host_tools/live",
         "tests/host_tools/test_python_api.py::test_the_program_in_the_readme")

#: Writes a pair into the working directory; prints what a base installation has loaded for the model.
PREPARE = """
import sys
import litestereo.host_tools.devices.local, litestereo.sim.models.stereo_bm
print(litestereo.sim.models.stereo_bm.__file__)
print(*sorted({name.partition(".")[0] for name in sys.modules}))
import cv2
from support.pairs import generator, textured_pair
for name, image in zip(("left.png", "right.png"), textured_pair(160, 60, generator(1), 8)):
    cv2.imwrite(name, image)
"""

#: Packages of the gateware's tools begin like this; none may be installed or loaded.
GATEWARE = ("litex", "litedram", "liteeth", "litespi", "migen", "pythondata", "meson", "ninja")


class EndError(Exception):
    """A check that failed: what, and with which output."""


class NoNetworkError(EndError):
    """A package that cannot be fetched, as there is no network."""


@dataclass(frozen=True)
class End:
    """One end: its name, its Python, and the variable that names the interpreter."""

    name:     str
    python:   str
    variable: str


ENDS = (End("low", "3.10", "LITESTEREO_PYTHON_LOW"), End("high", "3.13", "LITESTEREO_PYTHON_HIGH"))


def candidates(end: End) -> Iterator[str]:
    """Yield what may be the interpreter of an end: the variable's alone if it is set, those on PATH, those of pyenv."""
    if named := os.environ.get(end.variable):
        yield named
        return
    name = f"python{end.python}"
    for folder in os.get_exec_path():
        if found := shutil.which(name, path=folder):
            yield found
    if pyenv := shutil.which("pyenv"):
        root = subprocess.run([pyenv, "root"], capture_output=True, text=True, check=False).stdout.strip()
        yield from map(str, sorted(Path(root).glob(f"versions/{end.python}.*/bin/{name}")))


def interpreter(end: End) -> str:
    """Return the interpreter of an end, or "" if there is none. A name on PATH may be a shim without a Python."""
    program = "import ensurepip, sys, venv; print('%d.%d' % sys.version_info[:2])"
    for path in candidates(end):
        try:
            done = subprocess.run([path, "-c", program], capture_output=True, text=True, check=False, timeout=60)
        except OSError:
            continue
        if (done.returncode, done.stdout.strip()) == (0, end.python):
            return path
    return ""


def run(*command: str | Path, cwd: Path, **variables: str) -> str:
    """Run a command without the variables of another Python or pytest, and return what it printed.

    Raises
    ------
    EndError
        It failed.
    """
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "PYTEST"))}
    done = subprocess.run(command, cwd=cwd, env=environment | variables, capture_output=True, text=True, check=False,
                          timeout=STEP_S)
    if done.returncode:
        raise EndError(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def install(python: Path, *arguments: str | Path) -> None:
    """Install with the pip of an environment.

    Raises
    ------
    NoNetworkError
        Nothing answers where the packages are.
    EndError
        pip failed for another reason.
    """
    try:
        run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps", *arguments,
            cwd=CHECKOUT)
    except EndError as error:
        if re.search("NewConnectionError|NameResolutionError|ConnectTimeoutError|ProxyError", str(error)):
            raise NoNetworkError("no network, and pip cannot fetch the packages") from None
        raise


def locked(name: str) -> tuple[str | Path, ...]:
    """Return pip's arguments for the packages of a lock."""
    return "--require-hashes", "--only-binary", ":all:", "--requirement", LOCKS / f"{name}.txt"


def size(folder: Path) -> int:
    """Return the bytes of all files in a folder."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if not path.is_dir() or path.is_symlink())


def check(end: End, python: str, wheel: Path, folder: Path) -> str:
    """Check an end in an empty folder, and return what it is, in one line.

    Raises
    ------
    EndError
        A check failed, or no network.
    """
    venv, work = folder / "venv", folder / "work"
    work.mkdir()
    run(python, "-m", "venv", venv, cwd=folder)
    inside = venv / "bin" / "python"
    install(inside, *locked(end.name))
    install(inside, "--no-index", wheel)
    # That what is locked is within the ranges of the wheel, and all that it needs.
    run(inside, "-m", "pip", "check", cwd=folder)
    weight = size(venv)
    if weight > SIZE_LIMIT:
        raise EndError(f"the environment has {weight / 1e6:.0f} MB, {SIZE_LIMIT / 1e6:.0f} MB are allowed")
    versions = dict(line.split("==") for line in run(inside, "-m", "pip", "freeze", cwd=folder).split("\n")
                    if "==" in line)
    tests  = str(CHECKOUT / "tests")
    origin, loaded, *_ = run(inside, "-c", PREPARE, cwd=work, PYTHONPATH=tests).split("\n")
    if not Path(origin).is_relative_to(venv.resolve()):
        raise EndError(f"the wheel is not what is tested: {origin}")
    if strangers := [name for name in [*versions, *loaded.split()] if name.startswith(GATEWARE)]:
        raise EndError(f"not of the host tools: {' '.join(strangers)}")
    run(venv / "bin" / "litestereo", "match", "left.png", "right.png", "-o", "out", "--device", "model:",
        "--disparities", "32", "--block-size", "9", cwd=work)
    if not (work / "out" / "disparity.npy").is_file():
        raise EndError("litestereo match has written no map")
    install(inside, *locked("ends"))
    # Without the settings of pyproject.toml and without conftest.py, which are for all of the tests.
    report = run(inside, "-m", "pytest", "-q", "-c", os.devnull, "--rootdir", CHECKOUT, "--noconftest", "-p",
                 "no:cacheprovider", "--import-mode=importlib", "--basetemp", folder / "pytest", *TESTS, cwd=CHECKOUT,
                 PYTHONPATH=tests, PYTHONDONTWRITEBYTECODE="1")
    return (f"Python {end.python}, numpy {versions['numpy']}, OpenCV {versions['opencv-python-headless']}: "
            f"{report.strip().splitlines()[-1]}; {weight / 1e6:.0f} MB")


def wheel_of_checkout(folder: Path) -> Path:
    """Build the wheel into a folder."""
    run(sys.executable, CHECKOUT / ".ci" / "wheel.py", "--out", folder, cwd=CHECKOUT)
    (wheel,) = (path for path in folder.glob("litestereo-*.whl") if "+" not in path.name)
    return wheel


def main() -> int:
    """Check the ends that are named; return 1 if one failed, NO_NETWORK if one could not be tried."""
    parser = argparse.ArgumentParser(prog="ends", description=__doc__.partition("\n")[0])
    parser.add_argument("end", nargs="?", choices=[end.name for end in ENDS], help="the end to test (default: both)")
    chosen = parser.parse_args().end
    status = 0
    with tempfile.TemporaryDirectory() as folder:
        wheel = wheel_of_checkout(Path(folder) / "dist")
        for end in ENDS:
            if chosen not in (None, end.name):
                continue
            python = interpreter(end)
            if not python:
                print(f"{end.name}: skipped: no Python {end.python}, on PATH or as {end.variable}", flush=True)
                continue
            begin = time.monotonic()
            place = Path(folder) / end.name
            place.mkdir()
            try:
                print(f"{end.name}: {check(end, python, wheel, place)}; {time.monotonic() - begin:.0f} s", flush=True)
            except NoNetworkError as error:
                print(f"{end.name}: skipped: {error}", flush=True)
                status = status or NO_NETWORK
            except EndError as error:
                print(f"{end.name}: failed: {error}", flush=True)
                status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
