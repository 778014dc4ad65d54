#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""DMA: memory ports, and the readers and writers of streams."""
