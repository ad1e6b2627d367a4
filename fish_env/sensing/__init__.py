"""What sensors see of a motion: channels, and the effects of imperfect measurement."""

from fish_env.sensing.channels import channels_from_states
from fish_env.sensing.measurement import ages_s, measured_channels, true_command_times, true_times

__all__ = [
    "ages_s",
    "channels_from_states",
    "measured_channels",
    "true_command_times",
    "true_times",
]
