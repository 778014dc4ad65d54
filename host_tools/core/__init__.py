#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""What all host tools share: errors, settings, features, images, geometry."""

import os

#: Most pixels of an image that is read. OpenCV's own limit is 2**30, for which a damaged or made-up file of some bytes
#: can ask for gigabytes. OpenCV reads the variable when it is loaded, so it is set before.
MAX_PIXELS = 1 << 27
os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(MAX_PIXELS))
