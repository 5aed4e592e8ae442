"""Published records of rigid contact, repeated by their own schemes over their first impacts; whole in validation/records."""

import math

import pytest
from validation.records.case import by_its_scheme, woodpecker_apart
from validation.records.numbers import SLIDER_CRANK, WOODPECKER


def test_the_record_of_the_slider_crank_is_repeated_to_round_off() -> None:
    """Published number with its source: Siconos, slider-crank with direct projection, 30 ms with three clusters of impacts."""
    kept = by_its_scheme("slider-crank", 300)
    for at, turned, speed in SLIDER_CRANK[:2]:
        assert kept[at, 0] / (2.0 * math.pi) == pytest.approx(turned, rel=1e-13)
        assert kept[at, 3] == pytest.approx(speed, rel=1e-12)


def test_the_record_of_the_woodpecker_is_repeated_to_round_off() -> None:
    """Published number with its source: Siconos, woodpecker, 10 ms of sliding along the pole."""
    kept = by_its_scheme("woodpecker", 500)
    at, *places = WOODPECKER[0]
    assert kept[at, :3] == pytest.approx(places, rel=1e-13)


def test_the_package_follows_the_scheme_of_the_woodpecker_in_the_limit_of_small_angles() -> None:
    """Second formulation: the record's scheme, over 30 ms of pecking, with its jamming and slipping sleeve."""
    height, sleeve, bird = woodpecker_apart(1500)
    assert height < 1e-6
    assert sleeve < 1e-4
    assert bird < 2e-5
