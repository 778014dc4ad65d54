#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The host tools with their oldest supported releases; which Python .ci/ends.py finds, and what it refuses."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from support.scripts import script

CHECKOUT = Path(__file__).parents[1]

ends = script("ends")
LOW  = ends.ENDS[0]


@pytest.mark.long
def test_low_end():
    """The low end works; skipped without Python 3.10 or without a network. The high end is in `make ends`."""
    done = subprocess.run([sys.executable, CHECKOUT / ".ci" / "ends.py", "low"], capture_output=True, text=True,
                          check=False, timeout=900)
    print(done.stdout, done.stderr)
    if skipped := re.fullmatch(r"low: skipped: (.*)\n", done.stdout):
        assert done.returncode in (0, ends.NO_NETWORK)
        pytest.skip(skipped[1])
    assert done.returncode == 0
    passed = re.match(r"low: Python 3\.10, numpy 1\.26\.0, OpenCV 4\.10\.0\.84: (\d+) passed", done.stdout)
    assert int(passed[1]) > 100


def imported(path: Path) -> set[str]:
    """Return the modules that a module imports as it is loaded, with `.` in front where it says so."""
    found: set[str] = set()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {f"{'.'*node.level}{node.module or alias.name}" for alias in node.names}
    return found


def test_what_runs_there_loads_no_gateware():
    """Neither the tests that run at the ends nor the helpers that they load import what is not installed there."""
    tests = CHECKOUT / "tests"
    names = [name.partition("::")[0] for name in ends.TESTS if not name.startswith("-")]
    files = [path for name in names for path in ([CHECKOUT / name] if name.endswith(".py") else
                                                 sorted((CHECKOUT / name).rglob("test_*.py")))]
    assert len(files) > 20
    ignored = [CHECKOUT / name.partition("=")[2] for name in ends.TESTS if name.startswith("--ignore=")]
    waiting, seen = [path for path in files if path not in ignored], set[Path]()
    while waiting:
        path = waiting.pop()
        seen.add(path)
        for module in imported(path):
            first, _, rest = module.removeprefix("litestereo.").partition(".")
            gateware = first in ("gateware", *ends.GATEWARE) or first == "soc" and not rest.startswith("build.")
            assert not gateware, f"{path} loads {module}"
            helper = tests / "support" / f"{rest.replace('.', '/')}.py"
            if (module.startswith(".") or first == "support") and helper.exists() and helper not in seen:
                waiting.append(helper)
    assert tests / "support" / "limits.py" in seen


def executable(path, text):
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


@pytest.fixture
def no_python(monkeypatch, tmp_path):
    """Hide Python 3.10 from PATH and pyenv."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv(LOW.variable, raising=False)
    return tmp_path


def test_no_interpreter(no_python):
    """No interpreter is found if there is none, or a shim that fails, a file that does not run, or another version."""
    assert ends.interpreter(LOW) == ""
    path = no_python / "python3.10"
    for text in ("echo 'python3.10: command not found' >&2; exit 127", "echo 3.11"):
        executable(path, text)
        assert ends.interpreter(LOW) == ""
    path.write_bytes(b"\x7fELF")
    assert ends.interpreter(LOW) == ""


def test_interpreter(no_python, monkeypatch):
    """The second one on PATH is found after a shim that fails, and one of pyenv; the variable has priority."""
    executable(no_python / "python3.10", "exit 127")
    other = no_python / "other"
    other.mkdir()
    works = executable(other / "python3.10", "echo 3.10")
    monkeypatch.setenv("PATH", f"{no_python}:{other}")
    assert ends.interpreter(LOW) == str(works)
    monkeypatch.setenv("PATH", str(no_python))
    assert ends.interpreter(LOW) == ""
    installed = no_python / "pyenv.d" / "versions" / "3.10.13" / "bin"
    installed.mkdir(parents=True)
    executable(no_python / "pyenv", f"echo {no_python}/pyenv.d")
    third = executable(installed / "python3.10", "echo 3.10")
    assert ends.interpreter(LOW) == str(third)
    monkeypatch.setenv(LOW.variable, str(works))
    assert ends.interpreter(LOW) == str(works)
    monkeypatch.setenv(LOW.variable, str(no_python / "missing"))
    assert ends.interpreter(LOW) == ""


def test_no_network(monkeypatch, tmp_path):
    """A missing network is told from other errors of pip, such as a package that is not the locked one."""
    for name, text, error in (("deaf", "'NewConnectionError: no route', retrying", ends.NoNetworkError),
                              ("wrong", "THESE PACKAGES DO NOT MATCH THE HASHES", ends.EndError)):
        with pytest.raises(ends.EndError) as caught:
            ends.install(executable(tmp_path / name, f'echo "{text}" >&2; exit 1'), "brick")
        assert type(caught.value) is error


def test_size(tmp_path):
    """Files count their bytes, links count themselves."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "file").write_bytes(bytes(1000))
    (tmp_path / "link").symlink_to("folder")
    assert ends.size(tmp_path) == 1000 + len("folder")


@pytest.mark.parametrize("weight, strangers, message", [
    (ends.SIZE_LIMIT + 1, "", "the environment has 280 MB, 280 MB are allowed"),
    (1, "migen==0.10.0\n", "not of the host tools: migen"),
])
def test_refused(monkeypatch, tmp_path, weight, strangers, message):
    """An environment that is too large, or contains packages of the gateware, is refused."""
    def run(*command, **_):
        if "freeze" in command:
            return f"numpy==1.26.0\n{strangers}"
        return f"{tmp_path}/venv/lib/stereobm.py\nnumpy\n" if ends.PREPARE in command else ""

    monkeypatch.setattr(ends, "run", run)
    monkeypatch.setattr(ends, "size", lambda folder: weight)
    with pytest.raises(ends.EndError, match=message):
        ends.check(LOW, "python3.10", Path("wheel"), tmp_path)
