#!/bin/sh
# Runs the fuzzers: run_fuzzers.sh BIN_FOLDER CORPUS OUT_FOLDER [NAME...]; FUZZ_SECONDS each (60). New inputs that reach
# something new stay in OUT_FOLDER/NAME for the next time; one that is a finding is OUT_FOLDER/NAME-crash-..., to be cured
# and then kept in CORPUS/NAME. Exit 1 when there is a finding. What libhdf5 itself leaks of a damaged file is none.
bin=$1 corpus=$2 out=$3; shift 3
seconds=${FUZZ_SECONDS:-60} failed=0
mkdir -p "$out" && echo leak:libhdf5 >"$out/leaks_of_libraries" || exit 5
export LSAN_OPTIONS="suppressions=$out/leaks_of_libraries:print_suppressions=0"
printf '%-12s %-8s %12s %10s  %s\n' target result executions covered log
for folder in "$corpus"/*/; do
  name=$(basename "$folder")
  [ $# -eq 0 ] || case " $* " in *" $name "*) ;; *) continue;; esac
  mkdir -p "$out/$name"
  result=passed
  TMPDIR=$([ -w /dev/shm ] && echo /dev/shm || echo "${TMPDIR:-/tmp}") OMP_NUM_THREADS=1 \
    "$bin/fuzz_$name" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=4096 -malloc_limit_mb=2048 -max_len=16384 \
    -print_final_stats=1 -artifact_prefix="$out/$name-" "$out/$name" "$folder" >"$out/$name.log" 2>&1 \
    || { result=FAILED; failed=1; }
  printf '%-12s %-8s %12s %10s  %s\n' "$name" "$result" \
    "$(sed -n 's/^stat::number_of_executed_units: *//p' "$out/$name.log")" \
    "$(sed -n 's/.* cov: \([0-9]*\).*/\1/p' "$out/$name.log" | tail -n 1)" "$out/$name.log"
done
exit $failed
