#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What `AbsoluteDifference` hands to `ColumnSum`."""

from ..costs import position_layout

# Difference Pair ----------------------------------------------------------------------------------

def difference_pair_layout(parameters):
    """Return per lane the absolute difference that enters the sums and the one that leaves them, and the position.

    Each is a number with a carry: see `with_carry`.
    """
    bits = parameters.lanes*(parameters.filtered_bits + 1)
    return [("enter", bits), ("leave", bits)] + position_layout(parameters)
