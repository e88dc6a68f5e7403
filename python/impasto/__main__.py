"""``python -m impasto`` is the program ``impasto``."""

import sys

from ._command import main

sys.exit(main())
