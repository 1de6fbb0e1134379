"""Keyed random numbers: each is a pure function of (seed, trial, slot, sender, receiver).

The uniform number of a link is compared with the loss probability. Comparisons of policies, strategies and loss rates
are paired: a packet lost at one rate is lost at higher ones.

The generator is counter-based: it adds each counter word to the state and mixes the state with "moremur" (P. Evensen,
2019), a 64-bit finaliser like that of SplitMix64 (Steele et al., 2014). Its constants fit into 63 bits and shifts are
masked: Python integers and compiled signed 64-bit words give the same bits.
"""

# ``trial`` of the draws of each kind; losses in missions use 0
SPEEDS = 2  # true vehicle speeds
FAULTS = 3  # vehicles and times of faults
FINDS = 4  # places and durations of a mission's features
MISSES = 5  # ticks without sensor data
DRIFTS = 6  # the directions of navigation errors
LOOKS = 7  # sensor observations of objects in the sea
CLOCKS = 8  # clock offsets and drifts
SURGES = 9  # times at which the current rises
NODES = 11  # nodes of a measured network for vehicles
DAMAGES = 12  # damaged packets
PLACES = 13  # inverted bits in damaged packets
SITES = 14  # link differences by place, time and receiver
EPISODES = 16  # the next benchmark run to learn on
GROUNDS = 17  # lines of a survey

_LOW_64 = 0xFFFF_FFFF_FFFF_FFFF
_LOW_37 = (1 << 37) - 1
_LOW_31 = (1 << 31) - 1
_LOW_53 = (1 << 53) - 1


def mixed(word: int) -> int:
    """Scramble 64 bits: each input bit inverts about half of the output bits."""
    # The masks make the arithmetic shift of signed 64-bit words a logical one.
    word = ((word ^ ((word >> 27) & _LOW_37)) * 0x3C79AC492BA7B653) & _LOW_64
    word = ((word ^ ((word >> 33) & _LOW_31)) * 0x1C69B3F74AC4AE35) & _LOW_64
    return word ^ ((word >> 27) & _LOW_37)


def trial_key(seed: int, trial: int) -> int:
    """Return the 64-bit generator state of a trial; `seed` is from 0 to 2^62."""
    # Counters begin at 1, since 0 is a fixed point of the mixing.
    return mixed(mixed(seed + 1) + trial + 1)


def slot_key(key: int, slot: int) -> int:
    """Return the generator state of a slot in a trial with this key."""
    return mixed(key + slot + 1)


STATES = 1 << 62
"""Pseudo-slot, beyond all slots, for the stream of link states."""


def state_key(seed: int, trial: int) -> int:
    """Return the generator state for link states in a trial, used as its trial key."""
    return slot_key(trial_key(seed, trial), STATES)


def link_uniform(key: int, sender: int, receiver: int) -> float:
    """Return the uniform number in [0, 1) of a link in a slot with this key."""
    return ((mixed(key + (sender << 16) + receiver + 1) >> 11) & _LOW_53) * 2.0**-53


def uniform(seed: int, trial: int, slot: int, sender: int, receiver: int) -> float:
    """Return the uniform number in [0, 1) of a packet; `seed` is from 0 to 2^62, node numbers are below 2^16."""
    return link_uniform(slot_key(trial_key(seed, trial), slot), sender, receiver)
