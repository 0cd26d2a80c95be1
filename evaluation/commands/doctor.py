"""`airground doctor`: what this machine can do."""

from __future__ import annotations

from dataclasses import dataclass

from evaluation.commands.words import Verb


@dataclass(frozen=True, kw_only=True)
class Doctor(Verb):
    """Look whether this machine can render and compute, and say what is missing.

    Exits with 1 if something is missing without which nothing works.
    """

    def main(self) -> int:
        from evaluation.setup.doctor import Health, examine, show

        findings = examine()
        show(findings)
        return int(any(finding.health == Health.BROKEN for finding in findings))
