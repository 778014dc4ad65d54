"""Location of the firmware's C sources, so that an installed package can build them.

The folder holds C only; this file makes it part of the wheel.
"""

from pathlib import Path

FIRMWARE_DIR = Path(__file__).resolve().parent
