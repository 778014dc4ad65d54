#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What all host tools share: errors, settings, features, images, geometry."""
