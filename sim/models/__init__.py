#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Reference models in NumPy. They import no other room of this project."""
