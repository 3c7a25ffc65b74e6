"""The loop against a board that lies and shares no code with it: a tenth of what `cargo xtask lies` makes."""

import lying_board


def test_each_lie_is_found_in_time_and_a_sound_board_is_believed(clutch):
    told, failures = lying_board.campaign(clutch.binary, 10 * len(lying_board.LIES), workers=4)
    assert not failures, "\n".join(failures)
    assert all(len(outcomes) == 10 for outcomes in told.values())
