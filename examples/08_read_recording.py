"""What is in a recording of a cell: its messages, and the motion as demonstrations to learn from.

python examples/08_read_recording.py RECORDING.mcap
"""

import sys
from collections import Counter

from hmcs import demonstrations_of, read_recording

content = read_recording(sys.argv[1])
print(f"{content.duration_s:.1f} s, {'whole' if content.whole else content.damage}")
for schema, count in Counter(message.schema for message in content.messages).most_common():
    print(f"{count:6} {schema}")

for number, demonstration in enumerate(demonstrations_of(content)):
    states = list(dict.fromkeys(state for state in demonstration.states if state is not None))
    length_s = demonstration.time_s[-1] - demonstration.time_s[0]
    print(f"demonstration {number}: {length_s:.1f} s, {', '.join(states) or 'no labels'}")
