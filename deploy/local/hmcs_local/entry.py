"""Where the `hmcs` command begins: nothing is imported before an interrupt is taken well."""

import sys

INTERRUPTED = 130


def main() -> None:
    """Run the command; Ctrl-C while it is still being loaded ends it without a word."""
    try:
        from hmcs_local.command import main as run

        run()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
