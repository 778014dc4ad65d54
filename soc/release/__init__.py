#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What a release needs: a list of components, and the proof that builds are reproducible."""
