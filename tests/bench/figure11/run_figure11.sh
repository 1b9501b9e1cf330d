#!/bin/sh
# Fig. 11: run_figure11.sh FOLDER BIN_FOLDER OUT_FOLDER; bodies and scene are in FOLDER. Four runs, resumed where they were
# stopped, then curves a frame and what the modes cost in error: OUT_FOLDER/figure11.csv, figure11.html.
# QUICK=1: 4 rings on a coarse grid, minutes; without it hours.
from=$1 bin=$2 out=$3
mkdir -p "$out"
quick=
[ -z "$QUICK" ] || quick="--set fluid.grid=[64,64,32] --set fluid.cell=1/32 --set scatter[0].count=4
  --set scatter[0].box=[[0.35,0.35,0.62],[1.65,1.65,0.75]] --set time.end=0.76"
set -f  # brackets are no patterns
# What a run of the process holds, KiB, beside the frames that it has written.
watch() {
  while kill -0 "$1" 2>/dev/null; do
    kib=$(sed -n 's/^VmRSS:[^0-9]*\([0-9]*\).*/\1/p' "/proc/$1/status" 2>/dev/null)
    [ -z "$kib" ] || echo "$(find "$2/frames" -name '*.vtp' 2>/dev/null | wc -l),$kib" >>"$2.memory"
    sleep 0.5
  done
}
for mesh in 5k 60k; do
  "$bin/archetide-precompute" build "$from/ring$mesh.body.toml" -o "$out/ring$mesh.h5" || exit $?
  for kind in modes=10 deformable=full; do
    run=$out/${kind%=*}$mesh
    [ ! -e "$run/done.stamp" ] || continue
    "$bin/archetide-sim" run "$from/figure11.scene.toml" --archetypes "$out" -o "$run" --resume auto \
      --set "scatter[0].archetype=ring$mesh" --set "scatter[0].$kind" $quick &
    watch $! "$run" &
    wait $! 2>/dev/null
    [ -e "$run/done.stamp" ] || { echo "figure11: $run did not end" >&2; exit 3; }
  done
done
"$bin/bench_figure11" "$out"
