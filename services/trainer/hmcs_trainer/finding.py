"""States found in demonstrations, whatever labels they have: found, reported, written down."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.discovery.unlabeled import UnlabeledSettings, discover, labeled
from hmcs.recordings.csv_labels import write_csv_labels
from hmcs.recordings.demonstrations import stretches_of
from hmcs.recordings.generated_marker import is_unchanged_generated, with_generated_marker
from hmcs.recordings.labels import How, how_labeled, labels_beside, labels_of, write_labels
from hmcs.task import Task
from hmcs.whole_files import written_whole
from hmcs_trainer.references import Source, is_drawing

LEAST_STEPS = 3
"""A motion that reaches less far than so many steps is a slip of the hand."""


class Found(NamedTuple):
    """What was found."""

    task: Task
    """The template with gestemes g1, g2, … and states s1, s2, …."""
    sources: tuple[Source, ...]
    """With their demonstrations labeled by it."""
    findings: tuple[str, ...]
    """What was found and what should be known of it, a sentence each."""

    @property
    def demonstrations(self) -> list[Demonstration]:
        """All of them, in order."""
        return [each for source in self.sources for each in source.demonstrations]


def found_states(template: Task, sources: Sequence[Source], name: str) -> Found:
    """Return the task of this name whose states are found in the motion; labels do not count.

    Raises LearningError where nothing can be found in a demonstration, naming it.
    """
    kept = [_without_slips(source, template.dead_zone_m) for source in sources]
    given = [each for source, _ in kept for each in source.demonstrations]
    discovery = discover(given, UnlabeledSettings(least_step_m=template.dead_zone_m))
    task, demonstrations = labeled(discovery, given, template.model_copy(update={"name": name}))
    coming = iter(demonstrations)
    labeled_sources = tuple(
        source._replace(demonstrations=tuple(islice(coming, len(source.demonstrations))))
        for source, _ in kept
    )
    findings = (
        f"{_several(len(task.states), 'state')} of {_several(len(task.gestemes), 'gesteme')} found "
        f"in {_several(len(given), 'demonstration')}",
        *map(_told, demonstrations),
        *(slip for _, slips in kept for slip in slips),
        *discovery.notes,
        *_lost(template),
    )
    return Found(task, labeled_sources, findings)


def check_places(sources: Sequence[Source], task_file: Path) -> None:
    """Raise UserError where what is found would take the place of what somebody wrote."""
    for source in sources:
        if not source.labels_beside:
            continue
        beside = labels_beside(Path(source.reference))
        if beside.exists() and not is_unchanged_generated(beside):
            raise UserError(
                f"{beside}: has labels that somebody set, and --find-states would write its own in "
                "their place: move that file away, or train without --find-states"
            )
    if task_file.exists() and not is_unchanged_generated(task_file):
        raise UserError(
            f"{task_file}: is there already, and --find-states would write the task it finds in "
            "its place: name another --output, or move that file away"
        )


def write_found(found: Found, task_file: Path) -> Iterator[str]:
    """Write the task, and labels beside each file; yield what was written, and where not.

    To be called after `check_places`.
    """
    _write_task(found.task, task_file)
    yield f"the task that was found: {task_file}"
    for source in found.sources:
        content, beside = source.recording, labels_beside(Path(source.reference))
        if is_drawing(source.reference):
            yield f"{source.reference}: is a drawing: labels are not written beside it"
            continue
        if not source.labels_beside:
            yield (
                f"{source.reference}: is a recording of another program: labels are not written "
                "beside it; make CSV files of it by `hmcs import`, and train from those"
            )
            continue
        if content is None:
            stretches = stretches_of(source.demonstrations, 0)
            write_csv_labels(beside, stretches, Path(source.reference), found=True)
            yield (
                f"{_several(len(stretches), 'label')} written to {beside}: they count instead of "
                "what its column state says, until you remove it"
            )
            continue
        said: How = how_labeled(content)
        stretches = stretches_of(source.demonstrations, content.first_ns)
        covered = said == "said meanwhile" and labels_of(content)
        write_labels(content, stretches, found=True)
        yield f"{_several(len(stretches), 'label')} written to {beside}" + (
            ": they count instead of those said meanwhile, until you remove it" if covered else ""
        )


def _without_slips(source: Source, dead_zone_m: float) -> tuple[Source, list[str]]:
    """The source without motions that lead nowhere, and the remarks about them."""
    far = [
        each
        for each in source.demonstrations
        if float(np.linalg.norm(np.ptp(each.positions, axis=0))) >= LEAST_STEPS * dead_zone_m
    ]
    if not far:
        return source, []
    kept = set(map(id, far))
    slips = [
        f"{each.name}: moves hardly at all from {each.time_s[0]:.1f} s to {each.time_s[-1]:.1f} s: "
        "left out"
        for each in source.demonstrations
        if id(each) not in kept
    ]
    return source._replace(demonstrations=tuple(far)), slips


def _told(demonstration: Demonstration) -> str:
    parts = (
        f"{state} {demonstration.time_s[samples.start]:.1f}–"
        f"{demonstration.time_s[samples.stop - 1]:.1f} s"
        for state, samples in demonstration.stretches
    )
    return f"{demonstration.name}: {', '.join(parts)}"


def _lost(template: Task) -> list[str]:
    """What the states of the template had and those that were found have not."""
    own = [state.name for state in template.states if state.fixture is not None]
    if not own:
        return []
    return [
        f"the fixtures of {', '.join(own)} in {template.name!r} are of states nobody looked for: "
        "write them to those that were found, where they are meant"
    ]


def _several(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _write_task(task: Task, file: Path) -> None:
    data = task.model_dump(mode="json", exclude_defaults=True)
    data = {"format": task.format, "name": task.name} | data
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=100)
    with written_whole(file) as unfinished:
        unfinished.write_text(with_generated_marker(text), encoding="utf-8", newline="\n")
