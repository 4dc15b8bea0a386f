"""For every test: no machine is too busy, and interrupts reach what it starts."""

from __future__ import annotations

import signal

from hypothesis import settings

# The same examples in every run: a run tells of the change alone. `--hypothesis-profile=others`
# looks at others, and at more of them where a test leaves their number open.
settings.register_profile("any-machine", deadline=None, derandomize=True)
settings.register_profile("others", deadline=None, max_examples=1000)
settings.load_profile("any-machine")

# A shell has what runs in its background ignore interrupts, and so would all that tests start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
