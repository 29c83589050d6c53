"""Templates, constraints, FuseSoC core file and smoke test lie beside the Verilog, to build it into a design."""

from tachometry.hdl.export.render import render_files
from tachometry.spec import AxesSpec, Encoder, TachometerSpec
from tachometry.spec.control import AnySpec
from tachometry.spec.language.port import arranged
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
# Quarter periods that the smoke test turns the encoder forward and back, and with a filter that is long.
_TURNS, _FEW_TURNS = (40, 16), (8, 4)


def kit(spec: AnySpec, name: str, bus: Bus | None = None) -> dict[str, str]:
    """Return texts by file name, those of `KIT`."""
    ports = arranged(ports_on(spec, bus))
    return render_files(
        KIT,
        name,
        spec=spec,
        tacho=spec.tachometer if spec.axes is None else spec,  # the commands of a loop are synchronous
        bus=bus,
        inputs=[port for port in ports if port.direction == "input"],
        outputs=[port for port in ports if port.direction == "output"],
        scales=_scales(spec),
        help=lambda port: f"{port.help.rstrip('.')}; in {port.unit}." if port.unit else port.help,
        paths=_synchronizers(spec, bus),
        bits="" if spec.axes is None else "*",
        tick_cycles=spec.timing.tick_cycles,
        idle={**(bus.idle if bus else {}), **_first_levels(spec)},
        **(_bench(spec.tachometer) if spec.axes is None else _axes_bench(spec)),
    )


def _scales(spec: AnySpec) -> dict[str, str]:
    """Return the scales of outputs, to be copied into a program, by their names."""
    velocity, counts = spec.tachometer.velocity, spec.tachometer.encoder.counts_per_rev
    lsb = f"{velocity.rad_per_s_per_lsb!r} rad/s"
    turn = counts if isinstance(counts, int) else f"({counts})"
    return {"velocity": f"2^-{velocity.frac_bits} {spec.tachometer.unit} = {lsb}", "position": f"2*pi/{turn} rad"}


def _synchronizers(spec: AnySpec, bus: Bus | None) -> dict[str, list[str]]:
    """Return where the synchroniser of each pin is in the core: the boxes from the outermost to itself."""
    box = {"tick_in": ["sampling_clock"]} if spec.axes is None else {}
    default = ["conditioner"] if spec.axes is None else []
    tacho = spec.tachometer
    complements = [f"{line}_n" for line in tacho.front_end.complemented]
    pins = (*tacho.front_end.lines, *complements, *tacho.front_end.sensed, *["tick_in"] * tacho.external_tick)
    boxes = {pin: box.get(pin, default) for pin in pins}
    boxes |= {tacho.reads.line: ["master"]} if tacho.reads else {}
    boxes |= {line: ["bridge"] for line in (bus.asynchronous if bus else ())}
    return {pin: [*path, f"sync_{pin}"] for pin, path in boxes.items()}


def _first_levels(spec: AnySpec) -> dict[str, int]:
    """Return levels of the sensor's lines before it turns, those that are not 0, and of an index that is inverted."""
    encoder, all_ones = spec.tachometer.encoder, (1 << (spec.axes or 1)) - 1
    first = dict(zip(encoder.kind.lines, encoder.kind.legal[0], strict=encoder.sampled is None)) | {"z": 0}
    if spec.tachometer.reads is not None:
        first[spec.tachometer.reads.line] = 1
    at_pins = {line: level ^ (line in encoder.inverted) for line, level in first.items()}
    at_pins |= {f"{line}_n": 1 - at_pins[line] for line in spec.tachometer.front_end.complemented}
    return {line: all_ones for line, level in at_pins.items() if level}


def _turned(encoder: Encoder, turns: tuple[int, int]) -> tuple[dict[str, str], int]:
    """Return levels of the lines after a step of the smoke test, as Verilog, and the counts of all its steps."""
    kind, moved = encoder.kind, turns[0] - turns[1]
    levels = {"a": "quarter[1] ^ quarter[0]", "b": "quarter[1]"}
    counts = moved * encoder.decoding // 4
    if encoder.sensor == "hall":
        by_place = zip(*kind.cycle, strict=True)
        each = (sum(level << number for number, level in enumerate(of_line)) for of_line in by_place)
        levels = {line: f"1'(6'd{bits} >> quarter)" for line, bits in zip(kind.lines, each, strict=True)}
        counts = moved
    elif encoder.sensor == "pulses":
        levels = {"a": levels["a"]}
        counts = sum(turns) * encoder.decoding // 4 * (-1 if encoder.reverse else 1)
    elif encoder.sampled is not None and encoder.sensor != "sampled":  # by a model of the encoder
        levels, counts = {}, moved
    elif encoder.sampled is not None:
        age = {} if encoder.sample_age is not None else {"sample_age": "0"}
        levels, counts = {"sample": "quarter", "sample_valid": "1'b1", "sample_ok": "1'b1", **age}, moved
    elif not kind.cycle:
        levels = {
            "a": "1'b1" if encoder.sensor == "step-dir" else "forward",
            "b": "forward" if encoder.sensor == "step-dir" else "!forward",
        }
        counts = moved * encoder.decoding
    return levels, counts


def _wired(spec: TachometerSpec, levels: dict[str, str]) -> dict[str, str]:
    """Return levels of the pins: those of the lines, but of inverted ones and complements the others."""
    wired = {line: f"~({level})" if line in spec.encoder.inverted else level for line, level in levels.items()}
    return wired | {f"{line}_n": f"~({wired[line]})" for line in spec.front_end.complemented if line in wired}


def _bench(tacho: TachometerSpec) -> dict[str, object]:
    """Return how the smoke test turns an encoder, and the position that must follow."""
    encoder = tacho.encoder
    hold = max(_hold(tacho), min(2 * (tacho.filter_clocks + 8), tacho.filter_clocks + 300), tacho.blanking_clocks)
    turns = _turns(hold)
    levels, expected = _turned(encoder, turns)
    expected -= encoder.zero or 0
    lines = ("a", "b") if encoder.sampled is None else ("sample_valid",)
    low = {line: f"1'b{int(line in encoder.inverted)}" for line in lines}
    if encoder.sensor == "step-dir":
        del low["b"]
    return {
        "axes": None,
        "hold": hold,
        "turns": turns,
        "levels": _wired(tacho, levels),
        "ends": {} if encoder.kind.cycle or tacho.reads else low,
        "places": 6 if encoder.sensor == "hall" else 4,
        "place_bits": encoder.sampled.width if encoder.sampled else 3 if encoder.sensor == "hall" else 2,
        "velocity": "velocity",
        "lsb": 2.0**-tacho.velocity.frac_bits,
        "compared": "generate --testbench cocotb",
        "expected": expected,
        # Forward, as it counts; a line alone does not tell.
        "mirrored": encoder.reverse and encoder.sensor != "pulses",
        "backward": encoder.reverse and encoder.sensor == "pulses",
        "steps": "quarter periods" if encoder.kind.cycle else "LSB" if encoder.sampled else "steps",
        # A late answer has no command before it at first, and is not taken.
        "first_errors": -int(tacho.reads is not None and tacho.reads.late),
    }


def _axes_bench(tacho: AxesSpec) -> dict[str, object]:
    """Return the same for many encoders: every other one goes backward, its lines exchanged."""
    encoder = tacho.axis.encoder
    # Before the first edge there are rounds in which no axis is counted.
    hold = max(_hold(tacho), (4 + tacho.axis.filter_clocks) * tacho.slots)
    turns = _turns(hold)
    every, expected = _turned(encoder, turns)
    lines = [every["a"], every["b"]]
    turned = ([lines[(axis + line + encoder.reverse) % 2] for axis in reversed(range(tacho.axes))] for line in range(2))
    stores = " ".join(f"positions[{axis}] <= position_{axis};" for axis in range(tacho.axes))
    return {
        "axes": tacho,
        "hold": hold,
        "turns": turns,
        "levels": _wired(
            tacho.tachometer, {line: f"{{{', '.join(each)}}}" for line, each in zip("ab", turned, strict=True)}
        ),
        "ends": {},
        "places": 4,
        "place_bits": 2,
        "velocity": "velocity_0" if tacho.parallel else "velocity",
        "store": f"begin {stores} end" if tacho.parallel else "positions[axis] <= position;",
        "compared": "generate --testbench cocotb",
        "expected": expected,
        "mirrored": False,
        "steps": "quarter periods",
        "first_errors": 0,
    }


def _turns(hold: int) -> tuple[int, int]:
    return _TURNS if hold <= 2 * _LONGEST_HOLD else _FEW_TURNS


def _hold(tacho: TachometerSpec | AxesSpec) -> int:
    return min(-(-tacho.timing.tick_cycles // _STEPS_PER_TICK), _LONGEST_HOLD)
