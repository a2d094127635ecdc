from ._follow import (
    LaneRun as LaneRun,
    follow_in_lanes as follow_in_lanes,
    lanes_pay as lanes_pay,
    lanes_serve as lanes_serve,
)
