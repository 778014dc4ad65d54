#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Figures of other systems, from their publications; rates of evaluations are computed from the rest."""

from __future__ import annotations

from dataclasses import dataclass

@dataclass(frozen=True)
class Peer:
    """A published system."""
    name:        str
    method:      str
    width:       int
    height:      int
    disparities: int
    frames:      float # Per second.
    device:      str

    @property
    def evaluations(self) -> float:
        """Return the disparities evaluated per second."""
        return self.width*self.height*self.disparities*self.frames

PEERS = (
    Peer("Citron 2014, 9x9",          "SAD",                   640,  480,  16,  15.73, "Spartan-6 LX45"),
    Peer("Citron 2014, 7x7",          "SAD",                   640,  480,  16,  29.32, "Spartan-6 LX45"),
    Peer("Wang et al. 2015",          "AD-census, SGM",        1024, 768,  96,  67,    "Stratix IV"),
    Peer("Vitis StereoBM, 9x9",       "XSobel, SAD",           1920, 1080, 32,  18.1,  "Zynq UltraScale+ ZU9EG"),
    Peer("Vitis StereoBM, 15x15",     "XSobel, SAD",           1920, 1080, 128, 36.2,  "Zynq UltraScale+ ZU9EG"),
    Peer("Grabowski, Kryjak",         "SGM",                   3840, 2160, 64,  30,    "Virtex-7"),
    Peer("Luxonis OAK-D",             "census",                640,  400,  96,  110,   "Myriad X (ASIC)"),
    Peer("OpenMV, Arduino Portenta",  "SAD",                   450,  375,  48,  0.67,  "STM32H7 (CPU)"),
)
