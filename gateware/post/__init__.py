#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What follows an engine: selection of the winner, left-right check, median and border."""
