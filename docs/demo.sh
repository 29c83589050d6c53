#!/bin/sh
# A drive with an encoder of 500 lines as real ones are: standstill, a ramp, a reversal, a vibration and a stop.
# Run by `make demo`; BIN is the folder of the command `tachometry`, OUT where the results go, MOTION what the shaft
# does, METHODS who is compared.
set -eu

BIN=${BIN:-.venv/bin}
OUT=${OUT:-build/demo}
REVERSAL="s-curve:100rad/s:-60rad/s:80ms+constant:-60rad/s:40ms+ramp:-60rad/s:0:15ms"
MOTION=${MOTION:-stop:20ms+ramp:0:100rad/s:100ms+$REVERSAL+sine:20rad/s:40Hz:75ms+stop:45ms}
drive="--ppr 500 --clock 48MHz --max-speed 400rad/s"
core="--method track $drive --tick 20us"
motion="--motion $MOTION --jitter 5% --nonuniformity 0.1 --phase-error 10 --seed 1"
METHODS=${METHODS:-s,mt:min-time=500us,track,hostmot2,odrive}

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

for tick in 20us 100us; do
    echo
    echo "Methods, and what others use, on the same edges, with ticks of $tick:"
    # shellcheck disable=SC2086
    "$BIN/tachometry" compare $drive --tick $tick --methods "$METHODS" $motion \
        --plot "$OUT/methods.png" --csv "$OUT/methods_$tick.csv"
done

cat <<END

What was shown                                               where it is
  the Verilog that runs on an FPGA                           $OUT/tachometer.v
  hardware and golden model agree in every bit, twice        $OUT/drive.csv, replay.csv
  S, M/T, tracking, LinuxCNC and ODrive, and who is closest  $OUT/methods.png
  speed, measured and true, as curves beside the pins        $OUT/drive.vcd (gtkwave $OUT/drive.gtkw)
  every edge of the clock                                    $OUT/clocks.vcd
END
