"""``python -m corexy_fmi`` is the command ``corexy``."""

from corexy_fmi.cli import main

main()
