#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Counterparts of the tables and figures of the thesis that this project builds on, measured."""
