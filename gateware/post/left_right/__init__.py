#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Left-right check: each winner votes for a pixel of the right image."""
