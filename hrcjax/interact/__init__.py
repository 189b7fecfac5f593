"""Functions of an arm beside people, as compositions of the motion policy's leaves: keep away, follow, hand over, give way and resume."""

from hrcjax.interact.composition import InteractPolicyParams, interactive_policy
from hrcjax.interact.contact_limit import CONTACT_OR_SEPARATION, MonitorParams
from hrcjax.interact.follow import Following, FollowParams, beside_hand, follow, not_following
from hrcjax.interact.give_way import GiveWayParams, GivingWay, gently, give_way, in_refuge, task_at
from hrcjax.interact.hand_over import (
    HandingOver,
    HandOverParams,
    hand_over,
    not_handing_over,
    turn_between,
    turned_frame,
)
from hrcjax.interact.keep_away import KeepAwayParams, KeepingAway, keep_away, kept_from, not_keeping_away
from hrcjax.interact.keep_distance import KeepDistanceParams, keep_distance
from hrcjax.interact.nearing import (
    Nearing,
    NearingParams,
    carried_on,
    nearest_to_way,
    nobody_near,
    watch_nearing,
)
from hrcjax.interact.pose import frame_of, goal_at, pointing
from hrcjax.interact.reference import Reference, ReferenceParams, Share, Tool, at_rest, led_to, no_share, shifted
from hrcjax.interact.seen import Hand, HandParams, Seen, find_hand
from hrcjax.interact.track import HandTrack, TrackParams, hand_now, no_hand, still_for, watch_hand

__all__ = [
    "CONTACT_OR_SEPARATION", "FollowParams", "Following", "GiveWayParams", "GivingWay", "Hand", "HandOverParams", "HandParams",
    "HandTrack", "HandingOver", "InteractPolicyParams", "KeepAwayParams", "KeepDistanceParams", "KeepingAway", "MonitorParams", "Nearing",
    "NearingParams", "Reference", "ReferenceParams", "Seen", "Share", "Tool", "TrackParams", "at_rest", "beside_hand", "carried_on",
    "find_hand", "follow", "frame_of", "gently", "give_way", "goal_at", "hand_now", "hand_over", "in_refuge", "interactive_policy",
    "keep_away", "keep_distance", "kept_from", "led_to", "nearest_to_way", "no_hand", "no_share", "nobody_near", "not_following",
    "not_handing_over", "not_keeping_away", "pointing", "shifted", "still_for", "task_at", "turn_between", "turned_frame", "watch_hand",
    "watch_nearing",
]  # fmt: skip
