"""All figures in full: `make bench`, about fifteen minutes on two cores."""

from __future__ import annotations

from bench import (
    accuracy,
    fixture_tick,
    hmm_speed,
    messages,
    page,
    recorder,
    replay,
    step_to_belief,
    stops,
    takeovers,
    two_hops,
    whole_stack,
)
from bench.figures import tell


def main() -> int:
    """Measure and tell all of them; return 1 where a goal was missed."""
    reached = [
        tell(str(messages.__doc__), messages.measure(5000)),
        tell(str(two_hops.__doc__), two_hops.measure(20.0)),
        tell(str(step_to_belief.__doc__), step_to_belief.measure(2000)),
        tell(str(whole_stack.__doc__), whole_stack.measure(20.0)),
        tell(str(accuracy.__doc__), accuracy.measure()),
        tell(str(hmm_speed.__doc__), hmm_speed.measure(20)),
        tell(str(fixture_tick.__doc__), fixture_tick.measure(2000)),
        tell(str(stops.__doc__), stops.measure(25)),
        tell(str(recorder.__doc__), recorder.measure(10.0)),
        tell(str(page.__doc__), page.measure(8.0)),
        tell(str(replay.__doc__), replay.measure(5)),
        tell(str(takeovers.__doc__), takeovers.measure(5)),
    ]
    return 0 if all(reached) else 1


if __name__ == "__main__":
    raise SystemExit(main())
