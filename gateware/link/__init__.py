#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The frame link: messages between an Ethernet wire and memory."""
