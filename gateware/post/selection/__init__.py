#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Selection: the winner of all lanes, its tests and its fraction of a pixel."""
