"""The four studies of Zheng et al., repeated with this model.

Zheng, Xiong, Zheng, Wang, Tian, Xie, "Three-Dimensional Dynamic Modeling and Motion Analysis for
an Active-Tail-Actuated Robotic Fish with Barycentre Regulating Mechanism". Fish A swims straight
and turns, fish B glides and spirals. Every statement of the paper about a trend is checked by a
criterion that can fail, and every picture has the paper's arrangement.
"""

from fish_env.studies.paper.motions import Study, run_study
from fish_env.studies.paper.statements import Statement, all_statements, with_servo_lag

__all__ = ["Statement", "Study", "all_statements", "run_study", "with_servo_lag"]
