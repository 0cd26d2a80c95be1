"""Words that are right for persons only name no program and no data."""

from __future__ import annotations

import re
import subprocess

from tests.sources import ROOT

FOR_PERSONS = re.compile(
    r"(?<![a-z])(nobody|somebody|anybody|everybody|told|lived|wanting)(?![a-z])", re.IGNORECASE
)
NOT_READ = {"CHANGELOG.md", "docs/diary.md", "tests/test_wording.py"}
"""History, and the list of the words."""
KINDS = (".py", ".md", ".toml", ".j2", ".css", ".js", ".yml", ".yaml", ".txt", ".cff")


def test_words_for_persons_name_no_program() -> None:
    found = [
        f"{file}:{number}: {line.strip()}"
        for file in written()
        for number, line in enumerate((ROOT / file).read_text(encoding="utf-8").splitlines(), 1)
        if FOR_PERSONS.search(line)
    ]
    assert found == []


def written() -> list[str]:
    """Files of code and prose, and scripts, that git does not ignore."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return [
        file
        for file in listed.stdout.splitlines()
        if (file.endswith(KINDS) or file.startswith(("scripts/", ".ci/")) or file == "Makefile")
        and file not in NOT_READ
        and (ROOT / file).is_file()
    ]
