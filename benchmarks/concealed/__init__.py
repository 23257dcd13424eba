"""The concealed-effect proof: an independent plant, sealed cases, and their scoring."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # the plant is a package of its own
