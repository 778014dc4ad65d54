#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The link protocol: messages, payloads, refusals, and their framing on a serial line."""
