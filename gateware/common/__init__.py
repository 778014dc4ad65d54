#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""Vocabulary of all cores: parameters, layouts of their endpoints, and what pipelines are wired with."""

from .layouts import *
from .parameters import *
from .pipeline import *
