"""``python -m corexy_fmi`` is the command ``corexy``."""

from corexy_fmi.entry import main

main()
