"""Who loses which packet: every outcome a pure function of (seed, trial, slot, sender, receiver).

The uniform number of a link is drawn first and compared with the loss probability afterwards. So the same
outcomes meet every policy, every strategy and every loss rate of a trial: comparisons are paired, and what
is lost at one rate is lost at every higher one.

The generator is counter-based: each counter word is added to the state and the state is mixed. The mixer is
"moremur" (P. Evensen, 2019), a 64-bit finaliser of the kind that SplitMix64 uses (Steele et al., 2014). Its
constants fit into 63 bits and the shifts are masked, so the same lines give the same bits on Python integers
and on compiled signed 64-bit words.
"""

SPEEDS = 2
"""`trial` of the draws that say how fast a vehicle really is; losses of missions have 0."""
FAULTS = 3
"""`trial` of the draws that say which vehicle a fault befalls, and when."""
FINDS = 4
"""`trial` of the draws that say where a mission's features lie, and how long each takes."""
MISSES = 5
"""`trial` of the draws that say in which ticks a sensor yields nothing."""
DRIFTS = 6
"""`trial` of the draws that say in which direction a vehicle takes itself to be off."""
LOOKS = 7
"""`trial` of the draws that say what a look at an object of the sea shows."""
CLOCKS = 8
"""`trial` of the draws that say how far clocks are off, and how fast they drift."""
SURGES = 9
"""`trial` of the draws that say when the current rises."""
NODES = 11
"""`trial` of the draws that say which node of a measured network a vehicle is."""
DAMAGES = 12
"""`trial` of the draws that say which packets arrive damaged."""
PLACES = 13
"""`trial` of the draws that say which of their bits are turned."""
SITES = 14
"""`trial` of the draws that say how links of one length differ by place, time and receiver."""
"""`trial` of the draws by which fleets in one sea have seeds of their own."""
EPISODES = 16
"""`trial` of the draws that say which run of a benchmark is learned on next."""
GROUNDS = 17
"""`trial` of the draws that make the grounds by which strategies are judged."""

_LOW_64 = 0xFFFF_FFFF_FFFF_FFFF
_LOW_37 = (1 << 37) - 1
_LOW_31 = (1 << 31) - 1
_LOW_53 = (1 << 53) - 1


def mixed(word: int) -> int:
    """Scramble 64 bits: each input bit turns about half of the output bits."""
    word = ((word ^ ((word >> 27) & _LOW_37)) * 0x3C79AC492BA7B653) & _LOW_64
    word = ((word ^ ((word >> 33) & _LOW_31)) * 0x1C69B3F74AC4AE35) & _LOW_64
    return word ^ ((word >> 27) & _LOW_37)


def trial_key(seed: int, trial: int) -> int:
    """The generator's state for one trial, 64 bits; `seed` is from 0 to 2^62."""
    return mixed(mixed(seed + 1) + trial + 1)


def slot_key(key: int, slot: int) -> int:
    """The generator's state for one slot of the trial with that key."""
    return mixed(key + slot + 1)


STATES = 1 << 62
"""Stands where slots stand, beyond all of them: the stream of the states of links, apart from that of losses."""


def state_key(seed: int, trial: int) -> int:
    """The generator's state for the states of the links in one trial; takes the place of a trial's key."""
    return slot_key(trial_key(seed, trial), STATES)


def link_draw(key: int, sender: int, receiver: int) -> int:
    """The same number as `link_uniform` gives, in units of 2^-53."""
    return mixed(key + (sender << 16) + receiver + 1) >> 11 & _LOW_53


def link_uniform(key: int, sender: int, receiver: int) -> float:
    """The uniform number in [0, 1) of one link in the slot with that key."""
    return ((mixed(key + (sender << 16) + receiver + 1) >> 11) & _LOW_53) * 2.0**-53


def uniform(seed: int, trial: int, slot: int, sender: int, receiver: int) -> float:
    """The number in [0, 1) that decides a packet's fate: lost if it is below the loss probability.

    Args:
        seed: of the whole study or mission, from 0 to 2^62.
        trial: number of the run, or 0.
        slot: TDMA slot, counted from 0.
        sender: node that owns the slot.
        receiver: another node; node numbers are below 2^16.
    """
    return link_uniform(slot_key(trial_key(seed, trial), slot), sender, receiver)
