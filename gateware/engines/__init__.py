#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Engines: positioned pixel pairs in, costs or winners out. An engine knows neither memory nor registers."""
