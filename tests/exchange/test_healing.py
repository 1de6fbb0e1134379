"""A partitioned fleet that reconnects, under a policy with coded repairs."""

from benchmarks.healing import HALF, N_NODES, Healing


def test_after_a_partition_missing_items_are_sent_as_coded_repairs() -> None:
    """Statements name it again: they began behind what was settled, and symbols were over what the others had told."""
    healing = Healing(1)
    fleet, over = healing.fleet, set()
    for _ in range(4 * N_NODES):
        sent = fleet.pass_slot()
        account = fleet.codec.decode(sent.data, sent.slot // N_NODES, fleet.schedule.start_s(sent.slot)).packet.account
        sender = sent.slot % N_NODES
        over |= {(sender, one.origin) for one in account.statements if account.symbols and one.mask}
    assert any((sender < HALF) == (origin < HALF) for sender, origin in over)


def test_a_healed_partition_takes_few_transmissions() -> None:
    """1.98 ± 0.06 in 20 trials, and 2.35 where what was settled could not be stated again and so not be coded."""
    mean = sum(Healing(seed).heal()[0] for seed in range(4)) / 4
    assert mean < 2.2
