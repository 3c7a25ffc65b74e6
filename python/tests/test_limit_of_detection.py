"""The earliest at which counts can show a converter at 0 V: the limit that docs/safety.md states."""

import limit_of_detection as limit

MARGINS, CODE_KNOWN, EXACT = limit.KNOWLEDGE
SEEDS = range(1, 21)


def earliest(law, known):
    return [limit.periods_until_known(limit.LAWS[law], known, seed) for seed in SEEDS]


def test_under_pd_no_detector_with_the_margins_can_have_10_ms_and_under_smc_one_can():
    pd, smc = earliest("PD", MARGINS), earliest("SMC", MARGINS)
    assert max(pd) > 10 >= max(smc)
    # Neither set has lost a sound shaft.
    assert min(pd + smc) > 0


def test_with_the_sign_function_the_law_itself_hides_a_converter_at_0_v_for_longer_than_10_ms():
    assert max(earliest("SMC, sign", EXACT)) > 10


def test_who_knows_more_is_never_later():
    for law in limit.LAWS:
        for more, less in zip(earliest(law, EXACT), earliest(law, CODE_KNOWN), strict=True):
            assert 0 < more <= less
        for more, less in zip(earliest(law, CODE_KNOWN), earliest(law, MARGINS), strict=True):
            assert 0 < more <= less


def test_a_sound_converter_is_never_suspected():
    for law in limit.LAWS.values():
        for known in limit.KNOWLEDGE:
            assert limit.periods_until_known(law, known, 1, converter=lambda volts: volts) is None
