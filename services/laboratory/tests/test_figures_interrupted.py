"""Ctrl-C while figures are made: exit code 130, and no file that is only half there."""

import os
import signal
import subprocess
import sys
import time


def test_ctrl_c_leaves_whole_files_only(tmp_path):
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "hmcs_laboratory", "figures", "--output", str(tmp_path)),
            # One that is made soon, and one that takes long.
            *("--only", "2.5,2.7", "--workers", "2"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        limit_s = time.monotonic() + 120
        while not (tmp_path / "figure_2_05.svg").exists():
            assert process.poll() is None
            assert time.monotonic() < limit_s
            time.sleep(0.05)
        # To all of them, as a terminal does it.
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert out == ""
    assert "Traceback" not in err
    assert err.splitlines()[-1] == "figures: interrupted"
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"figure_2_05.png", "figure_2_05.svg"}
    assert (tmp_path / "figure_2_05.png").read_bytes().endswith(b"IEND\xaeB`\x82")
