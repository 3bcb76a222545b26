"""Before printing: which layout, angle and dot size suit a projector and a viewer; area shares for one channel."""

from paxel_design.advice.effect import EffectSize, effect_size, simulated_model
from paxel_design.advice.ranking import Advice, Candidate, Setup, advise
from paxel_design.advice.shares import proposed_shares

__all__ = [
    "Advice",
    "Candidate",
    "EffectSize",
    "Setup",
    "advise",
    "effect_size",
    "proposed_shares",
    "simulated_model",
]
