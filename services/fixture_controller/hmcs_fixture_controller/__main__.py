"""Run the service: `python -m hmcs_fixture_controller`."""

from hmcs.bus.service import run
from hmcs_fixture_controller.service import FixtureController

raise SystemExit(run(FixtureController))
