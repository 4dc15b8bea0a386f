"""The models and oracles of `support.hmms`, as fixtures of these tests."""

from support.hmms import every_path, random_chain, random_emission, random_model

__all__ = ["every_path", "random_chain", "random_emission", "random_model"]
