"""A driver in C99 for the registers: a header of functions that need no memory but that of their arguments."""

import re
from collections.abc import Iterator

from tachometry.hdl.export.registers.c_header import comment
from tachometry.hdl.export.registers.values import CapturedValue, captured_flags, captured_values, in_unit
from tachometry.spec.language.provenance import notice
from tachometry.spec.registers.map import RegisterMap

_HEAD = """\
// Driver of the tachometer NAME, for C99 and C++11. It needs NAME_regs.h beside it, no memory and no library.
@NOTICE@
//
//   struct NAME_bus bus = {my_read, my_write, my_context};
//   struct NAME_snapshot now;
//   if (NAME_init(&bus) != PREFIX_OK) return;
//   NAME_read(&bus, &now);
//   double speed = NAME_rad_per_s(now.velocity);
//
// Who calls from several threads or from interrupts must see to it that one call ends before the next begins.

#ifndef PREFIX_DRIVER_H
#define PREFIX_DRIVER_H

#include <stdbool.h>
#include <stdint.h>

#include "NAME_regs.h"

// How the registers are accessed. Offsets are in bytes.
struct NAME_bus {
  uint32_t (*read)(void *context, uint32_t offset);
  void (*write)(void *context, uint32_t offset, uint32_t value);
  void *context;  // given to both
};

enum NAME_status {
  PREFIX_OK = 0,
  PREFIX_NOT_A_TACHOMETER,  // IDENTIFICATION is not that of a tachometer
  PREFIX_OTHER_CONFIGURATION  // a tachometer, but not the one that this file was made for
};

// What the core showed in one clock.
struct NAME_snapshot {
@SNAPSHOT@
};

// How often something happened since reset or NAME_clear; 255 stands for 255 and more.
struct NAME_counters {
@COUNTERS@
};

static inline int32_t NAME_signed_32(uint32_t word) {
  return word <= (uint32_t)INT32_MAX ? (int32_t)word : -(int32_t)(UINT32_MAX - word) - 1;
}

static inline int64_t NAME_signed_64(uint32_t low, uint32_t high) {
  const uint64_t word = (uint64_t)high << 32 | low;
  return word <= (uint64_t)INT64_MAX ? (int64_t)word : -(int64_t)(UINT64_MAX - word) - 1;
}

static inline uint32_t NAME_get(const struct NAME_bus *bus, uint32_t offset) {
  return bus->read(bus->context, offset);
}

// Sees that this core answers, and no other. The functions below rely on it.
static inline enum NAME_status NAME_init(const struct NAME_bus *bus) {
  if (NAME_get(bus, PREFIX_IDENTIFICATION_OFFSET) != PREFIX_IDENTIFICATION_RESET) {
    return PREFIX_NOT_A_TACHOMETER;
  }
  if (NAME_get(bus, PREFIX_CONFIGURATION_OFFSET) != PREFIX_CONFIGURATION_RESET) {
    return PREFIX_OTHER_CONFIGURATION;
  }
  return PREFIX_OK;
}

// Captures, and reads all that was captured. After NAME_hold(bus, true) it does not capture, and reads what the
// input `capture` of the core has captured last. If that input captures while this function reads, the snapshot is
// mixed.
static inline void NAME_read(const struct NAME_bus *bus, struct NAME_snapshot *now) {
@READ@
}

// Only the input `capture` of the core captures (true), or reading does, too (false, as after reset).
static inline void NAME_hold(const struct NAME_bus *bus, bool hold) {
  bus->write(bus->context, PREFIX_CONTROL_OFFSET, hold ? PREFIX_CONTROL_HOLD_MASK : 0);
}

// Sets all counters to 0.
static inline void NAME_clear(const struct NAME_bus *bus) {
  const uint32_t hold = NAME_get(bus, PREFIX_CONTROL_OFFSET) & PREFIX_CONTROL_HOLD_MASK;
  bus->write(bus->context, PREFIX_CONTROL_OFFSET, hold | PREFIX_CONTROL_CLEAR_MASK);
}

static inline void NAME_read_counters(const struct NAME_bus *bus, struct NAME_counters *counters) {
  const uint32_t word = NAME_get(bus, PREFIX_COUNTERS_OFFSET);
@COUNT@
}

// A velocity or a bound of it in rad/s.
static inline double NAME_rad_per_s(int64_t velocity) { return (double)velocity * PREFIX_RAD_PER_S_PER_LSB; }

// A velocity or a bound of it in the unit that PREFIX_UNIT names.
static inline double NAME_in_unit(int64_t velocity) { return (double)velocity * PREFIX_UNIT_PER_LSB; }

// A position in rad.
static inline double NAME_rad(int64_t position) { return (double)position * PREFIX_RAD_PER_COUNT; }
@MORE@
#endif
"""

# Functions for outputs that only some methods have.
_MORE = {
    "acceleration": """
// An acceleration in rad/s².
static inline double NAME_rad_per_s2(int64_t acceleration) {
  return (double)acceleration * PREFIX_RAD_PER_S2_PER_LSB;
}
""",
    "position_fine": """
// A fine position in rad.
static inline double NAME_fine_rad(int64_t position_fine) {
  return (double)position_fine * (PREFIX_POSITION_FINE_PER_LSB * PREFIX_RAD_PER_COUNT);
}
""",
}


def c_driver(registers: RegisterMap, name: str) -> str:
    """The text of `NAME_driver.h`; it includes `NAME_regs.h`.

    Parameters
    ----------
    registers : RegisterMap
    name : str
        Of the Verilog module; functions and types begin with it, macros with its capitals.
    """
    parts = {
        "NOTICE": notice("//").rstrip("\n").splitlines(),
        "SNAPSHOT": _members(registers),
        "COUNTERS": _counters(registers),
        "READ": _reading(registers),
        "COUNT": [
            f"  counters->{field} = (uint8_t)(word >> {_macro('COUNTERS', field)}_SHIFT);"
            for field in registers.counted
        ],
        "MORE": "".join(_MORE[one] for one in registers.spec.method_entries).split("\n"),
    }
    text = _HEAD
    for key, lines in parts.items():
        text = text.replace(f"@{key}@", "\n".join(lines))
    # In one go: the name may have PREFIX in it.
    return re.sub("NAME|PREFIX", lambda mark: {"NAME": name, "PREFIX": name.upper()}[mark[0]], text)


def _members(registers: RegisterMap) -> Iterator[str]:
    for value in captured_values(registers):
        yield from comment(" ".join((value.field.help, *in_unit(value.field))), "  ")
        yield f"  {_type(value)} {value.name};"
    for flag in captured_flags(registers):
        yield from comment(flag.help, "  ")
        yield f"  bool {flag.name};"


def _counters(registers: RegisterMap) -> Iterator[str]:
    for name, told in registers.counted.items():
        yield from comment(told, "  ")
        yield f"  uint8_t {name};"


def _reading(registers: RegisterMap) -> Iterator[str]:
    """In the order of the offsets: the first register captures."""
    for register in registers:
        if register.captured:
            yield f"  const uint32_t {register.name.lower()} = NAME_get(bus, PREFIX_{register.name}_OFFSET);"
    for value in captured_values(registers):
        yield f"  now->{value.name} = {_joined(value)};"
    for flag in captured_flags(registers):
        yield f"  now->{flag.name} = (status & {_macro('STATUS', flag.name)}_MASK) != 0;"


def _joined(value: CapturedValue) -> str:
    """The value from what was read of its registers."""
    words = [word.name.lower() for word in value.words]
    if value.field.signed:
        return f"NAME_signed_{value.bits}({', '.join(words)})"
    return words[0] if len(words) == 1 else f"(uint64_t){words[1]} << 32 | {words[0]}"


def _type(value: CapturedValue) -> str:
    return f"{'' if value.field.signed else 'u'}int{value.bits}_t"


def _macro(register: str, field: str) -> str:
    return f"PREFIX_{register}_{field.upper()}"
