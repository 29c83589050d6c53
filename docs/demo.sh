#!/bin/sh
# The drive of README.md with a disc that has the faults of real ones: standstill, a ramp, a reversal, a vibration and a stop.
# Run by `make demo`; BIN is the folder of the command `tachometry`, OUT where the results go, MOTION what the shaft
# does, METHODS who is compared.
set -eu

BIN=${BIN:-.venv/bin}
OUT=${OUT:-build/demo}
REVERSAL="s-curve:100rad/s:-60rad/s:80ms+constant:-60rad/s:40ms+ramp:-60rad/s:0:15ms"
MOTION=${MOTION:-stop:20ms+ramp:0:100rad/s:100ms+$REVERSAL+sine:20rad/s:40Hz:75ms+stop:45ms}
drive="--lines 2500 --clock 100MHz --pwm 10kHz --max-speed 6000rpm"
core="--method track $drive"
motion="--motion $MOTION --jitter 5% --nonuniformity 0.1 --phase-error 10 --seed 1"
METHODS=${METHODS:-track,mt,t,s,rairan,m,hostmot2,odrive}

echo "Verilog, manifest and FuseSoC file of the tracking method:"
# shellcheck disable=SC2086 # options are words
"$BIN/tachometry" generate $core -o "$OUT"

echo
echo "Its hardware, clock by clock, against the golden model and the truth:"
# shellcheck disable=SC2086
"$BIN/tachometry" simulate $core $motion \
    --vcd "$OUT/drive.vcd" --plot "$OUT/drive.png" --trace "$OUT/drive.csv" --counts "$OUT/drive_counts.csv" \
    --save-capture "$OUT/drive.sr"

echo
echo "A replay of the capture that the simulation saved, and every clock of its first half millisecond:"
# shellcheck disable=SC2086
"$BIN/tachometry" replay "$OUT/drive.sr" $core --trace "$OUT/replay.csv" --vcd "$OUT/clocks.vcd" --vcd-to 500us
cmp "$OUT/drive.csv" "$OUT/replay.csv"

echo
echo "Methods, and what others use, on the same edges, as README.md compares them:"
# shellcheck disable=SC2086
"$BIN/tachometry" compare $drive --methods "$METHODS" $motion --plot "$OUT/methods.png" --csv "$OUT/methods.csv"

cat <<END

What was shown                                               where it is
  the Verilog that runs on an FPGA                           $OUT/tachometer.v
  hardware and golden model agree in every bit, twice        $OUT/drive.csv, replay.csv
  all methods, LinuxCNC and ODrive, and who is closest       $OUT/methods.png
  speed, measured and true, as curves beside the pins        $OUT/drive.vcd (gtkwave $OUT/drive.gtkw)
  every edge of the clock                                    $OUT/clocks.vcd
END
