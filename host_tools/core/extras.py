#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Packages that only some commands need: the extras of the installation, and the command that installs one."""

from __future__ import annotations

import functools
import importlib
import importlib.metadata
import json
import shlex
import sys
import urllib.parse
import urllib.request
from pathlib import Path
from typing import Any

from .errors import MissingExtraError


def import_extra(module: str, extra: str, purpose: str) -> Any:
    """Return the module `module`.

    Parameters
    ----------
    extra
        Name of the extra that installs it, or what it imports.
    purpose
        What it is needed for, as the error says it: "an MCAP bag needs".

    Raises
    ------
    MissingExtraError
        It is not installed, or a package that it imports is not.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        missing = (error.name or module).partition(".")[0]
        if missing == "litestereo": # A damaged installation, which no extra repairs.
            raise
        raise MissingExtraError(f"{purpose} {missing}, which is not installed: {install_command(extra)}") from None


def ros_types(purpose: str) -> Any:
    """Return the definitions of ROS 2's messages, those of rosbags; the ones used here are equal in all distributions.

    Raises
    ------
    MissingExtraError
        rosbags is not installed; `purpose` as for `import_extra`.
    """
    import_extra("rosbags.typesys", "ros", purpose)
    return _ros_types()


@functools.cache
def _ros_types() -> Any:
    typesys = importlib.import_module("rosbags.typesys")
    return typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)


def install_command(extra: str) -> str:
    """Return the command that adds an extra to this installation, for a shell in any folder.

    LiteStereo is installed from a checkout or from the file of a wheel, and not by its name: pip has noted where that
    is. If it is not there any more, the command names the wheel alone, for the folder that has it.
    """
    return pip_command("install", *_origin(extra))


def pip_command(*arguments: str) -> str:
    """Return the command that runs pip for this very Python; `arguments` are quoted where they have to be."""
    return " ".join([shlex.quote(sys.executable or "python3"), "-m pip", *arguments])


def _origin(extra: str) -> list[str]:
    """Return what pip is to install, quoted."""
    try:
        package = importlib.metadata.distribution("litestereo")
        version = package.version
        noted   = json.loads(package.read_text("direct_url.json") or "{}")
    except (importlib.metadata.PackageNotFoundError, ValueError):
        version, noted = "VERSION", {}
    url  = urllib.parse.urlsplit(noted.get("url", ""))
    path = Path(urllib.request.url2pathname(url.path))
    if url.scheme != "file" or not path.exists():
        return [shlex.quote(f"litestereo-{version}-py3-none-any.whl[{extra}]")]
    editable = noted.get("dir_info", {}).get("editable")
    return [*(["--editable"] if editable else []), shlex.quote(f"{path}[{extra}]")]
