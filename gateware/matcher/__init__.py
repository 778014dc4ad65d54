#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The matcher: a stream of pixel pairs in, a disparity map out. Its front makes positioned pairs for an engine."""
