#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Matchers side by side on pairs with known disparities, and the metrics of their maps."""
