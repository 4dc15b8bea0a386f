"""`python -m hmcs_input_device`: the input device as a process."""

from hmcs.bus.service import run
from hmcs_input_device.service import InputDevice

raise SystemExit(run(InputDevice))
