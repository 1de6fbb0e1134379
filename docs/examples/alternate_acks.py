from exchange.policy.acknowledgement import Acknowledgement
from exchange.policy.policies import AckPolicy


def every_other_frame(n_nodes, frame, sender, row, column):
    return frame == 0 and row == sender


def own_receptions(reported, own, received, holders):
    return own & received


KIND = Acknowledgement(
    "sparse", "acknowledgements in every second frame", every_other_frame, own_receptions, period_frames=2
)
SPARSE = AckPolicy(KIND, repeat=True)
