#!/bin/sh
# The scenes of the paper, one after another: run_paper.sh LIST BIN_FOLDER ASSETS ARCHETYPES OUT_FOLDER; LIST: scenes.txt.
# Runs and films in OUT_FOLDER/NAME, the page OUT_FOLDER/index.html and the table OUT_FOLDER/paper.md, written again after
# each run. A run that has ended, well or not, with this scene and these settings is not run again (a failed one is, by
# other programs); one that was interrupted, or for which the disk was full (exit 5), goes on.
# SCENES='tub tori50': only these. QUICK=1: coarse grids and short times, minutes. THREADS: of a run.
# RENDER: options of `archetide-sim render`.
# Exit 3 when a run failed, with the page written; 75 when one was stopped.
list=$1 bin=$2 assets=$3 archetypes=$4 out=$5
mkdir -p "$out" || exit 5
set -f  # brackets are no patterns
render=${RENDER:-$([ -n "$QUICK" ] && echo --size 384x216 || echo --size 1280x720)}
threads=${THREADS:+-t $THREADS}

trimmed() { echo $1; }
names=$(sed '/^#/d; /^ *$/d; s/ *|.*//' "$list")
for wanted in $SCENES; do
  echo "$names" | grep -qx -- "$wanted" || {
    echo "paper: no scene \"$wanted\"; there are: $(trimmed "$names")" >&2
    exit 2
  }
done

page() { "$bin/bench_paper" "$list" "$out" ${QUICK:+--quick}; }

# Whether the run with these settings has ended and need not be run again.
ended() {  # run folder, scene file, settings
  [ -e "$1.settings" ] && [ "$(cat "$1.settings")" = "$3" ] || return 1
  [ ! "$2" -nt "$1.settings" ] || return 1
  for body in $(sed -n '/^  "archetypes"/,/^  \]/s/^ *"name": "\(.*\)",$/\1/p' "$1/manifest.json" 2>/dev/null); do
    [ ! "$archetypes/$body.h5" -nt "$1.settings" ] || return 1
  done
  [ ! -e "$1/done.stamp" ] || return 0
  [ -e "$1.failed" ] && [ "$(cat "$1.failed")" != 5 ] && [ ! "$bin/archetide-sim" -nt "$1.failed" ]
}

# Runs the scene; the exit code of the simulator.
simulate() {  # run folder, scene file, settings
  rm -f "$1.refused" "$1.failed"
  echo "$3" >"$1.settings"
  sets=
  for word in $3; do sets="$sets --set $word"; done
  "$bin/archetide-sim" check "$2" -q --archetypes "$archetypes" $sets >/dev/null 2>"$1.refused" || {
    code=$?
    cat "$1.refused" >&2
    return $code
  }
  rm -f "$1.refused"
  GLIBC_TUNABLES=${GLIBC_TUNABLES:-glibc.malloc.hugetlb=1} "$bin/archetide-sim" run "$2" -o "$1" --resume auto --replace \
    --archetypes "$archetypes" $threads $sets
}

# Pictures and film of what the run has written.
film() {  # run folder
  [ -e "$1/manifest.json" ] || return 0
  [ ! -e "$1.film" ] || [ "$1/manifest.json" -nt "$1.film" ] || [ "$(cat "$1.film")" != "$render" ] || return 0
  "$bin/archetide-sim" render "$1" -q $threads $render >/dev/null && echo "$render" >"$1.film"
}

failed=
while IFS='|' read -r name figure scene goal settings quick shows; do
  name=$(trimmed "$name")
  case $name in '' | \#*) continue ;; esac
  [ -z "$SCENES" ] || echo " $SCENES " | grep -q -- " $name " || continue
  run=$out/$name file=$assets/scenes/$(trimmed "$scene").scene.toml
  if [ -n "$QUICK" ]; then words=$(trimmed "$settings expect=absent $quick")
  else words=$(trimmed "$settings output.checkpoint={every_frames=24,keep=1}"); fi
  if ended "$run" "$file" "$words"; then
    echo "paper: $name is there already"
  else
    echo "paper: $name (Fig. $(trimmed "$figure"))"
    simulate "$run" "$file" "$words" </dev/null
    code=$?
    [ $code != 75 ] || exit 75
    [ $code = 0 ] || echo $code >"$run.failed"
    [ ! -e "$run/done.stamp" ] || rm -rf "$run/checkpoint"
  fi
  [ ! -e "$run.failed" ] || failed="$failed $name"
  film "$run" </dev/null || failed="$failed $name(film)"
  page >/dev/null || exit $?
done <"$list"
page || exit $?
[ -z "$failed" ] || {
  echo "paper: failed:$failed" >&2
  exit 3
}
