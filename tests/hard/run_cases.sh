#!/bin/sh
# Runs the hard cases: run_cases.sh CASES BIN_FOLDER OUT_FOLDER [NAME...]; prints a table and writes it to
# OUT_FOLDER/hard.txt, with the full output of each case beside it and all measured figures in OUT_FOLDER/hard.csv.
# QUICK=1 leaves out the tests named Slow*. A case whose programs have not changed since it passed is not run again. JOBS: the
# tests of a program are shared among so many processes.
# Exit 1 when a case fails or has no test.
cases=$1 bin=$2 out=$3; shift 3
jobs=${JOBS:-1}
mkdir -p "$out"; out=$(cd "$out" && pwd); bin=$(cd "$bin" && pwd)
failed=0
row() { printf '%-4s %-52s %-8s %8s  %s\n' "$@" | tee -a "$out/hard.txt.part"; }
: >"$out/hard.txt.part"
echo case,what,quantity,value,bound,result >"$out/hard.csv.part"
# One line of the table for each line "measured: QUANTITY = VALUE (at most BOUND)" of a log; one without figures else.
figures_csv() {  # name, what, result, log
  sed -n 's/^measured: \(.*\) = \(.*\) (at most \(.*\))$/\1\t\2\t\3/p' "$4" 2>/dev/null | awk -F'\t' -v OFS=, -v name="$1" -v what="$2" \
    -v result="$3" 'function q(s) { gsub(/"/, "\"\"", s); return "\"" s "\"" }
    { print q(name), q(what), q($1), q($2), q($3), q(result) }
    END { if (NR == 0) print q(name), q(what), "", "", "", q(result) }'
}
# Runs a program's tests that the filter selects, each once; its exit code says whether all passed.
run_tests() {  # program, filter, log
  job=0
  while [ $job -lt $jobs ]; do
    (cd "$bin/.." && GTEST_TOTAL_SHARDS=$jobs GTEST_SHARD_INDEX=$job "$bin/$1" --gtest_filter="$2"; echo $? >"$3.$job.code") \
      >"$3.$job" 2>&1 &
    job=$((job + 1))
  done
  wait
  passed=0 job=0
  while [ $job -lt $jobs ]; do
    cat "$3.$job" >>"$3"
    [ "$(cat "$3.$job.code")" = 0 ] || passed=1
    rm -f "$3.$job" "$3.$job.code"
    job=$((job + 1))
  done
  return $passed
}
row case what result seconds 'figures (value <= bound), details in CASE.log'
while IFS='|' read -r name what tests; do
  name=$(echo $name) what=$(echo $what)
  case $name in ''|\#*) continue;; esac
  [ $# -eq 0 ] || case " $* " in *" $name "*) ;; *) continue;; esac
  log=$out/$name.log result=passed waits=
  case $tests in *waiting:*) waits="waiting for${tests##*waiting:}"; tests=${tests%%;*};; esac
  case $tests in *waiting:*) row "$name" "$what" waiting - "$waits"
    figures_csv "$name" "$what" waiting /dev/null >>"$out/hard.csv.part"; continue;; esac
  stale=0
  for t in $tests; do [ "$log" -nt "$bin/${t%%:*}" ] || stale=1; done
  grep -q '^result: passed$' "$log" 2>/dev/null || stale=1
  [ -n "$QUICK" ] || ! grep -q '^quick$' "$log" 2>/dev/null || stale=1   # only its fast tests have passed
  if [ $stale = 1 ]; then
    start=$(date +%s)
    : >"$log.part"
    [ -z "$QUICK" ] || echo quick >>"$log.part"
    for t in $tests; do
      run_tests "${t%%:*}" "${t#*:}${QUICK:+-Slow*}" "$log.part" || result=FAILED
    done
    # a case whose tests are all slow is left out of a quick run; a filter that no test matches shows nothing
    grep -q '^\[       OK \]\|^\[  FAILED' "$log.part" || { [ -n "$QUICK" ] && result=slow || result=FAILED; }
    echo "seconds: $(( $(date +%s) - start ))" >>"$log.part"
    echo "result: $result" >>"$log.part"
    mv "$log.part" "$log"
  fi
  result=$(sed -n 's/^result: //p' "$log"); [ "$result" != FAILED ] || failed=1
  figures=$(sed -n 's/^measured: \(.*\) = \(.*\) (at most \(.*\))$/\1 \2 <= \3/p' "$log" | tail -n 3 | paste -sd ';' -)
  figures_csv "$name" "$what" "$result" "$log" >>"$out/hard.csv.part"
  row "$name" "$what" "$result" "$(sed -n 's/^seconds: \([0-9]*\)$/\1/p' "$log" | tail -n 1)" "$figures${waits:+ ($waits)}"
done <"$cases"
mv "$out/hard.txt.part" "$out/hard.txt"
mv "$out/hard.csv.part" "$out/hard.csv"
exit $failed
