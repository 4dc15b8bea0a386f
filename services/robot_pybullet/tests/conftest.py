from __future__ import annotations

import sys

# PyBullet has no wheels for later Pythons.
collect_ignore_glob = ["test_*.py"] if sys.version_info >= (3, 12) else []
