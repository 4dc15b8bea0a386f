"""The service: steps in, one call into the gesteme models, evidence out."""

from __future__ import annotations

import logging
import time
from collections import deque

from hmcs.bus.messages import Evidence
from hmcs.bus.service import Service, UserError
from hmcs.bus.session import Bus
from hmcs.bus.step_feed import FedStep, StepFeed
from hmcs.layered_start import layered_model
from hmcs.recognition.segment_filter.recognizer import bank_of, segment_filter_model
from hmcs.translation import evidence_message, step_of
from hmcs_gesteme_classifier.settings import GestemeClassifierSettings
from hmcs_gesteme_classifier.shares import share_of

HANDOVER_NS = 500_000_000
"""How long a gesteme is held on after a peer has taken it over: what is gained is gained at once,
what is lost only when the other has surely found its pace. Duplicates cost the task nothing."""


class GestemeClassifier(Service):
    """Publishes evidence for the gestemes it holds, a pure function of the last steps."""

    name = "gesteme_classifier"
    Settings = GestemeClassifierSettings
    settings: GestemeClassifierSettings

    def __init__(self, settings: GestemeClassifierSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._model = layered_model(settings.model, settings.task, settings.model_key)
        self._named = _named(settings.gestemes, self._model.gesteme_names, settings.model)
        self._evidence = bus.publisher(
            Evidence, bus.keys.evidence(self._model.name, bus.source.instance)
        )
        self._peers_key = bus.keys.member(self._model.name, self.name)
        self._peers = {bus.source.instance}
        self._living = {bus.source.instance}
        """Peers whose tokens the watch has reported, and not yet that they went."""
        # One more than is scored: how the hand turns in a step follows from the step before it.
        memory_steps = segment_filter_model(self._model).scoring.window_steps + 1
        self._bank = bank_of(self._model, [])
        self._recent: deque[FedStep] = deque(maxlen=memory_steps)
        self._ready = False
        self._feed = StepFeed(
            bus,
            log,
            self._on_step,
            self._on_restart,
            memory_steps=memory_steps,
        )

    def start(self) -> None:
        """Take a share, replay the last steps, and only then be counted on by the others."""
        if self._named:
            self._hold(self._named)
            self._feed.begin()
        else:
            there = self.bus.present(self._peers_key).members
            self._peers.update(peer.instance for peer in there)
            self._hold(self._share())
            self._feed.begin()
            self.bus.announce(
                self.bus.keys.member(self._model.name, self.name, self.bus.source.instance)
            )
            self.bus.watch(self._peers_key, self._on_peer)
            self.bus.at(time.monotonic_ns() + HANDOVER_NS, self._keep_living_peers)
        self._ready = True

    def health(self) -> tuple[bool, str]:
        """Healthy always: a classifier that waits for steps does what it is for."""
        steps = self._recent[-1].step.index if self._recent else "none yet"
        return True, f"{len(self._bank.held)} gestemes of {self._model.name}, last step {steps}"

    def facts(self) -> dict[str, str]:
        """Return the model and the gestemes held."""
        names = self._model.gesteme_names
        return {
            "model": self._model.name,
            "model_hash": self._model.hash,
            "gestemes": ", ".join(names[g] for g in self._bank.held),
        }

    def _on_step(self, fed: FedStep) -> None:
        self._recent.append(fed)
        evidence = self._bank.step(step_of(fed.step))
        if self._ready:
            message = evidence_message(self._model, evidence, fed.clock, self.settings.precision)
            self._evidence.put(message, fed.origin)

    def _on_restart(self, index: int) -> None:
        self._recent.clear()
        self._bank = bank_of(self._model, self._bank.held)
        self.log.info("beginning anew", extra={"step": index})

    def _on_peer(self, token: str, alive: bool) -> None:
        peer = self.bus.keys.member_of(token)
        if peer.instance != self.bus.source.instance:
            for known in (self._peers, self._living):
                (known.add if alive else known.discard)(peer.instance)
            # First of all, so that nothing that goes wrong below keeps it from being done.
            self.bus.at(time.monotonic_ns() + HANDOVER_NS, self._let_go)
            self._hold(self._share() | frozenset(self._bank.held))

    def _keep_living_peers(self) -> None:
        """Forget peers that went after they were looked for and before they were watched."""
        self._peers &= self._living
        self._hold(self._share())

    def _let_go(self) -> None:
        self._hold(self._share())

    def _share(self) -> frozenset[int]:
        return share_of(
            self.bus.source.instance,
            self._peers,
            self._model.gesteme_names,
            self.settings.redundancy,
        )

    def _hold(self, wanted: frozenset[int]) -> None:
        """Hold `wanted`; only the gestemes gained are replayed."""
        held = frozenset(self._bank.held)
        if wanted == held:
            return
        fresh = bank_of(self._model, sorted(wanted - held))
        for fed in self._recent:
            fresh.step(step_of(fed.step))
        self._bank = self._bank.replaced(fresh, sorted(held & wanted))
        self.log.info("gestemes held", extra=self.facts() | {"peers": len(self._peers)})


def _named(wanted: tuple[str, ...], known: tuple[str, ...], model: object) -> frozenset[int]:
    strangers = [name for name in wanted if name not in known]
    if strangers:
        raise UserError(
            f"gestemes {', '.join(strangers)} are not in model {model}: it has {', '.join(known)}"
        )
    return frozenset(known.index(name) for name in wanted)
