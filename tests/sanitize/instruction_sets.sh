#!/bin/sh
# Hard case H30: instruction sets. One step of three scenes by the program as it is shipped (g++ -O3, all instructions of
# this machine) and by another build of it (clang -O1, SSE2): instruction_sets.sh SIM OTHER_SIM ASSETS ARCHETYPES OUT_FOLDER
# Places and deformations of bodies, m, and velocities, m/s and rad/s, may differ by 1e-12. Exit 3 when they differ by more.
# Solves to 1e-12: what a tolerance leaves open differs too (tub with 1e-5: 3e-11 rad/s), for multigrid works in single
# precision. Measured: 6e-14 rad/s.
sim=$1 other=$2 assets=$3 archetypes=$4 out=$5
mkdir -p "$out" || exit 5
set -f  # brackets are no patterns

one_step() {  # program, scene, run folder, settings
  sets=
  for word in $4; do sets="$sets --set $word"; done
  "$1" run "$assets/scenes/$2.scene.toml" -o "$3" --replace -q -t 1 --archetypes "$archetypes" --set time.fps=100 \
    --set time.end=0.01 --set coupling.tolerance=1e-12 --set expect=absent $sets >"$3.log" 2>&1 </dev/null
}

failed=
while IFS='|' read -r name settings; do
  if ! one_step "$sim" "$name" "$out/$name" "$settings" || ! one_step "$other" "$name" "$out/${name}_other" "$settings"; then
    echo "instruction sets: $name: FAILED, see $out/$name.log and $out/${name}_other.log"
    failed=1
    continue
  fi
  # "bodies.csv: x differs by 1.2e-15 (3e-15 of its largest value), row 3"
  "$sim" diff "$out/$name" "$out/${name}_other" >"$out/$name.diff" 2>&1
  code=$?  # 3: they differ
  if [ $code != 0 ] && [ $code != 3 ]; then
    echo "instruction sets: $name: FAILED, see $out/$name.diff"
    failed=1
    continue
  fi
  most=$(awk '/^bodies.csv: ([xyz]|[vw][xyz]|q[0-9]+) differs by / {
    if ($5 + 0 > most + 0) { most = $5; what = $2 } } END { print most + 0, what }' "$out/$name.diff")
  echo "instruction sets: $name: largest difference after a step $most"
  [ "$(echo "$most" | awk '{ print ($1 <= 1e-12) }')" = 1 ] || failed=1
done <<SCENES
tub|fluid.grid=[24,24,24] fluid.cell=1/24 body[0].position=[0.5,0.5,0.42]
jellyfish|fluid.grid=[32,32,40] fluid.cell=1/32
pond|fluid.grid=[36,36,21] fluid.cell=1/12
SCENES
[ -z "$failed" ] || exit 3
