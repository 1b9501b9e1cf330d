#!/bin/sh
# Three scenes, coarse and short, by a simulator that checks itself: run_scenes.sh SIM ASSETS ARCHETYPES OUT_FOLDER
# On two threads. Logs in OUT_FOLDER/NAME.log; exit 3 when a scene failed or a checker had something to say.
sim=$1 assets=$2 archetypes=$3 out=$4
mkdir -p "$out" || exit 5
set -f  # brackets are no patterns

failed=
# name | scene | end, s | settings: water and particles with a ring that hits the floor's walls; jointed bodies under one
# skin; a crowd of bodies, most of them nonlinear, that touch each other
while IFS='|' read -r name scene end settings; do
  sets=
  for word in $settings; do sets="$sets --set $word"; done
  start=$(date +%s)
  "$sim" run "$assets/scenes/$scene.scene.toml" -o "$out/$name" --replace -q -t 2 --set "time.end=$end" \
    --archetypes "$archetypes" --set expect=absent $sets >"$out/$name.log" 2>&1 </dev/null
  code=$?
  if [ $code = 0 ]; then result=clean; else result="FAILED (exit $code, see $out/$name.log)" failed=1; fi
  echo "sanitize: $name to $end s, $(($(date +%s) - start)) s: $result"
done <<SCENES
tub|tub|1.0|fluid.grid=[32,32,32] fluid.cell=1/32 fluid.particles={per_cell=8}
jellyfish|jellyfish|0.5|fluid.grid=[32,32,40] fluid.cell=1/32
pond|pond|1.0|fluid.grid=[36,36,21] fluid.cell=1/12
SCENES
[ -z "$failed" ] || exit 3
