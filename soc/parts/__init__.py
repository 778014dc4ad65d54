#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Parts of a SoC: methods that add the matcher and the frame link, `StereoSoC`, and modules that LiteX lacks."""
