#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What the bitstream, the firmware and the host tools are made of, and under which licences."""
