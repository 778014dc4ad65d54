#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The tables and figures of the thesis that this project follows up, each with its counterpart, measured."""
