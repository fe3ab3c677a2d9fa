"""Our simulator's personalities meet the same checks that real autopilots do, in lock-step."""

from collections.abc import Iterator

import pytest

from tests.conformance import checks
from tests.conformance.field import Field, simulated_field
from tests.conformance.report import CHECKS, Check, run_check

checks.load()


@pytest.fixture(scope="module", params=["ardupilot", "px4"])
def field(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Field]:
    field = simulated_field((request.param, request.param), tmp_path_factory.mktemp("conformance"))
    field.discover()
    yield field
    field.close()


@pytest.mark.parametrize("entry", CHECKS, ids=[entry.name for entry in CHECKS])
def test_check(field: Field, entry: Check) -> None:
    for vehicle in field.ids[:1]:
        line = run_check(field, entry, vehicle)
        assert line.verdict != "FAIL", str(line)
