#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The link: requests and replies over a channel, and the transports below it."""
