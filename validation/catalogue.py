"""Validation cases in the order of the page."""

from validation.array.case import CASE as ARRAY
from validation.bearing.case import CASE as BEARING
from validation.belt.case import CASE as BELT
from validation.bending.case import CASE as BENDING
from validation.bent_array.case import CASE as BENT_ARRAY
from validation.bouncing.case import CASE as BOUNCING
from validation.case import Case
from validation.controlled_four_bar.case import CASE as CONTROLLED_FOUR_BAR
from validation.cradle.case import CASE as CRADLE
from validation.flexible_slider_crank.case import CASE as FLEXIBLE_SLIDER_CRANK
from validation.four_bar.case import CASE as FOUR_BAR
from validation.guide.case import CASE as GUIDE
from validation.hard_contact.case import CASE as HARD_CONTACT
from validation.hard_limit.case import CASE as HARD_LIMIT
from validation.mixed_contact.case import CASE as MIXED_CONTACT
from validation.n_four_bar.case import CASE as N_FOUR_BAR
from validation.pendulum.case import CASE as PENDULUM
from validation.records.case import CASE as RECORDS
from validation.slider_crank.case import CASE as SLIDER_CRANK
from validation.sliding.case import CASE as SLIDING
from validation.spring_pendulum.case import CASE as SPRING_PENDULUM
from validation.squeezer.case import CASE as SQUEEZER

__all__ = ["CASES"]

CASES: tuple[Case, ...] = (
    PENDULUM,
    N_FOUR_BAR,
    SQUEEZER,
    SLIDER_CRANK,
    GUIDE,
    HARD_CONTACT,
    HARD_LIMIT,
    MIXED_CONTACT,
    FOUR_BAR,
    CONTROLLED_FOUR_BAR,
    RECORDS,
    ARRAY,
    SPRING_PENDULUM,
    CRADLE,
    BOUNCING,
    BELT,
    SLIDING,
    BEARING,
    BENDING,
    BENT_ARRAY,
    FLEXIBLE_SLIDER_CRANK,
)
