#!/bin/sh
# Do the fast tests notice a mistake? run_mutations.sh SOURCE OUT_FOLDER [COUNT [SEED]]: COUNT (200) times one line of
# cut_cells, pressure, coupling, solid, contact or fluid is changed in a copy of SOURCE in OUT_FOLDER, built, and tested.
# A table of what happened stands in OUT_FOLDER/mutations.txt: killed (by the first test that failed), stillborn (does not compile), slow
# (tests do not end), SURVIVED. Most mistakes are noticed by the folder's own unit tests, which are built and run first.
# Minutes each; results that are there for this seed are kept. TESTS: a filter of ctest (-R), unit tests are not run first.
source=$(cd "$1" && pwd) out=$2 count=${3:-200} seed=${4:-1}
mkdir -p "$out" && out=$(cd "$out" && pwd)
copy=$out/source table=$out/mutations.txt
[ -d "$copy/.git" ] || git clone -q "$source" "$copy" || exit 1
cd "$copy" || exit 1
git fetch -q "$source" HEAD && git reset -q --hard FETCH_HEAD || exit 1
[ -f build/CMakeCache.txt ] || cmake -S . -B build -DARCHETIDE_PRECOMPUTE=OFF >"$out/configure.log" || exit 1
build() { cmake --build build --parallel "${JOBS:-2}" "$@" >"$out/build.log" 2>&1; }
unit() { (cd build && timeout 600 "bin/test_unit_$1" --gtest_filter='-Slow*' --gtest_fail_fast) >"$out/test.log" 2>&1; }
build || {
  echo "mutations: the source does not compile: $out/build.log" >&2
  exit 1
}
tests() {
  OMP_WAIT_POLICY=passive timeout 1800 ctest --test-dir build -L fast ${TESTS:+-R "$TESTS"} --stop-on-failure \
    -j"${JOBS:-2}" >"$out/test.log" 2>&1
}

# A test that fails anyway would kill every change.
sound=$out/sound.$(git rev-parse HEAD)
[ -z "$TESTS" ] && [ -e "$sound" ] || tests || {
  echo "mutations: the tests fail before anything is changed: $out/test.log" >&2
  exit 1
}
[ -n "$TESTS" ] || : >"$sound"

# Every change that can be made, one a line: file, line, what, the new text.
changes() {
  for file in runtime/cut_cells/*.cpp runtime/pressure/*.cpp runtime/coupling/*.cpp runtime/solid/*.cpp \
      runtime/contact/*.cpp runtime/fluid/*.cpp; do
    awk -v file="$file" '
      function change(from, to,   at) {
        at = index($0, from)
        if (at) print file "\t" NR "\t" from " -> " to "\t" substr($0, 1, at - 1) to substr($0, at + length(from))
      }
      /^ *\/\// || /^#/ || /^ *\*/ || /include/ { next }
      { change(" + ", " - "); change(" - ", " + "); change(" * ", " / "); change(" += ", " -= "); change(" -= ", " += ")
        change(" < ", " <= "); change(" > ", " >= "); change(" <= ", " < "); change(" && ", " || "); change(" || ", " && ")
        change(" == ", " != "); change("0.5 ", "0.25 "); change("2.0 ", "3.0 "); change("std::max(", "std::min(")
        change("std::min(", "std::max("); change("if (!", "if ("); change(" = true", " = false") }' "$file"
  done
}
list=$out/changes.$seed
changes | awk -v seed="$seed" 'BEGIN { srand(seed) } { print rand() "\t" $0 }' | sort -k1,1n | cut -f2- >"$list.new"
# Numbers of another source mean other changes.
if [ -e "$list" ] && ! cmp -s "$list" "$list.new" && [ -e "$table" ]; then
  grep "^$seed\." "$table" >>"$out/mutations.before.txt"
  grep -v "^$seed\." "$table" >"$table.new"
  mv "$table.new" "$table"
fi
mv "$list.new" "$list"

number=0
while IFS='	' read -r file line what text; do
  number=$((number + 1))
  [ "$number" -le "$count" ] || break
  grep -q "^$seed\.$number	" "$table" 2>/dev/null && continue
  # The line is replaced as it stands, whatever is in it.
  awk -v line="$line" -v number="$number" 'BEGIN { while ((getline < ARGV[2]) > 0) if (++n == number) { sub(/^[^\t]*\t[^\t]*\t[^\t]*\t/, ""); text = $0 } ARGV[2] = "" }
    FNR == line { print text; next } { print }' "$file" "$list" >"$out/changed.cpp"
  cp "$out/changed.cpp" "$file"
  folder=${file#runtime/} folder=${folder%%/*} by=
  if [ -z "$TESTS" ] && ! build --target "test_unit_$folder"; then
    result=stillborn
  elif [ -z "$TESTS" ] && ! unit "$folder"; then
    result=killed by=$(sed -n 's/^\[  FAILED  \] \([^ ]*\)$/\1/p' "$out/test.log" | head -n 1)
    [ -n "$by" ] || by="test_unit_$folder ends"
  elif ! build; then
    result=stillborn
  else
    tests
    case $? in
      0) result=SURVIVED;;
      124) result=slow;;
      *) result=killed by=$(sed -n 's/^[[:space:]]*[0-9]* - \([^ ]*\) (.*/\1/p' "$out/test.log" | head -n 1);;
    esac
  fi
  printf '%s.%s\t%s\t%s:%s\t%s\t%s\n' "$seed" "$number" "$result" "$file" "$line" "$what" "$by" | tee -a "$table"
  git checkout -q -- "$file"
done <"$list"
printf 'killed %s, survived %s, stillborn %s, slow %s\n' $(for r in killed SURVIVED stillborn slow; do
  grep -c "^$seed\..*	$r	" "$table"; done)
