#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Tools of all builds: content keys, locks, logged tools, LiteX's builder. It imports nothing else of this project."""
