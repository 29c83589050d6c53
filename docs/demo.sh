#!/bin/sh
# The experiment of Tsuji 2009: 500 counts per revolution, Ts = 1 ms, 10 ms at most, from 0 to 40 rad/s in 5 s.
# Run by `make demo`; BIN is the folder of the command `tachometry`, OUT where the results go, TIME how long the ramp is.
set -eu

BIN=${BIN:-.venv/bin}
OUT=${OUT:-build/demo}
TIME=${TIME:-5s}
common="--ppr 500 --decoding 1 --clock 50kHz --tick 1ms --max-time 10ms --max-speed 60rad/s"
core="--method s $common"
motion="--motion ramp:0:40rad/s:$TIME --vibration 1mrad:50Hz --seed 1"

echo "Verilog, manifest and FuseSoC file:"
# shellcheck disable=SC2086 # options are words
"$BIN/tachometry" generate $core -o "$OUT"

echo
echo "Simulation against the golden model and the truth:"
# shellcheck disable=SC2086
"$BIN/tachometry" simulate $core $motion \
    --vcd "$OUT/ramp.vcd" --plot "$OUT/ramp.png" --trace "$OUT/ramp.csv" --counts "$OUT/ramp_counts.csv" \
    --save-capture "$OUT/ramp.sr"

echo
echo "All methods, and what others use, on the same edges:"
# shellcheck disable=SC2086
"$BIN/tachometry" compare $common $motion --plot "$OUT/methods.png" --csv "$OUT/methods.csv"

echo
echo "Replay of the capture that the simulation saved:"
# shellcheck disable=SC2086
"$BIN/tachometry" replay "$OUT/ramp.sr" $core --trace "$OUT/replay.csv"

cmp "$OUT/ramp.csv" "$OUT/replay.csv"
echo "Simulation and replay gave the same trace; the results are in $OUT."
