#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Every command that says how to install something works: LiteStereo is on no package index, so it names a file.

The commands are those in the documents, in the help, and in errors of the host tools; one of them is run.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from litestereo.host_tools import cli
from litestereo.host_tools.core import opencv
from litestereo.host_tools.core.errors import MissingExtraError
from litestereo.host_tools.core.extras import import_extra, install_command
from support.scripts import script
from support.stub_wheel import stub_wheel

CHECKOUT = Path(__file__).parents[1]
PROJECT  = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["project"]
EXTRAS   = PROJECT["optional-dependencies"]

#: What may be installed: the checkout, or the file of a wheel.
TARGET = re.compile(r"(?P<what>.*?)(\[(?P<extras>[\w,]+)\])?")
WHEEL  = re.compile(rf"litestereo-{re.escape(PROJECT['version'])}(\+noopencv)?-py3-none-any\.whl")

#: Options of pip that may be in a command.
OPTIONS = {"--editable", "--no-deps", "--force-reinstall"}


def is_opencv(word):
    """Return whether a word is one of OpenCV's packages, with or without a version."""
    return re.split("[<>=]", word)[0] in opencv.DISTRIBUTIONS


def wrong(command):
    """Return what is wrong with a command `... pip install ...` or `... pip uninstall ...`, or "" if it works."""
    before, _, after = command.partition(" install ")
    if not after:
        removed = command.partition(" uninstall ")[2].split()
        return "" if all(map(is_opencv, removed)) else "neither installs nor removes OpenCV"
    if re.search(r"(?<!['\w])[^' ]*\[", re.sub(r"'[^']*'", "", after)):
        return "brackets are a pattern of the shell: quote them"
    for word in shlex.split(after):
        if word in OPTIONS or is_opencv(word):
            continue
        found  = TARGET.fullmatch(word)
        path   = Path(found["what"])
        folder = path.is_absolute() and (path / "pyproject.toml").is_file()
        if found["what"] != "." and not folder and not WHEEL.fullmatch(path.name):
            return f"{word} is no checkout, and no wheel of this version"
        if unknown := {*(found["extras"] or "").split(",")} - {"", *EXTRAS}:
            return f"{unknown} are no extras"
    return ""


def commands(text):
    """Return the pip commands in a text: between backticks, or in an indented line."""
    found = re.findall(r"`([^`\n]*\bpip (?:un)?install [^`\n]*)`", text)
    rest  = re.sub(r"`[^`\n]*`", "", text)
    return found + [line.strip() for line in re.findall(r"(?m)^ +[^\n]*\bpip (?:un)?install [^\n]*$", rest)]


def documents():
    """Yield texts for people, and their places: all documents, the output of the Makefile, sources."""
    names = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], check=True, cwd=CHECKOUT,
                           capture_output=True, text=True).stdout.splitlines()
    return {name: (CHECKOUT / name).read_text() for name in names
            if (name.endswith((".md", ".py", ".c", ".h")) or name == "Makefile")
            and not name.startswith("tests/") and (CHECKOUT / name).is_file()}


@pytest.mark.parametrize("command", [
    "pip install litestereo[view]", "pip install 'litestereo[view]'", "pip install litestereo", "pip install .[view]",
    "pip install '.[viewer]'", "pip install 'dist/litestereo-0.0.1-py3-none-any.whl[view]'", "pip uninstall numpy",
    "pip install dist/litestereo-0.1.0-py3-none-any.whl[view]", "pip install rerun-sdk", "pip install '/nowhere[view]'",
])
def test_commands_that_do_not_work(command):
    assert wrong(command)


def test_documents():
    """The README has commands for users of the host tools; other documents may have some."""
    pages = {name: text for name, text in documents().items() if name.endswith(".md")}
    found = {(name, command) for name, text in pages.items() for command in commands(text)}
    assert len({command for name, command in found if name == "README.md"}) >= 10
    assert {pair: wrong(pair[1]) for pair in found if wrong(pair[1])} == {}


def test_nothing_else_names_an_index():
    """No text names an extra without a file, and no source spells a command itself."""
    for name, text in documents().items():
        assert not re.search(r"litestereo\[|pip install '?litestereo(?!-)", text), name
        if not name.endswith(".md"):
            assert not commands(re.sub(r"pip install '\.\[", "", text)), name


def helps(capsys):
    """Return the help of each command by its name."""
    def printed(*arguments):
        with pytest.raises(SystemExit):
            cli.main([*arguments, "--help"])
        return capsys.readouterr().out

    names = re.findall(r"(?m)^ {4}(\w+) ", printed().partition("\ncommands:")[2].partition("\noptions:")[0]
                       .partition("\nexamples:")[0])
    return {name: printed(name) for name in names}


def test_help(capsys):
    texts = helps(capsys)
    assert {"match", "view", "export", "eval"} <= set(texts)
    found = {name: commands(text) for name, text in texts.items()}
    assert found["view"] == [install_command("view")]
    assert [wrong(command) for all_ in found.values() for command in all_ if wrong(command)] == []


def test_errors():
    """Each extra that a module needs is one of the project's, and the command in the error installs it."""
    asked = {extra for text in documents().values() for extra in re.findall(r'import_extra\([^,]+, "(\w+)"', text)}
    assert asked == {"view", "ros", "cluster", "gateware"}
    for extra in asked:
        with pytest.raises(MissingExtraError, match="needs nopackage, which is not installed: ") as caught:
            import_extra("nopackage.module", extra, "it needs")
        command = str(caught.value).partition(" installed: ")[2]
        assert command == install_command(extra) and f"[{extra}]" in command and wrong(command) == ""


def test_error_of_an_import_within(tmp_path, monkeypatch):
    """The error names the missing package; a damaged installation is not a missing extra."""
    (tmp_path / "outer.py").write_text("import nopackage.inner\n")
    (tmp_path / "damaged.py").write_text("import litestereo.nothing\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingExtraError, match="cosim: needs nopackage, "):
        import_extra("outer", "gateware", "cosim: needs")
    with pytest.raises(ModuleNotFoundError, match=r"litestereo\.nothing"):
        import_extra("damaged", "gateware", "cosim: needs")


def test_opencv(monkeypatch):
    """The commands for environments without OpenCV, and with two, have the project's range."""
    (required,) = (one for one in PROJECT["dependencies"] if one.startswith("opencv"))
    assert required == opencv.REQUIREMENT
    ends = {one.operator: tuple(map(int, one.version.split(".")[:2])) for one in Requirement(required).specifier}
    assert opencv.TESTED[0] == ends[">="] and opencv.TESTED[1] < ends["<"]
    monkeypatch.setattr(opencv, "_owners", lambda: {"opencv-python": "4.11.0.86", "opencv-python-headless": "5.0.0.93"})
    assert wrong(opencv.check_opencv().partition("files: ")[2].partition(",")[0]) == ""
    monkeypatch.setattr(opencv, "_owners", dict)
    monkeypatch.setattr(opencv.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(opencv.OpenCVError) as caught:
        opencv.check_opencv()
    assert wrong(str(caught.value).partition("missing: ")[2]) == ""


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    return script("wheel").wheels(tmp_path_factory.mktemp("wheels"))


def run(*command, cwd):
    return subprocess.run(command, check=True, cwd=cwd, capture_output=True, text=True).stdout


@pytest.mark.long
@pytest.mark.parametrize("place", [0, 1], ids=["wheel", "noopencv"])
def test_the_command_of_an_error(wheels, place, tmp_path, monkeypatch):
    """The command that the installed wheel prints installs the extra, from any folder; without the packages pip fails.

    The packages are stubs of the requested releases, so no network is needed. The test also shows that the wheel
    `+noopencv` brings no OpenCV.
    """
    stubs = tmp_path / "stubs with a blank"
    stubs.mkdir()
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", stubs.as_uri())
    monkeypatch.setenv("PIP_DISABLE_PIP_VERSION_CHECK", "1")
    wheel = tmp_path / "a folder" / wheels[place].name
    wheel.parent.mkdir()
    wheel.write_bytes(wheels[place].read_bytes())
    run(sys.executable, "-m", "venv", tmp_path / "venv", cwd=tmp_path)
    python = tmp_path / "venv" / "bin" / "python"
    run(python, "-m", "pip", "install", "--no-deps", wheel, cwd=tmp_path)
    command = run(python, "-c", "from litestereo.host_tools.core.extras import install_command as i; print(i('view'))",
                  cwd=tmp_path).strip()
    assert f"'{wheel}[view]'" in command and wrong(command) == ""
    assert subprocess.run(command, shell=True, cwd="/", capture_output=True, check=False).returncode != 0
    for one in map(Requirement, [*PROJECT["dependencies"], *EXTRAS["view"]]):
        lowest = next(part.version for part in one.specifier if part.operator in (">=", "=="))
        if one.marker is None or one.marker.evaluate():
            stub_wheel(stubs, one.name, lowest)
    run("sh", "-c", command, cwd="/")
    installed = run(python, "-m", "pip", "list", "--format=freeze", cwd=tmp_path)
    assert "rerun-sdk==" in installed and "numpy==" in installed
    assert ("opencv" in installed.replace("noopencv", "")) == (place == 0)
    wheel.unlink()
    command = run(python, "-c", "from litestereo.host_tools.core.extras import install_command as i; print(i('view'))",
                  cwd=tmp_path).strip()
    assert command.endswith(f"-m pip install '{wheel.name}[view]'")
