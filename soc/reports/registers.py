#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The register maps in `docs/`, generated from the peripherals: `python -m litestereo.soc.reports.registers`."""

import argparse
import re
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from migen.fhdl.tools import list_targets

from litex.soc.interconnect                  import wishbone
from litex.soc.interconnect.csr              import CSRField, CSRStatus, CSRStorage
from litex.soc.interconnect.csr_eventmanager import EventManager
from litex.soc.integration.doc               import ModuleDoc

from ...gateware.cameras.parameters            import CameraParameters
from ...gateware.common.features               import FEATURES, PERIPHERAL_FEATURES
from ...gateware.common.parameters             import MatcherParameters
from ...gateware.peripherals.cameras           import CameraPeripheral
from ...gateware.peripherals.frame_link        import FrameLink
from ...gateware.peripherals.stereo_peripheral import StereoPeripheral
from ..build.pages                             import Page
from ..build.paths                             import PACKAGE_DIR, content_key
from ..parts.add_frame_link                    import UDP_PORT

DOCS     = PACKAGE_DIR / "docs"
DOCUMENT = DOCS / "registers.md"
BEGIN    = "<!-- generated: begin -->"
END      = "<!-- generated: end -->"

BUS_BYTES = 4 # Width of LiteX's CSR bus by default: a longer register takes several words.

# LiteX describes each of an EventManager's registers by its last event.
EVENT_REGISTERS = {
    "status":  "Level of each event's trigger; always 0 for events that are pulses.",
    "pending": "Events that have happened. Write 1 to a bit to clear it.",
    "enable":  "Events that raise the interrupt while they are pending.",
}

# Peripheral ---------------------------------------------------------------------------------------

def default_peripheral() -> StereoPeripheral:
    """Return the peripheral with its default parameters and all features, on Wishbone ports of 128 bits."""
    return StereoPeripheral(*wishbone_ports(), MatcherParameters(features=(*FEATURES, *PERIPHERAL_FEATURES)),
        image_ports=(wishbone_ports()[1], wishbone_ports()[1]))

def default_frame_link() -> FrameLink:
    """Return the frame link with its default parameters, on the same ports."""
    return FrameLink(*wishbone_ports(), UDP_PORT)

def default_cameras() -> CameraPeripheral:
    """Return the cameras with their default parameters."""
    return CameraPeripheral(CameraParameters())

def wishbone_ports() -> list[wishbone.Interface]:
    """Return two ports: the first reads, the second writes."""
    return [wishbone.Interface(data_width=128, address_width=32, addressing="word") for _ in range(2)]

#: The peripheral of each document.
PERIPHERALS = {
    DOCUMENT:                         default_peripheral,
    DOCS / "frame_link_registers.md": default_frame_link,
    DOCS / "camera_registers.md":     default_cameras,
}

def map_key(peripheral: Callable) -> str:
    """Return the content key of a peripheral's register map."""
    return content_key(register_map(peripheral()))

PAGES = [Page(f"docs/{path.name}", "registers", partial(map_key, peripheral))
    for path, peripheral in PERIPHERALS.items()]

def event_descriptions(module) -> dict[int, str]:
    """Return the description of each register of the module's EventManagers, by the register's duid."""
    managers = [value for value in vars(module).values() if isinstance(value, EventManager)]
    return {getattr(manager, name).duid: text for manager in managers for name, text in EVENT_REGISTERS.items()}

def fields_of(csr) -> list[CSRField]:
    """Return the fields of a register, from bit 0 up."""
    return csr.fields.fields if hasattr(csr, "fields") else []

# Cells --------------------------------------------------------------------------------------------

def one_line(text: str | None) -> str:
    """Return a description as a cell of a table."""
    return " ".join((text or "").split()).replace("|", "\\|")

def access(csr) -> str:
    """Return how software may access a register."""
    return "r" if isinstance(csr, CSRStatus) and csr.read_only else "rw"

def field_access(csr, field: CSRField) -> str:
    """Return how software may access a field."""
    return "w, pulse" if field.pulse else access(csr)

def reset_value(csr, driven: set) -> str:
    """Return the value after reset, where it is fixed: in what software writes, and in what nothing drives."""
    if isinstance(csr, CSRStorage):
        value = csr.storage.reset.value
    elif isinstance(csr, CSRStatus) and not driven & {csr.status, *fields_of(csr)}:
        value = csr.status.reset.value
    else:
        return "-"
    return f"{value}" if value < 10 else f"{value} ({value:#x})"

def bits(field: CSRField) -> str:
    """Return the position of a field in its register."""
    return f"{field.offset}" if field.size == 1 else f"{field.offset + field.size - 1}:{field.offset}"

def field_description(field: CSRField) -> str:
    """Return the description of a field and of its values."""
    values = [f"{value}: {one_line(names[-1])}" for value, *names in field.values or []]
    return " ".join([one_line(field.description), *values])

# Document -----------------------------------------------------------------------------------------

def register_map(peripheral) -> Iterator[str]:
    """Yield the lines of the peripheral's documentation in Markdown."""
    csrs         = peripheral.get_csrs(sort=True)
    fragment     = peripheral.get_fragment()
    driven       = list_targets([fragment.comb, *fragment.sync.values()])
    descriptions = event_descriptions(peripheral)

    for section in vars(peripheral).values():
        if isinstance(section, ModuleDoc):
            yield from ["## Use", *textwrap.dedent(section.body()).rstrip().splitlines(), ""]

    yield from ["## Registers", "",
        "| offset | name | bits | access | reset | description |",
        "|---|---|---|---|---|---|"]
    offset = 0
    for csr in csrs:
        name        = f"[`{csr.name}`](#{csr.name})" if fields_of(csr) else f"`{csr.name}`"
        description = descriptions.get(csr.duid) or getattr(csr, "description", None)
        description = description or ("See its fields." if fields_of(csr) else "")
        cells       = [f"`{offset:#04x}`", name, csr.size, access(csr), reset_value(csr, driven), one_line(description)]
        yield f"| {' | '.join(map(str, cells))} |"
        offset += -(-csr.size//(8*BUS_BYTES))*BUS_BYTES

    yield from ["", "## Fields"]
    for csr in csrs:
        if fields_of(csr):
            yield from ["", f"### {csr.name}", "", "| bits | name | access | description |", "|---|---|---|---|"]
        for field in fields_of(csr):
            yield f"| {bits(field)} | `{field.name}` | {field_access(csr, field)} | {field_description(field)} |"

def generate(text: str, peripheral) -> str:
    """Return the document with new text between its markers; raise ValueError if it has no markers."""
    pattern = re.compile(f"({re.escape(BEGIN)}\n).*(^{re.escape(END)})", re.MULTILINE | re.DOTALL)
    if not pattern.search(text):
        raise ValueError(f"there are no lines {BEGIN} and {END}")
    lines     = list(register_map(peripheral))
    generated = "\n".join(lines)
    page      = Page("", "registers", lambda: content_key(lines))
    return page.stamped(pattern.sub(lambda found: f"{found[1]}\n{generated}\n\n{found[2]}", text))

# Command ------------------------------------------------------------------------------------------

def main(arguments: Sequence[str] | None = None, peripherals: Mapping[Path, Callable] = PERIPHERALS) -> int:
    """Write the documents, or with `--check` say whether they are up to date; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m litestereo.soc.reports.registers",
        description="Write the register maps in docs/.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit status 1 if a file is stale")
    options = parser.parse_args(arguments)
    return max(update(document, peripheral, options.check) for document, peripheral in peripherals.items())

def update(document: Path, peripheral: Callable, check: bool) -> int:
    """Write one document, or say whether it is up to date; return the exit status."""
    try:
        text = document.read_text()
        new  = generate(text, peripheral())
    except (OSError, ValueError) as error:
        print(f"registers: {document}: {getattr(error, 'strerror', None) or error}", file=sys.stderr)
        return 1
    if new != text and check:
        print(f"registers: {document} is stale: run python -m litestereo.soc.reports.registers", file=sys.stderr)
        return 1
    if new != text:
        document.write_text(new)
    return 0

if __name__ == "__main__":
    sys.exit(main())
