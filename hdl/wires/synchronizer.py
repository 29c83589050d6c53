"""From an asynchronous pin into the clock domain."""

from amaranth import Module, Signal
from amaranth.lib.cdc import FFSynchronizer


class Synchronizer(FFSynchronizer):
    """Amaranth's two flip-flops, which keep their attribute for vendors in exported Verilog.

    On a platform of Amaranth that has its own synchroniser it is that one. Else the flip-flops carry `ASYNC_REG`, with
    which Vivado places them side by side, and makes no shift register of them. The first is called `stage0`, the second
    `stage1`: constraints refer to these names.

    - `pin`: One, or several that are independent.
    """

    def __init__(self, pin: Signal, level: Signal) -> None:
        super().__init__(pin, level)

    def elaborate(self, platform: object) -> Module:
        if hasattr(platform, "get_ff_sync"):
            return super().elaborate(platform)
        m = Module()
        stages = [Signal(len(self.i), name=f"stage{k}", reset_less=True, attrs={"ASYNC_REG": "TRUE"}) for k in range(2)]
        m.d.sync += [stages[0].eq(self.i), stages[1].eq(stages[0])]
        m.d.comb += self.o.eq(stages[1])
        return m
