#!/bin/sh
# Minutes of scene time, coarsely: run_long.sh SIM ASSETS ARCHETYPES OUT_FOLDER. Nothing may grow: memory, energy, error of
# the volume, work of a step. Runs in OUT_FOLDER/NAME, logs beside them, the table in OUT_FOLDER/long.md.
# SCENES='tub jellyfish3': only these. THREADS: of a run. QUICK=1: a tenth of the time.
# Exit 3 when a run failed or a criterion was missed.
sim=$1 assets=$2 archetypes=$3 out=$4
mkdir -p "$out" || exit 5
set -f  # brackets are no patterns
table=$out/long.md

# Runs the simulator and writes its resident memory (kB) each second to the file.
watched() {  # file, words of the command
  file=$1
  shift
  "$@" </dev/null &
  child=$!
  : >"$file"
  while kill -0 $child 2>/dev/null; do
    awk '/^VmRSS/ { print $2 }' /proc/$child/status >>"$file" 2>/dev/null
    sleep 1
  done
  wait $child
}

# A row of the table. The run is read from a tenth of its time on, and 3 s, when all bodies are there and what fell has
# fallen; "late" is its second half.
# Memory: largest resident set, late against before. Gain: largest rise of energy without the work of forces above its
# lowest value before, as a part of the largest motion (kinetic and elastic). Motion: mean, late against before. Volume:
# largest error in sight, before and late, as a part of all water. A sloshing tank exchanges 0.2 % of its motion with its
# potential energy and back. Iterations: mean of both solves, before and late.
judge() {  # name, end, exit code, stats.csv, memory
  awk -F, -v name="$1" -v end="$2" -v code="$3" '
    function most(a, b) { return a > b ? a : b }
    FNR == 1 && NR == 1 { for (i = 1; i <= NF; ++i) at[$i] = i; next }
    FILENAME == ARGV[1] {
      t = $at["t"]; steps += 1; halvings += $at["halvings"]
      water = $at["water_volume"] + $at["spray_volume"] + $at["outflow_volume"]
      motion = $at["water_kinetic"] + $at["spray_kinetic"] + $at["body_kinetic"] + $at["body_elastic"]
      free = $at["energy"] - $at["actuation_work"]
      if (steps == 1) first = water
      largest = most(largest, motion)
      if (t < 0.1 * end || t < 3) next
      if (lowest == "" || free < lowest) lowest = free
      gain = most(gain, free - lowest)
      late = t > 0.5 * end
      error = water - first; if (error < 0) error = -error
      volume[late] = most(volume[late], error / first)
      n[late] += 1; m[late] += motion
      its[late] += $at["iterations"] + $at["iterations_position"]; s[late] += $at["seconds"]
      next
    }
    { rss[++samples] = $1 }
    END {
      for (k = 1; k <= samples; ++k) resident[k > samples / 2] = most(resident[k > samples / 2], rss[k])
      memory = resident[0] ? resident[1] / resident[0] : 0
      for (k = 0; k < 2; ++k) if (n[k]) { m[k] /= n[k]; its[k] /= n[k]; s[k] /= n[k] }
      share = largest ? gain / largest : 0
      grown = m[0] ? m[1] / m[0] : 0
      missed = ""
      if (code != 0) missed = missed " exit " code ";"
      if (!n[1] || t < 0.999 * end) missed = missed " no end;"
      if (memory > 1.02) missed = missed " memory;"
      if (share > 5e-3) missed = missed " energy;"
      if (grown > 1.1) missed = missed " motion;"
      if (volume[1] > 1e-3 || (volume[1] > 1e-6 && volume[1] > 1.5 * volume[0])) missed = missed " volume;"
      if (its[1] > 1.1 * its[0] + 0.5) missed = missed " iterations;"
      printf "| %s | %g | %d, %d | %.1f, x %.3f | %.1e | %.3g, %.3g | %.1e, %.1e | %.1f, %.1f | %.3f, %.3f | %s |\n", name, end,
        steps, halvings, resident[1] / 1024, memory, share, m[0], m[1], volume[0], volume[1], its[0], its[1], s[0], s[1],
        missed ? "MISSED:" missed : "nothing grows"
    }' "$4" "$5"
}

{
  echo "| scene | end, s | steps, halvings | memory, MiB, late / before | energy gained | motion before, late, J | error of volume before, late | iterations before, late | s a step before, late | |"
  echo "|---|---|---|---|---|---|---|---|---|---|"
} >"$table"
while IFS='|' read -r name end settings; do
  [ -z "$SCENES" ] || echo " $SCENES " | grep -q -- " $name " || continue
  [ -z "$QUICK" ] || end=$(echo "$end" | awk '{ print $1 / 10 }')
  sets=
  for word in $settings; do sets="$sets --set $word"; done
  watched "$out/$name.memory" "$sim" run "$assets/scenes/$name.scene.toml" -o "$out/$name" --replace -q ${THREADS:+-t $THREADS} \
    --archetypes "$archetypes" --set "time.end=$end" --set time.fps=1 --set 'output.frames=["bodies.vtp"]' \
    --set 'output.checkpoint={every_frames=60,keep=1}' --set expect=absent $sets >"$out/$name.log" 2>&1
  judge "$name" "$end" $? "$out/$name/stats.csv" "$out/$name.memory" | tee -a "$table"
done <<SCENES
tub|600|fluid.grid=[48,48,48] fluid.cell=1/48
starfish150|60|fluid.grid=[84,132,24] fluid.cell=1/24
jellyfish3|60|fluid.grid=[32,32,40] fluid.cell=1/32
SCENES
! grep -q MISSED "$table" || exit 3
