"""The tutorial prints what it says it prints."""

import io
import re
from contextlib import redirect_stdout
from pathlib import Path

import hmcs_baselines.hmm

TUTORIAL = Path(hmcs_baselines.hmm.__file__).with_name("TUTORIAL.md")
BLOCK = re.compile(r"```python\n(.*?)```\n(?:\n```text\n(.*?)```\n)?", re.DOTALL)


def test_every_block_of_the_tutorial_prints_the_output_below_it():
    text = TUTORIAL.read_text()
    blocks = BLOCK.findall(text)
    assert len(blocks) == text.count("```python")
    assert sum(bool(expected) for _, expected in blocks) == text.count("```text")
    names = {}
    for number, (code, expected) in enumerate(blocks):
        printed = io.StringIO()
        with redirect_stdout(printed):
            exec(compile(code, f"{TUTORIAL.name}, block {number}", "exec"), names)
        assert printed.getvalue() == expected
