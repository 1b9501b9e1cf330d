#!/bin/sh
# What CI leaves out, part by part: run_nightly.sh OUT COMMIT MAKE WORD..; MAKE WORD.. TARGET does a part. A part that fails
# does not stop the others; one that has passed at this commit is not done again (at one that ends in "-dirty": always).
# OUT/nightly/index.html: the parts and how they went before; OUT/nightly/trend.csv: a line a part that was done, since ever;
# OUT/nightly/PART.log. PARTS='slow fuzz': only these. Exit 1 when a part fails.
out=$1 commit=$2
shift 2
nightly=$out/nightly trend=$out/nightly/trend.csv rows=$out/nightly/rows
mkdir -p "$nightly" || exit 5
[ -s "$trend" ] || echo date,commit,part,result,seconds,summary >"$trend" || exit 5

# One line that tells how a part went, from its log.
summary() {  # part, log
  case $1 in
    fast|slow|sanitize-address) sed -n 's/.*\(tests passed, .*\)/\1/p' "$2" | tail -n 1;;
    hard|faults) echo "$(grep -c ' passed ' "$2") passed, $(grep -c ' FAILED ' "$2") failed";;
    fuzz) awk '$2 == "passed" || $2 == "FAILED" { n += $3; ++targets; failed += $2 == "FAILED" }
      END { printf "%d executions of %d targets, %d with findings\n", n, targets, failed }' "$2";;
    long) echo "$(grep -c 'nothing grows' "$2") in which nothing grows, $(grep -c 'MISSED' "$2") others";;
    sanitize-thread) echo "$(grep -c ': clean$' "$2") scenes clean, $(grep -c 'PASSED' "$2") test programs passed";;
    *) grep -v '^make\|^ *$' "$2" | tail -n 1;;
  esac | tr -d '"\r' | tr , ';' | cut -c1-200
}

: >"$rows"
failed=0 hard=
while IFS='|' read -r part words what page; do
  part=$(echo $part) what=$(echo $what) page=$(echo $page)
  [ -z "$PARTS" ] || case " $PARTS " in *" $part "*) ;; *) continue;; esac
  log=$nightly/$part.log stamp=$nightly/$part.passed result=passed
  if [ "$(cat "$stamp" 2>/dev/null)" != "$commit" ] || [ "${commit%-dirty}" != "$commit" ]; then
    rm -f "$stamp"
    # tests that the hard cases have passed, in this night, are not done again with the slow ones
    but=
    [ "$part $hard" != "slow passed" ] || but=$(sed -n 's/^\[       OK \] \([^ ]*\).*/\1/p' "$out"/hard/*.log 2>/dev/null | grep '^Slow\|/Slow' |
      sed 's/\./\\./g' | sort -u | paste -sd '|' -)
    echo "nightly: $part, log in $log"
    start=$(date +%s)
    "$@" $words ${but:+"NOT=^($but)\$\$"} >"$log" 2>&1 </dev/null || result=FAILED
    seconds=$(($(date +%s) - start))
    [ $result = FAILED ] || echo "$commit" >"$stamp"
    line=$(summary "$part" "$log")
    echo "$(date -u +%Y-%m-%dT%H:%M:%SZ),$commit,$part,$result,$seconds,$line" >>"$trend"
  else
    line=$(awk -F, -v part="$part" '$3 == part { line = $6; seconds = $5 } END { print seconds "\t" line }' "$trend")
    seconds=${line%%	*} line=${line#*	}
  fi
  [ $result = passed ] || failed=1
  [ "$part" != hard ] || hard=$result
  printf 'nightly: %-17s %-7s %6s s  %s\n' "$part" "$result" "$seconds" "$line"
  [ -z "$page" ] || [ -e "$out/$page" ] || page=
  printf '%s\t%s\t%s\t%s\t%s\t%s\n' "$part" "$what" "$result" "$seconds" "$line" "$page" >>"$rows"
done <<PARTS
fast | check | every fast test |
hard | hard | the hard cases of stability | hard/hard.txt
slow | slow | every slow test that is not among the hard cases: random scenes, validation |
scorecard | scorecard | every figure with a known answer | scorecard.html
paper | paper QUICK=1 | the scenes of the paper, coarse and short | paper_quick/index.html
faults | faults | kills, signals, full disks, little memory, odd names |
mutate | mutate | random mistakes in command lines and files |
fuzz | fuzz | random inputs for every reader |
sanitize-address | sanitize-address | fast tests and scenes with checks of memory and undefined behaviour |
sanitize-thread | sanitize-thread | tests of threads and scenes with checks of races |
long | long | minutes of scene time in which nothing may grow | long/long.md
PARTS

# The page: the parts now, then one column for each time that something was done, the last one first.
awk -v commit="$commit" -v when="$(date -u '+%Y-%m-%d %H:%M UTC')" '
  function text(s) { gsub(/&/, "\\&amp;", s); gsub(/</, "\\&lt;", s); gsub(/>/, "\\&gt;", s); return s }
  function cell(result, s) { return "<td class=" (result == "passed" ? "ok" : "bad") ">" s "</td>" }
  BEGIN {
    print "<!doctype html>\n<meta charset=utf-8>\n<title>archetide: nightly</title>\n<style>body{font:15px sans-serif;margin:2em}" \
      "table{border-collapse:collapse;margin:1em 0}td,th{border:1px solid #bbb;padding:.3em .6em;text-align:left}" \
      ".ok{background:#dff2df}.bad{background:#f6d0d0;font-weight:bold}</style>"
    print "<h1>Nightly of " text(commit) "</h1>\n<p>" when "</p>\n<table><tr><th>part<th>what<th>result<th>minutes<th>summary<th>"
  }
  FILENAME == ARGV[1] {
    split($0, f, "\t")
    part[++parts] = f[1]
    printf "<tr><td>%s</td><td>%s</td>%s<td>%.1f</td><td>%s</td><td><a href=\"%s.log\">log</a>%s</td></tr>\n", f[1], text(f[2]),
      cell(f[3], f[3]), f[4] / 60, text(f[5]), f[1], f[6] != "" ? " <a href=\"../" f[6] "\">table</a>" : ""
    next
  }
  FNR > 1 {
    split($0, f, ",")
    night = substr(f[1], 1, 10) "<br>" text(f[2])
    if (night != last) column[++columns] = last = night
    seconds[columns, f[3]] = f[5]; result[columns, f[3]] = f[4]
  }
  END {
    print "</table>\n<h2>Before</h2>\n<p>Minutes of each part, by day and commit; all of it is in <a href=\"trend.csv\">trend.csv</a>.</p>" \
      "\n<table><tr><th>part"
    first = columns > 14 ? columns - 13 : 1
    for (c = columns; c >= first; --c) print "<th>" column[c]
    for (p = 1; p <= parts; ++p) {
      print "<tr><td>" part[p] "</td>"
      for (c = columns; c >= first; --c)
        print ((c, part[p]) in seconds) ? cell(result[c, part[p]], sprintf("%.1f", seconds[c, part[p]] / 60)) : "<td></td>"
    }
    print "</table>"
  }' "$rows" "$trend" >"$nightly/index.html.part" && mv "$nightly/index.html.part" "$nightly/index.html" || exit 5
rm -f "$rows"
echo "nightly: open $nightly/index.html"
exit $failed
