"""The page of the report, without its figures; it needs nothing from elsewhere."""

from __future__ import annotations

from string import Template

PAGE = Template(
    """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>HMCS demo</title>
<style>
  body { font: 16px/1.55 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #222;
         max-width: 62rem; margin: 0 auto; padding: 1.5rem 1.2rem 4rem; background: #fff; }
  h1 { font-size: 1.7rem; line-height: 1.2; margin: 1rem 0 .4rem; }
  h2 { font-size: 1.2rem; margin: 2.6rem 0 .6rem; }
  p, dd, li { max-width: 46rem; }
  .verdict { font-size: 1.15rem; }
  figure { margin: 1.4rem 0 2rem; }
  img { width: 100%; height: auto; }
  figcaption { color: #444; font-size: .95rem; max-width: 46rem; }
  table { border-collapse: collapse; }
  th, td { text-align: left; padding: .32rem 1.4rem .32rem 0; border-bottom: 1px solid #e3e3e3; }
  th { border-bottom: 2px solid #888; }
  td:nth-child(2) { font-variant-numeric: tabular-nums; }
  .yes { color: #006b4f; } .no { color: #b3200d; font-weight: 600; }
  .warning { border-left: 4px solid #b3200d; padding: .3rem 0 .3rem 1rem; }
  dt { margin-top: .7rem; } dd { margin-left: 1.6rem; color: #333; }
  code { font-size: .92em; }
  .small { color: #555; font-size: .9rem; }
</style>
</head>
<body>
<h1>An operator's hand, recognized while it moves</h1>
<p class="verdict">$verdict</p>
$stopped
<figure>
  <img src="hand_and_robot.png" alt="Paths of hand and robot, colored by the recognized state">
  <figcaption>Left, the operator's hand; right, the robot's tool; both seen from behind the robot.
  The color is the state that was recognized while the stroke was made, so a stroke that changes its
  color anywhere but at a circle was misread there. Circles mark where the operator truly goes on to
  the next shape. Each shape is written twice: the second time is the thin line. The robot does not
  copy the hand: motion across the recognized path is damped, so the two drift apart, and each shape
  begins where the robot is then.</figcaption>
</figure>

<h2>What happened</h2>
<ol>
  <li>A model learned five shapes ($shapes) from five human drawings of each.</li>
  <li>A router, an input device, two gesteme classifiers, a task HMM, a fixture controller and a
  simulated robot came up as processes of their own.</li>
  <li>Drawings $held_out of each shape, which the model had never seen, were played as the
  operator's hand at 100 Hz, one after another, for $motion_s s. Every $dead_zone_mm mm of movement
  is a step: $steps in all.</li>
  <li>After $killed_at_s s <code>$killed</code> was killed with SIGKILL. The other classifier went
  on alone; a fresh one, <code>$newcomer</code>, fetched the last steps, replayed them and was ready
  $ready_after_s s later.</li>
</ol>

<figure>
  <img src="belief.png" alt="State probabilities and fixturing factor over time">
  <figcaption>Top, the truth. Middle, the probability of each state after every step, stacked:
  one plain color is certainty, grey is motion that is no part of the task. Bottom, the
  fixturing factor k = max(½, p·$xi) of the most probable state: at ½ the robot moves freely, above
  it motion across the recognized path is damped. It lets go while the next shape is still
  uncertain, for a moment wherever the path it follows changes, and where the motion is less likely
  than it ever was in the demonstrations.</figcaption>
</figure>

<figure>
  <img src="latency.png" alt="Latency of each hop, and from step to belief around the swap">
  <figcaption>Left, how long each hop took, with the median and the 99th percentile marked. Hand →
  robot state holds the wait for the robot's control cycle and for its next state. Right, the time
  from each step to its belief around the swap, a dot a step; a cross would be a step
  without a belief.</figcaption>
</figure>

<figure>
  <img src="path_error.png" alt="Distance to the mean demonstration, segment by segment">
  <figcaption>How far hand and robot were from the mean of the five demonstrations, for each shape
  from where it truly begins. People write the same letter in different sizes: this is what
  the fixture has to work with, not an error of the hand.</figcaption>
</figure>

<h2>Figures</h2>
<table>
<thead><tr><th>Figure</th><th>Here</th><th>Goal</th><th></th></tr></thead>
<tbody>
$rows
</tbody>
</table>
<p class="small">Measured by one observer on the bus, a process of its own, on the same machine as
all the others: its clock is theirs. Other work on the machine shows in the latencies.</p>

<h2>How the figures are defined</h2>
<p>The true state of a step is the label of the sample midway between the two that began and
completed it. A switch is believed at the first step, from halfway through the shape before to the
end of the new one, at which the new state is the most probable; every other change of the most
probable state is a false switch. All of them are in <a href="summary.json">summary.json</a>:</p>
<dl>
$meanings
</dl>

<h2>Files</h2>
<ul>
  <li><a href="summary.json">summary.json</a>: the figures.</li>
  <li><a href="recording.npz">recording.npz</a>: everything the observer saw, as numpy arrays.</li>
  <li><a href="performance.csv">performance.csv</a>: what the hand did, with the true states.</li>
  <li><a href="human-shapes.hmcs">human-shapes.hmcs</a>: the model.</li>
  <li><a href="logs/">logs</a> of every process.</li>
</ul>
<p class="small">Seed $seed; $versions.</p>
</body>
</html>
"""
)
