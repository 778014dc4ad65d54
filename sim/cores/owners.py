#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Which core each line of a model's Verilog comes from: the Verilog is one module, of all cores inside each other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from litex.gen.fhdl.namer import SignalNamespace
from migen import Memory, Module, Signal
from migen.fhdl.tools import list_targets

#: Packages whose modules are parts of the core that uses them: states, FIFOs, registers of a stream.
PARTS = ("migen", "litex")

#: Package of the cores.
CORES = "litestereo.gateware."


def owners(top: Module, namespace: SignalNamespace) -> dict[str, Any]:
    """Return whose the signals of emitted Verilog are.

    Parameters
    ----------
    top
        The module, after its conversion.
    namespace
        Names of the conversion.

    Returns
    -------
    dict
        For JSON. `cores` has class and module of each instance of a core. `targets` has, by its name in Verilog, the
        instance that drives a signal or has a memory; signals of other projects' cores and of the bench are not in it.
        `names` has the name that a signal has in its core, by its name in Verilog.
    """
    cores:   list[list[str]] = []
    targets: dict[str, int]  = {}
    for instance, statements, memories in _modules(top, None, cores):
        driven = [signal for statement in statements for signal in list_targets(statement)
                  if isinstance(signal, Signal)]
        for target in [*driven, *memories]:
            if isinstance(target, Memory) or target in namespace.name_dict or target.name_override is not None:
                # Parts come first: a reset that their core adds does not make them its own.
                targets.setdefault(namespace.get_name(target), -1 if instance is None else instance)
    names = {namespace.get_name(signal): signal.name_override or signal.backtrace[-1][0]
             for signal in list(namespace.name_dict) if isinstance(signal, Signal)}
    return {"cores": cores, "targets": {name: instance for name, instance in targets.items() if instance >= 0},
            "names": names}


def _modules(module: Module, owner: int | None, cores: list[list[str]],
             ) -> Iterator[tuple[int | None, list[Any], list[Memory]]]:
    """Yield, parts first, the owner of each module with its statements and memories without those of its parts."""
    package = type(module).__module__
    if package.startswith(CORES):
        owner = len(cores)
        cores.append([type(module).__name__, package])
    elif package.partition(".")[0] not in PARTS:
        owner = None
    inner: set[int] = set()
    for _, part in module._submodules:
        yield from _modules(part, owner, cores)
        inner |= {id(item) for item in _all(part)}
    own = [item for item in _all(module) if id(item) not in inner]
    yield owner, [item for item in own if not _is_special(item)], [item for item in own if isinstance(item, Memory)]


def _all(module: Module) -> list[Any]:
    fragment = module._fragment
    return [*fragment.comb, *(item for items in fragment.sync.values() for item in items), *fragment.specials]


def _is_special(item: Any) -> bool:
    return hasattr(item, "list_ios")
