"""The torture itself: each kind of case, a few of them, and that what fails is told."""

from __future__ import annotations

import pytest

import torture
from torture import FAMILIES, Family, Outcome, Tally, batch, table

COUNTS = {
    "profiles": 1,
    "override": 3,
    "readers": 1,
    "smoothing": 3,
    "tools": 8,
    "corners": 3,
    "chains": 25,
    "servo": 10,
    "kills": 1,
    "folders": 1,
}


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_a_sample_of_each_kind(family: Family, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torture, "INPUTS_A_CASE", 100)
    monkeypatch.setattr(torture, "PROFILES_A_CASE", 100)
    monkeypatch.setattr(torture, "KILLS_A_CASE", 5)
    tally = batch(family.case, 2_000_000, COUNTS[family.name])
    assert tally.done == COUNTS[family.name]
    assert not tally.failed


def sometimes(seed: int) -> Outcome:
    if seed == 4:
        raise ValueError("a planted fault")
    if seed == 5:
        pytest.fail("in the words of a test")
    return Outcome("ok" if seed < 3 else "refused", share=0.1 * seed)


def test_what_fails_is_told_with_its_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    tally = batch(sometimes, 1, 5)
    assert tally.done == 5
    assert tally.words == {"ok": 2, "refused": 1}
    assert tally.refused == {"refused": 1}
    assert [seed for seed, _ in tally.failed] == [4, 5]
    assert tally.failed[0][1].startswith("ValueError: a planted fault in sometimes:")
    assert tally.failed[1][1].startswith("Failed: in the words of a test in ")
    assert tally.share == pytest.approx(0.3)
    family = Family(sometimes, "some", 5, 1.0)
    text = table([(family, 5, tally)], 1, "abc").markdown()
    assert "| some  |       5 |    5 |                  1 |      2 |             0.3000000000 |" in text
    assert text.endswith("\n\nFailed of some: 4, 5.")
    monkeypatch.setattr(torture, "MOST_SECONDS", -1.0)
    assert "more than" in batch(sometimes, 1, 1).failed[0][1]


def test_kinds_that_did_not_run_keep_their_rows() -> None:
    first = [(family, 10, Tally(done=8, failed=[(k, "")], share=0.25)) for k, family in enumerate(FAMILIES[:3])]
    before = table(first, 100, "abc").markdown()
    after = table([(FAMILIES[1], 20, Tally(done=20))], 900, "def", before).markdown()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in after.splitlines() if line[:1] == "|"]
    assert [row[0] for row in rows[2:]] == [family.title for family in FAMILIES[:3]]
    assert rows[2][1:] == ["10,000", "8,000", "0", "1", "0.2500000000", "-", "0.0", "100", "abc"]
    assert rows[3][1:] == ["20", "20", "0", "0", "-", "-", "0.0", "900", "def"]
    failed = [line for line in after.splitlines() if line.startswith("Failed of")]
    assert failed == [f"Failed of {FAMILIES[0].title}: 0.", f"Failed of {FAMILIES[2].title}: 2."]
    assert table([], 0, "", after).markdown() == after


@pytest.mark.slow
def test_the_program_runs_and_says_how_it_went(capsys: pytest.CaptureFixture[str]) -> None:
    assert torture.main(["--only", "profiles", "--count", "2", "--workers", "1", "--seed", "7"]) == 0
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("| seven-phase"))
    assert [cell.strip() for cell in row.split("|")][1:4] == ["seven-phase profiles alone", "2,000", "2,000"]
