"""Templates, constraints, FuseSoC core file and smoke test lie beside the Verilog, to build it into a design."""

from functools import singledispatch

from tachometry.hdl.export.render import render_files
from tachometry.spec import AxesSpec, TachometerSpec
from tachometry.spec.control import AnySpec
from tachometry.spec.language.port import Port
from tachometry.spec.registers.buses import Bus, ports_on

# The files, and what --help says of them.
KIT = {
    "NAME.core": "FuseSoC core file (CAPI2): targets default, lint and sim",
    "NAME_inst.v": "instantiation template",
    "NAME_pkg.vhd": "package for VHDL with the component",
    "NAME_tb.sv": "smoke test, for the target sim",
    "NAME.xdc": "constraints for Vivado",
    "NAME.sdc": "constraints for Quartus and others",
}
_STEPS_PER_TICK, _LONGEST_HOLD = 4, 5000
_MOVED = 40 - 16  # quarter periods that the smoke test turns the encoder


def kit(spec: AnySpec, name: str, bus: Bus | None = None) -> dict[str, str]:
    """Return texts by file name, those of `KIT`.

    Parameters
    ----------
    spec : TachometerSpec, AxesSpec or LoopSpec
    name : str
        Of the module.
    bus : Bus or None
        On which its registers are.
    """
    ports = ports_on(spec, bus)
    return render_files(
        KIT,
        name,
        spec=spec,
        tacho=spec.tachometer if spec.axes is None else spec,  # the commands of a loop are synchronous
        bus=bus,
        inputs=[port for port in ports if port.direction == "input"],
        outputs=[port for port in ports if port.direction == "output"],
        help=_help,
        idle=bus.idle if bus else {},
        paths=_synchronizers(spec, bus),
        bits="" if spec.axes is None else "*",
        tick_cycles=spec.timing.tick_cycles,
        **_bench(spec),
    )


def _help(port: Port) -> str:
    return f"{port.help.rstrip('.')}; in {port.unit}." if port.unit else port.help


def _synchronizers(spec: AnySpec, bus: Bus | None) -> dict[str, list[str]]:
    """Return where the synchroniser of each pin is in the core: the boxes from the outermost to itself."""
    box = {"tick_in": ["sampling_clock"]} if spec.axes is None else {}
    default = ["conditioner"] if spec.axes is None else []
    boxes = {pin.name: box.get(pin.name, default) for pin in spec.tachometer.ports.pins}
    boxes |= {line: ["bridge"] for line in (bus.asynchronous if bus else ())}
    return {pin: [*path, f"sync_{pin}"] for pin, path in boxes.items()}


@singledispatch
def _bench(spec: AnySpec) -> dict[str, object]:
    """Return how the smoke test turns one encoder, or many, and the position that must follow."""
    tacho = spec.tachometer
    return {
        "axes": None,
        "hold": max(_hold(tacho), min(2 * (tacho.filter_clocks + 8), tacho.filter_clocks + 300)),
        "a": "quarter[1] ^ quarter[0]",
        "b": "quarter[1]",
        "velocity": "velocity",
        "lsb": 2.0**-tacho.widths.frac_bits,
        "compared": "generate --testbench cocotb",
        "expected": _MOVED * tacho.encoder.decoding // 4,
    }


@_bench.register
def _(tacho: AxesSpec) -> dict[str, object]:
    # Every other one goes backward, its lines exchanged.
    lines = ["quarter[1] ^ quarter[0]", "quarter[1]"]
    a, b = ([lines[(axis + line) % 2] for axis in reversed(range(tacho.axes))] for line in range(2))
    stores = " ".join(f"positions[{axis}] <= position_{axis};" for axis in range(tacho.axes))
    return {
        "axes": tacho,
        # Before the first edge there are rounds in which no axis is counted.
        "hold": max(_hold(tacho), (4 + tacho.axis.filter_clocks) * tacho.slots),
        "a": f"{{{', '.join(a)}}}",
        "b": f"{{{', '.join(b)}}}",
        "velocity": "velocity_0" if tacho.parallel else "velocity",
        "store": f"begin {stores} end" if tacho.parallel else "positions[axis] <= position;",
        "compared": "generate --testbench cocotb",
        "expected": _MOVED * tacho.axis.encoder.decoding // 4,
    }


def _hold(tacho: TachometerSpec | AxesSpec) -> int:
    return min(-(-tacho.timing.tick_cycles // _STEPS_PER_TICK), _LONGEST_HOLD)
