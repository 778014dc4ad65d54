"""Stream cores of the matcher, and the DMA shell and peripheral around them."""
