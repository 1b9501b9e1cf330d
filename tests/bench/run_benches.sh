#!/bin/sh
# Runs the programs of a list: run_benches.sh LIST BIN_FOLDER OUT_FOLDER, and writes what they print to
# OUT_FOLDER/benches.csv, one row for each line, with the full output in OUT_FOLDER/NAME.log. QUICK=1: only those marked
# quick; SLOW=1: those marked slow, too. A program that has not changed since its log was written is not run again.
# Words in a command: TORUS and TORUS60K are archetypes of 5k and 60k tets; ARCHETYPES and ASSETS are the folders of
# the variables with these names.
# Exit 1 when a program fails.
list=$1 bin=$2 out=$3
mkdir -p "$out"; out=$(cd "$out" && pwd); bin=$(cd "$bin" && pwd)
failed=0
echo name,what,command,result,seconds,line >"$out/benches.csv.part"
rows() {  # name, what, command, result, seconds: of the lines that come in; what googletest prints around them is left out
  grep -v '^\[\|^Note: Google Test\|^Running main() from\|^Randomizing\|^ *$\|^ *[0-9]* FAILED TEST\|^  YOU HAVE' |
    awk -v OFS=, -v name="$1" -v what="$2" -v command="$3" -v result="$4" -v seconds="$5" '
      function q(s) { gsub(/"/, "\"\"", s); return "\"" s "\"" }
      { print q(name), q(what), q(command), q(result), q(seconds), q($0) }
      END { if (NR == 0) print q(name), q(what), q(command), q(result), q(seconds), "" }'
}
while IFS='|' read -r name kind what command; do
  name=$(echo $name) kind=$(echo $kind) what=$(echo $what)
  case $name in ''|\#*) continue;; esac
  [ -z "$QUICK" ] || [ "$kind" = quick ] || continue
  command=$(echo "$command" | sed 's/^ *//; s/ *$//')
  log=$out/$name.log
  wanted=1
  [ "$kind" != slow ] || [ -n "$SLOW" ] || wanted=0
  words=$(echo "$command" | sed "s#\bASSETS\b#$ASSETS#; s#\bARCHETYPES\b#$ARCHETYPES#; s#\bTORUS60K\b#$ARCHETYPES/torus60k.h5#; s#\bTORUS\b#$ARCHETYPES/torus.h5#")
  if [ $wanted = 1 ] && ! { [ "$log" -nt "$bin/${command%% *}" ] && grep -q '^result: done$' "$log"; }; then
    echo "$name: $command" >&2
    start=$(date +%s) result=done
    eval "'$bin'/$words" >"$log.part" 2>"$log.errors" || result=FAILED
    [ $result = done ] || cat "$log.errors" >&2
    printf 'seconds: %s\nresult: %s\n' $(( $(date +%s) - start )) $result >>"$log.part"
    mv "$log.part" "$log"; rm -f "$log.errors"
  fi
  if [ -f "$log" ]; then
    result=$(sed -n 's/^result: //p' "$log"); [ "$result" != FAILED ] || failed=1
    sed '/^seconds: /d; /^result: /d' "$log" |
      rows "$name" "$what" "$command" "$result" "$(sed -n 's/^seconds: //p' "$log")" >>"$out/benches.csv.part"
  else
    rows "$name" "$what" "$command" 'not run (SLOW=1 runs it)' - </dev/null >>"$out/benches.csv.part"
  fi
done <"$list"
mv "$out/benches.csv.part" "$out/benches.csv"
exit $failed
