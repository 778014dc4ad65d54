#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Mutants that behave as the core does, and why: core, source, what stands in its place."""

EQUIVALENT: dict[tuple[str, str, str], str] = {}
