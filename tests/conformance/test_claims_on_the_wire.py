"""What the claims of CBBA take on the wire."""

from exchange.packets import Fragment
from missions.runs.setup import resolved
from remoras.testing.sample_worlds import small_patches
from worldmodel import PropertyValue


def test_the_claims_of_thirteen_patches_are_one_short_block() -> None:
    """Head: relayed 1, sequence, time, part 1; a fact: subject, attribute, value 16 or 10, another follows 1.

    13 blocks of one claim each would repeat the head 13 times; here the one head and the time of last news are shared.
    """
    setup = resolved(small_patches("cbba"))
    claims_of, claim = (setup.tbox.attribute_named(name).uid for name in ("claimsOf", "claim"))
    facts = (PropertyValue(1, claims_of, 5), *(PropertyValue(10 + n, claim, 700) for n in range(13)))
    bits = setup.codec.fragment_bits(Fragment(1, 1, 1.0, facts, 0, 1), relayed=False)
    one = setup.codec.fragment_bits(Fragment(1, 1, 1.0, facts[:2], 0, 1), relayed=False)
    assert bits < 400
    assert bits < 13 * one / 2
