#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

from unittest import mock

from migen import *

from litex.gen import *

from litex.soc.integration.soc import SoCRegion
from litex.soc.interconnect    import csr_bus, wishbone

# Bridge -------------------------------------------------------------------------------------------

class CSRBridge(LiteXModule):
    """From Wishbone to the CSR bus, with a register before and after the banks; see `BankRegister`.

    As LiteX's Wishbone2CSR, but it waits for the banks' registers: an access takes five clocks. A reset withdraws an
    access, as it does the CPU's request.
    """
    def __init__(self, address_width, csr):
        self.wishbone = bus = wishbone.Interface(address_width=address_width, data_width=csr.data_width,
            addressing="word")
        self.csr      = csr

        # # #

        self.fsm = fsm = FSM(reset_state="IDLE")
        fsm.act("IDLE",
            If(bus.cyc & bus.stb,
                NextValue(csr.adr, bus.adr),
                # The data remain: the banks do not register them.
                NextValue(csr.dat_w, bus.dat_w),
                NextValue(csr.re, ~bus.we & (bus.sel != 0)),
                NextValue(csr.we, bus.we & (bus.sel != 0)),
                NextState("ADDRESS")
            )
        )
        fsm.act("ADDRESS",
            NextValue(csr.adr, 0),
            NextValue(csr.re, 0),
            NextValue(csr.we, 0),
            NextState("BANK")
        )
        fsm.act("BANK",
            NextState("DATA")
        )
        fsm.act("DATA",
            NextValue(bus.dat_r, csr.dat_r),
            NextState("ACK")
        )
        fsm.act("ACK",
            bus.ack.eq(1),
            NextState("IDLE")
        )

# Banks --------------------------------------------------------------------------------------------

class BankRegister(LiteXModule):
    """A register between the CSR bus and a bank, so that it lies next to the bank.

    Without it, a register in the middle of the FPGA is decoded by banks at its edges, in one clock. A bank sees its own
    addresses alone, otherwise one of another bank: the synthesis would find that all banks' registers are the same, and
    keep one. A reset withdraws the access.

    Parameters
    ----------
    bank : csr_bus.Interface
        Bus of the bank.
    number : int
        Number of the bank: the address without its lower `page_bits` bits.
    """
    def __init__(self, bank, number, page_bits):
        self.bus = bus = csr_bus.Interface(bank.data_width, bank.address_width, bank.alignment)

        # # #

        selected = Signal()
        self.comb += [
            selected.eq(bus.adr[page_bits:] == number),
            bank.dat_w.eq(bus.dat_w),
            bus.dat_r.eq(bank.dat_r),
        ]
        self.sync += [
            bank.adr.eq(Mux(selected, bus.adr, int(number == 0) << page_bits)),
            bank.re.eq(bus.re & selected),
            bank.we.eq(bus.we & selected),
        ]

class RegisteredBanks(csr_bus.CSRBankArray):
    """As LiteX's array of banks, with a `BankRegister` in front of each."""

    def get_buses(self):
        """Return the buses of all banks."""
        numbers   = [number for *_, number, _ in [*self.banks, *self.srams]]
        page_bits = log2_int(self.paging//4)
        registers = [BankRegister(bus, number, page_bits) for bus, number in zip(super().get_buses(), numbers)]
        self.submodules += registers
        return [register.bus for register in registers]

# CSR Registers Mixin ------------------------------------------------------------------------------

class CSRRegistersMixin:
    """Gives a LiteX SoC with Wishbone registers on its CSR bus, for a clock of more than 60 MHz on a large ECP5:
    `class MySoC(CSRRegistersMixin, SoCCore)`, with `csr_registers` set before the SoC is finalized."""

    csr_registers = False # Whether the CSR bus has registers.

    def add_csr_bridge(self, name="csr", origin=None, register=False):
        """Add the bridge that waits for the banks' registers, or LiteX's."""
        if not self.csr_registers:
            super().add_csr_bridge(name, origin, register)
            return
        bridge = CSRBridge(self.bus.address_width, csr_bus.Interface(
            data_width    = self.csr.data_width,
            address_width = self.csr.address_width,
        ))
        self.add_module(name=f"{name}_bridge", module=bridge)
        self.bus.add_slave(name=name, slave=bridge.wishbone, region=SoCRegion(
            origin = origin,
            size   = 2**(self.csr.address_width + 2),
            cached = False,
            decode = self.cpu.csr_decode,
        ))
        self.csr.add_master(name=name, master=bridge.csr)
        self.add_config("CSR_DATA_WIDTH", self.csr.data_width)
        self.add_config("CSR_ALIGNMENT",  self.csr.alignment)

    def finalize(self):
        """Finalize the SoC; LiteX has no parameter for the class of the banks' array."""
        banks = RegisteredBanks if self.csr_registers else csr_bus.CSRBankArray
        with mock.patch.object(csr_bus, "CSRBankArray", banks):
            super().finalize()
