"""Turns of candidates in one process, in CPU seconds of all its threads."""

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass, field

LONG = 2.0  # CPU s: a warm-up as long as this is steady, and counts as a turn


@dataclass
class Candidate:
    """Something to be timed.

    `work` is called `repeat` times in a turn; `repeat` is raised until a turn lasts `shortest` seconds. There are
    `rounds` turns; before a single one, nothing is warmed up.
    """

    name: str
    work: Callable[[], object]
    rounds: int = 5
    shortest: float = 0.1
    repeat: int = 1
    turns: list[float] = field(default_factory=list)  # CPU s of one call
    result: object = None

    def turn(self) -> float:
        gc.collect()
        before = time.process_time()
        for _ in range(self.repeat):
            self.result = self.work()
        return time.process_time() - before

    @property
    def cpu(self) -> float:
        """CPU seconds of one call: the least of all turns, since others only ever add to it."""
        return min(self.turns)


def interleave(candidates: list[Candidate]) -> None:
    """Times all in turns: A B C, C B A, A B C …, so that a disturbance of the machine meets all of them."""
    for c in candidates:
        if c.rounds > 1:  # a warm-up that also finds out how often to repeat
            took = c.turn()
            while took < c.shortest:
                c.repeat = max(2 * c.repeat, round(1.1 * c.repeat * c.shortest / max(took, 1e-6)))
                took = c.turn()
            if took > LONG:
                c.turns.append(took / c.repeat)
    turn = candidates
    while turn := [c for c in reversed(turn) if len(c.turns) < c.rounds]:
        for c in turn:
            c.turns.append(c.turn() / c.repeat)
