#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Only locked packages are installed: .ci/lock holds every package with its hashes, and .ci/install checks them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

from support.stub_wheel import stub_wheel

CHECKOUT = Path(__file__).parents[1]
LOCKS    = CHECKOUT / ".ci" / "lock"
PROJECT  = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())
PYTHONS  = ("3.11", "3.12", "3.13", "3.14")

BASE     = PROJECT["project"]["dependencies"]
EXTRAS   = PROJECT["project"]["optional-dependencies"]

#: Requirements of each lock.
WANTED = {"build": PROJECT["build-system"]["requires"],
          "test": [*BASE, *EXTRAS["test"]],
          **{extra: EXTRAS[extra] for extra in ("fpga", "lock")},
          "low": BASE,
          "high": BASE,
          "ends": [one for one in EXTRAS["test"] if one.startswith("pytest==")]}

#: The Python of each lock that is not for Python 3.11 and later.
PYTHON = {"low": "3.10", "high": "3.13", "ends": "3.10"}


def locked(text):
    """Return requirement and hashes of each package in a lock, by its name."""
    packages = {}
    for block in re.split(r"\n(?=\w)", re.sub(r"(?m)^ *#.*\n?", "", text)):
        requirement, *hashes = block.replace("\\\n", "").split("--hash=sha256:")
        requirement = Requirement(requirement.strip())
        packages[canonicalize_name(requirement.name)] = (requirement, [one.strip() for one in hashes])
    return packages


def pins(names):
    """Return requirements, with `litestereo[...]` replaced by the requirements of those extras."""
    for requirement in map(Requirement, names):
        if requirement.name == "litestereo":
            for extra in requirement.extras:
                yield from pins(EXTRAS[extra])
        else:
            yield requirement


def needs(requirements, python):
    """Return all packages that `requirements` need with a Python on Linux, as the installed packages declare."""
    environment = {"python_version": python, "python_full_version": f"{python}.0", "sys_platform": "linux"}
    seen, queue = set(), [(canonicalize_name(one.name), frozenset(one.extras)) for one in requirements]
    while queue:
        name, extras = key = queue.pop()
        if key in seen:
            continue
        seen.add(key)
        try:
            lines = distribution(name).requires or []
        except PackageNotFoundError: # This Python does not need the package.
            continue
        for one in map(Requirement, lines):
            chosen = one.marker is None or any(one.marker.evaluate(environment | {"extra": extra})
                                               for extra in ("", *extras))
            if chosen:
                queue.append((canonicalize_name(one.name), frozenset(one.extras)))
    return {name for name, _ in seen}


def test_all_extras():
    """Each extra is in a lock: its own, or that of the tests."""
    within = re.search(r"litestereo\[(.*)\]", EXTRAS["test"][0]).group(1).split(",")
    assert set(EXTRAS) == set(WANTED) - {"build", *PYTHON} | set(within)
    assert {path.stem for path in LOCKS.iterdir()} == set(WANTED)


@pytest.mark.parametrize("name", WANTED)
def test_pins(name):
    """Every pin is locked at its version, every range at a version inside it; a package has one version, and hashes."""
    packages = locked((LOCKS / f"{name}.txt").read_text())
    assert packages
    for requirement, hashes in packages.values():
        assert re.fullmatch(r"==[^*]+", str(requirement.specifier)), requirement
        assert hashes and all(re.fullmatch(r"[0-9a-f]{64}", one) for one in hashes), requirement
    for pin in pins(WANTED[name]):
        if pin.marker and not pin.marker.evaluate({"python_version": PYTHON.get(name, "3.11")}):
            continue
        requirement, _ = packages[canonicalize_name(pin.name)]
        exact = len(pin.specifier) == 1 and next(iter(pin.specifier)).operator == "=="
        if exact:
            assert requirement.specifier == pin.specifier, f"{pin} is not what .ci/lock/{name}.txt has: run make lock"
        else:
            assert pin.specifier.contains(version(requirement)), f"{pin}: .ci/lock/{name}.txt is stale: run make lock"


def version(requirement):
    """Return the version of a requirement `name==version`."""
    (specifier,) = requirement.specifier
    return specifier.version


def test_ranges():
    """Each requirement of the host tools is a range: low.txt has its lower end, high.txt the release of the tests."""
    low, high, test = (locked((LOCKS / f"{name}.txt").read_text()) for name in ("low", "high", "test"))
    for one in map(Requirement, BASE):
        name = canonicalize_name(one.name)
        ends = {specifier.operator: Version(specifier.version) for specifier in one.specifier}
        assert set(ends) == {">=", "<"}, one
        assert Version(version(low[name][0])).release[:len(ends[">="].release)] == ends[">="].release, one
        assert high[name][0].specifier == test[name][0].specifier
    assert PROJECT["project"]["requires-python"] == f">={PYTHON['low']}"


def test_one_release():
    """A package in two locks has the same release in both, except at the low end."""
    releases = {}
    for name in sorted(set(WANTED) - {"low"}):
        for package, (requirement, hashes) in locked((LOCKS / f"{name}.txt").read_text()).items():
            assert releases.setdefault(package, (requirement.specifier, hashes)) == (requirement.specifier, hashes)


@pytest.mark.parametrize("python", PYTHONS)
def test_complete(python):
    """The installer installs only what the lock names, so the lock is complete for each Python."""
    packages = locked((LOCKS / "test.txt").read_text())
    for name in needs(pins(WANTED["test"]), python):
        marker = packages[name][0].marker
        assert marker is None or marker.evaluate({"python_version": python, "python_full_version": f"{python}.0"}), name


@pytest.mark.long
def test_wrong_hash(tmp_path):
    """.ci/install accepts a file with the correct hash, and stops at a wrong one."""
    locks = tmp_path / ".ci" / "lock"
    locks.mkdir(parents=True)
    shutil.copy(CHECKOUT / ".ci" / "install", tmp_path / ".ci")
    shutil.copy(CHECKOUT / "pyproject.toml", tmp_path)
    right = stub_wheel(tmp_path, "mortar")
    wrong = right[::-1]
    (locks / "build.txt").write_text(f"brick==1.0 --hash=sha256:{stub_wheel(tmp_path, 'brick')}\n")
    (locks / "test.txt").write_text(f"mortar==1.0 --hash=sha256:{wrong}\n")
    result = subprocess.run([tmp_path / ".ci" / "install"], capture_output=True, text=True, check=False,
                            env=os.environ | {"PIP_FIND_LINKS": str(tmp_path), "PIP_NO_INDEX": "1"})
    assert result.returncode == 1
    assert result.stderr.splitlines()[-1].startswith("install: the packages of .ci/lock/test.txt are not installed")
    assert f"Expected sha256 {wrong}" in result.stderr
    installed = {path.name for path in (tmp_path / ".venv").glob("lib/python*/site-packages/*-1.0.dist-info")}
    assert installed == {"brick-1.0.dist-info"}
    assert not (tmp_path / ".venv" / "installed").exists()


def test_unknown_extra():
    """An unknown name is refused before anything is installed."""
    result = subprocess.run([CHECKOUT / ".ci" / "install", "tset"], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (1, "install: unknown extra 'tset': there is fpga\n")
